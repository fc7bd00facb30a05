#pragma once

#include <cstdint>
#include <vector>

#include "support/builders.h"

namespace vrpipe::testing {

// Default program: 4 instructions, 146 cycles for attributes, 20 instructions, 75 cycles; an instruction issues in 2.
constexpr Cycle issue_cycles = (4 + 20) * 2;
constexpr Cycle fragment_cycles = issue_cycles + 146 + 75;
constexpr Cycle merge_cycles = 13 * 2 + 30;

/// 64 splats, each over the whole image of 64x64 pixels.
class SmScene {
 protected:
  SmScene() : draw(draw_of(64, 64, std::vector<Splat>(64, flat_box(0, 0, 64, 64, 0.5F)))), context(context_of(draw)) {}

  /// Of a splat of its own; with pairs to merge, of two quads at each position.
  static Warp warp(std::uint32_t sequence, TileId tile = {0, 0}, std::uint8_t merge_pairs = 0) {
    Warp result;
    result.tile = tile;
    result.sequence = result.tile_sequence = sequence;
    result.merge_pairs = merge_pairs;
    for (unsigned i = 0; i < 8; ++i) {
      result.quads[result.count++] = {sequence % 64, static_cast<std::uint8_t>(merge_pairs != 0 ? i / 2 : i), all_lanes,
                                      0, 0};
    }
    return result;
  }

  Draw draw;
  RenderContext context;
};

}  // namespace vrpipe::testing
