#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

namespace {

class CheckedSm final : public CheckedSlot<SmBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  void attach(const ColorSurface& surface) override {
    SmBehaviour::attach(surface);
    ask("attach", [&] { checked_->attach(surface); });
  }
  void shade(const Warp& warp, ShadedWarp& out) override {
    ShadedWarpPool* const pool = out.pool;
    ask("shade", [&] { checked_->shade(warp, out); });
    out.pool = pool;
    if (out.count > warp.count) fault("shade", "{} quads of {} in {} left", out.count, warp.count, words_of(warp.tile));
    if (out.tile != warp.tile || out.sequence != warp.sequence || out.tile_sequence != warp.tile_sequence ||
        out.mark != Mark::none) {
      fault("shade", "a warp of {} with a tile, numbers or a mark that are not its own", words_of(warp.tile));
    }
    ++warps_;
    for (unsigned i = 0; i < warp.count; ++i) {
      const Quad& quad = warp.quads[i];
      shaded_.add(quad.draw, 1);
      shaded_fragments_.add(quad.draw, popcount(quad.coverage));
      lost_quads_.add(quad.draw, 1);
      lost_fragments_ += popcount(quad.coverage);
    }
    for (unsigned i = 0; i < out.count; ++i) {
      if (out.position[i] >= positions_per_tile || out.live[i] == 0 || out.live[i] > 0xf) {
        fault("shade", "quad {} of a warp of {}: position {} and live samples {}", i, words_of(warp.tile),
              out.position[i], out.live[i]);
      }
      lost_fragments_ -= popcount(out.live[i]);
      if (frame().splats() > 0) check_splat("shade", out.draw[i], out.first_primitive[i] / 2);
      lost_quads_.take_back(out.draw[i], 1);
    }
  }
  void shade_vertices(const VertexWarp& warp) override {
    ask("shade_vertices", [&] { checked_->shade_vertices(warp); });
  }
  const SmTime& time() const override {
    return ask("time", [&]() -> const SmTime& { return checked_->time(); });
  }
  void check_timing() const override { time(); }
  void check_counters() const override {
    check_counter("fragment_warps", checked_->fragment_warps.value(), warps_, "warps came in");
    check_by_draw("quads_shaded", {&checked_->quads_shaded}, shaded_, "quads came in");
    check_by_draw("fragments_shaded", {&checked_->fragments_shaded}, shaded_fragments_, "fragments came in");
    check_by_draw("quads_pruned + quads_merged", {&checked_->quads_pruned, &checked_->quads_merged}, lost_quads_,
                  "quads did not come out");
    check_counter("fragments_pruned + fragments_merged",
                  checked_->fragments_pruned.value() + checked_->fragments_merged.value(), lost_fragments_,
                  "fragments did not come out");
  }

 private:
  std::uint64_t warps_ = 0;
  Seen shaded_;
  Seen shaded_fragments_;
  Seen lost_quads_;
  std::uint64_t lost_fragments_ = 0;  ///< a merged quad has fragments of two draws
};

}  // namespace

std::unique_ptr<Behaviour> check_sm(const std::string& name, const RenderContext& context,
                                    std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedSm, SmBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
