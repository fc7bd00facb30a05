#include "pixel_oracle.h"

#include <algorithm>
#include <cmath>

#include <vrpipe/arithmetic/running_bound.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/raster.h>
#include <vrpipe/pipeline/slots/sm.h>
#include <vrpipe/pipeline/slots/vpo.h>

#include "builders.h"

namespace vrpipe::testing {

namespace {

template <class SlotBehaviour>
std::unique_ptr<Behaviour> make(const char* slot, const char* name, const RenderContext& context, SlotBehaviour*& out) {
  const Implementation& implementation = Registry::instance().find(slot, name);
  const std::unique_ptr<ParameterSet> parameters = implementation.make_parameters();
  std::unique_ptr<Behaviour> behaviour = implementation.make_behaviour(*parameters, context);
  out = dynamic_cast<SlotBehaviour*>(behaviour.get());
  return behaviour;
}

}  // namespace

std::vector<std::vector<OracleFragment>> fragments_of(const RenderContext& context) {
  VpoBehaviour* vpo = nullptr;
  RasterBehaviour* raster = nullptr;
  SmBehaviour* sm = nullptr;
  const auto owned_vpo = make("vpo", "primitive-assembly", context, vpo);
  const auto owned_raster = make("raster", "tile-rasterizer", context, raster);
  const auto owned_sm = make("sm", "splat-shader", context, sm);

  std::vector<std::vector<OracleFragment>> pixels(std::size_t{context.frame->width()} * context.frame->height());
  std::array<Primitive, 2> primitives;
  for (std::uint32_t splat = 0; splat < context.frame->splats(); ++splat) {
    const unsigned count = vpo->assemble(0, splat, primitives);
    for (unsigned i = 0; i < count; ++i) {
      raster->begin(primitives[i], primitives[i].bounds);
      QuadBeat beat;
      unsigned tests = 0;
      bool new_tile = false;
      while (raster->next(beat, tests, new_tile)) {
        for (unsigned q = 0; q < beat.count; ++q) {
          Warp warp;
          warp.tile = beat.tile;
          warp.count = 1;
          warp.quads[0] = beat.quads[q];
          ShadedWarp shaded;
          sm->shade(warp, shaded);
          if (shaded.count == 0) continue;
          for (unsigned lane = 0; lane < 4; ++lane) {
            if (((shaded.live[0] >> lane) & 1U) == 0) continue;
            const std::uint32_t x = beat.tile.x * screen_tile_pixels + beat.quads[q].position % 8U * 2 + (lane & 1U);
            const std::uint32_t y = beat.tile.y * screen_tile_pixels + beat.quads[q].position / 8U * 2 + (lane >> 1U);
            const QuadColor& c = shaded.color[0];
            pixels[std::size_t{y} * context.frame->width() + x].push_back(
                {{c.red[lane], c.green[lane], c.blue[lane]}, c.alpha[lane]});
          }
        }
      }
    }
  }
  return pixels;
}

OraclePixel blend_exactly(const std::vector<OracleFragment>& fragments, const RenderContext& context) {
  const RunningBound running(context.format, context.precision.blend_rounding, true);
  OraclePixel pixel;
  std::array<PixelBound, 3> bounds{};  // channel by channel
  for (const OracleFragment& fragment : fragments) {
    const double before = pixel.rgba[3];
    const double alpha = fragment.alpha;
    pixel.rgba[3] += (1.0 - before) * alpha;
    for (unsigned i = 0; i < 3; ++i) {
      const double color = fragment.color[i];
      pixel.rgba[i] += (1.0 - before) * color;
      running.blended(bounds[i], alpha, color, before, pixel.rgba[3], pixel.rgba[i]);
      pixel.color_bound[i] = bounds[i].color;
    }
    pixel.alpha_bound = std::max(pixel.alpha_bound, bounds[0].alpha);
    ++pixel.fragments;
  }
  return pixel;
}

std::vector<std::array<float, 4>> pixels_in_order(const Frame& frame, bool terminates) {
  std::vector<std::array<float, 4>> pixels(std::size_t{frame.width()} * frame.height());
  std::vector<bool> terminated(pixels.size());
  std::vector<bool> ended(pixels.size());  // by a pass before
  for (const Frame::Command& command : frame.commands()) {
    if (!command.is_draw) {
      if (command.clear.color) pixels.assign(pixels.size(), {});
      if (command.clear.termination) terminated.assign(pixels.size(), false);
      continue;
    }
    const DrawCall& call = frame.draw_call(command.draw);
    const auto passes = [&](float alpha) {
      const float threshold = call.state.termination_threshold;
      return call.state.termination_inclusive ? alpha >= threshold : alpha > threshold;
    };
    if (call.state.shader == FragmentShader::alpha_threshold) {
      for (std::size_t i = 0; i < pixels.size(); ++i) ended[i] = ended[i] || passes(pixels[i][3]);
      continue;
    }
    Draw part = *call.geometry;
    part.splats.assign(part.splats.begin() + call.first, part.splats.begin() + call.first + call.splats);
    const auto fragments = fragments_of(context_of(part, call.state));
    const bool terminates_here = terminates && call.state.early_termination;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (call.state.stencil.test && ended[i]) continue;
      for (const OracleFragment& fragment : fragments[i]) {
        if (terminates_here && terminated[i]) continue;
        const float before = pixels[i][3];
        if (!call.state.blend) pixels[i] = {};
        const float transmittance = 1.0F - pixels[i][3];
        for (unsigned channel = 0; channel < 3; ++channel)
          pixels[i][channel] += transmittance * fragment.color[channel];
        pixels[i][3] += transmittance * fragment.alpha;
        if (terminates_here && !passes(before) && passes(pixels[i][3])) terminated[i] = true;
      }
    }
  }
  return pixels;
}

float largest_color(const Draw& draw) {
  float largest = 0;
  for (const Splat& splat : draw.splats) largest = std::max({largest, splat.red, splat.green, splat.blue});
  return largest;
}

}  // namespace vrpipe::testing
