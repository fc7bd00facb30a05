#pragma once

#include <vrpipe/workloads/mesh.h>

#include "surfaces.h"

namespace vrpipe {

/// Makes the meshes of built-in scenes, in the world of ScenePainter: y UP, turned down on output. Colours are not lit.
class MeshPainter {
 public:
  /// A surface as a grid of columns x rows cells, whose front is where its normals point to.
  void surface(const Surface& surface, const Paint& paint, int columns, int rows);
  /// The six faces of an axis-aligned box, in cells of about `cell` along each side.
  void box(const Vec3& centre, const Vec3& half, const Paint& paint, double cell);
  /// Frustum with both lids.
  void cylinder(const Vec3& base, const Vec3& top, double base_radius, double top_radius, const Paint& paint,
                int sectors, int rings);

  Mesh take() { return std::move(mesh_); }

 private:
  Mesh mesh_;
};

}  // namespace vrpipe
