#include "asset_files.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <new>
#include <utility>

#include <assimp/IOStream.hpp>

#include <vrpipe/component/error.h>

#include "../file_io.h"
#include "obj_document.h"

namespace vrpipe {
namespace {

constexpr std::uint64_t kMaxFileBytes = std::uint64_t{1} << 30;

/// A file in memory.
class MemoryStream : public Assimp::IOStream {
 public:
  MemoryStream(std::string bytes, std::set<Assimp::IOStream*>& open) : bytes_(std::move(bytes)), open_(open) {
    open_.insert(this);
  }
  ~MemoryStream() override { open_.erase(this); }
  MemoryStream(const MemoryStream&) = delete;
  MemoryStream& operator=(const MemoryStream&) = delete;

  std::size_t Read(void* buffer, std::size_t size, std::size_t count) override {
    if (size == 0 || count == 0) return 0;
    const std::size_t whole = std::min(count, (bytes_.size() - position_) / size);
    std::memcpy(buffer, bytes_.data() + position_, whole * size);
    position_ += whole * size;
    return whole;
  }
  std::size_t Write(const void* /*buffer*/, std::size_t /*size*/, std::size_t /*count*/) override { return 0; }
  aiReturn Seek(std::size_t offset, aiOrigin origin) override {
    const std::size_t from = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? position_ : bytes_.size();
    if (origin == aiOrigin_END ? offset > from : offset > bytes_.size() - from) return aiReturn_FAILURE;
    position_ = origin == aiOrigin_END ? from - offset : from + offset;
    return aiReturn_SUCCESS;
  }
  std::size_t Tell() const override { return position_; }
  std::size_t FileSize() const override { return bytes_.size(); }
  void Flush() override {}

 private:
  std::string bytes_;
  std::set<Assimp::IOStream*>& open_;
  std::size_t position_ = 0;
};

}  // namespace

std::string read_mesh_file(const std::string& path) {
  const InputFile file(path, kCannotReadMesh);
  if (file.size() > kMaxFileBytes) {
    throw UserError(kCannotReadMesh, path, "it has " + std::to_string(file.size()) + " bytes",
                    "a file of a mesh has at most " + std::to_string(kMaxFileBytes) + "; use a simpler mesh");
  }
  try {
    std::string bytes(static_cast<std::size_t>(file.size()), '\0');
    file.read(0, bytes.data(), bytes.size());
    file.check_unchanged();
    return bytes;
  } catch (const std::bad_alloc&) {
    throw UserError(kCannotReadMesh, path, "it needs " + std::to_string(file.size() >> 20U) + " MiB of memory",
                    "raise the limit on memory, or use a simpler mesh");
  }
}

AssetFiles::~AssetFiles() {
  while (!open_.empty()) delete *open_.begin();
}

bool AssetFiles::Exists(const char* name) const {
  if (path_ == name) return true;
  try {
    const InputFile file(name, "cannot read mesh");
    return true;
  } catch (const UserError&) {
    return false;
  }
}

Assimp::IOStream* AssetFiles::Open(const char* name, const char* mode) {
  if (std::strpbrk(mode, "wa+") != nullptr) return nullptr;
  if (path_ == name) return new MemoryStream(bytes_, open_);
  try {
    std::string bytes = read_mesh_file(name);
    // The other files of an .obj are materials.
    auto* stream = new MemoryStream(obj_ ? reduced_mtl(bytes) : std::move(bytes), open_);
    ++others_read_;
    return stream;
  } catch (const UserError& error) {
    failure_ = error.what();
    return nullptr;
  }
}

void AssetFiles::Close(Assimp::IOStream* stream) { delete stream; }

}  // namespace vrpipe
