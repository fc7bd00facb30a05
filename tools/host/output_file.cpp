#include "host/output_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <map>
#include <system_error>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

#include "host/command_failure.h"
#include "host/process_setup.h"

namespace vrpipe::tools {
namespace {

namespace fs = std::filesystem;

std::string place(const fs::path& path, const std::string& option) { return option + " " + path.string(); }

std::string describe(int error) { return std::generic_category().message(error); }

constexpr const char* cannot_write = "cannot write file";
constexpr const char* cannot_use_folder = "cannot use folder";

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

/// An absolute path without links, as far as it is there, and without a slash at its end.
fs::path plain(const fs::path& path) {
  std::error_code ignored;
  return (fs::weakly_canonical(path, ignored) / "").lexically_normal().parent_path();
}

/// What tells a file from every other; empty for a pipe or a device, which replaces nothing.
std::string identity(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) {
    return S_ISREG(status.st_mode) ? fmt::format("{}:{}", status.st_dev, status.st_ino) : std::string();
  }
  int ignored = 0;
  const fs::path target = followed(path, ignored);
  return (plain(folder_of(target)) / target.filename()).string();
}

}  // namespace

void check_output_file(const fs::path& path, const std::string& option, const std::optional<fs::path>& folder_to_be) {
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    throw UserError(cannot_write, place(path, option), why, remedy);
  };
  if (path == "-") refuse("only --json can go to stdout", "name a file (./- for one of this name)");
  if (path.filename().native().size() > NAME_MAX) refuse(describe(ENAMETOOLONG), remedy_for_output(ENAMETOOLONG));
  int error = 0;
  const fs::path target = followed(path, error);
  if (error != 0) refuse(describe(error), remedy_for_output(error));
  if (is_folder(target) || !target.has_filename()) refuse("it is a folder", "name a file in it");
  const fs::path folder = folder_of(target);
  if (!is_folder(folder)) {
    if (folder_to_be && plain(folder) == plain(*folder_to_be)) return;
    refuse("there is no folder " + folder.string(), "create it, or name another place");
  }
  std::error_code ignored;
  const fs::file_status status = fs::status(target, ignored);
  const bool is_replaced = !fs::exists(status) || fs::is_regular_file(status);
  if (::access(is_replaced ? folder.c_str() : target.c_str(), is_replaced ? W_OK | X_OK : W_OK) != 0) {
    refuse(describe(errno), remedy_for_output(errno));
  }
}

void check_files_differ(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs) {
  std::map<std::string, const NamedFile*> taken;
  for (const NamedFile& input : inputs) taken.emplace(identity(input.path), &input);
  for (const NamedFile& output : outputs) {
    const std::string key = identity(output.path);
    if (key.empty()) continue;
    const auto [other, is_new] = taken.emplace(key, &output);
    if (is_new) continue;
    throw UserError(cannot_write, place(output.path, output.option),
                    place(other->second->path, other->second->option) + " is the same file", "name another file");
  }
}

void check_output_folder(const fs::path& path, const std::string& option) {
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    throw UserError(cannot_use_folder, place(path, option), why, remedy);
  };
  if (path == "-") refuse("images cannot go to stdout", "name a folder (./- for one of this name)");
  for (const fs::path& part : path) {
    if (part.native().size() > NAME_MAX) refuse(describe(ENAMETOOLONG), remedy_for_output(ENAMETOOLONG));
  }
  fs::path there = path;
  struct stat status {};
  while (::stat(there.c_str(), &status) != 0) {
    const int error = errno;
    const bool is_missing = error == ENOTDIR || (error == ENOENT && ::lstat(there.c_str(), &status) != 0);
    if (!is_missing) refuse(there.string() + ": " + describe(error), remedy_for_output(error));
    there = there.has_parent_path() && there.parent_path() != there ? there.parent_path() : fs::path(".");
  }
  if (!S_ISDIR(status.st_mode)) refuse(there.string() + " is not a folder", "name another place");
  if (::access(there.c_str(), W_OK | X_OK) != 0) {
    refuse(there.string() + ": " + describe(errno), "name a place that can be written");
  }
}

void create_output_folder(const fs::path& path, const std::string& option) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error && !is_folder(path)) {
    throw UserError(cannot_use_folder, place(path, option), error.message(), remedy_for_output(error.value()));
  }
}

void write_output_file(const fs::path& path, const std::string& bytes, const std::string& option) {
  AtomicFile file(path, cannot_write, place(path, option));
  file.write(bytes.data(), bytes.size());
  file.commit();
  note_written(path.string());
}

CourseFile::CourseFile(const fs::path& path, const std::string& option) : path_(path) {
  attempt([&] { file_ = std::make_unique<AtomicFile>(path, cannot_write, place(path, option)); });
}

void CourseFile::write(const void* data, std::size_t size_bytes) {
  if (file_ != nullptr) attempt([&] { file_->write(data, size_bytes); });
}

void CourseFile::commit() {
  if (file_ != nullptr) attempt([&] { file_->commit(); });
  if (failure_) std::rethrow_exception(failure_);
  note_written(path_.string());
}

template <class Step>
void CourseFile::attempt(const Step& step) {
  try {
    step();
  } catch (const UserError&) {
    failure_ = std::current_exception();
    file_.reset();
  }
}

bool ResultFiles::write(const fs::path& path, const std::string& bytes, const std::string& option) {
  return finish(path, option, [&] { write_output_file(path, bytes, option); });
}

bool ResultFiles::finish(const fs::path& path, const std::string& option, const std::function<void()>& finish) {
  try {
    finish();
    written_.insert(option);
    return true;
  } catch (const UserError& error) {
    failures_ += failures_.empty() ? error.what() : "; neither could " + place(path, option) + " be written";
    failed_.insert(option);
    return false;
  }
}

bool ResultFiles::has(const std::string& option) const {
  return written_.count(option) > 0 && failed_.count(option) == 0;
}

void ResultFiles::check() const {
  if (!failures_.empty()) throw CommandFailure(exit_user_error, failures_);
}

}  // namespace vrpipe::tools
