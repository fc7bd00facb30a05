#include "output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <system_error>

#include <fmt/format.h>

#include <vrpipe/error.h>

namespace vrpipe::tools {
namespace {

namespace fs = std::filesystem;

std::string place(const fs::path& path, const std::string& option) { return option + " " + path.string(); }

std::string describe(int error) { return std::generic_category().message(error); }

constexpr const char* cannot_write = "cannot write file";
constexpr const char* cannot_use_folder = "cannot use folder";

bool is_regular_or_missing(const fs::path& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  return !fs::exists(status) || fs::is_regular_file(status);
}

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

/// Writes all bytes; 0, or the error's number.
int write_all(int descriptor, const std::string& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t written = ::write(descriptor, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    done += static_cast<std::size_t>(written);
  }
  return 0;
}

}  // namespace

void check_output_file(const fs::path& path, const std::string& option, const std::optional<fs::path>& folder_to_be) {
  std::error_code error;
  if (folder_to_be && fs::absolute(path).lexically_normal().parent_path() ==
                          (fs::absolute(*folder_to_be) / "").lexically_normal().parent_path()) {
    return;
  }
  if (fs::is_directory(path, error)) {
    throw UserError(cannot_write, place(path, option), "it is a folder", "name a file in it");
  }
  const fs::path folder = folder_of(path);
  if (!fs::is_directory(folder, error)) {
    throw UserError(cannot_write, place(path, option), "there is no folder " + folder.string(),
                    "create it, or name another place");
  }
  const fs::path written = is_regular_or_missing(path) ? folder : path;
  if (::access(written.c_str(), W_OK) != 0) {
    throw UserError(cannot_write, place(path, option), describe(errno), "name a place that can be written");
  }
}

void check_output_folder(const fs::path& path, const std::string& option) {
  std::error_code error;
  fs::path there = path;
  while (!fs::exists(there, error) && there.has_parent_path() && there.parent_path() != there) {
    there = there.parent_path();
  }
  if (!fs::exists(there, error)) there = ".";
  if (!fs::is_directory(there, error)) {
    throw UserError(cannot_use_folder, place(path, option), there.string() + " is not a folder", "name another place");
  }
  if (::access(there.c_str(), W_OK | X_OK) != 0) {
    throw UserError(cannot_use_folder, place(path, option), there.string() + ": " + describe(errno),
                    "name a place that can be written");
  }
}

void create_output_folder(const fs::path& path, const std::string& option) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error && !fs::is_directory(path)) {
    throw UserError(cannot_use_folder, place(path, option), error.message(), "name a place that can be written");
  }
}

void write_output_file(const fs::path& path, const std::string& bytes, const std::string& option) {
  const auto refuse = [&](int error) {
    throw UserError(cannot_write, place(path, option), describe(error), "free some space, or name another place");
  };
  if (!is_regular_or_missing(path)) {
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor < 0) refuse(errno);
    const int error = write_all(descriptor, bytes);
    ::close(descriptor);
    if (error != 0) refuse(error);
    return;
  }
  // A link stays a link: what it points to is replaced.
  std::error_code ignored;
  const fs::path resolved = fs::weakly_canonical(path, ignored);
  const fs::path target = resolved.empty() ? path : resolved;
  static std::atomic<unsigned> counter{0};
  fs::path temporary;
  int descriptor = -1;
  do {
    temporary = target;
    temporary += fmt::format(".tmp-{}-{}", ::getpid(), counter++);
    descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor < 0 && errno == EEXIST);
  if (descriptor < 0) refuse(errno);
  int error = write_all(descriptor, bytes);
  if (::close(descriptor) != 0 && error == 0) error = errno;
  if (error == 0 && ::rename(temporary.c_str(), target.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(temporary.c_str());
    refuse(error);
  }
}

}  // namespace vrpipe::tools
