#include "ply_records.h"

#include <charconv>
#include <cstring>
#include <string_view>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/mesh.h>

namespace vrpipe {
namespace {

constexpr char kCannotRead[] = "cannot read mesh";
constexpr char kExportAgain[] = "export the mesh again";
/// Longer lists are no polygons, and triangulating one would take minutes.
constexpr std::uint64_t kMaxListLength = 1024;

class RecordWalker {
 public:
  RecordWalker(const PlyHeader& header, const std::string& bytes, const std::string& where)
      : bytes_(bytes), where_(where), position_(header.size_bytes) {
    ascii_ = header.format == "ascii 1.0";
    swap_ = header.format == "binary_big_endian 1.0";
    if (!ascii_ && !swap_ && header.format != "binary_little_endian 1.0") {
      throw UserError(kCannotRead, where, "its format is `" + header.format + "`",
                      "PLY formats are ascii 1.0, binary_little_endian 1.0 and binary_big_endian 1.0");
    }
  }

  void walk(const PlyElement& element) {
    for (const PlyProperty& property : element.properties) check_types(property);
    if (element.properties.empty() && element.count > 0) fail(element, 0, "the element has no properties");
    for (std::uint64_t record = 0; record < element.count; ++record) {
      if (ascii_) next_line(element, record);
      for (const PlyProperty& property : element.properties) {
        const std::uint64_t length = property.is_list() ? list_length(element, record, property) : 1;
        if (ascii_) {
          for (std::uint64_t i = 0; i < length; ++i) next_word(element, record);
        } else {
          skip(element, record, length * ply_scalar_size(property.type));
        }
      }
    }
  }

 private:
  [[noreturn]] void fail(const PlyElement& element, std::uint64_t record, const std::string& why) const {
    throw UserError(kCannotRead, where_,
                    why + " (record " + std::to_string(record) + " of element " + shortened(element.name) + ")",
                    kExportAgain);
  }

  void check_types(const PlyProperty& property) const {
    const bool known =
        ply_scalar_size(property.type) > 0 && (!property.is_list() || ply_scalar_size(property.count_type) > 0);
    if (known) return;
    throw UserError(kCannotRead, where_, "property `" + shortened(property.name) + "` has an unknown type",
                    "PLY types are char uchar short ushort int uint float double, and int8 to float64");
  }

  void skip(const PlyElement& element, std::uint64_t record, std::uint64_t size_bytes) {
    if (size_bytes > bytes_.size() - position_) fail(element, record, "the file is cut short");
    position_ += static_cast<std::size_t>(size_bytes);
  }

  /// A record of a text is a line.
  void next_line(const PlyElement& element, std::uint64_t record) {
    do {
      if (position_ >= bytes_.size()) fail(element, record, "the file is cut short");
      const std::size_t end = std::min(bytes_.find('\n', position_), bytes_.size());
      line_ = std::string_view(bytes_).substr(position_, end - position_);
      position_ = end + 1;
    } while (line_.find_first_not_of(" \t\r") == std::string_view::npos);
  }

  std::string_view next_word(const PlyElement& element, std::uint64_t record) {
    constexpr std::string_view kBlank = " \t\r";
    const std::size_t begin = line_.find_first_not_of(kBlank);
    if (begin == std::string_view::npos) fail(element, record, "a line has too few values");
    const std::size_t end = std::min(line_.find_first_of(kBlank, begin), line_.size());
    const std::string_view word = line_.substr(begin, end - begin);
    line_.remove_prefix(end);
    if (word.find_first_not_of("+-.0123456789eEinfatyINFATY") != std::string_view::npos) {
      fail(element, record, "`" + shortened(word) + "` is not a number");
    }
    return word;
  }

  std::uint64_t list_length(const PlyElement& element, std::uint64_t record, const PlyProperty& property) {
    std::uint64_t length = 0;
    if (ascii_) {
      const std::string_view word = next_word(element, record);
      const auto result = std::from_chars(word.data(), word.data() + word.size(), length);
      if (result.ec != std::errc{} || result.ptr != word.data() + word.size()) {
        fail(element, record, "`" + shortened(word) + "` is not the length of a list");
      }
    } else {
      const std::uint32_t size = ply_scalar_size(property.count_type);
      if (size == 8 || property.count_type.front() == 'f') fail(element, record, "the length of a list is no integer");
      const std::size_t begin = position_;
      skip(element, record, size);
      for (std::uint32_t i = 0; i < size; ++i) {
        const std::size_t byte = begin + (swap_ ? i : size - 1 - i);
        length = length << 8 | static_cast<unsigned char>(bytes_[byte]);
      }
    }
    // A negative length is a large one.
    if (length > kMaxListLength) {
      fail(element, record,
           "a list has " + std::to_string(length) + " values, more than " + std::to_string(kMaxListLength));
    }
    return length;
  }

  const std::string& bytes_;
  const std::string& where_;
  std::size_t position_;
  std::string_view line_;
  bool ascii_ = false, swap_ = false;
};

}  // namespace

void check_ply_records(const PlyHeader& header, const std::string& bytes, const std::string& where) {
  const PlyElement* faces = header.element("face");
  if (faces == nullptr || faces->count == 0 || header.element("vertex") == nullptr) {
    throw UserError(kCannotRead, where, "it has no faces",
                    "give a .ply with elements vertex and face; Gaussians are given as a scene");
  }
  if (faces->first_list() == nullptr) {
    throw UserError(kCannotRead, where, "element face has no list of vertices", kExportAgain);
  }
  RecordWalker walker(header, bytes, where);
  for (const PlyElement& element : header.elements) {
    if (header.element(element.name) != &element) {
      throw UserError(kCannotRead, where, "there are two elements `" + shortened(element.name) + "`", kExportAgain);
    }
    if (&element == faces && header.element("vertex") > faces) {
      throw UserError(kCannotRead, where, "element face comes before element vertex", kExportAgain);
    }
    if (element.count > kMaxMeshElements) {
      throw UserError(kCannotRead, where,
                      "it has " + std::to_string(element.count) + " records of element " + shortened(element.name),
                      "use at most " + std::to_string(kMaxMeshElements));
    }
    walker.walk(element);
  }
}

}  // namespace vrpipe
