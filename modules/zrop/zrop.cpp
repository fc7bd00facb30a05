#include "zrop/zrop.h"

#include "zrop/late_quads.h"

#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/pipeline/frame_facts.h>
#include <vrpipe/pipeline/late_plan.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

DepthStencilRop::DepthStencilRop(const Parameters& parameters, const RenderContext& context)
    : context_(context),
      time_(parameters, context.frame->depth_format()),
      depth_stencil_(context),
      depth_stencil_gate_(context, "zrop.depth_stencil"),
      termination_gate_(context, "zrop.termination") {}

namespace {

/// Takes samples out of a beat, draw by draw: `dead(quad, index)` gives those of a quad; `count(draw, quads in, quads out,
/// fragments)` what has become of a draw's.
template <class Dead, class Count>
void take_out(QuadBeat& beat, Dead&& dead, Count&& count) {
  unsigned kept = 0;
  for (unsigned i = 0; i < beat.count;) {
    const DrawIndex draw = beat.quads[i].draw;
    const unsigned first = i;
    const unsigned kept_before = kept;
    unsigned fragments = 0;
    for (; i < beat.count && beat.quads[i].draw == draw; ++i) {
      Quad quad = beat.quads[i];
      const unsigned lost = dead(quad, i);
      fragments += popcount(static_cast<LaneMask>(lost));
      quad.coverage = static_cast<LaneMask>(quad.coverage & ~lost);
      beat.quads[kept] = quad;
      kept += quad.coverage != 0 ? 1U : 0U;
    }
    count(draw, i - first, kept - kept_before, fragments);
  }
  beat.count = static_cast<std::uint8_t>(kept);
}

}  // namespace

DepthStencilTest::Outcome DepthStencilRop::test_quad(const Quad& quad, TileId tile) {
  constexpr auto row = static_cast<std::int32_t>(quads_per_tile_row);
  const auto x = static_cast<std::int32_t>(tile.x * screen_tile_pixels) + 2 * (quad.position % row);
  const auto y = static_cast<std::int32_t>(tile.y * screen_tile_pixels) + 2 * (quad.position / row);
  return depth_stencil_.test(quad, x, y, surface_->format(),
                             surface_->quad(surface_->grid().place(tile, quad.position)));
}

std::uint32_t DepthStencilRop::test_depth_stencil(QuadBeat& beat) {
  std::uint32_t changed = 0;
  take_out(
      beat,
      [&](const Quad& quad, unsigned index) {
        const DepthStencilTest::Outcome outcome = test_quad(quad, beat.tile);
        changed |= (outcome.wrote ? 1U : 0U) << index;
        return static_cast<unsigned>(quad.coverage & ~outcome.passed);
      },
      [&](DrawIndex draw, unsigned in, unsigned out, unsigned fragments) {
        quads_tested.add(draw, in);
        quads_depth_stencil_failed.add(draw, in - out);
        fragments_depth_stencil_failed.add(draw, fragments);
      });
  return changed;
}

void DepthStencilRop::tell_terminated(const QuadBeat& beat) const {
  const std::size_t tile = surface_->grid().place(beat.tile, 0);
  for (unsigned i = 0; i < beat.count; ++i) {
    const Quad& quad = beat.quads[i];
    const auto lanes = static_cast<LaneMask>(quad.coverage & surface_->terminated(tile + quad.position));
    if (lanes != 0) context_.fragments->happened(FragmentFate::terminated, beat.tile, quad.position, lanes);
  }
}

void DepthStencilRop::test_termination(QuadBeat& beat, bool is_first) {
  if (context_.fragments != nullptr) tell_terminated(beat);
  const std::size_t tile = surface_->grid().place(beat.tile, 0);
  take_out(
      beat,
      [&](const Quad& quad, unsigned) -> unsigned {
        return quad.coverage & surface_->terminated(tile + quad.position);
      },
      [&](DrawIndex draw, unsigned in, unsigned out, unsigned fragments) {
        if (is_first) quads_tested.add(draw, in);
        fragments_terminated.add(draw, fragments);
        quads_terminated.add(draw, in - out);
      });
}

void DepthStencilRop::end_unshaded(QuadBeat& beat) {
  take_out(
      beat, [](const Quad& quad, unsigned) -> unsigned { return quad.coverage; },
      [&](DrawIndex draw, unsigned in, unsigned, unsigned fragments) {
        quads_unshaded.add(draw, in);
        fragments_unshaded.add(draw, fragments);
      });
}

std::uint32_t DepthStencilRop::test(QuadBeat& beat) {
  std::uint32_t changed = 0;
  if (beat.count > 0) {
    // All are of one state.
    const DrawState& state = context_.state(beat.quads[0].draw);
    const bool tests_early = state.tests_early() && depth_stencil_gate_.enter();
    if (tests_early) changed = test_depth_stencil(beat);
    if (state.tests_termination() && termination_gate_.enter()) test_termination(beat, !tests_early);
    if (state.shader == FragmentShader::none) end_unshaded(beat);
  }
  if (run_ahead_ == nullptr) return changed;
  run_ahead_->tested(beat, ahead_);
  if (!beat.last_of_bin) return changed;
  for (const TerminationSignal& signal : ahead_) mark(signal);
  ahead_.clear();
  return changed;
}

std::uint32_t DepthStencilRop::test_late(ShadedWarp& warp) {
  const QuadBeat beat = quads_of(warp);
  std::array<LaneMask, quads_per_warp> passed{};
  std::uint32_t changed = 0;
  const bool tests = beat.count > 0 && depth_stencil_gate_.enter();
  const bool blends = beat.count > 0 && writes_color(context_.state(beat.quads[0].draw).shader);  // all quads' state
  for (unsigned i = 0; i < beat.count; ++i) {
    const Quad& quad = beat.quads[i];
    const DepthStencilTest::Outcome outcome =
        tests ? test_quad(quad, beat.tile) : DepthStencilTest::Outcome{quad.coverage, false};
    passed[i] = outcome.passed;
    changed |= (outcome.wrote ? 1U : 0U) << i;
    quads_tested_late.add(quad.draw, 1);
    quads_late_failed.add(quad.draw, outcome.passed == 0 ? 1 : 0);
    fragments_late_failed.add(quad.draw, popcount(static_cast<LaneMask>(quad.coverage & ~outcome.passed)));
    if (blends) continue;
    quads_unblended.add(quad.draw, outcome.passed != 0 ? 1 : 0);
    fragments_unblended.add(quad.draw, popcount(outcome.passed));
    passed[i] = 0;
  }
  warp.keep(passed);
  return changed;
}

void DepthStencilRop::update(const TerminationSignal& signal) {
  ++termination_updates;
  if (signal.epoch != epoch_) {
    ++updates_void;
  } else if (run_ahead_ == nullptr) {
    mark(signal);
  }
}

void DepthStencilRop::pass(Mark mark) {
  const Clear* const clear = context_.frame->clear_of(mark);
  if (clear != nullptr && (clear->termination || clear->depth || clear->stencil)) {
    surface_->clear(*clear, context_.placement);
    epoch_ = static_cast<std::uint16_t>(epoch_ + (clear->termination ? 1 : 0));
  }
  if (run_ahead_ != nullptr) run_ahead_->pass(mark);
}

namespace {
const SlotRegistrar zrop_slot{{"zrop", 70, "depth-stencil-rop", "", true, check_zrop}, {}, {way_of_late_tests()}};
const Registrar<DepthStencilRop, ZropBehaviour> registrar(
    "zrop", "depth-stencil-rop", "depth, stencil and termination tests, termination update on the stencil MSB", false,
    Trust::trusted);
const EffectRegistrar depth_stencil_effect{
    {"zrop",
     "depth_stencil",
     "",
     EffectKind::functional,
     "the tests of depth and stencil, and what they store",
     "no draw tests depth or stencil, and none shades nothing",
     "the depth-stencil target; ZROP, for one of its effects",
     "before a test of depth or stencil",
     {"zrop"},
     [](const EffectQuestion& asked) {
       const FrameFacts& facts = asked.facts;
       const unsigned called = std::max(facts.testing_depth_stencil, facts.shading_nothing);
       if (called == 0) return EffectDecision::omit("no draw tests depth or stencil");
       return EffectDecision::keep(fmt::format("{} of {} draws test depth or stencil", called, facts.draws));
     }}};
const EffectRegistrar termination_effect{
    {"zrop",
     "termination",
     "",
     EffectKind::functional,
     "early termination (HET): its test and updates in ZROP, the alpha test in CROP and the signals between them",
     "no draw terminates early: the variant does without, or its state",
     "ZROP, for one of its effects; the link crop.terminations",
     "before a termination test, and in CROP before the alpha test of a draw that terminates",
     {"zrop", "crop.terminations"},
     [](const EffectQuestion& asked) {
       const FrameFacts& facts = asked.facts;
       if (facts.terminating == 0) return EffectDecision::omit("no draw terminates early");
       return EffectDecision::keep(fmt::format("{} of {} draws terminate early", facts.terminating, facts.draws));
     }}};
const EffectRegistrar late_tests_effect{
    {"zrop",
     "late_tests",
     "",
     EffectKind::functional,
     "tests of depth and stencil after shading",
     "no draw is tested late: none both discards and writes depth or stencil, and none asks for it",
     "ZROP, for one of its effects; the links prop.late and zrop.late",
     "in LatePlan, of which PROP, TC and ZROP each have one",
     {"zrop", "prop.late", "zrop.late"},
     [](const EffectQuestion& asked) {
       const FrameFacts& facts = asked.facts;
       if (facts.tested_late == 0) return EffectDecision::omit("no draw is tested after shading");
       return EffectDecision::keep(
           fmt::format("{} of {} draws are tested after shading", facts.tested_late, facts.draws));
     }}};
const EffectRegistrar z_cache_effect{
    {"zrop",
     "z_cache",
     "",
     EffectKind::timing,
     "the traffic of the depth-stencil target, and the cache before it",
     "no memory is connected, or no draw reads the target",
     "a sectored cache, queues of look-ups and the memory port's accesses",
     "before a test of a draw that reads the target, where memory is connected",
     {},
     [](const EffectQuestion& asked) {
       const FrameFacts& facts = asked.facts;
       if (!asked.memory_connected)
         return EffectDecision::omit(asked.has_time ? "ZROP's memory port is bound to nothing"
                                                    : "no memory is followed at this fidelity");
       if (facts.terminating + facts.testing_depth_stencil + facts.shading_nothing == 0)
         return EffectDecision::omit("no draw reads the depth-stencil target");
       return EffectDecision::keep(fmt::format("a depth-stencil target of {:.1f} MB",
                                               1e-6 * static_cast<double>(facts.addresses.depth_stencil.bytes)));
     }}};

// Not decided: why stands in place of a predicate.
const EffectRegistrar update_latency_effect{
    {"zrop",
     "update_latency",
     "",
     EffectKind::functional,
     "an update of the termination bit takes its way from CROP; what is tested meanwhile does not see it",
     "with termination on, every update has a way to go; strict termination is the choice of the user, not of the "
     "frame",
     "queues of updates",
     "",
     {},
     nullptr}};
}  // namespace

}  // namespace vrpipe
