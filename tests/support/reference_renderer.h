#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <vrpipe/arithmetic/running_bound.h>
#include <vrpipe/pipeline/draw.h>

namespace vrpipe::testing {

struct ReferenceOptions {
  /// A pixel takes no more fragments once its accumulated alpha is >= this; unset: it takes all.
  std::optional<double> termination_threshold;
  /// Also compute, per pixel, how far a blender that rounds to the nearest of this format after every fragment may be off.
  std::optional<ColorFormat> bound_format;
  /// Enlarges the oriented box by this many pixels on every side (coverage only).
  double box_padding = 0;
};

struct ReferenceImage {
  std::uint32_t width = 0, height = 0;
  std::vector<std::array<double, 4>> rgba;  ///< row-major, premultiplied, no background
  std::vector<PixelBound> bound;            ///< per pixel; empty unless asked for
  std::uint64_t fragments_covered = 0;      ///< samples inside oriented boxes, of pixels not yet terminated
  std::uint64_t fragments_blended = 0;      ///< of these, alpha >= 1/255
  std::uint64_t fragments_near_prune_edge =
      0;  ///< alpha within a relative 1e-5 of 1/255: rounding may decide otherwise
  std::vector<std::uint32_t> near_edge_per_pixel;  ///< the same, per pixel

  const std::array<double, 4>& at(std::uint32_t x, std::uint32_t y) const {
    return rgba[static_cast<std::size_t>(y) * width + x];
  }
};

/// Renders a draw without tiles, bins, quads or fixed point: splats in order; a pixel belongs to a splat when its
/// sample lies in the splat's oriented box (borders included); alpha = min(0.99, opacity exp(-d^2/2)) with d the
/// distance in sigmas, pruned below 1/255; blended front to back, premultiplied. All in double.
/// @throws std::invalid_argument when the draw has triangles
ReferenceImage render_reference(const Draw& draw, const ReferenceOptions& options = {});

}  // namespace vrpipe::testing
