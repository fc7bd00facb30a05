#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/screen_tiling.h>
#include <vrpipe/pipeline/units.h>

namespace vrpipe {

/// Depth-stencil ROP: the termination test and update on the stencil's most significant bit (paper 5.2).
class DepthStencilRop : public ZropBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer quads_per_cycle{
        *this,
        "quads_per_cycle",
        16,
        1,
        16,
        "quads",
        "measured on a GH100 graphics GPC: 8 quads a cycle and ROP partition; the paper's GPC has two",
        "tested in a cycle"};
    Integer latency_cycles{
        *this, "latency_cycles", 8, 1, 1000, "cycles", source::open, "of a test, z-cache read included"};
    Integer updates_per_cycle{
        *this,
        "updates_per_cycle",
        1,
        1,
        16,
        "signals",
        source::open,
        "termination updates, each a read-modify-write of the z-cache; such a cycle tests nothing"};
  };
  DepthStencilRop(const Parameters& parameters, const RenderContext& context);

  void test(QuadBeat& beat) override;
  void update(const TerminationSignal& signal) override;
  void pass(Mark mark) override;
  void follow(FunctionalRunAhead& run_ahead) override { run_ahead_ = &run_ahead; }
  TimingParameters timing() const override { return timing_; }

  Counter updates_void{*this, "updates_void", "signals",
                       "received after a clear of what they were for; they take time"};

 private:
  void mark(const TerminationSignal& signal) {
    std::uint8_t& bits = surface_->terminated(surface_->grid().place(signal.tile, signal.position));
    bits = static_cast<std::uint8_t>(bits | signal.pixels);
  }

  const RenderContext& context_;
  const TimingParameters timing_;
  std::uint16_t epoch_ = 0;  ///< clears of termination so far
  FunctionalRunAhead* run_ahead_ = nullptr;
  std::vector<TerminationSignal> ahead_;  ///< of the bin under test
};

}  // namespace vrpipe
