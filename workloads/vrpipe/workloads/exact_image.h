#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <vrpipe/arithmetic/running_bound.h>
#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/draw_state.h>

namespace vrpipe {

/// An image in double precision: premultiplied red, green, blue and alpha, no background; row by row from the top.
struct ExactImage {
  std::uint32_t width = 0, height = 0;  ///< pixels
  std::vector<std::array<double, 4>> rgba;

  const std::array<double, 4>& at(std::uint32_t x, std::uint32_t y) const {
    return rgba[static_cast<std::size_t>(y) * width + x];
  }
};

/// What a draw shows when nothing is rounded or left out: the reference that errors are measured against.
/// Every sample takes the splats in draw order, front to back, as the method prescribes: alpha = min(0.99, opacity
/// exp(-d^2/2)), d the distance in sigmas, where the sample lies in the splat's oriented box, borders included;
/// alpha below 1/255 is pruned. No tiles, no quads, no fixed point, no termination; the exponential and all sums are
/// in double. The same bits for any number of threads.
/// @param threads  0: one per hardware thread
/// @throws std::invalid_argument when the draw has triangles or is a mesh
ExactImage render_exactly(const Draw& draw, unsigned threads = 0);

/// How a pipeline draws, as far as its precision goes.
struct DrawnPrecision {
  ColorFormat format = ColorFormat::rgba16f;
  DevicePrecision device;
  bool merges = false;
  double pruning_threshold = 1.0 / 255.0;
  std::optional<double> termination_threshold;  ///< none: no pixel terminates
  /// Along either axis: samples farther out may be left out.
  double sigmas_covered = std::numeric_limits<double>::infinity();
};

/// What render_exactly() gives, and how far a pipeline's image may be from it.
struct BoundedImage {
  ExactImage exact;
  std::vector<std::uint32_t> fragments;         ///< of each pixel, with alpha from 1/255 on
  std::vector<std::vector<PixelBound>> bounds;  ///< of each precision asked for, of each pixel
};

/// A pipeline that draws the same splats, covers the same samples (boxes padded, F5) and evaluates alpha from half axes in single
/// precision is within these bounds: of the shader's alpha, of fragments that it may prune or not, or leave out far from the centre, of blending (F4), and of what is behind
/// a pixel that may have terminated. docs/numerics.md has the proof. Colours are clamped where the format clamps.
/// @throws std::invalid_argument as render_exactly()
BoundedImage render_with_bounds(const Draw& draw, const std::vector<DrawnPrecision>& precisions, unsigned threads = 0);

}  // namespace vrpipe
