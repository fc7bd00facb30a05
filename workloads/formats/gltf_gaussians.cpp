// Gaussians in glTF 2.0, as .glb or .gltf: point primitives with the extension KHR_gaussian_splatting of Khronos.
// https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_gaussian_splatting
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <boost/archive/iterators/binary_from_base64.hpp>
#include <boost/archive/iterators/dataflow_exception.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <nlohmann/json.hpp>

#include <vrpipe/workloads/portable_math.h>

#include "formats/attribute_codes.h"
#include "formats/scene_format.h"
#include "formats/sog_scene.h"
#include "formats/turn.h"

namespace vrpipe {
namespace {

using Json = nlohmann::json;

constexpr char kExtension[] = "KHR_gaussian_splatting";
constexpr char kGltfRemedy[] = "export it again, as uncompressed KHR_gaussian_splatting or as .ply";
constexpr char kGlbMagic[] = "glTF";

bool mentions_gaussians(const FileBytes& bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), static_cast<std::size_t>(bytes.size()));
  return text.find(kExtension) != std::string_view::npos;
}

Match matches_gltf(const SceneFile& file) {
  if (file.bytes.begins_with(kGlbMagic)) return Match::by_content;
  return file.ends_with(".gltf") && mentions_gaussians(file.bytes) ? Match::by_content : Match::no;
}

/// A part of a file's bytes.
FileBytes part_of(const FileBytes& bytes, std::uint64_t offset, std::uint64_t size, const std::string& what) {
  const std::byte* const first = bytes.range(offset, size, what);
  return FileBytes(std::shared_ptr<const std::byte[]>(bytes.storage(), first), size, bytes.where());
}

/// The numbers of an accessor, all of which are there.
struct AccessorNumbers {
  FileBytes bytes;  ///< holds them
  const std::byte* first = nullptr;
  std::uint64_t count = 0, stride = 0;
  std::uint64_t type = 0;  ///< as glTF's componentType
  bool normalized = false;

  double at(std::uint64_t index, std::size_t component) const {
    const std::byte* const element = first + index * stride;
    const auto scaled = [&](auto value) {
      const double most = static_cast<double>(std::numeric_limits<decltype(value)>::max());
      return normalized ? std::max(static_cast<double>(value) / most, -1.0) : static_cast<double>(value);
    };
    switch (type) {
      case 5120: return scaled(load<std::int8_t>(element + component));
      case 5121: return scaled(load<std::uint8_t>(element + component));
      case 5122: return scaled(load<std::int16_t>(element + 2 * component));
      case 5123: return scaled(load<std::uint16_t>(element + 2 * component));
      default: return static_cast<double>(load<float>(element + 4 * component));
    }
  }
};

/// How a node places its Gaussians: x becomes scale turn x + offset.
struct Placement {
  bool is_none = true;
  glm::dmat3 matrix{1};
  Vec3 offset{};
  double log_scale = 0;
  glm::dquat rotation{1, 0, 0, 0};
  std::array<Vec3, 3> turn{};  ///< rows
};

/// A primitive of Gaussians in its place.
struct PlacedPrimitive {
  AccessorNumbers position, rotation, scale, opacity, f_dc;
  std::vector<AccessorNumbers> rest;
  int degree = 0;
  Placement placement;
};

class GltfGaussians {
 public:
  explicit GltfGaussians(const SceneFile& file) : file_(file) {
    if (file.bytes.begins_with(kGlbMagic)) {
      read_chunks();
    } else {
      document_ = parse_scene_json(file.bytes);
    }
    if (document_.contains("extensionsRequired")) {
      for (const Json& name : array(document_["extensionsRequired"], "extensionsRequired")) {
        if (name != kExtension && name != "KHR_mesh_quantization")
          fail("it requires the extension " + shortened(name), kGltfRemedy);
      }
    }
    read_scene();
    if (parts_.empty())
      fail(fmt::format("no primitive of its scene has {}", kExtension), "draw it with a scene, as a mesh");
  }

  GaussianFile read() {
    std::uint64_t count = 0;
    int degree = 0;
    for (const PlacedPrimitive& part : parts_) {
      count += part.position.count;
      degree = std::max(degree, part.degree);
    }
    check_count(count, bytes_read_, file_.bytes);
    const bool has_logarithms = any_scale_is_negative();
    if (has_logarithms) notes_.insert("its scales are logarithms, as drafts of KHR_gaussian_splatting had them");
    if (other_primitives_ > 0) {
      notes_.insert(fmt::format("{} primitive{} of it without Gaussians {} not drawn: give the file as --mesh as well",
                                other_primitives_, other_primitives_ == 1 ? "" : "s",
                                other_primitives_ == 1 ? "is" : "are"));
    }
    // What is far from the world's origin keeps its place.
    constexpr double kFar = 256;
    std::array<double, 3> origin{};
    for (std::size_t i = 0; i < 3; ++i) {
      const double offset = parts_.front().placement.offset[i];
      if (std::fabs(offset) >= kFar) origin[i] = std::floor(offset);
    }
    GaussianArray gaussians(count, degree, file_.bytes.where());
    std::uint64_t first = 0;
    for (const PlacedPrimitive& part : parts_) {
      const HarmonicsTurn harmonics(part.placement.turn);
      decode_into(gaussians, first, part.position.count, [&](std::uint64_t index, GaussianAttributes& gaussian) {
        decode(part, index, has_logarithms, gaussian);
        place(part, harmonics, index, origin, gaussian);
      });
      first += part.position.count;
    }
    GaussianFile result;
    result.gaussians = gaussians.build();
    result.gaussians.set_origin(origin);
    result.up = {0, 1, 0};
    result.notes.assign(notes_.begin(), notes_.end());
    return result;
  }

 private:
  [[noreturn]] void fail(const std::string& why, const std::string& remedy) const { file_.bytes.fail(why, remedy); }
  static std::string shortened(const Json& value) {
    constexpr std::size_t kLongest = 100;
    return value.is_string() ? value.get<std::string>().substr(0, kLongest) : std::string("that is no text");
  }
  const Json& array(const Json& value, const std::string& place) const {
    if (!value.is_array()) fail("`" + place + "` is not an array", kGltfRemedy);
    return value;
  }
  /// Element `index` of an array of objects of the document.
  const Json& element(const char* kind, std::uint64_t index, const std::string& place) const {
    const Json& all = array(json_member(document_, kind, file_.bytes), kind);
    if (index >= all.size() || !all[index].is_object())
      fail(fmt::format("{} names {}[{}], of {}", place, kind, index, all.size()), kGltfRemedy);
    return all[index];
  }
  std::uint64_t whole(const Json& object, const char* name, const std::string& place) const {
    return json_count(json_member(object, name, file_.bytes), place + "." + name, file_.bytes);
  }
  std::uint64_t whole_or(const Json& object, const char* name, std::uint64_t otherwise,
                         const std::string& place) const {
    return object.contains(name) ? whole(object, name, place) : otherwise;
  }

  void read_chunks() {
    constexpr std::uint64_t kHeader = 12, kChunkHeader = 8;
    constexpr std::uint32_t kJson = 0x4e4f534a, kBinary = 0x004e4942;
    const FileBytes& bytes = file_.bytes;
    const std::string what = "its header";
    if (bytes.number<std::uint32_t>(4, what) != 2) bytes.fail_at(4, "it is no .glb of version 2", kGltfRemedy);
    const std::uint64_t text_size = bytes.number<std::uint32_t>(kHeader, what);
    if (bytes.number<std::uint32_t>(kHeader + 4, what) != kJson)
      bytes.fail_at(kHeader + 4, "its first chunk is no JSON", kGltfRemedy);
    document_ = parse_scene_json(part_of(bytes, kHeader + kChunkHeader, text_size, "its JSON"));
    const std::uint64_t next = kHeader + kChunkHeader + (text_size + 3) / 4 * 4;
    if (next >= bytes.size()) return;
    const std::uint64_t size = bytes.number<std::uint32_t>(next, "its second chunk");
    if (bytes.number<std::uint32_t>(next + 4, "its second chunk") != kBinary) return;
    binary_ = part_of(bytes, next + kChunkHeader, size, "its binary chunk");
    bytes_read_ += size;
  }

  const FileBytes& buffer(std::uint64_t index, const std::string& place) {
    const auto known = buffers_.find(index);
    if (known != buffers_.end()) return known->second;
    const Json& buffer = element("buffers", index, place);
    FileBytes bytes;
    if (!buffer.contains("uri")) {
      if (index != 0 || !binary_) fail(fmt::format("buffers[{}] has no bytes", index), kGltfRemedy);
      bytes = *binary_;
    } else {
      const std::string uri = json_text(buffer["uri"], "uri", file_.bytes);
      bytes = uri.rfind("data:", 0) == 0 ? from_data_uri(uri) : file_.neighbour(without_escapes(uri));
      bytes_read_ += bytes.size();
    }
    return buffers_.emplace(index, std::move(bytes)).first->second;
  }

  static std::string without_escapes(const std::string& uri) {
    std::string name;
    for (std::size_t i = 0; i < uri.size(); ++i) {
      const std::string digits = uri[i] == '%' ? uri.substr(i + 1, 2) : "";
      const bool is_escape =
          digits.size() == 2 && digits.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
      name += is_escape ? static_cast<char>(std::stoi(digits, nullptr, 16)) : uri[i];
      if (is_escape) i += 2;
    }
    return name;
  }

  FileBytes from_data_uri(const std::string& uri) const {
    namespace iterators = boost::archive::iterators;
    using Decoded = iterators::transform_width<iterators::binary_from_base64<const char*>, 8, 6>;
    const std::string mark = ";base64,";
    const std::size_t at = uri.find(mark);
    if (at == std::string::npos) fail("a buffer's data URI is not in base64", kGltfRemedy);
    const std::size_t from = at + mark.size(), end = uri.find_last_not_of('=') + 1;
    const std::uint64_t size = end > from ? (end - from) * 6 / 8 : 0;
    const std::shared_ptr<std::byte[]> bytes = allocate_bytes(size, file_.bytes.where());
    try {
      Decoded next(uri.data() + from);
      std::generate_n(bytes.get(), size, [&next] { return static_cast<std::byte>(*next++); });
    } catch (const iterators::dataflow_exception&) {
      fail("a buffer's data URI is not in base64", kGltfRemedy);
    }
    return FileBytes(bytes, size, file_.bytes.where() + ", a buffer");
  }

  /// The accessor that `attributes` has as `name`, of `components` each.
  AccessorNumbers numbers(const Json& attributes, const std::string& name, std::uint64_t components,
                          const std::string& place) {
    const std::string of = place + "." + name;
    if (!attributes.contains(name)) fail(place + " has no `" + name + "`", kGltfRemedy);
    const Json& accessor = element("accessors", json_count(attributes[name], of, file_.bytes), of);
    const char* const shape = components == 1 ? "SCALAR" : components == 3 ? "VEC3" : "VEC4";
    if (!accessor.contains("type") || accessor["type"] != shape) fail(of + " is not of type " + shape, kGltfRemedy);
    if (accessor.contains("sparse") || !accessor.contains("bufferView"))
      fail(of + " has a sparse accessor, or one without data", kGltfRemedy);
    AccessorNumbers result;
    result.type = whole(accessor, "componentType", of);
    const bool is_known = (result.type >= 5120 && result.type <= 5123) || result.type == 5126;
    if (!is_known) fail(of + " is of neither bytes, shorts nor floats", kGltfRemedy);
    result.normalized = accessor.contains("normalized") && accessor["normalized"] == true;
    result.count = whole(accessor, "count", of);
    const Json& view = element("bufferViews", whole(accessor, "bufferView", of), of);
    const std::uint64_t size = components * (result.type == 5126 ? 4 : result.type >= 5122 ? 2 : 1);
    result.stride = whole_or(view, "byteStride", size, of);
    if (result.stride < size || result.stride > 252) fail(of + " has a byteStride that cannot be", kGltfRemedy);
    result.bytes = part_of(buffer(whole(view, "buffer", of), of), whole_or(view, "byteOffset", 0, of),
                           whole(view, "byteLength", of), of);
    const std::uint64_t offset = whole_or(accessor, "byteOffset", 0, of);
    if (result.count > 0) {
      result.bytes.records(offset, result.count - 1, result.stride, of);
      result.bytes.range(offset + (result.count - 1) * result.stride, size, of);
    }
    result.first = result.bytes.data() + offset;
    return result;
  }

  std::vector<double> doubles(const Json& node, const char* name, std::size_t length, const std::string& place) const {
    std::vector<double> values;
    for (const Json& value : array(node[name], place + "." + name)) {
      if (!value.is_number() || !std::isfinite(value.get<double>())) break;
      values.push_back(value.get<double>());
    }
    if (values.size() != length || node[name].size() != length)
      fail(fmt::format("{}.{} is not {} numbers", place, name, length), kGltfRemedy);
    return values;
  }

  glm::dmat4 matrix_of(const Json& node, const std::string& place) const {
    glm::dmat4 matrix(1);
    if (node.contains("matrix")) {
      const std::vector<double> values = doubles(node, "matrix", 16, place);
      for (std::size_t i = 0; i < 16; ++i) matrix[i / 4][i % 4] = values[i];
      return matrix;
    }
    if (node.contains("rotation")) {
      const std::vector<double> xyzw = doubles(node, "rotation", 4, place);
      const glm::dquat rotation(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
      if (!(glm::dot(rotation, rotation) > 0)) fail(place + ".rotation is zero", kGltfRemedy);
      matrix = glm::dmat4(glm::mat3_cast(glm::normalize(rotation)));
    }
    if (node.contains("scale")) {
      const std::vector<double> scale = doubles(node, "scale", 3, place);
      for (std::size_t i = 0; i < 3; ++i) matrix[i] *= scale[i];
    }
    if (node.contains("translation")) {
      const std::vector<double> to = doubles(node, "translation", 3, place);
      matrix[3] = {to[0], to[1], to[2], 1};
    }
    return matrix;
  }

  /// @throws UserError where axes are stretched one by one, so that a Gaussian's axes would not stay at right angles
  Placement placement_of(const glm::dmat4& matrix, const std::string& place) const {
    Placement placement;
    placement.matrix = glm::dmat3(matrix);
    placement.offset = Vec3(matrix[3]);
    placement.is_none = matrix == glm::dmat4(1);
    const double scale = glm::length(placement.matrix[0]);
    const glm::dmat3 turn = scale > 0 ? placement.matrix / scale : glm::dmat3(0);
    const glm::dmat3 product = glm::transpose(turn) * turn;
    for (std::size_t i = 0; i < 3; ++i) {
      placement.turn[i] = {turn[0][i], turn[1][i], turn[2][i]};
      for (std::size_t j = 0; j < 3; ++j) {
        if (!(std::fabs(product[i][j] - (i == j ? 1.0 : 0.0)) < 1e-4))
          fail(place + " and its parents scale its axes differently",
               "apply the scale to the Gaussians before exporting");
      }
    }
    placement.log_scale = portable_log(scale);
    // A Gaussian is its own mirror image through its centre.
    placement.rotation = glm::quat_cast(glm::determinant(turn) < 0 ? -turn : turn);
    return placement;
  }

  void read_scene() {
    const std::uint64_t scene = whole_or(document_, "scene", 0, "the document");
    const Json& roots = element("scenes", scene, "`scene`");
    struct Open {
      std::uint64_t node;
      glm::dmat4 parent;
    };
    std::vector<Open> open;
    std::set<std::uint64_t> seen;
    const auto add = [&](const Json& from, const char* name, const std::string& place, const glm::dmat4& parent) {
      if (!from.contains(name)) return;
      const Json& list = array(from[name], place + "." + name);
      for (auto child = list.rbegin(); child != list.rend(); ++child) {
        const std::uint64_t node = json_count(*child, place + "." + name, file_.bytes);
        if (!seen.insert(node).second) fail(fmt::format("nodes[{}] is there twice", node), kGltfRemedy);
        open.push_back({node, parent});
      }
    };
    add(roots, "nodes", "its scene", glm::dmat4(1));
    while (!open.empty()) {
      const Open next = open.back();
      open.pop_back();
      const std::string place = fmt::format("nodes[{}]", next.node);
      const Json& node = element("nodes", next.node, "a node");
      const glm::dmat4 matrix = next.parent * matrix_of(node, place);
      if (node.contains("mesh")) read_mesh(whole(node, "mesh", place), matrix, place);
      add(node, "children", place, matrix);
    }
  }

  void read_mesh(std::uint64_t index, const glm::dmat4& matrix, const std::string& node) {
    const Json& primitives =
        array(json_member(element("meshes", index, node), "primitives", file_.bytes), "primitives");
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      const std::string place = fmt::format("meshes[{}].primitives[{}]", index, i);
      const Json& primitive = primitives[i];
      if (!primitive.is_object()) fail(place + " is not an object", kGltfRemedy);
      const auto extensions = primitive.find("extensions");
      if (extensions == primitive.end() || !extensions->is_object() || !extensions->contains(kExtension)) {
        ++other_primitives_;
        continue;
      }
      check_properties((*extensions)[kExtension], place);
      if (whole_or(primitive, "mode", 4, place) != 0) fail(place + " has Gaussians and is not of points", kGltfRemedy);
      const Json& attributes = json_member(primitive, "attributes", file_.bytes);
      if (!attributes.is_object()) fail(place + ".attributes is not an object", kGltfRemedy);
      parts_.push_back(part(attributes, place + ".attributes"));
      parts_.back().placement = placement_of(matrix, node);
      check_count(parts_.back().position.count, bytes_read_, file_.bytes);
    }
  }

  /// What the extension says of how they are to be drawn.
  void check_properties(const Json& extension, const std::string& place) {
    if (!extension.is_object()) fail(place + "." + kExtension + " is not an object", kGltfRemedy);
    if (extension.contains("extensions") && !extension["extensions"].empty()) {
      const Json& more = extension["extensions"];
      const std::string name = more.is_object() ? more.begin().key().substr(0, 100) : std::string("that has no name");
      fail(place + " needs the extension " + name + ", which is not read", kGltfRemedy);
    }
    const auto is = [&](const char* name, std::initializer_list<const char*> known) {
      if (!extension.contains(name)) return true;
      return std::any_of(known.begin(), known.end(), [&](const char* each) { return extension[name] == each; });
    };
    if (!is("kernel", {"ellipse"})) fail(place + " has the kernel " + shortened(extension["kernel"]), kGltfRemedy);
    if (!is("projection", {"perspective"}))
      fail(place + " has the projection " + shortened(extension["projection"]), kGltfRemedy);
    if (!is("colorSpace", {"srgb_rec709_display", "BT.709"}))
      notes_.insert("its colours are of the space " + shortened(extension["colorSpace"]) + ", and drawn as if of sRGB");
    if (is("sortingMethod", {"cameraDistance"})) {
      notes_.insert("it is meant to be sorted by distance from the camera, and is by depth, as INRIA does");
    } else if (!is("sortingMethod", {"zDepth"})) {
      notes_.insert("it is meant to be sorted by " + shortened(extension["sortingMethod"]) +
                    ", and is by depth, as INRIA does");
    }
  }

  PlacedPrimitive part(const Json& attributes, const std::string& place) {
    const std::string prefix = std::string(kExtension) + ":";
    PlacedPrimitive part;
    part.position = numbers(attributes, "POSITION", 3, place);
    part.rotation = numbers(attributes, prefix + "ROTATION", 4, place);
    part.scale = numbers(attributes, prefix + "SCALE", 3, place);
    part.opacity = numbers(attributes, prefix + "OPACITY", 1, place);
    part.f_dc = numbers(attributes, prefix + "SH_DEGREE_0_COEF_0", 3, place);
    for (int degree = 1; degree <= 3; ++degree) {
      const auto name = [&](int n) { return fmt::format("{}SH_DEGREE_{}_COEF_{}", prefix, degree, n); };
      if (!attributes.contains(name(0))) break;
      for (int n = 0; n <= 2 * degree; ++n) part.rest.push_back(numbers(attributes, name(n), 3, place));
      part.degree = degree;
    }
    std::vector<const AccessorNumbers*> all = {&part.rotation, &part.scale, &part.opacity, &part.f_dc};
    for (const AccessorNumbers& each : part.rest) all.push_back(&each);
    for (const AccessorNumbers* each : all) {
      if (each->count != part.position.count) {
        fail(fmt::format("an attribute of {} has {} elements, and its POSITION {}", place, each->count,
                         part.position.count),
             kGltfRemedy);
      }
    }
    return part;
  }

  /// A scale is not; its logarithm may be.
  bool any_scale_is_negative() const {
    for (const PlacedPrimitive& part : parts_) {
      for (std::uint64_t i = 0; i < part.scale.count; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (part.scale.at(i, axis) < 0) return true;
        }
      }
    }
    return false;
  }

  static void decode(const PlacedPrimitive& part, std::uint64_t index, bool has_logarithms,
                     GaussianAttributes& gaussian) {
    for (std::size_t i = 0; i < 3; ++i) {
      gaussian.position[i] = static_cast<float>(part.position.at(index, i));
      const double scale = part.scale.at(index, i);
      gaussian.log_scale[i] = has_logarithms ? static_cast<float>(scale) : log_scale_of(scale);
      gaussian.rotation[1 + i] = static_cast<float>(part.rotation.at(index, i));
      gaussian.f_dc[i] = static_cast<float>(part.f_dc.at(index, i));
      for (std::size_t c = 0; c < part.rest.size(); ++c)
        gaussian.f_rest[i][c] = static_cast<float>(part.rest[c].at(index, i));
    }
    gaussian.rotation[0] = static_cast<float>(part.rotation.at(index, 3));
    gaussian.opacity_logit = logit_of_opacity(part.opacity.at(index, 0));
  }

  static void place(const PlacedPrimitive& part, const HarmonicsTurn& harmonics, std::uint64_t index,
                    const std::array<double, 3>& origin, GaussianAttributes& gaussian) {
    const Placement& placement = part.placement;
    if (placement.is_none) return;
    const Vec3 here{part.position.at(index, 0), part.position.at(index, 1), part.position.at(index, 2)};
    const Vec3 there = placement.matrix * here + (placement.offset - Vec3{origin[0], origin[1], origin[2]});
    const auto& q = gaussian.rotation;
    const glm::dquat rotation = placement.rotation * glm::dquat(q[0], q[1], q[2], q[3]);
    gaussian.rotation = {static_cast<float>(rotation.w), static_cast<float>(rotation.x), static_cast<float>(rotation.y),
                         static_cast<float>(rotation.z)};
    for (std::size_t i = 0; i < 3; ++i) {
      gaussian.position[i] = static_cast<float>(there[i]);
      gaussian.log_scale[i] = static_cast<float>(static_cast<double>(gaussian.log_scale[i]) + placement.log_scale);
      harmonics.apply(gaussian.f_rest[i], part.degree);
    }
  }

  const SceneFile& file_;
  Json document_;
  std::optional<FileBytes> binary_;  ///< of a .glb
  std::map<std::uint64_t, FileBytes> buffers_;
  std::uint64_t bytes_read_ = 0;
  std::vector<PlacedPrimitive> parts_;
  std::size_t other_primitives_ = 0;
  std::set<std::string> notes_;
};

GaussianFile read_gltf(const SceneFile& file) { return GltfGaussians(file).read(); }

const SceneFormatRegistrar gltf_registrar(
    {"glTF KHR_gaussian_splatting",
     "FILE.glb or FILE.gltf",
     "point primitives of glTF 2.0 with Gaussians, SH degree 0 to 3, uncompressed",
     {},
     matches_gltf,
     read_gltf});

}  // namespace
}  // namespace vrpipe
