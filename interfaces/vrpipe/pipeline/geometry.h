#pragma once

#include <array>
#include <cstdint>

#include <vrpipe/arithmetic/lanes.h>
#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

/// Vertices in fixed point, `subpixel_bits` fraction bits, within the guard band of +-32768 pixels (D3D11.3: 16.8).
struct SnappedTriangle {
  std::array<std::int32_t, 3> x, y;
};

constexpr double guard_band_pixels = 32768.0;

/// The snapped triangle of a primitive of a draw, as vertex shading and the viewport transform give it. A box that exceeds the
/// guard band is cut across its axes outside the viewport, so that no edge that can be seen turns.
/// Returns false when the splat is not finite.
bool snap_triangle(const RenderContext& context, DrawIndex draw, std::uint32_t splat, unsigned triangle,
                   SnappedTriangle& out);

/// The same for primitives in their order: both triangles of a splat are of one box, which is snapped once.
class TriangleSnapper {
 public:
  explicit TriangleSnapper(const RenderContext& context) : context_(context) {}
  bool snap(DrawIndex draw, std::uint32_t splat, unsigned triangle, SnappedTriangle& out);

 private:
  [[gnu::noinline]] void snap_box(const DrawCall& call, std::uint32_t splat);
  const RenderContext& context_;
  std::uint32_t splat_ = ~0U;  ///< of the box
  bool is_finite_ = false;
  LaneBits x_{}, y_{};  ///< its corners
};

/// Whether a draw's splats are a rectangle each: one primitive, which covers its bounds. Its snapped triangle has the corners
/// upper left, upper right and lower left.
inline bool draws_rectangles(const DrawCall& draw) {
  return draw.state.splat_extent == SplatExtent::fill_rectangle && draw.geometry->triangles.empty() &&
         !draw.geometry->is_mesh();
}

/// Twice the signed area, in squared sub-pixel steps; 0 is culled. Below 0 the vertices go counter-clockwise, as one sees them.
std::int64_t doubled_area(const SnappedTriangle& triangle);

/// Whether a triangle of a draw turns its back to the viewer (CullMode).
bool is_back_face(const Draw& draw, const SnappedTriangle& triangle);

/// Where a sample lies in a triangle: how much of each vertex it is. Exact but for one rounding each, as edge functions are;
/// at covered samples each is in [0, 1].
class BarycentricWeights {
 public:
  BarycentricWeights() = default;
  /// Of a triangle with an area.
  BarycentricWeights(const SnappedTriangle& triangle, unsigned subpixel_bits)
      : triangle_(triangle),
        subpixel_bits_(subpixel_bits),
        doubled_area_(static_cast<double>(doubled_area(triangle))) {}
  /// At the sample of a pixel.
  std::array<double, 3> at(std::int32_t x, std::int32_t y) const {
    const std::int64_t px = (2 * std::int64_t{x} + 1) << (subpixel_bits_ - 1);
    const std::int64_t py = (2 * std::int64_t{y} + 1) << (subpixel_bits_ - 1);
    std::array<double, 3> weights{};
    for (unsigned i = 0; i < 3; ++i) {
      const unsigned from = (i + 1) % 3;
      const unsigned to = (i + 2) % 3;
      const std::int64_t edge = (std::int64_t{triangle_.x[to]} - triangle_.x[from]) * (py - triangle_.y[from]) -
                                (std::int64_t{triangle_.y[to]} - triangle_.y[from]) * (px - triangle_.x[from]);
      weights[i] = static_cast<double>(edge) / doubled_area_;
    }
    return weights;
  }

 private:
  SnappedTriangle triangle_{};
  unsigned subpixel_bits_ = 1;
  double doubled_area_ = 1;
};

/// The pixels whose samples may be covered, clipped to the viewport; may be empty.
PixelRect covered_bounds(const SnappedTriangle& triangle, unsigned subpixel_bits, std::uint32_t width,
                         std::uint32_t height);

/// Whether all that is used of a splat is finite. Its positions alone would let a NaN colour or opacity through to the
/// colour target.
bool is_finite(const Splat& splat);
bool is_finite(const MeshTriangle& triangle);
/// Of a splat of a draw, or a triangle of its mesh.
bool is_finite(const DrawCall& draw, std::uint32_t splat);

/// Why primitive assembly passes a triangle on, or does not.
enum class Culling : std::uint8_t {
  none,        ///< it is passed on
  not_finite,  ///< a vertex is not finite, or cannot be cut to the guard band
  zero_area,   ///< after snapping
  facing,      ///< the draw culls what faces this way
  outside,     ///< it covers no sample of the viewport's pixels
};
/// `bounds` gets those of a triangle that is not culled.
Culling cull_triangle(const RenderContext& context, DrawIndex draw, std::uint32_t splat, unsigned triangle,
                      PixelRect& bounds);
Culling cull_triangle(const RenderContext& context, TriangleSnapper& snapper, DrawIndex draw, std::uint32_t splat,
                      unsigned triangle, PixelRect& bounds);

/// How many primitives a splat of a draw is.
inline unsigned primitives_per_splat(const DrawCall& draw) {
  const bool is_box = draw.geometry->triangles.empty() && !draw.geometry->is_mesh();
  return is_box && !draws_rectangles(draw) ? 2U : 1U;
}

}  // namespace vrpipe
