#include "formats/file_bytes.h"

#include <algorithm>
#include <limits>
#include <new>
#include <thread>

#include <vrpipe/component/error.h>

#include "file_io.h"
#include "for_each_chunk.h"

namespace vrpipe {
namespace {

constexpr char kShortRemedy[] = "get the file again, it seems cut short";

}  // namespace

const std::string kCannotReadScene = "cannot read scene";

FileBytes FileBytes::read(const std::filesystem::path& path) {
  const std::string where = path.string();
  const InputFile file(path, kCannotReadScene);
  const std::shared_ptr<std::byte[]> bytes = allocate_bytes(file.size(), where);
  constexpr std::uint64_t kChunk = std::uint64_t{4} << 20U;
  for_each_chunk((file.size() + kChunk - 1) / kChunk, std::thread::hardware_concurrency(), [&](std::uint64_t chunk) {
    const std::uint64_t offset = chunk * kChunk;
    file.read(offset, bytes.get() + offset, static_cast<std::size_t>(std::min(kChunk, file.size() - offset)));
  });
  file.check_unchanged();
  return FileBytes(bytes, file.size(), where);
}

FileBytes FileBytes::copy(const void* data, std::uint64_t size, const std::string& where) {
  const std::shared_ptr<std::byte[]> bytes = allocate_bytes(size, where);
  if (size > 0) std::memcpy(bytes.get(), data, static_cast<std::size_t>(size));
  return FileBytes(bytes, size, where);
}

const std::byte* FileBytes::records(std::uint64_t offset, std::uint64_t count, std::uint64_t stride,
                                    const std::string& what) const {
  const std::uint64_t room = offset > size_ ? 0 : size_ - offset;
  if (stride > 0 && count > room / stride) {
    const bool fits = count <= (std::numeric_limits<std::uint64_t>::max() - offset) / stride;
    fail("it announces " + std::to_string(count) + " records of " + std::to_string(stride) + " bytes in " + what +
             " from byte " + std::to_string(offset) + " on, which needs " +
             (fits ? std::to_string(offset + count * stride) : "more than 2^64") + " bytes, and the file has " +
             std::to_string(size_),
         kShortRemedy);
  }
  return range(offset, count * stride, what);
}

bool FileBytes::begins_with(const char* text) const {
  const std::size_t length = std::strlen(text);
  return length <= size_ && std::memcmp(data(), text, length) == 0;
}

void FileBytes::fail_at(std::uint64_t byte, const std::string& why, const std::string& remedy) const {
  fail("at byte " + std::to_string(byte) + " " + why, remedy);
}

void FileBytes::fail(const std::string& why, const std::string& remedy) const {
  throw UserError(kCannotReadScene, where_, why, remedy);
}

void FileBytes::fail_short(std::uint64_t offset, std::uint64_t size, const std::string& what) const {
  fail("it ends at byte " + std::to_string(size_) + ", within or before " + what + " (" + std::to_string(size) +
           " bytes from byte " + std::to_string(offset) + " on)",
       kShortRemedy);
}

std::shared_ptr<std::byte[]> allocate_bytes(std::uint64_t size, const std::string& where) {
  try {
    return std::shared_ptr<std::byte[]>(new std::byte[static_cast<std::size_t>(size)]);
  } catch (const std::bad_alloc&) {
    throw UserError(kCannotReadScene, where, "it needs " + std::to_string(size >> 20U) + " MiB of memory",
                    "raise the limit on memory, or use a smaller scene");
  }
}

}  // namespace vrpipe
