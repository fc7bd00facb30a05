#pragma once

#include <filesystem>
#include <string>

namespace vrpipe::testing {

/// A file of tests/data as it lies there.
std::filesystem::path data_file(const std::string& name);

/// The bytes of tests/data/NAME.xz, unpacked.
std::string unpacked(const std::string& name);

/// The same as a file, for readers that take a path; removed with this object.
class UnpackedFile {
 public:
  explicit UnpackedFile(const std::string& name);
  ~UnpackedFile();
  UnpackedFile(const UnpackedFile&) = delete;
  UnpackedFile& operator=(const UnpackedFile&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace vrpipe::testing
