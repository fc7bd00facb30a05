#pragma once

#include "depth_stencil_test.h"
#include "zrop_time.h"

#include <vrpipe/pipeline/screen_tiling.h>
#include <vrpipe/pipeline/slots/zrop.h>

namespace vrpipe {

/// Depth-stencil ROP: the tests of depth and stencil, then the termination test, and the termination update on the stencil's
/// most significant bit (paper 5.2); or those of depth and stencil after shading. Depth and stencil are written whether or not a
/// pixel has terminated: that only says that nothing of it can be seen any more.
class DepthStencilRop : public ZropBehaviour {
 public:
  using Parameters = ZropParameters;
  /// Throws UserError for a z-cache that cannot be.
  DepthStencilRop(const Parameters& parameters, const RenderContext& context);

  std::uint32_t test(QuadBeat& beat) override;
  std::uint32_t test_late(ShadedWarp& warp) override;
  void update(const TerminationSignal& signal) override;
  void pass(Mark mark) override;
  void follow(FunctionalRunAhead& run_ahead) override { run_ahead_ = &run_ahead; }
  const ZropTime& time() const override { return time_; }

  Counter updates_void{*this, "updates_void", "signals",
                       "received after a clear of what they were for; they take time"};

 private:
  DepthStencilTest::Outcome test_quad(const Quad& quad, TileId tile);
  /// Take failed samples and quads out of a beat. The termination test first tells who looks which it will take.
  std::uint32_t test_depth_stencil(QuadBeat& beat);
  void test_termination(QuadBeat& beat, bool is_first);
  void tell_terminated(const QuadBeat& beat) const;
  /// Nothing shades them.
  void end_unshaded(QuadBeat& beat);
  void mark(const TerminationSignal& signal) {
    std::uint8_t& bits = surface_->terminated(surface_->grid().place(signal.tile, signal.position));
    bits = static_cast<std::uint8_t>(bits | signal.pixels);
  }

  const RenderContext& context_;
  const ZropTime time_;
  DepthStencilTest depth_stencil_;
  EffectGate depth_stencil_gate_;
  EffectGate termination_gate_;
  std::uint16_t epoch_ = 0;  ///< clears of termination so far
  FunctionalRunAhead* run_ahead_ = nullptr;
  std::vector<TerminationSignal> ahead_;  ///< of the bin under test
};

}  // namespace vrpipe
