#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace vrpipe {

/// One projected Gaussian, in screen space, as the vertex shader receives it; also the record of a `.spl` file.
/// Pixel (x, y) has its sample at (x + 0.5, y + 0.5); y points down.
struct Splat {
  float cx, cy;  ///< centre, pixels
  float ax, ay;  ///< first axis times half extent, pixels
  float bx, by;  ///< second axis (perpendicular) times half extent, pixels
  float r;       ///< half extent along either axis, in sigmas: sqrt(2 ln(255 opacity))
  float reserved;
  float red, green, blue;  ///< colour, not premultiplied, >= 0
  float opacity;           ///< in (0, 1]
};
static_assert(sizeof(Splat) == 48, "a Splat is the 12 float32 of a .spl record");

/// A triangle with explicit screen positions in pixels; for microbenchmarks and meshes.
struct ScreenTriangle {
  std::array<float, 3> x, y;
};

/// Everything that one draw call renders, sorted front to back.
/// Without `triangles`, each splat is drawn as the two triangles of its oriented box. With them, triangle i is
/// drawn in place of the box of splat i (sizes equal), and the splat gives its colour and opacity.
struct Draw {
  std::uint32_t width = 0;   ///< pixels, 1 to 16384
  std::uint32_t height = 0;  ///< pixels, 1 to 16384
  std::vector<Splat> splats;
  std::vector<ScreenTriangle> triangles;
};

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
  std::uint64_t gaussians_visible = 0;  ///< in the draw
  RejectedGaussians rejected;
};

}  // namespace vrpipe
