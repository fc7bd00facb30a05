#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include <vrpipe/component/parameter.h>
#include <vrpipe/kernel/rate.h>
#include <vrpipe/memory/sectors.h>
#include <vrpipe/model/occupancy.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/crop.h>

namespace vrpipe {

/// Of blending in the shader.
struct InShaderParameters : ParameterSet {
  enum Lock : unsigned { ordered, none };
  Choice lock{*this,
              "lock",
              {"ordered", "none"},
              ordered,
              "the pixel-shader interlock of GPUs, ordered, as its image is that of a colour ROP",
              "fragments of a pixel blend one after the other, in draw order; without, loads and stores of several "
              "race, and updates are lost"};
  Real tile_lock_cycles{*this,
                        "tile_lock_cycles",
                        17.4,
                        0,
                        10000,
                        "cycles",
                        "measured on a GH100 graphics GPC, of 4 SMs: splats of one size",
                        "of taking the lock for a coverage tile: warps of a screen tile of which none has a pixel of "
                        "another"};
  Real warp_lock_cycles{*this,
                        "warp_lock_cycles",
                        13.7,
                        0,
                        10000,
                        "cycles",
                        "measured on a GH100 graphics GPC, of 4 SMs: splats of one size",
                        "beside that, of each of its warps; what is locked goes in draw order"};
  Integer hand_over_cycles{
      *this,
      "hand_over_cycles",
      1300,
      0,
      1000000,
      "cycles",
      "measured on a GH100 graphics GPC: a stack of 4x4 pixels takes 2166 cycles a layer, less load "
      "and store",
      "from the last store of a warp until one that waits for a pixel of it loads"};
  Real lock_clock_mhz{
      *this,
      "lock_clock_mhz",
      0,
      0,
      100000,
      "MHz",
      "not known: the GH100 was measured at 1980 MHz alone",
      "of the clock that the three above are cycles of, if they are as long at every other; 0: they are "
      "cycles of any"};
  Integer blend_cycles{*this,
                       "blend_cycles",
                       100,
                       0,
                       10000,
                       "cycles",
                       "Accel-Sim, SM87_ORIN: 4 cycles an instruction; 25 that depend on each other",
                       "from the loaded colour until it is stored: unpack, blend, pack"};
  Integer warps{*this,
                "warps",
                256,
                1,
                65536,
                "warps",
                "GH100: 64 warps for each of 4 SMs",
                "that blend or wait for the lock at a time"};
  Integer memory_bytes_per_cycle{*this,
                                 "memory_bytes_per_cycle",
                                 256,
                                 32,
                                 1024,
                                 "bytes",
                                 "assumed: a warp's 32 pixels of RGBA16F, from 4 SMs of 64 bytes each",
                                 "of colour that SMs load from L2, and that they store to it"};
};

/// Kinds of work where the shader blends.
struct InShaderWork {
  /// Quads, and thousandths of a cycle of the lock.
  enum : unsigned { blend = CropWork::blend, lock, kinds };
};

/// What blending in the shader takes, stated here alone: the unit of `cycle` asks for it when its turn comes, that of `lt`
/// when a warp arrives, `bound` for a sum.
///
/// Measured on a GH100 graphics GPC: draws with a lock take so much for each coverage tile and so much for each warp, as
/// from one place that hands locks out in turn; beside that a pixel goes from one warp to the next after its store and a
/// hand-over. Unordered locks take as long as ordered ones.
class InShaderTime {
 public:
  InShaderTime(const InShaderParameters& parameters, std::uint64_t clock_ps);

  const bool locks;
  const std::uint32_t warps;             ///< at a time
  const std::uint32_t blend_cycles;      ///< from load to store
  const std::uint32_t hand_over_cycles;  ///< from store to the next load of a pixel
  const std::uint32_t memory_bytes_per_cycle;

  /// Thousandths of a cycle, of quads of a warp that take the lock together.
  std::uint64_t price_of(bool opens_tile) const { return warp_thousandths_ + (opens_tile ? tile_thousandths_ : 0); }
  /// Of quads in any warps and tiles, all in full warps.
  std::uint64_t least_of(unsigned quads) const { return warp_thousandths_ * quads / quads_per_warp; }
  /// The slot's kinds of work.
  static std::vector<WorkKind> kinds() { return {{"blend", 1, 0, false}, {"lock", 0, 0.001, true}}; }

 private:
  std::uint64_t tile_thousandths_;
  std::uint64_t warp_thousandths_;
};

/// Of each quad of a warp the pixels for which it takes the lock, and which it loads: all that it covers, if that is known.
/// What a shader discards takes part, as the lock's unit knows nothing of that (measured: with it draws of pruned splats are met as others are).
using PixelsOfQuads = std::array<LaneMask, quads_per_warp>;
inline const PixelsOfQuads& pixels_of(const ShadedWarp& warp, const RenderContext& context) {
  return context.hands_on_coverage ? warp.covered : warp.live;
}

/// Coverage tiles, one for each screen tile: warps of which none has a pixel of another take the lock together, and two
/// quads of a warp with the same pixel take it one after the other (US 10,055,806).
class CoverageTiles {
 public:
  explicit CoverageTiles(const ScreenTiling& grid) : covered_(grid.quads()) {}
  struct Part {
    unsigned end;  ///< its quads are those before
    bool opens;    ///< a coverage tile
  };
  /// Quads of a warp from one on, up to the first of which a pixel is taken. `place` is the screen tile's; `is_open`:
  /// whether any that were taken there before hold the lock or wait for it.
  Part take(const ShadedWarp& warp, const PixelsOfQuads& pixels, unsigned from, std::size_t place, bool is_open) {
    LaneMask* const covered = &covered_[place];
    const bool opens = !is_open || (covered[warp.position[from]] & pixels[from]) != 0;
    if (opens) std::fill_n(covered, positions_per_tile, LaneMask{0});
    unsigned end = from;
    for (; end < warp.count && (covered[warp.position[end]] & pixels[end]) == 0; ++end) {
      LaneMask& of_quad = covered[warp.position[end]];
      of_quad = static_cast<LaneMask>(of_quad | pixels[end]);
    }
    return {end, opens};
  }

 private:
  std::vector<LaneMask> covered_;
};

/// Calls `access(address, bytes)` for what quads of a warp that have any of `pixels` load or store: naturally aligned,
/// neighbours together.
template <class Access>
void for_each_shader_access(const ColorSurface& surface, const ShadedWarp& warp, const PixelsOfQuads& pixels,
                            unsigned from, unsigned to, Access&& access) {
  constexpr unsigned line_bytes = 128, sector_bytes = 32;
  const unsigned quad_bytes = 4 * bytes_per_pixel(surface.format());
  const unsigned unit_bytes = std::min(quad_bytes, sector_bytes);
  const std::size_t tile = surface.grid().place(warp.tile, 0);
  std::array<std::uint64_t, quads_per_warp> lines;
  std::array<std::uint32_t, quads_per_warp> units;
  unsigned count = 0;
  for (unsigned i = from; i < to; ++i) {
    if (pixels[i] == 0) continue;
    const std::uint64_t address = surface.address(tile + warp.position[i]);
    const std::uint64_t line = address / line_bytes;
    unsigned at = 0;
    while (at < count && lines[at] != line) ++at;
    if (at == count) {
      lines[count] = line;
      units[count++] = 0;
    }
    units[at] |= sector_mask(static_cast<unsigned>(address % line_bytes) / unit_bytes, quad_bytes / unit_bytes);
  }
  for (unsigned i = 0; i < count; ++i) {
    for_each_sector_run(units[i], line_bytes / unit_bytes, [&](unsigned first, unsigned run) {
      access(lines[i] * line_bytes + std::uint64_t{first} * unit_bytes, run * unit_bytes);
    });
  }
}

}  // namespace vrpipe
