#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <vrpipe/workloads/mesh.h>

struct aiScene;

namespace vrpipe {

/// What a file's colours mean.
enum class ColourRule {
  as_they_are,        ///< vertex colours, or else those of the material
  white_material,     ///< vertex colours, or else white: the materials were not found
  linear_and_product  ///< glTF: vertex times material, linear
};

/// Counts and removes the faces whose indices or positions cannot be used, which triangulation must not meet, and what is no
/// face but a line or a point.
/// @throws UserError for a polygon of more than 1024 corners
void remove_bad_faces(aiScene& scene, const std::string& where, RejectedTriangles& rejected);

/// Triangles of a glTF whose indices lie, which assimp has left out: those that a mesh of this number, its name, should have
/// and has not.
/// @pre nothing was removed yet
std::uint64_t triangles_left_out(const aiScene& scene, const std::vector<std::uint64_t>& triangles);

/// The triangles of all nodes of an imported scene, in the world.
/// @pre remove_bad_faces, then triangulation
/// @throws UserError for more than kMaxMeshElements vertices or triangles
Mesh mesh_of_scene(const aiScene& scene, ColourRule rule, const std::string& where);

}  // namespace vrpipe
