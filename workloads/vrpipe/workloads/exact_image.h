#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/draw.h>

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

}  // namespace vrpipe
