// Gaussians in glTF 2.0, as .glb or .gltf: point primitives with the extension KHR_gaussian_splatting of Khronos.
// https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_gaussian_splatting
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <nlohmann/json.hpp>

#include <vrpipe/workloads/portable_math.h>

#include "formats/attribute_codes.h"
#include "formats/gltf_data.h"
#include "formats/scene_format.h"
#include "formats/sog_scene.h"
#include "formats/turn.h"
#include "glb.h"

namespace vrpipe {
namespace {

using Json = nlohmann::json;

Match matches_gltf(const SceneFile& file) {
  const FileBytes& bytes = file.bytes;
  if (is_glb(bytes)) return Match::by_content;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), static_cast<std::size_t>(bytes.size()));
  return file.ends_with(".gltf") && mentions_gaussians(text) ? Match::by_content : Match::no;
}

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
  explicit GltfGaussians(const SceneFile& file) : file_(file), data_(file) {
    const Json& document = data_.document();
    if (document.contains("extensionsRequired")) {
      for (const Json& name : data_.array(document["extensionsRequired"], "extensionsRequired")) {
        if (name != kGltfGaussians && name != "KHR_mesh_quantization")
          data_.fail("it requires the extension " + shortened(name));
      }
    }
    read_scene();
    if (primitives_.empty())
      data_.fail(fmt::format("no primitive of its scene has {}", kGltfGaussians), "draw it with a scene, as a mesh");
  }

  GaussianFile read() {
    std::uint64_t count = 0;
    int degree = 0;
    for (const PlacedPrimitive& part : primitives_) {
      count += part.position.count;
      degree = std::max(degree, part.degree);
    }
    check_count(count, data_.bytes_read(), file_.bytes);
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
      const double offset = primitives_.front().placement.offset[i];
      if (std::fabs(offset) >= kFar) origin[i] = std::floor(offset);
    }
    GaussianArray gaussians(count, degree, file_.bytes.where());
    std::uint64_t first = 0;
    for (const PlacedPrimitive& part : primitives_) {
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
  static std::string shortened(const Json& value) {
    constexpr std::size_t kLongest = 100;
    return value.is_string() ? value.get<std::string>().substr(0, kLongest) : std::string("that is no text");
  }

  glm::dmat4 matrix_of(const Json& node, const std::string& place) const {
    glm::dmat4 matrix(1);
    if (node.contains("matrix")) {
      const std::vector<double> values = data_.doubles(node, "matrix", 16, place);
      for (std::size_t i = 0; i < 16; ++i) matrix[i / 4][i % 4] = values[i];
      return matrix;
    }
    if (node.contains("rotation")) {
      const std::vector<double> xyzw = data_.doubles(node, "rotation", 4, place);
      const glm::dquat rotation(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
      if (!(glm::dot(rotation, rotation) > 0)) data_.fail(place + ".rotation is zero");
      matrix = glm::dmat4(glm::mat3_cast(glm::normalize(rotation)));
    }
    if (node.contains("scale")) {
      const std::vector<double> scale = data_.doubles(node, "scale", 3, place);
      for (std::size_t i = 0; i < 3; ++i) matrix[i] *= scale[i];
    }
    if (node.contains("translation")) {
      const std::vector<double> to = data_.doubles(node, "translation", 3, place);
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
          data_.fail(place + " and its parents scale its axes differently",
                     "apply the scale to the Gaussians before exporting");
      }
    }
    placement.log_scale = portable_log(scale);
    // A Gaussian is its own mirror image through its centre.
    placement.rotation = glm::quat_cast(glm::determinant(turn) < 0 ? -turn : turn);
    return placement;
  }

  void read_scene() {
    const std::uint64_t scene = data_.whole_or(data_.document(), "scene", 0, "the document");
    const Json& roots = data_.element("scenes", scene, "`scene`");
    struct Open {
      std::uint64_t node;
      glm::dmat4 parent;
    };
    std::vector<Open> open;
    std::set<std::uint64_t> seen;
    const auto add = [&](const Json& from, const char* name, const std::string& place, const glm::dmat4& parent) {
      if (!from.contains(name)) return;
      const Json& list = data_.array(from[name], place + "." + name);
      for (auto child = list.rbegin(); child != list.rend(); ++child) {
        const std::uint64_t node = json_count(*child, place + "." + name, file_.bytes);
        if (!seen.insert(node).second) data_.fail(fmt::format("nodes[{}] is there twice", node));
        open.push_back({node, parent});
      }
    };
    add(roots, "nodes", "its scene", glm::dmat4(1));
    while (!open.empty()) {
      const Open next = open.back();
      open.pop_back();
      const std::string place = fmt::format("nodes[{}]", next.node);
      const Json& node = data_.element("nodes", next.node, "a node");
      const glm::dmat4 matrix = next.parent * matrix_of(node, place);
      if (node.contains("mesh")) read_mesh(data_.whole(node, "mesh", place), matrix, place);
      add(node, "children", place, matrix);
    }
  }

  void read_mesh(std::uint64_t index, const glm::dmat4& matrix, const std::string& node) {
    const Json& primitives =
        data_.array(json_member(data_.element("meshes", index, node), "primitives", file_.bytes), "primitives");
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      const std::string place = fmt::format("meshes[{}].primitives[{}]", index, i);
      const Json& primitive = primitives[i];
      if (!primitive.is_object()) data_.fail(place + " is not an object");
      const auto extensions = primitive.find("extensions");
      if (extensions == primitive.end() || !extensions->is_object() || !extensions->contains(kGltfGaussians)) {
        ++other_primitives_;
        continue;
      }
      check_properties((*extensions)[kGltfGaussians], place);
      if (data_.whole_or(primitive, "mode", 4, place) != 0) data_.fail(place + " has Gaussians and is not of points");
      const Json& attributes = json_member(primitive, "attributes", file_.bytes);
      if (!attributes.is_object()) data_.fail(place + ".attributes is not an object");
      primitives_.push_back(part(attributes, place + ".attributes"));
      primitives_.back().placement = placement_of(matrix, node);
      check_count(primitives_.back().position.count, data_.bytes_read(), file_.bytes);
    }
  }

  /// What the extension says of how they are to be drawn.
  void check_properties(const Json& extension, const std::string& place) {
    if (!extension.is_object()) data_.fail(place + "." + kGltfGaussians + " is not an object");
    if (extension.contains("extensions") && !extension["extensions"].empty()) {
      const Json& more = extension["extensions"];
      const std::string name = more.is_object() ? more.begin().key().substr(0, 100) : std::string("that has no name");
      data_.fail(place + " needs the extension " + name + ", which is not read");
    }
    const auto is = [&](const char* name, std::initializer_list<const char*> known) {
      if (!extension.contains(name)) return true;
      return std::any_of(known.begin(), known.end(), [&](const char* each) { return extension[name] == each; });
    };
    if (!is("kernel", {"ellipse"})) data_.fail(place + " has the kernel " + shortened(extension["kernel"]));
    if (!is("projection", {"perspective"}))
      data_.fail(place + " has the projection " + shortened(extension["projection"]));
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
    const std::string prefix = std::string(kGltfGaussians) + ":";
    PlacedPrimitive part;
    part.position = data_.numbers(attributes, "POSITION", 3, place);
    part.rotation = data_.numbers(attributes, prefix + "ROTATION", 4, place);
    part.scale = data_.numbers(attributes, prefix + "SCALE", 3, place);
    part.opacity = data_.numbers(attributes, prefix + "OPACITY", 1, place);
    part.f_dc = data_.numbers(attributes, prefix + "SH_DEGREE_0_COEF_0", 3, place);
    for (int degree = 1; degree <= 3; ++degree) {
      const auto name = [&](int n) { return fmt::format("{}SH_DEGREE_{}_COEF_{}", prefix, degree, n); };
      if (!attributes.contains(name(0))) break;
      for (int n = 0; n <= 2 * degree; ++n) part.rest.push_back(data_.numbers(attributes, name(n), 3, place));
      part.degree = degree;
    }
    std::vector<const AccessorNumbers*> all = {&part.rotation, &part.scale, &part.opacity, &part.f_dc};
    for (const AccessorNumbers& each : part.rest) all.push_back(&each);
    for (const AccessorNumbers* each : all) {
      if (each->count != part.position.count) {
        data_.fail(fmt::format("an attribute of {} has {} elements, and its POSITION {}", place, each->count,
                               part.position.count),
                   kGltfRemedy);
      }
    }
    return part;
  }

  /// A scale is not; its logarithm may be.
  bool any_scale_is_negative() const {
    for (const PlacedPrimitive& part : primitives_) {
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
  GltfData data_;
  std::vector<PlacedPrimitive> primitives_;
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
