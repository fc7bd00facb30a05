#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "formats/file_bytes.h"
#include "ply_header.h"

namespace vrpipe {

/// The header of a .ply whose bytes are there.
/// @throws UserError when it has none, or is not binary and little-endian
PlyHeader read_gaussian_ply_header(const FileBytes& file);

/// The records of one element of a binary .ply, which has scalar properties alone, as has every element before it.
class PlyRecords {
 public:
  /// @throws UserError when there is no such element, a property of it occurs twice or is a list, or the file ends before it does
  PlyRecords(const FileBytes& file, const PlyHeader& header, const std::string& element);

  std::uint64_t count() const { return element_->count; }
  std::uint64_t stride() const { return element_->stride_bytes; }
  const std::byte* data() const { return data_; }
  const std::byte* operator[](std::uint64_t index) const { return data_ + index * stride(); }

  bool has(const std::string& name) const { return properties_.count(name) != 0; }
  /// How many properties are named f_rest_*.
  std::uint64_t rest_count() const;
  /// Where a property lies in its record, bytes. `type` is "float", "uint" or "uchar"; so are its other names (float32 ...).
  /// @throws UserError when there is none, or it is of another type
  std::uint32_t offset(const std::string& name, std::string_view type) const;

 private:
  FileBytes file_;
  const PlyElement* element_;
  /// Not hashed: names could be made that all have one hash.
  std::map<std::string, const PlyProperty*> properties_;
  const std::byte* data_;
};

/// SH degree of `rest` properties f_rest_*.
/// @throws UserError unless there are 0, 9, 24 or 45
int sh_degree_of_ply(std::uint64_t rest, const std::string& element, const FileBytes& file);

}  // namespace vrpipe
