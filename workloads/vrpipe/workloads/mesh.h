#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/workloads/camera.h>

namespace vrpipe {

/// A triangle mesh in the world of the Gaussians. Front faces go counter-clockwise, as one sees them.
struct Mesh {
  /// Of each vertex; all three of one length.
  std::vector<std::array<float, 3>> positions;  ///< world units
  std::vector<std::array<float, 3>> normals;    ///< need not be of unit length
  std::vector<std::array<float, 3>> colours;  ///< RGB as the colour target holds it (sRGB-encoded, as splats are), >= 0
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of vertices

  bool empty() const { return triangles.empty(); }
};

/// Triangles that were left out, by reason. Such a triangle never reaches the pipeline.
struct RejectedTriangles {
  std::uint64_t not_finite = 0;          ///< a NaN or an infinity in a position, a normal or a colour
  std::uint64_t index_out_of_range = 0;  ///< a corner that names no vertex
  std::uint64_t degenerate = 0;          ///< corners on one line or in one point, or equal indices
  std::uint64_t lines_and_points = 0;    ///< of a file: primitives that are no triangles
  std::uint64_t total() const { return not_finite + index_out_of_range + degenerate + lines_and_points; }
};

/// Most vertices and most triangles of a mesh: 2 GB as a draw.
constexpr std::uint32_t kMaxMeshElements = std::uint32_t{1} << 24;

/// Whether a scene file holds a mesh, not Gaussians: .obj, .gltf and .glb do, and a .ply whose header has an element `face`
/// and no property `f_dc_0`.
/// @throws UserError when the header of a .ply cannot be read
bool is_mesh_file(const std::filesystem::path& path);

/// Reads a triangle mesh: .obj, .ply (binary or ASCII), .gltf or .glb (glTF 2.0).
/// Polygons are triangulated, the transforms of nodes are applied, coordinates are taken as they are: no axis is turned.
/// Missing normals are those of the triangles (flat, as glTF prescribes). Colours are those of the vertices; without them,
/// the diffuse colour of the material; without that, white. A glTF has linear colours, vertex times material, which are
/// encoded as sRGB; the others are taken as they are. Textures and transparency are left out.
/// Triangles that cannot be drawn are left out and counted in `rejected`, which is added to.
/// @throws UserError when the file cannot be read, is not such a mesh, has more than kMaxMeshElements vertices or triangles,
///         or nothing is left of it
Mesh read_mesh(const std::filesystem::path& path, RejectedTriangles& rejected);

/// Removes the triangles that cannot be drawn, and counts them in `rejected`, which is added to. Vertices stay.
/// @throws UserError for more than kMaxMeshElements vertices or triangles, or attributes that are not as many as the vertices
void reject_triangles(Mesh& mesh, RejectedTriangles& rejected);

/// What the vertex shader and the clipper make of a mesh: projects it with the camera of the Gaussians, clips it to the near
/// and the far plane and to the guard band of +-32768 pixels, in the mesh's order. Attributes of a vertex that clipping
/// makes are interpolated in clip space; it has the same bits in all triangles that share the edge. The winding stays; what
/// faces away and what misses the image stays, too. Computed in double, stored as float.
/// Triangles that reject_triangles() removes are left out and counted in `rejected`, which is added to.
/// @throws UserError as check_camera() and reject_triangles(), and for more than 2^31 triangles
Draw project_mesh(const Mesh& mesh, const Camera& camera, RejectedTriangles& rejected);

}  // namespace vrpipe
