#pragma once

#include <cstdint>

#include "sm.h"

namespace vrpipe {

/// The splat shader with what the paper imitates quad merging by, on hardware without it (VI-D): shuffles, blends and discards
/// in the shader, as often as merging has them, of whatever quads. Their colours are not blended: the image is wrong.
class ImitatedMerging : public SplatShader {
 public:
  struct Parameters : SplatShader::Parameters {
    Real paired_quads{*this,
                      "paired_quads",
                      0,
                      0,
                      1,
                      "of quads",
                      "imitates whatever quad merging has done",
                      "that issue the instructions of a merge; if any do, every warp takes their time"};
    Real discarded_quads{*this,
                         "discarded_quads",
                         0,
                         0,
                         1,
                         "of quads",
                         "imitates whatever quad merging has done",
                         "that are discarded, of those that have a fragment left"};
  };
  ImitatedMerging(const Parameters& parameters, const RenderContext& context);

  void shade(const Warp& warp, ShadedWarp& out) override;

 private:
  /// A part of its own: no other SM array lacks it.
  struct Statistics : StatisticSet {
    using StatisticSet::StatisticSet;
    Counter quads{*this, "quads", "quads", "that issue the instructions of a merge"};
    Counter warps{*this, "warps", "warps", "that have such quads"};
  };

  Statistics statistics_{*this, "imitation"};
  const RenderContext& context_;
  const std::uint32_t paired_, discarded_;  ///< thousandths
  const bool several_draws_;
};

}  // namespace vrpipe
