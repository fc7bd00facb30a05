#include "formats/zip_archive.h"

#include <algorithm>

#include <zip.h>

namespace vrpipe {
namespace {

constexpr char kZipRemedy[] = "get the file again";

std::string text_of(zip_error_t& error) {
  std::string text = zip_error_strerror(&error);
  zip_error_fini(&error);
  return text;
}

}  // namespace

struct ZipArchive::Handle {
  zip_t* archive = nullptr;
  ~Handle() {
    if (archive != nullptr) zip_discard(archive);
  }
};

ZipArchive::ZipArchive(const FileBytes& bytes) : bytes_(bytes), handle_(std::make_unique<Handle>()) {
  zip_error_t error;
  zip_error_init(&error);
  constexpr int kKeep = 0;
  zip_source_t* const source = zip_source_buffer_create(bytes.data(), bytes.size(), kKeep, &error);
  if (source != nullptr) handle_->archive = zip_open_from_source(source, ZIP_RDONLY, &error);
  if (handle_->archive == nullptr) {
    if (source != nullptr) zip_source_free(source);
    if (zip_error_code_zip(&error) == ZIP_ER_NOZIP) {
      zip_error_fini(&error);
      bytes.fail("it ends at byte " + std::to_string(bytes.size()) + ", without the directory that ends a zip archive",
                 "get the file again, it seems cut short");
    }
    bytes.fail("its zip archive of " + std::to_string(bytes.size()) + " bytes is damaged: " + text_of(error),
               kZipRemedy);
  }
  const zip_int64_t entries = zip_get_num_entries(handle_->archive, 0);
  for (zip_int64_t i = 0; i < entries; ++i) {
    const char* const name = zip_get_name(handle_->archive, static_cast<zip_uint64_t>(i), 0);
    names_.emplace_back(name == nullptr ? "" : name);
  }
}

ZipArchive::~ZipArchive() = default;

FileBytes ZipArchive::read(const std::string& name) const {
  const auto found = std::find(names_.begin(), names_.end(), name);
  if (found == names_.end())
    bytes_.fail("its zip archive has no file `" + name.substr(0, 100) + "`", "export the scene again");
  const auto index = static_cast<zip_uint64_t>(found - names_.begin());
  const std::string what = "the file `" + name.substr(0, 100) + "` in it";
  zip_stat_t status;
  zip_stat_init(&status);
  if (zip_stat_index(handle_->archive, index, 0, &status) != 0 || (status.valid & ZIP_STAT_SIZE) == 0) {
    bytes_.fail(what + " has no size", kZipRemedy);
  }
  // Other methods take memory as the archive says, up to gigabytes.
  const bool known = (status.valid & ZIP_STAT_COMP_METHOD) != 0 &&
                     (status.comp_method == ZIP_CM_STORE || status.comp_method == ZIP_CM_DEFLATE);
  if (!known) bytes_.fail(what + " is neither stored nor deflated", "pack the archive again, without compression");
  // Images do not shrink in a zip archive, and text not to a sixteenth.
  constexpr std::uint64_t kMostPerByte = 16, kAlways = std::uint64_t{1} << 20U;
  const std::uint64_t most = kMostPerByte * bytes_.size() + kAlways;
  if (status.size > most || status.size > most - unpacked_) {
    bytes_.fail(what + " is to have " + std::to_string(status.size) + " bytes, and the archive has " +
                    std::to_string(bytes_.size()),
                kZipRemedy);
  }
  unpacked_ += status.size;
  const std::shared_ptr<std::byte[]> unpacked = allocate_bytes(status.size, bytes_.where());
  zip_file_t* const file = zip_fopen_index(handle_->archive, index, 0);
  zip_int64_t done = file == nullptr ? -1 : zip_fread(file, unpacked.get(), status.size);
  // One byte more: only then is the checksum looked at.
  std::byte behind{};
  if (done >= 0 && zip_fread(file, &behind, 1) != 0) done = -1;
  if (file != nullptr && zip_fclose(file) != 0) done = -1;
  if (done < 0 || static_cast<zip_uint64_t>(done) != status.size) {
    bytes_.fail(what + " is cut short or damaged", kZipRemedy);
  }
  return FileBytes(unpacked, status.size, bytes_.where() + ", " + name.substr(0, 100));
}

}  // namespace vrpipe
