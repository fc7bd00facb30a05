#pragma once

#include <cstdint>

#include <vrpipe/pipeline/draw.h>

namespace vrpipe::testing {

/// What a draw has in common with those of trained scenes, or not. Sizes are those of splats' boxes.
struct DrawStatistics {
  std::uint64_t splats = 0;
  double opacity_low = 0, opacity_median = 0;           ///< of a tenth and of half of the splats no higher
  double side_median = 0;                               ///< of a square as large as the box, pixels
  double elongation_median = 0, elongation_99 = 0;      ///< longer over shorter axis
  double boxes_per_pixel = 0;                           ///< whole boxes, beyond the image as well
  double area_of_large = 0;                             ///< share of their area in those with a side over 32 pixels
  double fragments_per_pixel = 0, quads_per_pixel = 0;  ///< blended without early termination
  double termination_ratio = 0;       ///< fragments blended without over with early termination (strict)
  double quad_termination_ratio = 0;  ///< of quads
  double mixed_quads = 0;             ///< share of the image's quads that end with terminated and other pixels
  double terminated = 0, filled = 0;  ///< share of pixels that end terminated, and with an alpha over 0.9

  /// By how much early termination lowers the number of fragments in a quad that is blended, as a share.
  double fall_of_fragments_a_quad() const { return 1 - quad_termination_ratio / termination_ratio; }
};

/// Blends in float32, without tiles or bins; a splat is two triangles, whose quads are counted apart as a pipeline would.
/// @param threshold  accumulated alpha at which a pixel terminates
/// @throws std::invalid_argument when the draw has triangles, or no splats
DrawStatistics statistics_of(const Draw& draw, float threshold = 0.996f);

}  // namespace vrpipe::testing
