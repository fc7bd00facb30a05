#pragma once

#include <cstdint>

#include <vrpipe/blend.h>
#include <vrpipe/draw.h>

namespace vrpipe {

/// See the contract: `paper`, an update of the termination bit carries its time; `strict`, order alone decides.
enum class Termination : std::uint8_t { paper, strict };

/// The exponential of the fragment shader.
enum class Exponential : std::uint8_t { exact, ex2, fp16, table256, table16 };

/// What is rasterised for a splat: the oriented box where alpha falls to 1/255, the axis-aligned box of that ellipse, or
/// the oriented box at three sigmas.
enum class SplatExtent : std::uint8_t { oriented_box, axis_aligned_box, three_sigma };

/// The state of one draw call, the same for all units: what an application sets through the graphics API, and the
/// precision of the fixed-function hardware.
struct RenderState {
  const Draw* draw = nullptr;
  ColorFormat format = ColorFormat::rgba16f;
  BlendRounding blend_rounding = BlendRounding::rne;
  Termination termination = Termination::paper;
  bool early_termination = false;           ///< HET on: ZROP tests, CROP signals
  float termination_threshold = 0.996F;     ///< alpha, compared in single precision (paper 3.2)
  bool termination_inclusive = true;        ///< >= (paper, alg. 1) rather than > (paper 5.2)
  float pruning_threshold = 1.0F / 255.0F;  ///< fragments with alpha below are excluded from blending
  Exponential exponential = Exponential::ex2;
  SplatExtent splat_extent = SplatExtent::oriented_box;
  unsigned subpixel_bits = 8;  ///< of vertex coordinates (D3D11.3: 8)
  /// Half axes grow by this many sub-pixel steps, so that snapping loses no fragment at the pruning threshold.
  float obb_padding = 0.75F;
  unsigned gpcs = 1;  ///< of the platform
  unsigned gpc = 0;   ///< that this unit belongs to; it owns the screen tiles with owner_of(tile, gpcs) == gpc
};

}  // namespace vrpipe
