#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

struct RasterTime;

/// Slot `raster`: setup, coarse and fine rasterisation of one primitive at a time.
class RasterBehaviour : public Behaviour {
 public:
  /// Sets up a primitive, to be rasterised in `clip`.
  virtual void begin(const Primitive& primitive, const PixelRect& clip) = 0;
  /// Advances to the next raster tile that coarse rasterisation keeps, and gives its quads (0 to 16).
  /// `coarse_tests` counts the raster tiles tested on the way; `new_screen_tile` tells whether it is the first raster
  /// tile kept of its screen tile. False, with `coarse_tests` set, when the primitive is done.
  virtual bool next(QuadBeat& out, unsigned& coarse_tests, bool& new_screen_tile) = 0;
  /// What ZROP has stored, or a mark that ZROP has passed. One without Hi-Z has no use for it.
  virtual void update(const HiZUpdate& /*update*/) {}
  /// Whether, once it has passed a mark on, it begins no primitive before that comes back as an update: with strict
  /// termination, where time decides nothing.
  virtual bool waits_at(Mark /*mark*/) const { return false; }
  /// What its work takes: the parameters of its timing models (modules/raster/raster.h).
  virtual const RasterTime& time() const = 0;

  void add_to(Counts& counts, const CountOf& of) const override {
    counts.quads_rasterized += of(quads_rasterized);
    counts.fragments_rasterized += of(fragments_rasterized);
  }

  DrawCounter quads_rasterized{*this, "quads_rasterized", "quads", "with at least one covered sample"};
  DrawCounter fragments_rasterized{*this, "fragments_rasterized", "fragments", "covered samples"};
  // What a unit of one's own does not count of these is counted for it, by its answers.
  Counter setups{*this, "setups", "primitives", "set up; again for each flush that a primitive is in"};
  Counter raster_tiles_tested{*this, "raster_tiles_tested", "raster tiles", "by coarse rasterisation"};
  Counter raster_tiles_kept{*this, "raster_tiles_kept", "raster tiles", "handed to fine rasterisation"};
  Counter screen_tile_pairs{*this, "screen_tile_pairs", "pairs", "of a primitive and a screen tile that it may cover"};
};

/// The slot's kinds of work.
struct RasterWork {
  enum : unsigned { setup, coarse, fine, pairs, quads, bare_setup, rectangle_setup };
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_raster(const std::string& name, const RenderContext& context,
                                        std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
