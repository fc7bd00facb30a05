#include "file_io.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <system_error>

#include <vrpipe/error.h>

namespace vrpipe {
namespace {

std::string describe_errno(int error) { return std::generic_category().message(error); }

/// Closes a descriptor at the end of a scope.
struct DescriptorCloser {
  int descriptor;
  ~DescriptorCloser() { ::close(descriptor); }
};

}  // namespace

MappedFile::MappedFile(const std::filesystem::path& path, const std::string& what) {
  const std::string where = path.string();
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) {
    const int error = errno;
    throw UserError(what, where, error == ENOENT ? "no such file" : describe_errno(error),
                    error == ENOENT ? "check the path" : "check the file's permissions");
  }
  const DescriptorCloser closer{descriptor};
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) throw UserError(what, where, describe_errno(errno), "check the file system");
  if (S_ISDIR(status.st_mode)) throw UserError(what, where, "it is a directory", "name a file in it");
  if (!S_ISREG(status.st_mode)) {
    throw UserError(what, where, "it is not a regular file", "copy its contents to a file first");
  }
  if (status.st_size == 0) throw UserError(what, where, "the file is empty", "get or write the file again");
  size_ = static_cast<std::size_t>(status.st_size);
  void* address = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, descriptor, 0);
  if (address == MAP_FAILED) {
    throw UserError(what, where, "it cannot be mapped into memory: " + describe_errno(errno),
                    "raise the limit on address space, or use a smaller file");
  }
  data_ = static_cast<const std::byte*>(address);
}

MappedFile::~MappedFile() { ::munmap(const_cast<std::byte*>(data_), size_); }

AtomicFile::AtomicFile(const std::filesystem::path& path, const std::string& what) : path_(path), what_(what) {
  std::error_code ignored;
  const auto status = std::filesystem::status(path, ignored);
  if (std::filesystem::is_directory(status)) {
    throw UserError(what, path.string(), "it is a directory", "name a file in it");
  }
  // Renaming over a device or a pipe would replace it.
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw UserError(what, path.string(), "it is not a regular file", "name a new file or one that may be replaced");
  }
  static std::atomic<unsigned> counter{0};
  do {
    temporary_ = path;
    temporary_ += ".tmp-" + std::to_string(::getpid()) + "-" + std::to_string(counter++);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor_ < 0 && errno == EEXIST);
  if (descriptor_ < 0) {
    throw UserError(what, path.string(), describe_errno(errno),
                    "name a file in a folder that exists and can be written");
  }
  buffer_.reserve(std::size_t{1} << 16);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(temporary_.c_str());
}

void AtomicFile::fail(const std::string& why) {
  throw UserError(what_, path_.string(), why, "free some space or name another folder");
}

void AtomicFile::flush() {
  std::size_t done = 0;
  while (done < buffer_.size()) {
    const ssize_t written = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(describe_errno(errno));
    done += static_cast<std::size_t>(written);
  }
  buffer_.clear();
}

void AtomicFile::write(const void* data, std::size_t size_bytes) {
  const std::byte* bytes = static_cast<const std::byte*>(data);
  while (size_bytes > 0) {
    const std::size_t room = buffer_.capacity() - buffer_.size();
    const std::size_t part = size_bytes < room ? size_bytes : room;
    buffer_.insert(buffer_.end(), bytes, bytes + part);
    bytes += part;
    size_bytes -= part;
    if (buffer_.size() == buffer_.capacity()) flush();
  }
}

void AtomicFile::commit() {
  flush();
  const int descriptor = descriptor_;
  descriptor_ = -1;
  if (::close(descriptor) != 0 || ::rename(temporary_.c_str(), path_.c_str()) != 0) {
    const int error = errno;
    ::unlink(temporary_.c_str());
    fail(describe_errno(error));
  }
}

}  // namespace vrpipe
