#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "formats/file_bytes.h"
#include "ply_header.h"

namespace vrpipe {

/// The header of a .ply whose bytes are there.
/// @throws UserError when it has none, or a format that is not one of binary_little_endian, binary_big_endian and ascii
PlyHeader read_gaussian_ply_header(const FileBytes& file);

/// A number in a record.
struct PlyNumber {
  enum class Type : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
  std::uint32_t offset = 0;
  Type type = Type::float32;
  double of(const std::byte* record) const;
};

/// The records of one element of a .ply, which has scalar properties alone, as has every element before it. They lie as in a
/// binary little-endian file, and in it if it is one.
class PlyRecords {
 public:
  /// @throws UserError when there is no such element, a property of it occurs twice or is a list, the file ends before it does,
  /// or what should be a number in an ascii file is none
  PlyRecords(const FileBytes& file, const PlyHeader& header, const std::string& element);

  std::uint64_t count() const { return element_->count; }
  std::uint64_t stride() const { return element_->stride_bytes; }
  const std::byte* data() const { return data_; }
  /// Keeps them alive.
  const std::shared_ptr<const std::byte[]>& storage() const { return bytes_.storage(); }
  const std::byte* operator[](std::uint64_t index) const { return data_ + index * stride(); }

  bool has(const std::string& name) const { return properties_.count(name) != 0; }
  /// Of all properties, in alphabetical order.
  std::vector<std::string> names() const;
  /// How many properties are named f_rest_*.
  std::uint64_t rest_count() const;
  /// Where a property lies in its record, bytes. `type` is "float", "uint" or "uchar"; so are its other names (float32 ...).
  /// @throws UserError when there is none, or it is of another type
  std::uint32_t offset(const std::string& name, std::string_view type) const;
  /// The same of any type. @throws UserError when there is none
  PlyNumber number(const std::string& name) const;

 private:
  const PlyProperty& property(const std::string& name) const;
  /// What the element takes in a little-endian file, from other bytes.
  FileBytes swapped(const std::byte* records) const;
  FileBytes parsed(const PlyHeader& header) const;

  FileBytes file_;
  FileBytes bytes_;  ///< with the records
  const PlyElement* element_;
  /// Not hashed: names could be made that all have one hash.
  std::map<std::string, const PlyProperty*> properties_;
  const std::byte* data_;
};

/// SH degree of `rest` properties f_rest_*, 0 to 4.
/// @throws UserError unless there are 0, 9, 24, 45 or 72
int sh_degree_of_ply(std::uint64_t rest, const std::string& element, const FileBytes& file);

}  // namespace vrpipe
