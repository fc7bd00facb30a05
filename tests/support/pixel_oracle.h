#pragma once

#include <array>
#include <vector>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe::testing {

/// A fragment as the shader gives it: premultiplied colour, and alpha.
struct OracleFragment {
  std::array<float, 3> color;
  float alpha;
};

/// What all fragments of a pixel come to in double, and how far a blender may be off.
struct OraclePixel {
  std::array<double, 4> rgba{};
  std::array<double, 3> color_bound{};  ///< grows with every fragment, so it holds for every prefix too
  double alpha_bound = 0;               ///< the largest over all prefixes
  std::uint32_t fragments = 0;
};

/// Every sample's fragments in draw order, from the vpo, raster and sm behaviours alone: no bins, no merging, no
/// termination, no blending.
std::vector<std::vector<OracleFragment>> fragments_of(const RenderContext& context);

/// Blends them in double. The bound is the running one for a blender with single-precision arithmetic and one rounding
/// to the format of `state` after a fragment or after a merged pair.
OraclePixel blend_exactly(const std::vector<OracleFragment>& fragments, const RenderContext& context);

/// Every pixel of a frame as order alone makes it, of a target that does not round: bit for bit what CROP stores if
/// nothing is merged. Of stencils it knows those of a frame in passes (draw_in_passes).
std::vector<std::array<float, 4>> pixels_in_order(const Frame& frame, bool terminates);

/// The largest colour, not premultiplied, of a draw.
float largest_color(const Draw& draw);

}  // namespace vrpipe::testing
