#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// What tests take by the places that they touch: so much for each half, 4x8 pixels, of an 8x8 block in which a primitive
/// has quads, and at least so much for the block (measured on a GH100 graphics GPC: 1 and 1.4 cycles); and once so much for
/// the primitive (2.7: rectangles of 2x2 take 4.17 cycles, of 16x16 10.67, and one over many tiles 8.05 a tile).
class BlockPrice {
 public:
  /// In thousandths of a cycle; all 0: there is no such price.
  /// @param primitives  of the frame, in whose order they are numbered (primitive_order)
  BlockPrice(std::uint32_t half, std::uint32_t block, std::uint32_t of_primitive = 0, std::uint64_t primitives = 0)
      : half_(half),
        block_(std::max(half, block)),
        of_primitive_(of_primitive),
        seen_(of_primitive > 0 ? static_cast<std::size_t>(primitives) : 0) {}
  bool is_on() const { return block_ > 0 || of_primitive_ > 0; }
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
      const unsigned column = quad.position % quads_per_tile_row;
      const unsigned block = quad.position / (4 * quads_per_tile_row) * 2 + column / 4;
      const unsigned half = 1U << (column / 2 % 2);
      const std::uint32_t primitive = primitive_order(quad);
      if (primitive != last.primitive || block != last.block || tile != last.tile) {
        last = {tile, primitive, block, half};
        price += block_;
        if (of_primitive_ > 0 && !seen_[primitive]) {
          seen_[primitive] = true;
          price += of_primitive_;
        }
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
  std::uint32_t of_primitive_;
  std::vector<bool> seen_;  ///< primitives
  Place last_;
};

}  // namespace vrpipe
