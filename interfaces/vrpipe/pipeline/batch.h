#pragma once

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

}  // namespace vrpipe
