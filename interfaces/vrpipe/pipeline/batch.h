#pragma once

#include <cstdint>

#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/units.h>

/// What moves in one piece at `lt` and `at` where `cycle` moves what fits into a cycle: a flushed bin from TC to QRU
/// (instead of QuadBeat), a shaded warp from PROP to CROP (ShadedWarpItem instead of ColorBeat). Other links carry the
/// same items at every fidelity with time.

namespace vrpipe {

/// Where TC keeps the quads of a flushed bin until QRU has formed its warps.
struct BinStorage {
  TcBehaviour::Flush flush;
  bool in_use = false;
};

/// A flushed bin, or a mark.
struct BinItem {
  BinStorage* storage = nullptr;  ///< its first `quads` quads; the test takes the dead ones out
  TileId tile;
  std::uint32_t quads = 0;
  Mark mark = Mark::none;
  bool last_part = true;  ///< closes the bin; what runs ahead of time has a bin in parts
};

/// Quads of a warp that are looked up before the first of them is blended. Where places in CROP's queue, lines of the
/// cache or miss registers are few, one that is taken a few cycles longer than it need be tells; then quads go one by one,
/// as they do where a line could go for another one of the same warp.
inline unsigned quads_looked_up_at_once(const CropBehaviour::TimingParameters& crop) {
  constexpr std::uint32_t enough = 16 * quads_per_warp;
  const bool roomy =
      crop.cache_bytes / crop.line_bytes >= enough && crop.input_quads >= 3 * enough && crop.mshrs >= enough;
  const bool keeps_a_warp = crop.replacement == Replacement::lru && (crop.ways == 0 || crop.ways >= quads_per_warp);
  return roomy && keeps_a_warp ? quads_per_warp : 1;
}

}  // namespace vrpipe
