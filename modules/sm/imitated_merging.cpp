#include "sm/imitated_merging.h"

#include <array>

#include <vrpipe/arithmetic/random.h>

namespace vrpipe {
namespace {

/// The same at every fidelity, in whatever order quads come.
std::uint64_t drawn_thousandths(TileId tile, unsigned position, std::uint32_t primitive) {
  const std::uint64_t place = (std::uint64_t{tile.y} << 40U) | (std::uint64_t{tile.x} << 24U) | position;
  return mix(mix(primitive) ^ place) % 1000;
}

}  // namespace

ImitatedMerging::ImitatedMerging(const Parameters& parameters, const RenderContext& context)
    : SplatShader(parameters, context),
      context_(context),
      paired_(parameters.paired_quads.thousandths()),
      discarded_(parameters.discarded_quads.thousandths()),
      several_draws_(context.frame->draws().size() > 1) {
  if (paired_ > 0) time_.fragment.insert(time_.fragment.end(), time_.merge.begin(), time_.merge.end());
}

void ImitatedMerging::shade(const Warp& warp, ShadedWarp& out) {
  SplatShader::shade(warp, out);
  std::uint64_t imitating = 0;
  for (unsigned i = 0; i < warp.count; ++i) {
    const Quad& quad = warp.quads[i];
    imitating += drawn_thousandths(warp.tile, quad.position, primitive_order(quad)) < paired_ ? 1U : 0U;
  }
  statistics_.quads += imitating;
  statistics_.warps += imitating > 0 ? 1U : 0U;
  std::array<LaneMask, quads_per_warp> left{};
  for (unsigned i = 0; i < out.count; ++i) {
    if (drawn_thousandths(out.tile, out.position[i], out.first_primitive[i]) >= discarded_) {
      left[i] = out.live[i];
      continue;
    }
    const DrawIndex draw = several_draws_ ? out.draw[i] : DrawIndex{0};
    const auto fragments = static_cast<std::uint64_t>(__builtin_popcount(out.live[i]));
    quads_merged.add(draw, 1);
    fragments_merged.add(draw, fragments);
    if (context_.fragments != nullptr)
      context_.fragments->happened(FragmentFate::merged, out.tile, out.position[i], out.live[i]);
  }
  out.keep(left);
}

}  // namespace vrpipe
