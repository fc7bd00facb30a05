#pragma once

#include <array>
#include <cstdint>

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

/// Twice the signed area, in squared sub-pixel steps; 0 is culled.
std::int64_t doubled_area(const SnappedTriangle& triangle);

/// The pixels whose samples may be covered, clipped to the viewport; may be empty.
PixelRect covered_bounds(const SnappedTriangle& triangle, unsigned subpixel_bits, std::uint32_t width,
                         std::uint32_t height);

/// Whether all that is used of a splat is finite. Its positions alone would let a NaN colour or opacity through to the
/// colour target.
bool is_finite(const Splat& splat);

/// Why primitive assembly passes a triangle on, or does not.
enum class Culling : std::uint8_t {
  none,        ///< it is passed on
  not_finite,  ///< a vertex is not finite, or cannot be cut to the guard band
  zero_area,   ///< after snapping
  outside,     ///< it covers no sample of the viewport's pixels
};
/// `bounds` gets those of a triangle that is not culled.
Culling cull_triangle(const RenderContext& context, DrawIndex draw, std::uint32_t splat, unsigned triangle,
                      PixelRect& bounds);

/// How many triangles a splat of this geometry is.
inline unsigned triangles_per_splat(const Draw& draw) { return draw.triangles.empty() ? 2U : 1U; }

}  // namespace vrpipe
