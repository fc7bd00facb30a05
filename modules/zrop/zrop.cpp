#include "zrop/zrop.h"

#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

DepthStencilRop::DepthStencilRop(const Parameters& parameters, const RenderContext& context)
    : context_(context),
      timing_{parameters.quads_per_cycle,
              parameters.latency_cycles,
              parameters.updates_per_cycle,
              {parameters.cache.organization(), parameters.mshrs, parameters.input_quads, parameters.input_updates,
               parameters.sectors_per_cycle}} {
  timing_.z_cache.check();
}

void DepthStencilRop::test(QuadBeat& beat) {
  // All are of one state.
  if (beat.count > 0 && context_.state(beat.quads[0].draw).early_termination) {
    unsigned kept = 0;
    const std::size_t tile = surface_->grid().place(beat.tile, 0);
    for (unsigned i = 0; i < beat.count;) {
      const DrawIndex draw = beat.quads[i].draw;
      const unsigned first = i;
      const unsigned kept_before = kept;
      unsigned fragments = 0;
      for (; i < beat.count && beat.quads[i].draw == draw; ++i) {
        Quad quad = beat.quads[i];
        const unsigned dead = quad.coverage & surface_->terminated(tile + quad.position);
        fragments += popcount(static_cast<LaneMask>(dead));
        quad.coverage = static_cast<LaneMask>(quad.coverage & ~dead);
        beat.quads[kept] = quad;
        kept += quad.coverage != 0 ? 1U : 0U;
      }
      quads_tested.add(draw, i - first);
      fragments_terminated.add(draw, fragments);
      quads_terminated.add(draw, i - first - (kept - kept_before));
    }
    beat.count = static_cast<std::uint8_t>(kept);
  }
  if (run_ahead_ == nullptr) return;
  run_ahead_->tested(beat, ahead_);
  if (!beat.last_of_bin) return;
  for (const TerminationSignal& signal : ahead_) mark(signal);
  ahead_.clear();
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
  if (clear != nullptr && clear->termination) {
    surface_->clear_termination(context_.placement);
    ++epoch_;
  }
  if (run_ahead_ != nullptr) run_ahead_->pass(mark);
}

namespace {
const SlotRegistrar slot{{"zrop", 70, "depth-stencil-rop", "", true, check_zrop}};
const Registrar<DepthStencilRop, ZropBehaviour> registrar("zrop", "depth-stencil-rop",
                                                          "termination test and update on the stencil MSB", false,
                                                          Trust::trusted);
}  // namespace

}  // namespace vrpipe
