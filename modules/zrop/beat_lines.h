#pragma once

#include <array>
#include <cstdint>

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
        places_(sectors_of_quads(cache.organization, DepthStencilSurface::bytes_per_quad(surface.format()))) {}

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
  /// Of an update.
  Needed::Line find(const TerminationSignal& signal) const {
    const auto [line, sectors] = places_[signal.position];
    return {surface_.address(signal.tile, 0) + std::uint64_t{line} * line_bytes_, sectors};
  }

 private:
  const DepthStencilSurface& surface_;
  const std::uint32_t line_bytes_;
  const std::array<QuadSectors, positions_per_tile> places_;
};

}  // namespace vrpipe
