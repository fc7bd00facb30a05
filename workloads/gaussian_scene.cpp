#include <vrpipe/workloads/gaussian_scene.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <vrpipe/component/error.h>

#include "file_io.h"

namespace vrpipe {
namespace {

constexpr char kCannotRead[] = "cannot read scene";
constexpr char kExportRemedy[] = "export the scene as an INRIA 3D Gaussian splatting .ply (binary, little-endian)";
/// A header is some kilobytes; without this limit a foreign file would be searched to its end.
constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 20;

/// Offsets inside a record that we write: x y z nx ny nz f_dc f_rest opacity scale rot.
GaussianLayout canonical_layout(int sh_degree) {
  GaussianLayout layout;
  std::uint32_t offset = 0;
  const auto next = [&offset] {
    const std::uint32_t here = offset;
    offset += 4;
    return here;
  };
  for (auto& o : layout.position) o = next();
  offset += 12;  // normals
  for (auto& o : layout.f_dc) o = next();
  const std::size_t rest = 3 * std::size_t{kShRestPerChannel[static_cast<std::size_t>(sh_degree)]};
  for (std::size_t i = 0; i < rest; ++i) layout.f_rest[i] = next();
  layout.opacity = next();
  for (auto& o : layout.log_scale) o = next();
  for (auto& o : layout.rotation) o = next();
  return layout;
}

std::size_t canonical_floats(int sh_degree) {
  return 17 + 3 * std::size_t{kShRestPerChannel[static_cast<std::size_t>(sh_degree)]};
}

/// Bytes of a PLY scalar type; 0 for an unknown one.
std::uint32_t scalar_size(std::string_view type) {
  static const std::unordered_map<std::string_view, std::uint32_t> sizes = {
      {"char", 1},  {"uchar", 1},  {"short", 2},   {"ushort", 2}, {"int", 4},   {"uint", 4},
      {"float", 4}, {"double", 8}, {"int8", 1},    {"uint8", 1},  {"int16", 2}, {"uint16", 2},
      {"int32", 4}, {"uint32", 4}, {"float32", 4}, {"float64", 8}};
  const auto found = sizes.find(type);
  return found == sizes.end() ? 0 : found->second;
}

/// A word for a message: in a foreign file it may be a megabyte.
std::string shortened(std::string_view word) {
  constexpr std::size_t longest = 40;
  return word.size() <= longest ? std::string(word) : std::string(word.substr(0, longest)) + "...";
}

struct Property {
  std::string name, type;
  std::uint64_t offset = 0;  ///< bytes from the start of the record
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::uint64_t stride_bytes = 0;
  std::vector<Property> properties;
  std::string list_property;  ///< name of the first list property; empty when there is none
};

struct Header {
  std::vector<Element> elements;
  std::size_t size_bytes = 0;
};

class HeaderParser {
 public:
  HeaderParser(const std::string& where, std::string_view bytes) : where_(where), bytes_(bytes) {}

  Header parse() {
    if (bytes_.substr(0, 4) != "ply\n" && bytes_.substr(0, 5) != "ply\r\n") {
      fail("the file does not begin with a line `ply`", kExportRemedy);
    }
    next_line();
    bool format_seen = false;
    for (;;) {
      const std::vector<std::string_view> words = split(next_line());
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") break;
      if (words[0] == "format") {
        check_format(words);
        format_seen = true;
      } else if (words[0] == "element") {
        add_element(words);
      } else if (words[0] == "property") {
        add_property(words);
      } else {
        fail("header line " + std::to_string(line_) + " begins with `" + shortened(words[0]) + "`",
             "a PLY header holds format, comment, obj_info, element and property lines");
      }
    }
    if (!format_seen) fail("the header has no format line", kExportRemedy);
    header_.size_bytes = position_;
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(const std::string& why, const std::string& remedy) const {
    throw UserError(kCannotRead, where_, why, remedy);
  }

  std::string_view next_line() {
    const std::size_t end = bytes_.substr(0, kMaxHeaderBytes).find('\n', position_);
    if (end == std::string_view::npos) {
      fail("the header has no `end_header` line in its first " +
               std::to_string(std::min(bytes_.size(), kMaxHeaderBytes)) + " bytes",
           "get the file again, it seems cut short");
    }
    std::string_view line = bytes_.substr(position_, end - position_);
    position_ = end + 1;
    ++line_;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  }

  static std::vector<std::string_view> split(std::string_view line) {
    std::vector<std::string_view> words;
    constexpr std::string_view kBlank = " \t";
    for (;;) {
      const std::size_t begin = line.find_first_not_of(kBlank);
      if (begin == std::string_view::npos) return words;
      const std::size_t end = std::min(line.find_first_of(kBlank, begin), line.size());
      words.push_back(line.substr(begin, end - begin));
      line.remove_prefix(end);
    }
  }

  void check_format(const std::vector<std::string_view>& words) const {
    if (words.size() == 3 && words[1] == "binary_little_endian" && words[2] == "1.0") return;
    std::string format;
    for (std::size_t i = 1; i < words.size(); ++i) format += (i > 1 ? " " : "") + shortened(words[i]);
    fail("its format is `" + format + "`", "convert it to `binary_little_endian 1.0`, the only one that is read");
  }

  void add_element(const std::vector<std::string_view>& words) {
    Element element;
    if (words.size() == 3) {
      element.name = words[1];
      const char* end = words[2].data() + words[2].size();
      const auto result = std::from_chars(words[2].data(), end, element.count);
      if (result.ec == std::errc{} && result.ptr == end) {
        header_.elements.push_back(std::move(element));
        return;
      }
    }
    fail("header line " + std::to_string(line_) + " is not `element NAME COUNT` with a count of 0 to 2^64-1",
         kExportRemedy);
  }

  void add_property(const std::vector<std::string_view>& words) {
    const std::string line = "header line " + std::to_string(line_);
    if (header_.elements.empty()) fail(line + " is a property before any element", kExportRemedy);
    Element& element = header_.elements.back();
    if (words.size() == 5 && words[1] == "list") {
      if (element.list_property.empty()) element.list_property = words[4];
      return;
    }
    if (words.size() != 3) fail(line + " is not `property TYPE NAME`", kExportRemedy);
    const std::uint32_t size = scalar_size(words[1]);
    if (size == 0) {
      fail("property `" + shortened(words[2]) + "` has the unknown type `" + shortened(words[1]) + "`",
           "PLY types are char uchar short ushort int uint float double, and int8 to float64");
    }
    element.properties.push_back({std::string(words[2]), std::string(words[1]), element.stride_bytes});
    element.stride_bytes += size;
  }

  std::string where_;
  std::string_view bytes_;
  std::size_t position_ = 0;
  int line_ = 0;
  Header header_;
};

/// Finds the properties of the vertex element by name.
class VertexProperties {
 public:
  VertexProperties(const std::string& where, const Element& vertex) : where_(where) {
    for (const Property& property : vertex.properties) {
      if (!by_name_.emplace(property.name, &property).second) {
        throw UserError(kCannotRead, where,
                        "property `" + shortened(property.name) + "` occurs twice in element vertex", kExportRemedy);
      }
    }
  }

  bool has(const std::string& name) const { return by_name_.count(name) != 0; }

  std::uint32_t offset_of_float(const std::string& name) const {
    const auto found = by_name_.find(name);
    if (found == by_name_.end()) {
      throw UserError(kCannotRead, where_, "element vertex has no property `" + name + "`",
                      has("packed_position") ? "this is a compressed .ply: convert it to an INRIA .ply"
                                             : kExportRemedy);
    }
    const Property& property = *found->second;
    if (property.type != "float" && property.type != "float32") {
      throw UserError(kCannotRead, where_, "property `" + name + "` has type `" + shortened(property.type) + "`",
                      "convert it to float");
    }
    return static_cast<std::uint32_t>(property.offset);
  }

  /// How many properties are named f_rest_N.
  std::size_t rest_count() const {
    std::size_t count = 0;
    for (const auto& entry : by_name_) count += entry.first.rfind("f_rest_", 0) == 0;
    return count;
  }

 private:
  std::string where_;
  std::unordered_map<std::string, const Property*> by_name_;
};

/// `count` records of `stride` bytes from `offset` must lie within the file's `available` bytes; returns their end.
std::uint64_t checked_end(const std::string& where, const Element& element, std::uint64_t offset,
                          std::uint64_t available) {
  const std::uint64_t room = available - offset;
  if (element.stride_bytes == 0 || element.count <= room / element.stride_bytes) {
    return offset + element.count * element.stride_bytes;
  }
  const std::uint64_t most = std::numeric_limits<std::uint64_t>::max() - offset;
  const std::string expected = element.count <= most / element.stride_bytes
                                   ? std::to_string(offset + element.count * element.stride_bytes)
                                   : "more than 2^64";
  throw UserError(kCannotRead, where,
                  "the header announces " + std::to_string(element.count) + " records of " +
                      std::to_string(element.stride_bytes) + " bytes in element " + shortened(element.name) +
                      ", which needs " + expected + " bytes, and the file has " + std::to_string(available),
                  "get the file again, it seems cut short");
}

std::shared_ptr<const std::byte[]> read_records(const InputFile& file, const std::string& where, std::uint64_t offset,
                                                std::uint64_t size_bytes) {
  std::shared_ptr<std::byte[]> records;
  try {
    records.reset(new std::byte[static_cast<std::size_t>(size_bytes)]);  // not zeroed, as a vector would be
  } catch (const std::bad_alloc&) {
    throw UserError(kCannotRead, where, "its Gaussians need " + std::to_string(size_bytes >> 20U) + " MiB of memory",
                    "raise the limit on memory, or use a smaller scene");
  }
  file.read(offset, records.get(), static_cast<std::size_t>(size_bytes));
  return records;
}

}  // namespace

GaussianScene::GaussianScene(std::shared_ptr<const void> storage, const std::byte* records, std::uint64_t count,
                             std::size_t stride_bytes, const GaussianLayout& layout, int sh_degree)
    : storage_(std::move(storage)),
      records_(records),
      count_(count),
      stride_bytes_(stride_bytes),
      layout_(std::make_shared<const GaussianLayout>(layout)),
      sh_degree_(sh_degree) {}

GaussianSceneBuilder::GaussianSceneBuilder(int sh_degree) : sh_degree_(sh_degree), floats_per_gaussian_(0) {
  if (sh_degree < 0 || sh_degree > 3) throw std::invalid_argument("SH degree must be 0 to 3");
  floats_per_gaussian_ = canonical_floats(sh_degree);
}

void GaussianSceneBuilder::reserve(std::size_t gaussians) { floats_.reserve(gaussians * floats_per_gaussian_); }

void GaussianSceneBuilder::add(const GaussianAttributes& gaussian) {
  const auto append = [this](const float* values, std::size_t count) {
    floats_.insert(floats_.end(), values, values + count);
  };
  constexpr float kNoNormal[3] = {0, 0, 0};
  append(gaussian.position.data(), 3);
  append(kNoNormal, 3);
  append(gaussian.f_dc.data(), 3);
  for (const auto& channel : gaussian.f_rest) {
    append(channel.data(), kShRestPerChannel[static_cast<std::size_t>(sh_degree_)]);
  }
  append(&gaussian.opacity_logit, 1);
  append(gaussian.log_scale.data(), 3);
  append(gaussian.rotation.data(), 4);
}

GaussianScene GaussianSceneBuilder::build() {
  const std::uint64_t count = size();
  auto storage = std::make_shared<const std::vector<float>>(std::move(floats_));
  floats_.clear();
  const auto* records = reinterpret_cast<const std::byte*>(storage->data());
  return GaussianScene(storage, records, count, floats_per_gaussian_ * sizeof(float), canonical_layout(sh_degree_),
                       sh_degree_);
}

GaussianScene open_gaussian_ply(const std::filesystem::path& path) {
  const std::string where = path.string();
  const InputFile file(path, kCannotRead);
  std::string head(static_cast<std::size_t>(std::min<std::uint64_t>(file.size(), kMaxHeaderBytes)), '\0');
  file.read(0, head.data(), head.size());
  const Header header = HeaderParser(where, head).parse();

  std::uint64_t offset = header.size_bytes;
  const Element* vertex = nullptr;
  for (const Element& element : header.elements) {
    if (element.name == "vertex") {
      vertex = &element;
      break;
    }
    if (!element.list_property.empty()) {
      throw UserError(kCannotRead, where,
                      "element " + shortened(element.name) + " before element vertex has the list property `" +
                          shortened(element.list_property) + "`",
                      "write element vertex first");
    }
    offset = checked_end(where, element, offset, file.size());
  }
  if (vertex == nullptr) throw UserError(kCannotRead, where, "the header has no element vertex", kExportRemedy);
  if (!vertex->list_property.empty()) {
    throw UserError(kCannotRead, where,
                    "element vertex has the list property `" + shortened(vertex->list_property) + "`",
                    "a Gaussian has scalar properties only; remove the list");
  }

  const VertexProperties properties(where, *vertex);
  GaussianLayout layout;
  constexpr const char* kAxes[] = {"x", "y", "z"};
  for (std::size_t i = 0; i < 3; ++i) layout.position[i] = properties.offset_of_float(kAxes[i]);
  for (std::size_t i = 0; i < 3; ++i) layout.f_dc[i] = properties.offset_of_float("f_dc_" + std::to_string(i));
  layout.opacity = properties.offset_of_float("opacity");
  for (std::size_t i = 0; i < 3; ++i) layout.log_scale[i] = properties.offset_of_float("scale_" + std::to_string(i));
  for (std::size_t i = 0; i < 4; ++i) layout.rotation[i] = properties.offset_of_float("rot_" + std::to_string(i));

  const std::size_t rest = properties.rest_count();
  int sh_degree = -1;
  for (std::size_t degree = 0; degree < kShRestPerChannel.size(); ++degree) {
    if (rest == 3 * std::size_t{kShRestPerChannel[degree]}) sh_degree = static_cast<int>(degree);
  }
  if (sh_degree < 0) {
    throw UserError(kCannotRead, where, "element vertex has " + std::to_string(rest) + " properties f_rest_*",
                    "SH degrees 0 to 3 have 0, 9, 24 or 45 of them");
  }
  for (std::size_t i = 0; i < rest; ++i) layout.f_rest[i] = properties.offset_of_float("f_rest_" + std::to_string(i));

  const std::uint64_t end = checked_end(where, *vertex, offset, file.size());
  std::shared_ptr<const std::byte[]> records = read_records(file, where, offset, end - offset);
  file.check_unchanged();
  const std::byte* const first = records.get();
  return GaussianScene(std::move(records), first, vertex->count, static_cast<std::size_t>(vertex->stride_bytes), layout,
                       sh_degree);
}

void write_gaussian_ply(const std::filesystem::path& path, const GaussianScene& scene) {
  const std::size_t per_channel = kShRestPerChannel[static_cast<std::size_t>(scene.sh_degree())];
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(scene.size()) + "\n";
  const auto property = [&header](const std::string& name) { header += "property float " + name + "\n"; };
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) property(name);
  for (int i = 0; i < 3; ++i) property("f_dc_" + std::to_string(i));
  for (std::size_t i = 0; i < 3 * per_channel; ++i) property("f_rest_" + std::to_string(i));
  property("opacity");
  for (int i = 0; i < 3; ++i) property("scale_" + std::to_string(i));
  for (int i = 0; i < 4; ++i) property("rot_" + std::to_string(i));
  header += "end_header\n";

  AtomicFile file(path, "cannot write scene", path.string());
  file.write(header.data(), header.size());
  std::vector<float> record;
  for (std::uint64_t index = 0; index < scene.size(); ++index) {
    const GaussianRef gaussian = scene[index];
    record.clear();
    const auto append = [&record](const auto& values) { record.insert(record.end(), values.begin(), values.end()); };
    append(gaussian.position());
    append(std::array<float, 3>{0, 0, 0});
    append(gaussian.f_dc());
    for (std::uint32_t channel = 0; channel < 3; ++channel) {
      for (std::uint32_t c = 1; c <= per_channel; ++c) record.push_back(gaussian.f_rest(channel, c));
    }
    record.push_back(gaussian.opacity_logit());
    append(gaussian.log_scale());
    append(gaussian.rotation());
    file.write(record.data(), record.size() * sizeof(float));
  }
  file.commit();
}

}  // namespace vrpipe
