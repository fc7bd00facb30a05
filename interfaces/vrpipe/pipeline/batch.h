#pragma once

#include <algorithm>
#include <cstdint>

#include <vrpipe/pipeline/payload.h>

/// What moves in one piece at `lt` where `cycle` moves what fits into a cycle: a flushed bin from TC to QRU
/// (instead of QuadBeat), a shaded warp from PROP to CROP (ShadedWarpItem instead of ColorBeat). Other links carry the
/// same items at every fidelity with time.

namespace vrpipe {

struct BinStorage;

/// A flushed bin, or a mark.
struct BinItem {
  BinStorage* storage = nullptr;  ///< its first `quads` quads; the test takes the dead ones out
  TileId tile;
  std::uint32_t quads = 0;
  std::uint32_t beats = 1;  ///< of quads, as it moves at cycle
  Mark mark = Mark::none;
  bool last_part = true;  ///< closes the bin; what runs ahead of time has a bin in parts
};

/// Quads of the beats in which bins move at cycle, all but the last: as many as any is known to have had so far.
class BeatWidth {
 public:
  /// Of a bin of so many quads and beats.
  unsigned of(std::uint32_t quads, std::uint32_t beats) {
    beats = std::max(beats, 1U);
    return most_ = std::min(std::max(most_, (quads + beats - 1) / beats), QuadBeat::capacity);
  }

 private:
  unsigned most_ = 1;
};

}  // namespace vrpipe
