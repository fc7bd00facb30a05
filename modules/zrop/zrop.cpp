#include "zrop/zrop.h"

#include "zrop/late_quads.h"

#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

DepthStencilRop::DepthStencilRop(const Parameters& parameters, const RenderContext& context)
    : context_(context),
      timing_{parameters.quads_per_cycle,
              parameters.latency_cycles,
              parameters.updates_per_cycle,
              {parameters.cache.organization(), parameters.mshrs, parameters.input_quads, parameters.input_updates,
               parameters.sectors_per_cycle, parameters.fast_clear}},
      depth_stencil_(context) {
  timing_.z_cache.check(context.frame->depth_format());
}

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

void DepthStencilRop::test_termination(QuadBeat& beat, bool is_first) {
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
    const bool tests_early = state.tests_early();
    if (tests_early) changed = test_depth_stencil(beat);
    if (state.tests_termination()) test_termination(beat, !tests_early);
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
  const bool blends = beat.count > 0 && writes_color(context_.state(beat.quads[0].draw).shader);  // all quads' state
  for (unsigned i = 0; i < beat.count; ++i) {
    const Quad& quad = beat.quads[i];
    const DepthStencilTest::Outcome outcome = test_quad(quad, beat.tile);
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
const SlotRegistrar slot{{"zrop", 70, "depth-stencil-rop", "", true, check_zrop}};
const Registrar<DepthStencilRop, ZropBehaviour> registrar(
    "zrop", "depth-stencil-rop", "depth, stencil and termination tests, termination update on the stencil MSB", false,
    Trust::trusted);
}  // namespace

}  // namespace vrpipe
