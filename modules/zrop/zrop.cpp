#include "zrop/zrop.h"

#include <vrpipe/registry.h>

namespace vrpipe {

DepthStencilRop::DepthStencilRop(const Parameters& parameters, const RenderState& state)
    : cost_{parameters.quads_per_cycle, parameters.latency_cycles, parameters.updates_per_cycle},
      grid_(state.draw->width, state.draw->height),
      terminated_(grid_.quads()) {}

void DepthStencilRop::test(QuadBeat& beat) {
  unsigned kept = 0;
  quads_tested += beat.count;
  const std::uint8_t* const tile_bits = &terminated_[grid_.place(beat.tile, 0)];
  for (unsigned i = 0; i < beat.count; ++i) {
    Quad quad = beat.quads[i];
    const unsigned dead = quad.coverage & tile_bits[quad.position];
    fragments_terminated += popcount(static_cast<LaneMask>(dead));
    quad.coverage = static_cast<LaneMask>(quad.coverage & ~dead);
    beat.quads[kept] = quad;
    kept += quad.coverage != 0 ? 1U : 0U;
  }
  quads_terminated += beat.count - kept;
  beat.count = static_cast<std::uint8_t>(kept);
  if (run_ahead_ == nullptr || beat.end_of_draw) return;
  run_ahead_->tested(beat, ahead_);
  if (!beat.last_of_bin) return;
  for (const TerminationSignal& signal : ahead_) mark(signal);
  ahead_.clear();
}

void DepthStencilRop::update(const TerminationSignal& signal) {
  ++termination_updates;
  if (run_ahead_ == nullptr) mark(signal);
}

namespace {
const SlotRegistrar slot{{"zrop", 70, "depth-stencil-rop", "", true}};
const Registrar<DepthStencilRop, ZropBehaviour> registrar("zrop", "depth-stencil-rop",
                                                          "termination test and update on the stencil MSB", false,
                                                          Trust::trusted);
}  // namespace

}  // namespace vrpipe
