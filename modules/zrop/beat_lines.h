#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "block_price.h"
#include "z_cache.h"

#include <vrpipe/memory/sectors.h>
#include <vrpipe/pipeline/quad_sectors.h>
#include <vrpipe/pipeline/slots/zrop.h>

namespace vrpipe {

/// What of the z-cache quads need.
class BeatLines {
 public:
  /// The surface outlives it.
  BeatLines(const ZCache& cache, const DepthStencilSurface& surface)
      : surface_(surface),
        line_bytes_(cache.organization.line_bytes),
        bytes_per_tile_(positions_per_tile * DepthStencilSurface::bytes_per_quad(surface.format())),
        places_(sectors_of_quads(cache.organization, DepthStencilSurface::bytes_per_quad(surface.format()))) {
    halves_of_line_.resize(bytes_per_tile_ / line_bytes_);
    for (unsigned position = 0; position < positions_per_tile; ++position) {
      halves_of_line_[places_[position].line][half_of_block(position)] |= places_[position].sectors;
    }
    // Those that a line has come first.
    for (Halves& halves : halves_of_line_) std::fill(std::remove(halves.begin(), halves.end(), 0U), halves.end(), 0U);
    const Halves& first = halves_of_line_.front();
    const auto halves = static_cast<unsigned>(std::find(first.begin(), first.end(), 0U) - first.begin());
    half_of_a_line_ = std::max(halves / 2, 2U);
  }

  /// Lines, in the order in which they are needed first.
  struct Needed {
    struct Line {
      std::uint64_t address = 0;
      std::uint32_t sectors = 0;  ///< a bit each
    };
    unsigned count = 0;
    std::array<Line, QuadBeat::capacity> lines;
  };
  /// Of at most QuadBeat::capacity quads of a screen tile.
  void find(TileId tile, const Quad* quads, unsigned count, Needed& out) const {
    const std::uint64_t base = surface_.address(tile, 0);
    std::array<std::uint8_t, positions_per_tile> place{};  // from 1, by line of the tile; 0 for none
    out.count = 0;
    for (unsigned i = 0; i < count; ++i) {
      const auto [line, sectors] = places_[quads[i].position];
      if (place[line] == 0) {
        out.lines[out.count] = {base + std::uint64_t{line} * line_bytes_, 0};
        place[line] = static_cast<std::uint8_t>(++out.count);
      }
      out.lines[place[line] - 1U].sectors |= sectors;
    }
  }
  /// Of some quads of a beat, a bit each.
  void find(const QuadBeat& beat, std::uint32_t quads, Needed& out) const {
    std::array<Quad, QuadBeat::capacity> some;
    unsigned count = 0;
    for (; quads != 0; quads &= quads - 1) some[count++] = beat.quads[static_cast<unsigned>(__builtin_ctz(quads))];
    find(beat.tile, some.data(), count, out);
  }
  /// The halves, 4x8 pixels, of 8x8 blocks that a line has, a bit each: those with some of its sectors.
  std::uint32_t halves_with(std::uint64_t address, std::uint32_t sectors) const {
    std::uint32_t halves = 0, bit = 1;
    for (const std::uint32_t half : halves_of(address)) {
      halves |= (half & sectors) != 0 ? bit : 0U;
      bit <<= 1U;
    }
    return halves;
  }
  /// Of these so many are half a line, at least a block.
  unsigned half_of_a_line() const { return half_of_a_line_; }
  /// All sectors of such halves.
  std::uint32_t sectors_of(std::uint64_t address, std::uint32_t halves) const {
    std::uint32_t sectors = 0;
    for (; halves != 0; halves &= halves - 1)
      sectors |= halves_of(address)[static_cast<unsigned>(__builtin_ctz(halves))];
    return sectors;
  }
  /// Flits that reading sectors of a line takes of which others are held: one for each half of a block of which none is (measured
  /// on a GH100 graphics GPC).
  unsigned flits_of(std::uint64_t address, std::uint32_t read, std::uint32_t held) const {
    return static_cast<unsigned>(__builtin_popcount(halves_with(address, read) & ~halves_with(address, held)));
  }
  /// Where a screen tile begins.
  std::uint64_t tile(TileId tile) const { return surface_.address(tile, 0); }
  /// The number of a line of the surface, of so many.
  std::size_t index(std::uint64_t address) const {
    return static_cast<std::size_t>((address - surface_.address(std::size_t{0})) / line_bytes_);
  }
  std::size_t lines() const { return static_cast<std::size_t>(surface_.size_bytes() / line_bytes_) + 1; }
  /// Of an update.
  Needed::Line find(const TerminationSignal& signal) const {
    const auto [line, sectors] = places_[signal.position];
    return {surface_.address(signal.tile, 0) + std::uint64_t{line} * line_bytes_, sectors};
  }

 private:
  /// Sectors of a line that are of each half, 4x8 pixels, of an 8x8 block.
  using Halves = std::array<std::uint32_t, 8>;
  const Halves& halves_of(std::uint64_t address) const {
    return halves_of_line_[index(address) % halves_of_line_.size()];
  }

  const DepthStencilSurface& surface_;
  const std::uint32_t line_bytes_;
  const std::uint32_t bytes_per_tile_;
  const std::array<QuadSectors, positions_per_tile> places_;
  std::vector<Halves> halves_of_line_;  ///< of a tile
  unsigned half_of_a_line_ = 0;
};

}  // namespace vrpipe
