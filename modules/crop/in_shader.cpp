#include "crop/in_shader.h"

#include <stdexcept>

#include <vrpipe/component/error.h>

namespace vrpipe {

namespace {
LaneBits differ(const QuadColor& a, const QuadColor& b) {
  return (a.red != b.red) | (a.green != b.green) | (a.blue != b.blue) | (a.alpha != b.alpha);
}
}  // namespace

InShaderBlending::InShaderBlending(const Parameters& parameters, const RenderContext& context)
    : context_(context),
      time_(parameters, context.clock_ps),
      blend_(blend_function(context.format, context.precision.blend_rounding)) {
  if (context.frame->terminates_early()) {
    throw UserError("cannot terminate early", "crop=in-shader",
                    "a shader that blends has no alpha test unit, which signals terminated pixels",
                    "take a variant without early termination, or crop=color-rop");
  }
}

const CropTime& InShaderBlending::time() const {
  throw std::logic_error("blending in the shader has no time of a colour ROP");
}

void InShaderBlending::pass(Mark mark) {
  const Clear* const clear = context_.frame->clear_of(mark);
  if (clear == nullptr || !clear->color) return;
  const ScreenTiling& grid = surface_->grid();
  for (std::size_t tile = 0; tile < grid.tiles(); ++tile) {
    if (context_.placement.owns(grid.tile(tile))) surface_->clear(grid.tile(tile));
  }
}

CropBehaviour::Outcome InShaderBlending::store(DrawIndex draw, std::size_t place, LaneMask live, const QuadColor& color,
                                               const QuadColor& loaded) {
  if (live == 0) return {0, false};  // all of it is pruned
  if (context_.fragments != nullptr) {
    context_.fragments->happened(FragmentFate::blended, surface_->grid().tile(place / positions_per_tile),
                                 static_cast<unsigned>(place % positions_per_tile), live);
  }
  quads_blended.add(draw, 1);
  fragments_blended.add(draw, static_cast<unsigned>(__builtin_popcount(live)));
  const bool blends = context_.state(draw).blend;
  const QuadColor stored = blend_(blends ? loaded : QuadColor{}, color);
  QuadColor& quad = surface_->quad(place);
  const LaneBits lanes = expand_mask(live);
  if (const LaneBits other = lanes & differ(quad, loaded); blends && sign_mask(other) != 0)
    updates_lost += static_cast<unsigned>(__builtin_popcount(sign_mask(other)));
  const bool changed = sign_mask(lanes & differ(quad, stored)) != 0;
  quad = {select(lanes, stored.red, quad.red), select(lanes, stored.green, quad.green),
          select(lanes, stored.blue, quad.blue), select(lanes, stored.alpha, quad.alpha)};
  return {0, changed};
}

namespace {
const Registrar<InShaderBlending, CropBehaviour> in_shader_registrar(
    "crop", "in-shader", "the fragment shader loads, blends and stores, with an ordered lock or none", false,
    Trust::trusted, true);
}  // namespace

}  // namespace vrpipe
