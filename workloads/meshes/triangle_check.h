#pragma once

#include <array>
#include <cstdint>

#include <vrpipe/workloads/mesh.h>

namespace vrpipe {

/// @throws UserError, see reject_triangles()
void check_mesh(const Mesh& mesh);

/// Whether a triangle can be drawn; counts it in `rejected` if it cannot.
/// @pre check_mesh
bool can_be_drawn(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle, RejectedTriangles& rejected);

}  // namespace vrpipe
