#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace vrpipe {

/// One projected Gaussian, in screen space, as the vertex shader receives it; also the record of a `.spl` file.
/// Pixel (x, y) has its sample at (x + 0.5, y + 0.5); y points down.
struct Splat {
  float cx, cy;            ///< centre, pixels
  float ax, ay;            ///< first axis times half extent, pixels
  float bx, by;            ///< second axis (perpendicular) times half extent, pixels
  float r;                 ///< half extent along either axis, in sigmas: sqrt(2 ln(255 opacity))
  float depth;             ///< window depth of its centre, 0 (near) to 1; 0 in a `.spl` file, which has none
  float red, green, blue;  ///< colour, not premultiplied, >= 0
  float opacity;           ///< in (0, 1]
};
static_assert(sizeof(Splat) == 48, "a Splat is the 12 float32 of a .spl record");

/// A triangle with explicit screen positions in pixels; for microbenchmarks and meshes.
struct ScreenTriangle {
  std::array<float, 3> x, y;
};

/// A vertex of a mesh as its vertex shader writes it, after the division by w and the viewport transform.
struct MeshVertex {
  float x, y;              ///< window position, pixels
  float depth;             ///< window depth, 0 (near plane) to 1 (far plane)
  float inverse_w;         ///< 1 / w, above 0: attributes are interpolated perspective-correct
  float red, green, blue;  ///< colour, >= 0
  float nx, ny, nz;        ///< normal in world space; need not be of unit length
};

/// A triangle of a mesh, clipped to the near and the far plane and to the guard band.
struct MeshTriangle {
  std::array<MeshVertex, 3> vertices;
};
static_assert(sizeof(MeshTriangle) == 120, "vertex fetch reads three vertices of 10 float32");

/// What a draw call renders, in its order: splats, front to back, or the triangles of a mesh.
/// Without `triangles`, each splat is drawn as the two triangles of its oriented box. With them, triangle i is
/// drawn in place of the box of splat i (sizes equal), and the splat gives its colour and opacity.
/// A mesh has neither splats nor `triangles`. Where others speak of the splats of a draw, its triangles are meant as well.
struct Draw {
  std::uint32_t width = 0;   ///< pixels, 1 to 16384
  std::uint32_t height = 0;  ///< pixels, 1 to 16384
  std::vector<Splat> splats;
  std::vector<ScreenTriangle> triangles;
  std::vector<MeshTriangle> mesh;

  bool is_mesh() const { return !mesh.empty(); }
  std::size_t size() const { return is_mesh() ? mesh.size() : splats.size(); }  ///< splats, or triangles of a mesh
};

/// What vertex fetch reads for one of them.
inline std::uint64_t vertex_bytes_of_each(const Draw& draw) {
  return draw.is_mesh() ? sizeof(MeshTriangle) : sizeof(Splat);
}
inline std::uint64_t vertex_bytes(const Draw& draw) { return draw.size() * vertex_bytes_of_each(draw); }

/// Gaussians that preprocessing dropped, by reason. A dropped Gaussian never reaches the pipeline.
struct RejectedGaussians {
  std::uint64_t not_finite = 0;       ///< a value that preprocess() cannot use; see there
  std::uint64_t zero_quaternion = 0;  ///< all zero: no orientation
  std::uint64_t total() const { return not_finite + zero_quaternion; }
};

/// Where a draw came from, for the report.
struct SceneSummary {
  std::string name;
  std::uint64_t gaussians_total = 0;
  std::uint64_t gaussians_visible = 0;      ///< in the draw
  std::uint64_t gaussians_compensated = 0;  ///< of the total, whose opacity is that of a splat without dilation
  RejectedGaussians rejected;
  std::uint64_t triangles = 0;           ///< of meshes, in the draws of each, clipped
  std::uint64_t triangles_rejected = 0;  ///< that cannot be drawn
  std::vector<std::string> notes;        ///< what of its files is not used, or was assumed; a sentence each
};

}  // namespace vrpipe
