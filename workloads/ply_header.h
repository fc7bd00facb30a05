#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vrpipe {

struct PlyProperty {
  std::string name, type;
  std::uint64_t offset =
      0;  ///< of a scalar in a binary file: bytes from the start of the record, without the lists before it
  std::string count_type;  ///< of a list; empty for a scalar
  bool is_list() const { return !count_type.empty(); }
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::uint64_t stride_bytes = 0;  ///< of a record in a binary file, without its lists
  std::vector<PlyProperty> properties;
  /// The first list property; null when there is none.
  const PlyProperty* first_list() const;
};

struct PlyHeader {
  std::string format;  ///< as the file has it, e.g. "binary_little_endian 1.0"
  std::vector<PlyElement> elements;
  std::vector<std::string> comments;  ///< what follows the word `comment`, in order
  std::size_t size_bytes = 0;
  /// Null for an element that it does not have.
  const PlyElement* element(std::string_view name) const;
};

/// A header is some kilobytes; without this limit a foreign file would be searched to its end.
constexpr std::size_t kMaxPlyHeaderBytes = std::size_t{1} << 20;

/// Reads the header of a PLY file, of which `head` is the beginning. `what` begins the message, e.g. "cannot read scene";
/// `export_remedy` says which file would do.
/// @throws UserError when it is no such header, or longer than kMaxPlyHeaderBytes
PlyHeader read_ply_header(std::string_view head, const std::string& what, const std::string& where,
                          const std::string& export_remedy);

/// Bytes of a PLY scalar type; 0 for an unknown one.
std::uint32_t ply_scalar_size(std::string_view type);

/// A word for a message: in a foreign file it may be a megabyte.
std::string shortened(std::string_view word);

}  // namespace vrpipe
