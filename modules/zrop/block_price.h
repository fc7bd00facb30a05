#pragma once

#include <algorithm>
#include <cstdint>

#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// Of a position in a screen tile, from 0: the half, 4x8 pixels, of an 8x8 block in which it lies. Two are a block.
constexpr unsigned half_of_block(unsigned position) {
  return position / (4 * quads_per_tile_row) * 4 + position % quads_per_tile_row / 2;
}

/// What tests take by the places that they touch: so much for each half, 4x8 pixels, of an 8x8 block in which a primitive
/// has quads, and at least so much for the block (measured on a GH100 graphics GPC: 1 and 1.5 cycles).
class BlockPrice {
 public:
  /// In thousandths of a cycle; all 0: there is no such price.
  BlockPrice(std::uint32_t half, std::uint32_t block) : half_(half), block_(std::max(half, block)) {}
  bool is_on() const { return block_ > 0; }
  /// The most that so many quads take.
  std::uint64_t most_of(unsigned quads) const { return std::uint64_t{quads} * block_; }
  /// Where a primitive's quads were.
  struct Place {
    TileId tile;
    std::uint32_t primitive = ~0U;
    unsigned block = ~0U;
    unsigned halves = 0;  ///< of it, a bit each
  };
  /// Of quads in the order of their tests, in thousandths of a cycle: what they add to those before.
  std::uint64_t of(TileId tile, const Quad* quads, unsigned count) { return of(tile, quads, count, last_); }
  /// The same, where the last place is not that of the quads before.
  std::uint64_t of(TileId tile, const Quad* quads, unsigned count, Place& last) {
    std::uint64_t price = 0;
    for (unsigned i = 0; i < count; ++i) {
      const Quad& quad = quads[i];
      const unsigned block = half_of_block(quad.position) / 2;
      const unsigned half = 1U << half_of_block(quad.position) % 2;
      const std::uint32_t primitive = primitive_order(quad);
      if (primitive != last.primitive || block != last.block || tile != last.tile) {
        last = {tile, primitive, block, half};
        price += block_;
      } else if ((last.halves & half) == 0) {
        last.halves |= half;
        price += 2 * half_ > block_ ? 2 * half_ - block_ : 0;
      }
    }
    return price;
  }

 private:
  std::uint32_t half_;
  std::uint32_t block_;
  Place last_;
};

}  // namespace vrpipe
