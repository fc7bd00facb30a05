#pragma once

#include <cstddef>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "file_io.h"

namespace vrpipe::tools {

// Files that the user named. A long simulation must not end in a file that cannot be written, so names are checked
// first; and no file is seen half-written. `option` names the option in messages. All throw UserError.

/// A file, and the option that named it.
struct NamedFile {
  std::string option;  ///< e.g. "--json"
  std::filesystem::path path;
};

/// Checks, without creating anything, that a file can be written under this name.
/// @param folder_to_be  a folder that will be there by then, if any
void check_output_file(const std::filesystem::path& path, const std::string& option,
                       const std::optional<std::filesystem::path>& folder_to_be = std::nullopt);

/// Checks that no output is an input or another output, by whatever name, link or path to a file that is not there yet.
/// Several outputs may go to one pipe or device.
void check_files_differ(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs);

/// Checks, without creating anything, that a folder is there or can be made.
void check_output_folder(const std::filesystem::path& path, const std::string& option);

/// Makes the folder, with the folders above it, unless it is there.
void create_output_folder(const std::filesystem::path& path, const std::string& option);

/// A file that a run writes as it goes on. What keeps it from being written does not end the run: commit() says it.
class CourseFile {
 public:
  CourseFile(const std::filesystem::path& path, const std::string& option);
  void write(const void* data, std::size_t size_bytes);
  /// The file appears, or what kept it from that is thrown.
  void commit();

 private:
  template <class Step>
  void attempt(const Step& step);

  const std::filesystem::path path_;
  std::unique_ptr<AtomicFile> file_;  ///< null once it failed
  std::exception_ptr failure_;
};

/// Writes a file as AtomicFile does.
void write_output_file(const std::filesystem::path& path, const std::string& bytes, const std::string& option);

/// The files of one result: a disk that is full under one of them does not take the others with it.
class ResultFiles {
 public:
  /// Writes a file as write_output_file() does; what keeps it from being written, check() says. Returns whether it is there.
  bool write(const std::filesystem::path& path, const std::string& bytes, const std::string& option);
  /// The same of what `finish` writes, a CourseFile's last piece.
  bool finish(const std::filesystem::path& path, const std::string& option, const std::function<void()>& finish);
  /// Whether all that an option named is written, and something is.
  bool has(const std::string& option) const;
  /// Once all is written and printed. Throws CommandFailure with all that could not be.
  void check() const;

 private:
  std::set<std::string> written_, failed_;  ///< options
  std::string failures_;
};

}  // namespace vrpipe::tools
