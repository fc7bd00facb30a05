#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/rate.h>
#include <vrpipe/memory/cache_organization.h>
#include <vrpipe/memory/cache_statistics.h>
#include <vrpipe/memory/sectors.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// Of a quad: those of two pixels, one above the other, in which samples live.
constexpr unsigned columns_of(LaneMask live) { return ((live & 5U) != 0 ? 1U : 0U) + ((live & 10U) != 0 ? 1U : 0U); }

/// Slot `crop`: blends quads into the colour target and tests for termination.
class CropBehaviour : public Behaviour {
 public:
  /// Before the first blend. One that overrides it calls it.
  virtual void attach(ColorSurface& surface) { surface_ = &surface; }
  const ColorSurface* surface() const { return surface_; }
  /// A mark comes by, after all blends before it: a clear is done (Frame::clear_of), for this GPC's tiles.
  virtual void pass(Mark mark) = 0;
  struct Outcome {
    LaneMask terminated;  ///< pixels to signal: those that newly passed the termination threshold (HET only)
    bool changed;         ///< whether a stored value is another one than before
  };
  /// Blends the live samples of a quad of a draw into the one at a place of the surface's grid.
  virtual Outcome blend(DrawIndex draw, std::size_t place, LaneMask live, const QuadColor& color) = 0;
  /// The same for a quad of a warp, which timing models that blend quad by quad call.
  virtual Outcome blend_quad(std::size_t place, const ShadedWarp& warp, unsigned index) {
    return blend(warp.draw[index], place, warp.live[index], warp.color[index]);
  }
  /// By quad of a warp.
  using Outcomes = std::array<Outcome, quads_per_warp>;
  /// Blends quads `from` to `to` - 1 of a warp, in this order.
  virtual void blend_quads(const ShadedWarp& warp, unsigned from, unsigned to, Outcomes& outcomes) {
    for (unsigned i = from; i < to; ++i) {
      outcomes[i] = blend_quad(surface_->grid().place(warp.tile, warp.position[i]), warp, i);
    }
  }

  /// What the colour cache does for a line that quads need.
  using LineAccess = vrpipe::LineAccess;
  /// And for quads of a warp; quad `i` needs `sectors_of[i]` of the line in `lines[line_of[i]]`.
  struct CacheLookUp {
    unsigned count = 0;  ///< of lines, in the order in which they are needed first
    std::array<LineAccess, quads_per_warp> lines;
    std::array<std::uint8_t, quads_per_warp> line_of{};
    std::array<std::uint32_t, quads_per_warp> sectors_of{};
  };
  /// Looks quads `from` to `to` - 1 of a warp up, before their `blend`, in the order of blending. The cache sees this
  /// order alone, so that which sectors move does not depend on when; for timing models that do not follow fills through the
  /// cache themselves. Without a cache, no line is needed.
  virtual void look_up(const ShadedWarp&, unsigned /*from*/, unsigned /*to*/, CacheLookUp& out) { out.count = 0; }
  /// After a `blend` whose sectors are dirty for it.
  virtual void make_dirty(std::uint32_t /*line*/, std::uint32_t /*sectors*/) {}
  struct TimingParameters {
    Rate blend_rate;               ///< of quads, of this draw's format
    std::uint32_t input_quads;     ///< queue between tag look-up and blending
    std::uint32_t latency_cycles;  ///< of blending, termination test included
    bool forwards;                 ///< overlapping quads need not wait for `latency_cycles`
    std::uint32_t cache_bytes;
    std::uint32_t line_bytes;
    std::uint32_t sector_bytes;
    std::uint32_t mshrs;              ///< sectors in flight
    std::uint32_t sectors_per_cycle;  ///< filled or written back
    bool writes_unchanged;            ///< a blend that changes no value makes its sector dirty all the same
    std::uint32_t ways = 0;           ///< of a set of the cache; 0: fully associative
    Replacement replacement = Replacement::lru;
    std::uint32_t random_seed = 0;  ///< of random replacement
    bool hashes_sets = false;
    bool tells_conflicts = false;          ///< conflict misses are counted apart from capacity misses
    std::uint32_t line_cycles = 0;         ///< of blending, for a line that moves; 0: sectors are what takes time
    bool fetches_ahead = false;            ///< a line may go while quads wait to be blended into it
    std::uint32_t line_return_cycles = 0;  ///< from a line's last use to the next, if it left in between
    bool pairs_in_sector = false;          ///< quads blended in one cycle share a sector
    /// Of blending, for each column of two pixels of a quad with live samples, if that is more than the rate; 0: none.
    std::uint32_t column_cycles = 0;
    /// Of the cycles of the blender: in how many parts what moves is paid, and how many of these a move takes.
    std::uint32_t moves_in_a_cycle() const { return line_cycles == 0 ? sectors_per_cycle : 1; }
    std::uint32_t parts_of_a_move() const { return line_cycles == 0 ? 1 : line_cycles; }
    CacheOrganization cache() const;
    /// Throws UserError for a cache that cannot be (CacheOrganization::check), or whose lines do not hold a quad.
    void check_cache(ColorFormat format) const;
  };
  virtual TimingParameters timing() const = 0;

  DrawCounter quads_blended{*this, "quads_blended", "quads", "blended"};
  DrawCounter fragments_blended{*this, "fragments_blended", "fragments", "blended"};
  DrawCounter quads_dropped_late{*this, "quads_dropped_late", "quads",
                                 "of which CROP finds every pixel terminated (strict)"};
  DrawCounter fragments_dropped_late{*this, "fragments_dropped_late", "fragments",
                                     "whose pixel CROP finds terminated (strict)"};
  DrawCounter termination_signals{*this, "termination_signals", "signals", "sent to ZROP, one for a quad's pixels"};
  /// Of the colour cache; its accesses are quads. Whoever simulates it counts: the unit in `look_up`, or the timing model
  /// that follows fills through the cache.
  SectoredCacheStatistics cache_statistics{*this, "cache"};

 protected:
  ColorSurface* surface_ = nullptr;
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

/// Told of what the colour cache and the blender do for each quad: for the bound.
class BlendObserver {
 public:
  virtual ~BlendObserver() = default;
  virtual void looked_up(const CropBehaviour::LineAccess& access) = 0;
  virtual void blended(const ShadedWarp& warp, unsigned index, const CropBehaviour::Outcome& outcome) = 0;
};

/// The slot's kinds of work, and what they cost by the unit's own words: the same at every fidelity.
struct CropWork {
  /// Quads blended, what moves in its time (sectors, or lines where these have a price), and what hazards waste of the
  /// blender, and quads that have no neighbour to go with (pairs_in_sector): shares of a cycle, of which one has
  /// `parts_of_a_cycle`.
  enum : unsigned { blend, sectors, forwarding, unpaired };
  static std::uint64_t parts_of_a_cycle(const CropBehaviour::TimingParameters& timing) {
    return std::uint64_t{timing.blend_rate.items} * timing.moves_in_a_cycle();
  }
  static std::vector<WorkKind> kinds(const CropBehaviour::TimingParameters& timing);
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_crop(const std::string& name, const RenderContext& context,
                                      std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
