#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/memory/cache_statistics.h>
#include <vrpipe/memory/sectored_cache.h>
#include <vrpipe/memory/sectors.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/quad_sectors.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

class CropTime;

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
  /// By quad of a warp.
  using Outcomes = std::array<Outcome, quads_per_warp>;
  /// Blends quads `from` to `to` - 1 of a warp, in this order: what timing models call.
  virtual void blend_quads(const ShadedWarp& warp, unsigned from, unsigned to, Outcomes& outcomes) {
    for (unsigned i = from; i < to; ++i) {
      const std::size_t place = surface_->grid().place(warp.tile, warp.position[i]);
      outcomes[i] = blend(warp.draw[i], place, warp.live[i], warp.color[i]);
    }
  }

  /// What the colour cache does for a line that quads need.
  using LineAccess = vrpipe::LineAccess;
  /// And for quads of a warp, whose sectors are those of their places in the screen tile (CropTime::sectors_of_quads).
  struct CacheLookUp {
    /// Of the cache, by line of the tile: those that are needed.
    std::array<std::uint32_t, positions_per_tile> line_of{};
    unsigned count = 0;  ///< of those of which anything is missed, in the order in which they are needed first
    std::array<LineAccess, quads_per_warp> lines;
    std::array<std::uint8_t, quads_per_warp> first_quad{};  ///< in the warp, that needs each of these
  };
  /// Looks quads `from` to `to` - 1 of a warp up, before their `blend`, in the order of blending. The cache sees this
  /// order alone, so that which sectors move does not depend on when; for timing models that do not follow fills through the
  /// cache themselves. Without a cache, none is missed.
  virtual void look_up(const ShadedWarp&, unsigned /*from*/, unsigned /*to*/, CacheLookUp& out) { out.count = 0; }
  /// The colour cache of `look_up`, for models that make sectors dirty after their `blend`, or pin lines of quads between
  /// their look-up and their blend, and look up quad by quad then. None: whatever is looked up is there.
  virtual SectoredCache* cache() { return nullptr; }
  /// What its work takes: the parameters of its timing models (modules/crop/crop_time.h).
  virtual const CropTime& time() const = 0;

  void use_surfaces(Framebuffer& framebuffer) override { attach(framebuffer.color); }
  void add_to(Counts& counts, const CountOf& of) const override {
    counts.quads_dropped_late += of(quads_dropped_late);
    counts.fragments_dropped_late += of(fragments_dropped_late);
    counts.quads_blended += of(quads_blended);
    counts.fragments_blended += of(fragments_blended);
    counts.termination_updates += of(termination_signals);
  }

  DrawCounter quads_blended{*this, "quads_blended", "quads", "blended"};
  DrawCounter fragments_blended{*this, "fragments_blended", "fragments", "blended"};
  DrawCounter fragments_blended_late{*this, "fragments_blended_late", "fragments",
                                     "of those blended, whose pixel had passed the threshold already: they were tested "
                                     "before its termination landed"};
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

/// The slot's kinds of work.
struct CropWork {
  /// Quads blended, sectors that move in its time, what hazards waste of the blender, and quads that have no neighbour to
  /// go with (pairs_in_sector): parts of a cycle (CropTime). Flits of the port to L2, and those of ZROP's reads, beside which
  /// nothing is blended.
  enum : unsigned { blend, sectors, forwarding, unpaired, flits, reads, kinds };
  /// And what is counted for `bound`.
  enum : unsigned { sectors_filled = kinds, lines_filled, bytes_moved };
};

}  // namespace vrpipe
