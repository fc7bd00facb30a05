#pragma once

#include <cstdint>

#include <vrpipe/arithmetic/blend.h>
#include <vrpipe/arithmetic/exp2.h>

namespace vrpipe {

/// What is rasterised for a splat: the oriented box where alpha falls to 1/255, the axis-aligned box of that ellipse, or
/// the oriented box at three sigmas.
enum class SplatExtent : std::uint8_t { oriented_box, axis_aligned_box, three_sigma };

/// What an application sets for a draw through the graphics API, its shaders included.
struct DrawState {
  bool early_termination = false;           ///< HET on: ZROP tests, CROP signals
  float termination_threshold = 0.996F;     ///< alpha, compared in single precision (paper 3.2)
  bool termination_inclusive = true;        ///< >= (paper, alg. 1) rather than > (paper 5.2)
  float pruning_threshold = 1.0F / 255.0F;  ///< fragments with alpha below are excluded from blending
  SplatExtent splat_extent = SplatExtent::oriented_box;
  /// Half axes grow by this many sub-pixel steps, so that snapping loses no fragment at the pruning threshold.
  float obb_padding = 0.75F;
};
bool operator==(const DrawState& a, const DrawState& b);
inline bool operator!=(const DrawState& a, const DrawState& b) { return !(a == b); }

/// How exactly the hardware computes; no application sets it.
struct DevicePrecision {
  BlendRounding blend_rounding = BlendRounding::rne;
  Exponential exponential = Exponential::ex2;
  unsigned subpixel_bits = 8;  ///< of vertex coordinates (D3D11.3: 8)
};

}  // namespace vrpipe
