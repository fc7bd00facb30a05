// A testbench of the counting ROP. The plugin is linked: its classes have names here, and its units are registered.
#include <cstdio>
#include <stdexcept>

#include <vrpipe/testkit/bench.h>

#include "counting_rop.h"

int main() try {
  vrpipe::Draw draw;
  draw.width = draw.height = 16;
  vrpipe::RenderContext context;
  context.frame = vrpipe::Frame::of(draw);
  vrpipe::testkit::Bench bench("crop", "counting-rop", context, {{"cache_bytes", "8192"}});

  // The same opaque quad twice: the second changes nothing.
  vrpipe::ShadedWarp warp;
  vrpipe::ColorBeat beat;
  for (unsigned i = 0; i < 2; ++i) {
    warp.position[i] = 5;
    warp.live[i] = 0xf;
    warp.first_primitive[i] = warp.last_primitive[i] = i;
    for (vrpipe::Lanes* channel :
         {&warp.color[i].red, &warp.color[i].green, &warp.color[i].blue, &warp.color[i].alpha}) {
      *channel = vrpipe::splat_lanes(1.0F);
    }
    beat.quads[beat.count++] = {&warp, i};
  }
  warp.count = 2;
  bench.source<vrpipe::ColorBeat>("in_color").add(beat);
  bench.run();

  using Rop = CountingRop<vrpipe::ColorFormat::rgba16f, vrpipe::BlendRounding::rne>;
  const Rop& rop = bench.behaviour<Rop>();
  if (rop.quads_blended.value() != 2 || rop.quads_unchanged.value() != 1) throw std::runtime_error("unexpected counts");
  std::puts("counting-rop: one of two blends changes nothing");
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "counting_rop_bench: %s\n", error.what());
  return 1;
}
