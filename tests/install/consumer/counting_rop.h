#pragma once

#include <vrpipe/modules/crop/crop.h>

/// The shipped colour ROP that also counts blends which change no stored value. Parameters, the other counters and every
/// bit of the image stay what they are.
template <vrpipe::ColorFormat Format, vrpipe::BlendRounding Rounding>
class CountingRop : public vrpipe::ColorRop<Format, Rounding> {
  using Shipped = vrpipe::ColorRop<Format, Rounding>;
  using Outcomes = vrpipe::CropBehaviour::Outcomes;

 public:
  using Shipped::Shipped;

  void blend_quads(const vrpipe::ShadedWarp& warp, unsigned from, unsigned to, Outcomes& outcomes) override {
    Shipped::blend_quads(warp, from, to, outcomes);
    for (unsigned i = from; i < to; ++i) quads_unchanged += outcomes[i].changed ? 0U : 1U;
  }

  vrpipe::Counter quads_unchanged{*this, "quads_unchanged", "quads", "blended, or dropped late, without a change"};
};
