#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vrpipe {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "scene files are little-endian and are read where they lie");

/// ASCII letters in lower case.
std::string lower_case(std::string text);
/// With its dot, in lower case; empty for a name without one.
std::string extension_of(const std::filesystem::path& path);

/// `vrpipe` in the user's cache folder, as the XDG Base Directory Specification has it, where a relative path counts as none.
std::optional<std::filesystem::path> user_cache_folder();

/// A regular file that is read, not mapped: a mapped file that someone cuts short ends the program by SIGBUS.
class InputFile {
 public:
  /// @param what  begins the message, e.g. "cannot read scene"
  /// @throws UserError when the file is missing, is not a regular file, is empty, or cannot be read
  InputFile(const std::filesystem::path& path, const std::string& what);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// Bytes, when it was opened.
  std::uint64_t size() const { return size_; }
  /// Reads `size_bytes` from `offset` on; both lie within size().
  /// @throws UserError when the file has become shorter since it was opened, or cannot be read
  void read(std::uint64_t offset, void* data, std::size_t size_bytes) const;
  /// For the end: what was read is the file at one time.
  /// @throws UserError when the file was written since it was opened
  void check_unchanged() const;

 private:
  std::string what_, where_;
  int descriptor_;
  std::uint64_t size_ = 0;
  std::int64_t seconds_ = 0, nanoseconds_ = 0;  ///< of its last modification
};

/// Where `path` leads to: symbolic links at its end are followed, also to a file that is not there yet. What leads to
/// something else than a file stays as it is.
/// @param error  the error's number, 0 without
std::filesystem::path followed(const std::filesystem::path& path, int& error);

/// An output file, which appears under its name complete or not at all: written beside it, then renamed by commit().
/// A symbolic link stays one, what it leads to is replaced; a file that is replaced hands its mode on. What is no regular
/// file, such as a pipe or a device, is written as it is.
class AtomicFile {
 public:
  /// @param what   begins the message, e.g. "cannot write draw list"
  /// @param where  the place that messages name
  /// @throws UserError when the file cannot be made
  AtomicFile(const std::filesystem::path& path, const std::string& what, const std::string& where);
  ~AtomicFile();  ///< without commit(), removes what was written
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(const void* data, std::size_t size_bytes);  ///< @throws UserError, e.g. when the disk is full
  void commit();                                         ///< @throws UserError

 private:
  void flush();
  void remove();
  [[noreturn]] void fail(int error) const;

  std::string what_, where_;
  std::filesystem::path target_, temporary_;  ///< no `temporary_`: `target_` is written as it is
  std::atomic<const char*>* unfinished_ = nullptr;
  int descriptor_ = -1;
  std::vector<std::byte> buffer_;
};

/// Removes what AtomicFiles have written and not committed. For the end of the process; safe in a signal handler.
void remove_unfinished_files() noexcept;

/// What can be done about an error of the system on an output file or folder.
std::string remedy_for_output(int error);

}  // namespace vrpipe
