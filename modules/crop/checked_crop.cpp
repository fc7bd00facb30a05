#include "crop/checked_crop.h"

#include "crop/crop_time.h"

#include <vrpipe/pipeline/slots/checks.h>

namespace vrpipe {

namespace {

class CheckedCrop final : public CheckedSlot<CropBehaviour> {
 public:
  CheckedCrop(std::string name, const RenderContext& context, std::unique_ptr<CropBehaviour> checked)
      : CheckedSlot(std::move(name), context, std::move(checked)) {}

  void attach(ColorSurface& surface) override {
    CropBehaviour::attach(surface);
    ask("attach", [&] { checked_->attach(surface); });
  }
  void pass(Mark mark) override {
    ask("pass", [&] { checked_->pass(mark); });
  }
  Outcome blend(DrawIndex draw, std::size_t place, LaneMask live, const QuadColor& color) override {
    const Outcome outcome = ask("blend", [&] { return checked_->blend(draw, place, live, color); });
    take(draw, static_cast<unsigned>(place % positions_per_tile), live, outcome);
    return outcome;
  }
  void blend_quads(const ShadedWarp& warp, unsigned from, unsigned to, Outcomes& outcomes) override {
    ask("blend_quads", [&] { checked_->blend_quads(warp, from, to, outcomes); });
    for (unsigned i = from; i < to; ++i) take(warp.draw[i], warp.position[i], warp.live[i], outcomes[i]);
  }
  void look_up(const ShadedWarp& warp, unsigned from, unsigned to, CacheLookUp& out) override {
    ask("look_up", [&] { checked_->look_up(warp, from, to, out); });
    if (out.count > to - from)
      fault("look_up", "{} lines for {} quads in {}", out.count, to - from, words_of(warp.tile));
    const std::uint32_t held = time().cache.lines();
    for (unsigned i = 0; i < out.count; ++i) {
      if (out.lines[i].line >= held) fault("look_up", "line {} of a cache of {}", out.lines[i].line, held);
    }
    for (unsigned i = from; i < to; ++i) {
      const QuadSectors& quad = time().sectors_of_quads()[warp.position[i]];
      const std::uint32_t line = out.line_of[quad.line];
      if (line >= held) fault("look_up", "quad {} needs line {} of a cache of {}", i, line, held);
      ++line_accesses_;
      sector_accesses_ += bits(quad.sectors);
    }
    for (unsigned i = 0; i < out.count; ++i) {
      const unsigned quad = out.first_quad[i];
      if (quad < from || quad >= to) fault("look_up", "quad {} of {} to {} needs a line", quad, from, to);
      line_misses_ += out.lines[i].replaced ? 1 : 0;
      sector_misses_ += bits(out.lines[i].missed);
      sectors_filled_ += bits(out.lines[i].filled);
      written_back_ += bits(out.lines[i].written_back);
    }
  }
  SectoredCache* cache() override {
    return ask("cache", [&] { return checked_->cache(); });
  }
  const CropTime& time() const override {
    return ask("time", [&]() -> const CropTime& { return checked_->time(); });
  }
  void check_timing() const override { time(); }
  void check_counters() const override {
    check_by_draw("quads_blended + quads_dropped_late", {&checked_->quads_blended, &checked_->quads_dropped_late},
                  quads_, "quads came in");
    check_by_draw("fragments_blended + fragments_dropped_late",
                  {&checked_->fragments_blended, &checked_->fragments_dropped_late}, fragments_, "fragments came in");
    check_by_draw("termination_signals", {&checked_->termination_signals}, signalled_, "signals went out");
    if (line_accesses_ == 0) return;  // no cache, or one of the timing model's
    const SectoredCacheStatistics& cache = checked_->cache_statistics;
    check_counter("cache.line_accesses", cache.line_accesses.value(), line_accesses_, "quads needed a line");
    check_counter("cache.line_hits", cache.line_hits.value(), line_accesses_ - line_misses_, "lines were held");
    check_counter("cache.line_misses", cache.line_misses.value(), line_misses_, "lines were replaced");
    check_counter("cache.sector_accesses", cache.sector_accesses.value(), sector_accesses_, "sectors were needed");
    check_counter("cache.sector_hits", cache.sector_hits.value(), sector_accesses_ - sector_misses_,
                  "sectors were there");
    check_counter("cache.sector_misses", cache.sector_misses.value(), sector_misses_, "sectors were missed");
    check_counter("cache.sector_misses_compulsory + _capacity + _conflict",
                  cache.sector_misses_compulsory.value() + cache.sector_misses_capacity.value() +
                      cache.sector_misses_conflict.value(),
                  sector_misses_, "sectors were missed");
    check_counter("cache.sectors_written_back", cache.sectors_written_back.value(), written_back_,
                  "sectors were written back");
    const std::uint64_t sector_bytes = time().cache.sector_bytes;
    check_counter("cache.bytes_filled", cache.bytes_filled.value(), sector_bytes * sectors_filled_,
                  "bytes were filled");
    check_counter("cache.bytes_written_back", cache.bytes_written_back.value(), sector_bytes * written_back_,
                  "bytes were written back");
  }

 private:
  void take(DrawIndex draw, unsigned position, LaneMask live, const Outcome& outcome) {
    quads_.add(draw, 1);
    fragments_.add(draw, popcount(live));
    if (outcome.terminated == 0) return;
    signalled_.add(draw, 1);
    if (!frame().draw_call(draw).state.early_termination)
      fault("blend", "position {} of a tile is signalled without early termination", position);
    if ((outcome.terminated & ~live) != 0) {
      fault("blend", "position {} of a tile: pixels {:#x} terminated by fragments {:#x}", position, outcome.terminated,
            live);
    }
  }

  static unsigned bits(std::uint32_t sectors) { return static_cast<unsigned>(__builtin_popcount(sectors)); }

  std::uint64_t line_accesses_ = 0;
  std::uint64_t line_misses_ = 0;
  std::uint64_t sector_accesses_ = 0;
  std::uint64_t sector_misses_ = 0;
  std::uint64_t sectors_filled_ = 0;  ///< the other ones are written without
  std::uint64_t written_back_ = 0;
  Seen quads_;
  Seen fragments_;
  Seen signalled_;
};

}  // namespace

std::unique_ptr<Behaviour> check_crop(const std::string& name, const RenderContext& context,
                                      std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedCrop, CropBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
