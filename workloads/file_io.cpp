#include "file_io.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <system_error>

#include <vrpipe/component/error.h>

namespace vrpipe {
namespace {

namespace fs = std::filesystem;

std::string describe_errno(int error) { return std::generic_category().message(error); }

/// Temporary files under way. A signal handler reads them, so there are neither locks nor memory to be had; a file
/// beyond these is not removed when a signal ends the process.
std::array<std::atomic<const char*>, 64> unfinished{};

std::atomic<const char*>* note_unfinished(const char* name) {
  for (std::atomic<const char*>& slot : unfinished) {
    const char* free = nullptr;
    if (slot.compare_exchange_strong(free, name)) return &slot;
  }
  return nullptr;
}

}  // namespace

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string extension_of(const std::filesystem::path& path) { return lower_case(path.extension().string()); }

std::optional<fs::path> user_cache_folder() {
  const auto absolute = [](const char* variable) -> std::optional<fs::path> {
    const char* const value = std::getenv(variable);
    if (value == nullptr || value[0] != '/') return std::nullopt;
    return fs::path(value);
  };
  if (const auto folder = absolute("XDG_CACHE_HOME")) return *folder / "vrpipe";
  if (const auto home = absolute("HOME")) return *home / ".cache" / "vrpipe";
  return std::nullopt;
}

InputFile::InputFile(const fs::path& path, const std::string& what) : what_(what), where_(path.string()) {
  // A pipe without a writer would block.
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor_ < 0) {
    const int error = errno;
    throw UserError(what, where_, error == ENOENT ? "no such file" : describe_errno(error),
                    error == EACCES ? "check the file's permissions" : "check the path");
  }
  struct stat status {};
  const int error = ::fstat(descriptor_, &status) != 0 ? errno : 0;
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    ::close(descriptor_);
    throw UserError(what, where_, why, remedy);
  };
  if (error != 0) refuse(describe_errno(error), "check the file system");
  if (S_ISDIR(status.st_mode)) refuse("it is a directory", "name a file in it");
  if (!S_ISREG(status.st_mode)) refuse("it is not a regular file", "copy its contents to a file first");
  if (status.st_size == 0) refuse("the file is empty", "get or write the file again");
  size_ = static_cast<std::uint64_t>(status.st_size);
  seconds_ = status.st_mtim.tv_sec;
  nanoseconds_ = status.st_mtim.tv_nsec;
}

InputFile::~InputFile() { ::close(descriptor_); }

void InputFile::read(std::uint64_t offset, void* data, std::size_t size_bytes) const {
  std::byte* to = static_cast<std::byte*>(data);
  while (size_bytes > 0) {
    const ssize_t count = ::pread(descriptor_, to, size_bytes, static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw UserError(what_, where_, describe_errno(errno), "check the disk and the file system");
    if (count == 0) {
      throw UserError(what_, where_, "it became shorter while it was read", "wait until it is written, and try again");
    }
    to += count;
    offset += static_cast<std::uint64_t>(count);
    size_bytes -= static_cast<std::size_t>(count);
  }
}

void InputFile::check_unchanged() const {
  struct stat now {};
  if (::fstat(descriptor_, &now) != 0) throw UserError(what_, where_, describe_errno(errno), "check the file system");
  if (static_cast<std::uint64_t>(now.st_size) == size_ && now.st_mtim.tv_sec == seconds_ &&
      now.st_mtim.tv_nsec == nanoseconds_) {
    return;
  }
  throw UserError(what_, where_, "it was written while it was read", "wait until it is written, and try again");
}

fs::path followed(const fs::path& path, int& error) {
  error = 0;
  struct stat end {};
  // The links in /dev/fd to pipes lead to no path.
  if (::stat(path.c_str(), &end) == 0 && !S_ISREG(end.st_mode)) return path;
  fs::path place = path;
  constexpr int most_links = 40;  // as many as Linux follows
  for (int i = 0; i < most_links; ++i) {
    struct stat status {};
    const bool is_there = ::lstat(place.c_str(), &status) == 0;
    error = is_there || errno == ENOENT ? 0 : errno;
    if (!is_there || !S_ISLNK(status.st_mode)) return place;
    std::error_code unreadable;
    const fs::path link = fs::read_symlink(place, unreadable);
    error = unreadable.value();
    if (error != 0) return place;
    place = place.parent_path() / link;
  }
  error = ELOOP;
  return place;
}

std::string remedy_for_output(int error) {
  switch (error) {
    case ENOSPC:
    case EDQUOT: return "free some space, or name another place";
    case EFBIG: return "raise the limit on the size of files, or name another place";
    case ENAMETOOLONG: return "give a shorter name";
    case ENOENT: return "create the folder, or name another place";
    default: return "name a place that can be written";
  }
}

AtomicFile::AtomicFile(const fs::path& path, const std::string& what, const std::string& where)
    : what_(what), where_(where) {
  buffer_.reserve(std::size_t{1} << 16);  // first, since it may throw
  int error = 0;
  target_ = followed(path, error);
  if (error != 0) fail(error);
  struct stat before {};
  const bool is_there = ::stat(target_.c_str(), &before) == 0;
  if (is_there && S_ISDIR(before.st_mode)) throw UserError(what, where, "it is a directory", "name a file in it");
  if (is_there && !S_ISREG(before.st_mode)) {
    descriptor_ = ::open(target_.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor_ < 0) fail(errno);
  } else {
    // Not longer than a name may be, and no more open to others than the file that it replaces.
    const std::string start = target_.filename().string().substr(0, NAME_MAX - 32);
    const mode_t mode = is_there ? before.st_mode & 0777U : 0666U;
    static std::atomic<unsigned> counter{0};
    do {
      if (unfinished_ != nullptr) *unfinished_ = nullptr;
      temporary_ = target_;
      temporary_.replace_filename(start + ".tmp-" + std::to_string(::getpid()) + "-" + std::to_string(counter++));
      unfinished_ = note_unfinished(temporary_.c_str());
      descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    } while (descriptor_ < 0 && errno == EEXIST);
    if (descriptor_ < 0) {
      error = errno;
      remove();
      fail(error);
    }
    // What the umask took away. Some file systems have no modes to set.
    if (is_there && ::fchmod(descriptor_, before.st_mode & 07777U) != 0) errno = 0;
  }
}

AtomicFile::~AtomicFile() { remove(); }

/// What is left to do when the file is not wanted, or is done.
void AtomicFile::remove() {
  if (descriptor_ >= 0) {
    ::close(descriptor_);
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
  }
  descriptor_ = -1;
  if (unfinished_ != nullptr) *unfinished_ = nullptr;
  unfinished_ = nullptr;
}

void AtomicFile::fail(int error) const {
  throw UserError(what_, where_, describe_errno(error), remedy_for_output(error));
}

void AtomicFile::flush() {
  std::size_t done = 0;
  while (done < buffer_.size()) {
    const ssize_t written = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(errno);
    done += static_cast<std::size_t>(written);
  }
  buffer_.clear();
}

void AtomicFile::write(const void* data, std::size_t size_bytes) {
  const std::byte* bytes = static_cast<const std::byte*>(data);
  while (size_bytes > 0) {
    const std::size_t part = std::min(size_bytes, buffer_.capacity() - buffer_.size());
    buffer_.insert(buffer_.end(), bytes, bytes + part);
    bytes += part;
    size_bytes -= part;
    if (buffer_.size() == buffer_.capacity()) flush();
  }
}

void AtomicFile::commit() {
  flush();
  int error = ::close(descriptor_) != 0 ? errno : 0;
  descriptor_ = -1;
  if (!temporary_.empty()) {
    if (error == 0 && ::rename(temporary_.c_str(), target_.c_str()) != 0) error = errno;
    if (error != 0) ::unlink(temporary_.c_str());
  }
  remove();
  if (error != 0) fail(error);
}

void remove_unfinished_files() noexcept {
  for (const std::atomic<const char*>& slot : unfinished) {
    const char* const name = slot;
    if (name != nullptr) ::unlink(name);
  }
}

}  // namespace vrpipe
