#include "ply_document.h"

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/mesh.h>

#include "asset_files.h"
#include "words.h"

namespace vrpipe {
namespace {

constexpr char kExportAgain[] = "export the mesh again";
/// Longer lists are no polygons, and triangulating one would take minutes.
constexpr std::uint64_t kMaxListLength = 1024;

bool is_integer(std::string_view type) { return type.front() != 'f' && type.front() != 'd'; }

/// Whether a mesh needs a property. Where several have one name, the first of them.
bool is_needed(const PlyElement& element, const PlyProperty& property) {
  const auto first = std::find_if(element.properties.begin(), element.properties.end(),
                                  [&](const PlyProperty& p) { return p.name == property.name; });
  if (&*first != &property) return false;
  const std::string& name = property.name;
  if (element.name == "face") return property.is_list() && (name == "vertex_indices" || name == "vertex_index");
  const auto one_of = [&](std::initializer_list<const char*> names) {
    return !property.is_list() && std::find(names.begin(), names.end(), name) != names.end();
  };
  return one_of({"x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"});
}

/// Walks over all records and copies what is needed of them.
class RecordWalker {
 public:
  RecordWalker(const PlyHeader& header, const std::string& bytes, const std::string& where)
      : bytes_(bytes), where_(where), position_(header.size_bytes) {
    ascii_ = header.format == "ascii 1.0";
    swap_ = header.format == "binary_big_endian 1.0";
    if (!ascii_ && !swap_ && header.format != "binary_little_endian 1.0") {
      throw UserError(kCannotReadMesh, where, "its format is `" + header.format + "`",
                      "PLY formats are ascii 1.0, binary_little_endian 1.0 and binary_big_endian 1.0");
    }
  }

  void walk(const PlyElement& element, std::string& copied) {
    for (const PlyProperty& property : element.properties) check_types(property);
    if (element.properties.empty() && element.count > 0) fail(element, 0, "the element has no properties");
    const bool needed = element.name == "vertex" || element.name == "face";
    for (std::uint64_t record = 0; record < element.count; ++record) {
      if (ascii_) next_line(element, record);
      for (const PlyProperty& property : element.properties) {
        std::string* const to = needed && is_needed(element, property) ? &copied : nullptr;
        const std::size_t begin = position_;
        const std::uint64_t length = property.is_list() ? list_length(element, record, property, to) : 1;
        if (ascii_) {
          for (std::uint64_t i = 0; i < length; ++i) value(element, record, property, to);
        } else {
          skip(element, record, length * ply_scalar_size(property.type));
          if (to != nullptr) to->append(bytes_, begin, position_ - begin);
        }
      }
      if (ascii_) copied += '\n';
    }
  }

 private:
  [[noreturn]] void fail(const PlyElement& element, std::uint64_t record, const std::string& why) const {
    throw UserError(kCannotReadMesh, where_,
                    why + " (record " + std::to_string(record) + " of element " + shortened(element.name) + ")",
                    kExportAgain);
  }

  void check_types(const PlyProperty& property) const {
    const bool known =
        ply_scalar_size(property.type) > 0 && (!property.is_list() || ply_scalar_size(property.count_type) > 0);
    if (known) return;
    throw UserError(kCannotReadMesh, where_, "property `" + shortened(property.name) + "` has an unknown type",
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
    return word;
  }

  /// A value of a text.
  void value(const PlyElement& element, std::uint64_t record, const PlyProperty& property, std::string* to) {
    const std::string_view word = next_word(element, record);
    std::string copy;
    if (is_integer(property.type)) {
      if (const auto integer = number_of<std::int64_t>(word)) copy = fmt::format("{} ", *integer);
    } else {
      if (const auto number = float_of(word)) copy = fmt::format("{} ", *number);
    }
    if (copy.empty()) fail(element, record, "`" + shortened(word) + "` is not a number of its type");
    if (to != nullptr) *to += copy;
  }

  std::uint64_t list_length(const PlyElement& element, std::uint64_t record, const PlyProperty& property,
                            std::string* to) {
    std::uint64_t length = 0;
    if (ascii_) {
      const std::string_view word = next_word(element, record);
      const auto number = number_of<std::uint64_t>(word);
      if (!number) fail(element, record, "`" + shortened(word) + "` is not the length of a list");
      length = *number;
      if (to != nullptr) *to += fmt::format("{} ", length);
    } else {
      const std::uint32_t size = ply_scalar_size(property.count_type);
      if (!is_integer(property.count_type)) fail(element, record, "the length of a list is no integer");
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

std::string reduced_ply(const PlyHeader& header, const std::string& bytes, const std::string& where) {
  const PlyElement *const vertices = header.element("vertex"), *const faces = header.element("face");
  if (faces == nullptr || faces->count == 0 || vertices == nullptr) {
    throw UserError(kCannotReadMesh, where, "it has no faces",
                    "give a .ply with elements vertex and face; Gaussians are given as a scene");
  }
  if (vertices > faces)
    throw UserError(kCannotReadMesh, where, "element face comes before element vertex", kExportAgain);
  RecordWalker walker(header, bytes, where);
  std::string head = "ply\nformat " + header.format + "\n", records;
  for (const PlyElement& element : header.elements) {
    if (header.element(element.name) != &element) {
      throw UserError(kCannotReadMesh, where, "there are two elements `" + shortened(element.name) + "`", kExportAgain);
    }
    if (element.count > kMaxMeshElements) {
      throw UserError(kCannotReadMesh, where,
                      "it has " + std::to_string(element.count) + " records of element " + shortened(element.name),
                      "use at most " + std::to_string(kMaxMeshElements));
    }
    std::string copied;
    walker.walk(element, copied);
    if (&element != vertices && &element != faces) continue;
    records += copied;
    head += "element " + element.name + " " + std::to_string(element.count) + "\n";
    std::vector<std::string> names;
    for (const PlyProperty& property : element.properties) {
      if (!is_needed(element, property)) continue;
      names.push_back(property.name);
      head += "property " + (property.is_list() ? "list " + property.count_type + " " : "") + property.type + " " +
              property.name + "\n";
    }
    const auto has = [&](const char* name) { return std::find(names.begin(), names.end(), name) != names.end(); };
    if (&element == vertices ? !has("x") || !has("y") || !has("z") : names.size() != 1) {
      throw UserError(kCannotReadMesh, where,
                      &element == vertices ? "element vertex has no x, y and z"
                                           : "element face has no list vertex_indices, or two",
                      kExportAgain);
    }
  }
  return head + "end_header\n" + records;
}

}  // namespace vrpipe
