#pragma once

#include <memory>
#include <string>
#include <vector>

#include "formats/file_bytes.h"

namespace vrpipe {

/// A zip archive in memory.
class ZipArchive {
 public:
  /// @throws UserError when it is none, or is damaged
  explicit ZipArchive(const FileBytes& bytes);
  ~ZipArchive();
  ZipArchive(const ZipArchive&) = delete;
  ZipArchive& operator=(const ZipArchive&) = delete;

  /// Names of its files, in their order.
  const std::vector<std::string>& names() const { return names_; }
  /// A file's bytes.
  /// @throws UserError when there is no such file, it is damaged or packed in another way than by deflating, or all that was read
  ///         is much larger than the whole archive
  FileBytes read(const std::string& name) const;

 private:
  struct Handle;
  FileBytes bytes_;
  std::unique_ptr<Handle> handle_;
  std::vector<std::string> names_;
  mutable std::uint64_t unpacked_ = 0;  ///< bytes, of all that was read
};

}  // namespace vrpipe
