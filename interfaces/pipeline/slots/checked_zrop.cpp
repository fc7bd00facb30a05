#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/pipeline/slots/zrop.h>

namespace vrpipe {

namespace {

class CheckedZrop final : public CheckedSlot<ZropBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  std::uint32_t test(QuadBeat& beat) override {
    const TileId tile = beat.tile;
    const unsigned count = beat.count;
    const bool last_of_bin = beat.last_of_bin;
    const bool tests = count > 0 && !frame().draws().empty() &&
                       frame().draw_call(beat.quads[0].draw).state.reads_depth_stencil_early();
    for (unsigned i = 0; i < count; ++i) {
      const Quad& quad = beat.quads[i];
      if (tests) tested_.add(quad.draw, 1);
      lost_quads_.add(quad.draw, 1);
      lost_fragments_.add(quad.draw, popcount(quad.coverage));
    }
    const std::uint32_t changed = ask("test", [&] { return checked_->test(beat); });
    if (changed >> count != 0) fault("test", "quads {:#x} of {} have changed something", changed, count);
    if (beat.count > count) fault("test", "{} quads of {} in {} passed", beat.count, count, words_of(tile));
    if (beat.tile != tile || beat.last_of_bin != last_of_bin || beat.mark != Mark::none) {
      fault("test", "a beat of {} with a tile or marks that are not its own", words_of(tile));
    }
    check_quads("test", tile, beat.quads.data(), beat.count);
    for (unsigned i = 0; i < beat.count; ++i) {
      const Quad& quad = beat.quads[i];
      lost_quads_.take_back(quad.draw, 1);
      lost_fragments_.take_back(quad.draw, popcount(quad.coverage));
    }
    return changed;
  }
  std::uint32_t test_late(ShadedWarp& warp) override {
    const ShadedWarp before = warp;
    const std::uint32_t changed = ask("test_late", [&] { return checked_->test_late(warp); });
    warp.pool = before.pool;
    if (changed >> before.count != 0) {
      fault("test_late", "quads {:#x} of {} have changed something", changed, before.count);
    }
    if (warp.tile != before.tile || warp.sequence != before.sequence || warp.tile_sequence != before.tile_sequence ||
        warp.slot != before.slot || warp.mark != Mark::none) {
      fault("test_late", "a warp of {} with a tile, numbers or a mark that are not its own", words_of(before.tile));
    }
    unsigned at = 0;
    for (unsigned i = 0; i < before.count; ++i) {
      const DrawIndex draw = before.draw[i];
      tested_late_.add(draw, 1);
      const bool stays = at < warp.count && warp.live[at] != 0 && (warp.live[at] & ~before.live[i]) == 0 &&
                         warp.position[at] == before.position[i] &&
                         warp.first_primitive[at] == before.first_primitive[i];
      if (stays && !writes_color(frame().draw_call(draw).state.shader)) {
        fault("test_late", "position {} of {} goes on, of a draw that writes no colour", before.position[i],
              words_of(before.tile));
      }
      if (!stays) lost_late_.add(draw, 1);
      lost_late_fragments_.add(draw, popcount(before.live[i]) - (stays ? popcount(warp.live[at]) : 0U));
      at += stays ? 1U : 0U;
    }
    if (at != warp.count) {
      fault("test_late", "{} quads of {} in {} left, and {} of them are not among these in this order", warp.count,
            before.count, words_of(before.tile), warp.count - at);
    }
    return changed;
  }
  void attach(DepthStencilSurface& surface) override {
    ZropBehaviour::attach(surface);
    ask("attach", [&] { checked_->attach(surface); });
  }
  void pass(Mark mark) override {
    ask("pass", [&] { checked_->pass(mark); });
  }
  void update(const TerminationSignal& signal) override {
    ++updates_;
    ask("update", [&] { checked_->update(signal); });
  }
  void follow(FunctionalRunAhead& run_ahead) override {
    ask("follow", [&] { checked_->follow(run_ahead); });
  }
  const ZropTime& time() const override {
    return ask("time", [&]() -> const ZropTime& { return checked_->time(); });
  }
  void check_timing() const override { time(); }
  void check_counters() const override {
    check_by_draw("quads_tested", {&checked_->quads_tested}, tested_, "quads came in");
    check_by_draw("quads_terminated + quads_depth_stencil_failed + quads_unshaded",
                  {&checked_->quads_terminated, &checked_->quads_depth_stencil_failed, &checked_->quads_unshaded},
                  lost_quads_, "quads did not come out");
    check_by_draw("fragments_terminated + fragments_depth_stencil_failed + fragments_unshaded",
                  {&checked_->fragments_terminated, &checked_->fragments_depth_stencil_failed,
                   &checked_->fragments_unshaded},
                  lost_fragments_, "fragments did not come out");
    check_by_draw("quads_tested_late", {&checked_->quads_tested_late}, tested_late_, "quads came in");
    check_by_draw("quads_late_failed + quads_unblended", {&checked_->quads_late_failed, &checked_->quads_unblended},
                  lost_late_, "quads did not come out");
    check_by_draw("fragments_late_failed + fragments_unblended",
                  {&checked_->fragments_late_failed, &checked_->fragments_unblended}, lost_late_fragments_,
                  "fragments did not come out");
    check_counter("termination_updates", checked_->termination_updates.value(), updates_, "signals came in");
  }

 private:
  Seen tested_;
  Seen lost_quads_;
  Seen lost_fragments_;
  Seen tested_late_;
  Seen lost_late_;
  Seen lost_late_fragments_;
  std::uint64_t updates_ = 0;
};

}  // namespace

std::unique_ptr<Behaviour> check_zrop(const std::string& name, const RenderContext& context,
                                      std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedZrop, ZropBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
