#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>

namespace vrpipe {

/// Begins every message about a file of Gaussians.
extern const std::string kCannotReadScene;

/// Bytes of a file, whole and in memory, or of what was unpacked from one. Every access is checked: what lies behind the end is
/// the user's error, and the message says at which byte the file ends. Copies share the bytes.
class FileBytes {
 public:
  FileBytes() = default;
  /// @param where  the file, and the part of it, for messages
  FileBytes(std::shared_ptr<const std::byte[]> storage, std::uint64_t size, std::string where)
      : storage_(std::move(storage)), size_(size), where_(std::move(where)) {}

  /// Reads a file, with all cores.
  /// @throws UserError when it cannot be read, changes meanwhile, or does not fit in memory
  static FileBytes read(const std::filesystem::path& path);
  /// A copy, for what is in memory already.
  static FileBytes copy(const void* data, std::uint64_t size, const std::string& where);

  std::uint64_t size() const { return size_; }
  const std::string& where() const { return where_; }
  const std::byte* data() const { return storage_.get(); }
  const std::shared_ptr<const std::byte[]>& storage() const { return storage_; }

  /// `size` bytes from `offset`; `what` says what they are, e.g. "its header".
  /// @throws UserError when they are not all there
  const std::byte* range(std::uint64_t offset, std::uint64_t size, const std::string& what) const {
    if (offset > size_ || size > size_ - offset) fail_short(offset, size, what);
    return data() + offset;
  }
  /// The same for `count` records of `stride` bytes, whose product may be beyond 64 bits.
  const std::byte* records(std::uint64_t offset, std::uint64_t count, std::uint64_t stride,
                           const std::string& what) const;
  /// A little-endian number.
  template <class T>
  T number(std::uint64_t offset, const std::string& what) const {
    T value;
    std::memcpy(&value, range(offset, sizeof value, what), sizeof value);
    return value;
  }
  /// Whether it begins with these characters.
  bool begins_with(const char* text) const;

  /// @throws UserError that names the byte
  [[noreturn]] void fail_at(std::uint64_t byte, const std::string& why, const std::string& remedy) const;
  [[noreturn]] void fail(const std::string& why, const std::string& remedy) const;

 private:
  [[noreturn]] void fail_short(std::uint64_t offset, std::uint64_t size, const std::string& what) const;

  std::shared_ptr<const std::byte[]> storage_;
  std::uint64_t size_ = 0;
  std::string where_;
};

/// An unaligned little-endian number.
template <class T>
T load(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

/// Memory for `size` bytes, not zeroed.
/// @throws UserError when there is not so much
std::shared_ptr<std::byte[]> allocate_bytes(std::uint64_t size, const std::string& where);

}  // namespace vrpipe
