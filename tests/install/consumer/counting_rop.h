#pragma once

#include <vrpipe/modules/crop/crop.h>

/// The shipped colour ROP that also counts blends which change no stored value. Parameters, the other counters and every
/// bit of the image stay what they are.
template <vrpipe::ColorFormat Format, vrpipe::BlendRounding Rounding>
class CountingRop : public vrpipe::ColorRop<Format, Rounding> {
  using Shipped = vrpipe::ColorRop<Format, Rounding>;
  using Outcome = vrpipe::CropBehaviour::Outcome;
  using Outcomes = vrpipe::CropBehaviour::Outcomes;

 public:
  using Shipped::Shipped;

  // A quad comes by one of the two, at cycle by the first, elsewhere by the second.
  Outcome blend(vrpipe::DrawIndex draw, std::size_t place, vrpipe::LaneMask live,
                const vrpipe::QuadColor& color) override {
    const Outcome outcome = Shipped::blend(draw, place, live, color);
    count(outcome);
    return outcome;
  }
  void blend_quads(const vrpipe::ShadedWarp& warp, unsigned from, unsigned to, Outcomes& outcomes) override {
    Shipped::blend_quads(warp, from, to, outcomes);
    for (unsigned i = from; i < to; ++i) count(outcomes[i]);
  }

  vrpipe::Counter quads_unchanged{*this, "quads_unchanged", "quads", "blended, or dropped late, without a change"};

 private:
  void count(const Outcome& outcome) {
    if (!outcome.changed) ++quads_unchanged;
  }
};
