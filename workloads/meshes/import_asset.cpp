#include "import_asset.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <assimp/material.h>
#include <assimp/mesh.h>
#include <assimp/scene.h>
#include <glm/geometric.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/portable_math.h>

#include "asset_files.h"

namespace vrpipe {
namespace {

/// Cutting ears takes a time of the square of this or more.
constexpr unsigned kMaxFaceCorners = 1024;

Vec3 to_double(const aiVector3D& v) { return {v.x, v.y, v.z}; }
std::array<float, 3> to_floats(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

bool is_finite(const aiVector3D& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// An affine map in double.
struct Transform {
  std::array<Vec3, 3> columns{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Vec3 offset{0, 0, 0};

  static Transform of(const aiMatrix4x4& m) {
    return {{{{m.a1, m.b1, m.c1}, {m.a2, m.b2, m.c2}, {m.a3, m.b3, m.c3}}}, {m.a4, m.b4, m.c4}};
  }
  Vec3 direction(const Vec3& v) const { return columns[0] * v.x + columns[1] * v.y + columns[2] * v.z; }
  Vec3 point(const Vec3& p) const { return direction(p) + offset; }
  Transform operator*(const Transform& inner) const {
    return {{direction(inner.columns[0]), direction(inner.columns[1]), direction(inner.columns[2])},
            point(inner.offset)};
  }
  double determinant() const { return glm::dot(columns[0], glm::cross(columns[1], columns[2])); }
  /// Normals stay at right angles to their surface, outside of it also in a mirror: the transposed inverse times |det|.
  Vec3 normal(const Vec3& n) const {
    const Vec3 turned = glm::cross(columns[1], columns[2]) * n.x + glm::cross(columns[2], columns[0]) * n.y +
                        glm::cross(columns[0], columns[1]) * n.z;
    return determinant() < 0 ? -turned : turned;
  }
};

/// sRGB's transfer function (IEC 61966-2-1), continued beyond 1.
double encode_srgb(double linear) {
  if (!(linear > 0.0031308)) return 12.92 * linear;
  return 1.055 * portable_exp(portable_log(linear) / 2.4) - 0.055;
}

Vec3 material_colour(const aiScene& scene, const aiMesh& mesh, ColourRule rule) {
  const Vec3 white = {1, 1, 1};
  if (rule == ColourRule::white_material || mesh.mMaterialIndex >= scene.mNumMaterials) return white;
  const aiMaterial& material = *scene.mMaterials[mesh.mMaterialIndex];
  // Assimp's own, of which a file that names no material gets one: a grey.
  aiString name;
  if (rule == ColourRule::as_they_are && material.Get(AI_MATKEY_NAME, name) == AI_SUCCESS &&
      name == aiString(AI_DEFAULT_MATERIAL_NAME)) {
    return white;
  }
  aiColor4D colour;
  const bool found = rule == ColourRule::linear_and_product
                         ? material.Get(AI_MATKEY_BASE_COLOR, colour) == AI_SUCCESS
                         : material.Get(AI_MATKEY_COLOR_DIFFUSE, colour) == AI_SUCCESS;
  return found ? Vec3{colour.r, colour.g, colour.b} : white;
}

/// Appends the meshes of nodes.
class Collector {
 public:
  Collector(const aiScene& scene, ColourRule rule, const std::string& where)
      : scene_(scene), rule_(rule), where_(where) {}

  void add(const aiMesh& mesh, const Transform& transform) {
    check_room(mesh);
    const Vec3 material = material_colour(scene_, mesh, rule_);
    const bool mirrored = transform.determinant() < 0;
    const auto first = static_cast<std::uint32_t>(result_.positions.size());
    const auto add_vertex = [&](unsigned v) {
      result_.positions.push_back(to_floats(transform.point(to_double(mesh.mVertices[v]))));
      result_.colours.push_back(colour(mesh, v, material));
    };
    // With normals, triangles share vertices as they do in the file.
    if (mesh.HasNormals()) {
      for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
        add_vertex(v);
        result_.normals.push_back(to_floats(transform.normal(to_double(mesh.mNormals[v]))));
      }
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;
      std::array<std::uint32_t, 3> corners = {face.mIndices[0], face.mIndices[1], face.mIndices[2]};
      if (mirrored) std::swap(corners[1], corners[2]);
      if (mesh.HasNormals()) {
        result_.triangles.push_back({first + corners[0], first + corners[1], first + corners[2]});
        continue;
      }
      const auto at = static_cast<std::uint32_t>(result_.positions.size());
      for (const std::uint32_t corner : corners) add_vertex(corner);
      result_.normals.insert(result_.normals.end(), 3, flat_normal(at));
      result_.triangles.push_back({at, at + 1, at + 2});
    }
  }

  Mesh take() { return std::move(result_); }

 private:
  void check_room(const aiMesh& mesh) const {
    const std::uint64_t triangles = result_.triangles.size() + std::uint64_t{mesh.mNumFaces};
    const std::uint64_t added =
        mesh.HasNormals() ? std::uint64_t{mesh.mNumVertices} : 3 * std::uint64_t{mesh.mNumFaces};
    const std::uint64_t vertices = result_.positions.size() + added;
    if (std::max(triangles, vertices) <= kMaxMeshElements) return;
    throw UserError(kCannotReadMesh, where_,
                    "it has more than " + std::to_string(kMaxMeshElements) +
                        " triangles or vertices, three for each triangle without normals",
                    "use a simpler mesh");
  }

  std::array<float, 3> colour(const aiMesh& mesh, unsigned vertex, const Vec3& material) const {
    Vec3 colour = material;
    if (mesh.HasVertexColors(0)) {
      const aiColor4D& c = mesh.mColors[0][vertex];
      colour = {c.r, c.g, c.b};
      if (rule_ == ColourRule::linear_and_product) colour *= material;
    }
    std::array<float, 3> stored{};
    for (std::size_t i = 0; i < 3; ++i) {
      const double value = rule_ == ColourRule::linear_and_product ? encode_srgb(colour[i]) : colour[i];
      stored[i] = static_cast<float>(value < 0 ? 0.0 : value);
    }
    return stored;
  }

  std::array<float, 3> flat_normal(std::uint32_t first) const {
    const auto corner = [&](std::uint32_t i) {
      const auto& p = result_.positions[first + i];
      return Vec3{p[0], p[1], p[2]};
    };
    const Vec3 normal = glm::cross(corner(1) - corner(0), corner(2) - corner(0));
    const double length = glm::length(normal);
    return length > 0 && std::isfinite(length) ? to_floats(normal / length) : std::array<float, 3>{};
  }

  const aiScene& scene_;
  ColourRule rule_;
  const std::string& where_;
  Mesh result_;
};

}  // namespace

void remove_bad_faces(aiScene& scene, const std::string& where, RejectedTriangles& rejected) {
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    aiMesh& mesh = *scene.mMeshes[m];
    const auto is_bad = [&](const aiFace& face) {
      if (face.mNumIndices > kMaxFaceCorners) {
        throw UserError(kCannotReadMesh, where, "a face has " + std::to_string(face.mNumIndices) + " corners",
                        "triangulate faces of more than " + std::to_string(kMaxFaceCorners));
      }
      if (face.mNumIndices < 3) {
        ++rejected.lines_and_points;
        return true;
      }
      const unsigned *const begin = face.mIndices, *const end = begin + face.mNumIndices;
      if (std::any_of(begin, end, [&](unsigned v) { return v >= mesh.mNumVertices; })) {
        rejected.index_out_of_range += face.mNumIndices - 2;
        return true;
      }
      if (!std::all_of(begin, end, [&](unsigned v) { return is_finite(mesh.mVertices[v]); })) {
        rejected.not_finite += face.mNumIndices - 2;
        return true;
      }
      return false;
    };
    // Faces own their indices: swapped, not copied. The kinds that are left must be right: assimp asserts them.
    unsigned kept = 0;
    mesh.mPrimitiveTypes = 0;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (is_bad(mesh.mFaces[f])) continue;
      mesh.mPrimitiveTypes |= mesh.mFaces[f].mNumIndices == 3 ? aiPrimitiveType_TRIANGLE : aiPrimitiveType_POLYGON;
      std::swap(mesh.mFaces[kept].mNumIndices, mesh.mFaces[f].mNumIndices);
      std::swap(mesh.mFaces[kept++].mIndices, mesh.mFaces[f].mIndices);
    }
    mesh.mNumFaces = kept;
  }
}

std::uint64_t triangles_left_out(const aiScene& scene, const std::vector<std::uint64_t>& triangles) {
  std::vector<std::uint64_t> there(triangles.size());
  std::vector<bool> used(triangles.size());
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    // NUMBER, or NUMBER-PRIMITIVE.
    std::size_t number = triangles.size();
    const char* const end = mesh.mName.data + mesh.mName.length;
    if (std::from_chars(mesh.mName.data, end, number).ec != std::errc{} || number >= triangles.size()) continue;
    used[number] = true;
    there[number] += static_cast<std::uint64_t>(
        std::count_if(mesh.mFaces, mesh.mFaces + mesh.mNumFaces, [](const aiFace& f) { return f.mNumIndices == 3; }));
  }
  std::uint64_t missing = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (used[i] && there[i] < triangles[i]) missing += triangles[i] - there[i];
  }
  return missing;
}

Mesh mesh_of_scene(const aiScene& scene, ColourRule rule, const std::string& where) {
  Collector collector(scene, rule, where);
  std::vector<std::pair<const aiNode*, Transform>> open;
  if (scene.mRootNode != nullptr) open.emplace_back(scene.mRootNode, Transform{});
  while (!open.empty()) {
    const auto [node, above] = open.back();
    open.pop_back();
    const Transform here = above * Transform::of(node->mTransformation);
    for (unsigned i = 0; i < node->mNumMeshes; ++i) {
      if (node->mMeshes[i] < scene.mNumMeshes) collector.add(*scene.mMeshes[node->mMeshes[i]], here);
    }
    // Backwards, so that the first child comes first.
    for (unsigned i = node->mNumChildren; i-- > 0;) open.emplace_back(node->mChildren[i], here);
  }
  return collector.take();
}

}  // namespace vrpipe
