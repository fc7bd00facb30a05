#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace vrpipe {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "scene files are little-endian and are read where they lie");

/// A regular file mapped read-only into memory. The file must not shrink while it is mapped.
class MappedFile {
 public:
  /// @param what  begins the message, e.g. "cannot read scene"
  /// @throws UserError when the file is missing, is not a regular file, is empty, or cannot be mapped
  MappedFile(const std::filesystem::path& path, const std::string& what);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  const std::byte* data() const { return data_; }
  std::size_t size() const { return size_; }

 private:
  const std::byte* data_ = nullptr;
  std::size_t size_ = 0;
};

/// A file that appears under its name complete or not at all: written beside it, then renamed by commit().
class AtomicFile {
 public:
  /// @param what  begins the message, e.g. "cannot write draw list"
  /// @throws UserError when nothing can be created in the folder, or `path` is something else than a regular file
  AtomicFile(const std::filesystem::path& path, const std::string& what);
  ~AtomicFile();  ///< without commit(), removes what was written
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(const void* data, std::size_t size_bytes);  ///< @throws UserError, e.g. when the disk is full
  void commit();                                         ///< @throws UserError

 private:
  void flush();
  [[noreturn]] void fail(const std::string& why);

  std::filesystem::path path_, temporary_;
  std::string what_;
  int descriptor_ = -1;
  std::vector<std::byte> buffer_;
};

}  // namespace vrpipe
