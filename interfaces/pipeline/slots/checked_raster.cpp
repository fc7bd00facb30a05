#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/pipeline/slots/raster.h>

namespace vrpipe {

namespace {

class CheckedRaster final : public CheckedSlot<RasterBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  void begin(const Primitive& primitive, const PixelRect& clip) override {
    primitive_ = primitive;
    kept_before_ = kept_;
    ask("begin", [&] { checked_->begin(primitive, clip); });
    count_up_to(checked_->setups, ++set_up_);
  }
  bool next(QuadBeat& out, unsigned& coarse_tests, bool& new_screen_tile) override {
    const bool more = ask("next", [&] { return checked_->next(out, coarse_tests, new_screen_tile); });
    count_up_to(checked_->raster_tiles_tested, tested_ += coarse_tests);
    if (coarse_tests > raster_tiles())
      fault("next", "{} raster tiles tested, the frame has {}", coarse_tests, raster_tiles());
    if (!more) return false;
    count_up_to(checked_->raster_tiles_kept, ++kept_);
    count_up_to(checked_->screen_tile_pairs, pairs_ += new_screen_tile ? 1 : 0);
    if (kept_ - kept_before_ > raster_tiles())
      fault("next", "splat {} covers more raster tiles than the frame has", primitive_.splat);
    if (out.count > QuadBeat::capacity) fault("next", "{} quads in a raster tile", out.count);
    if (out.mark != Mark::none || out.last_of_bin) fault("next", "a raster tile with marks that are not its own");
    check_tile("next", out.tile);
    check_quads("next", out.tile, out.quads.data(), out.count);
    for (unsigned i = 0; i < out.count; ++i) {
      const Quad& quad = out.quads[i];
      if (quad.splat != primitive_.splat || quad.triangle != primitive_.triangle || quad.draw != primitive_.draw) {
        fault("next", "a quad of splat {}.{} for splat {}.{}", quad.splat, quad.triangle, primitive_.splat,
              primitive_.triangle);
      }
      fragments_.add(primitive_.draw, popcount(quad.coverage));
    }
    quads_.add(primitive_.draw, out.count);
    return true;
  }
  void update(const HiZUpdate& update) override {
    if (update.mark == Mark::none) {
      check_tile("update", update.tile);
      if (update.part > 3) fault("update", "raster tile {} of {}", update.part, words_of(update.tile));
    }
    ask("update", [&] { checked_->update(update); });
  }
  bool waits_at(Mark mark) const override {
    return ask("waits_at", [&] { return checked_->waits_at(mark); });
  }
  const RasterTime& time() const override {
    return ask("time", [&]() -> const RasterTime& { return checked_->time(); });
  }
  void check_timing() const override { time(); }
  void check_counters() const override {
    check_by_draw("quads_rasterized", {&checked_->quads_rasterized}, quads_, "quads came out");
    check_by_draw("fragments_rasterized", {&checked_->fragments_rasterized}, fragments_, "fragments came out");
  }

 private:
  std::uint64_t raster_tiles() const { return 4 * tiles(); }

  std::uint64_t set_up_ = 0, tested_ = 0, kept_ = 0, pairs_ = 0;
  Primitive primitive_;
  std::uint64_t kept_before_ = 0;  ///< of the primitives before this one
  Seen quads_;
  Seen fragments_;
};

}  // namespace

std::unique_ptr<Behaviour> check_raster(const std::string& name, const RenderContext& context,
                                        std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedRaster, RasterBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
