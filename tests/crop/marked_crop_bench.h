#pragma once

#include <cstdint>

#include "support/fidelities.h"

namespace vrpipe::testing {

/// CROP with a slow memory and a source of warps of one quad, and of marks.
struct MarkedCropBench {
  MarkedCropBench(Fidelity fidelity, const RenderContext& context, const testkit::Bench::Settings& settings = {})
      : bench(fidelity, "crop", "color-rop", context, settings) {
    bench.set_memory(300, 4);
    if (fidelity == Fidelity::cycle) {
      beats = &bench.source<ColorBeat>("in_color", 7);
    } else {
      items = &bench.source<ShadedWarpItem>("in_color", 7);
    }
  }
  void quad(DrawIndex draw, TileId tile, unsigned position, float alpha) {
    ShadedWarp& warp = pool.take();
    warp.tile = tile;
    warp.count = 1;
    warp.mark = Mark::none;
    warp.position[0] = static_cast<std::uint8_t>(position);
    warp.live[0] = all_lanes;
    warp.first_primitive[0] = warp.last_primitive[0] = next_primitive++;
    warp.draw[0] = draw;
    warp.color[0] = color_of(alpha, alpha, alpha, alpha);
    ColorBeat beat;
    beat.count = 1;
    beat.quads[0] = {&warp, 0};
    send(warp, beat);
  }
  void mark(Mark mark) {
    ShadedWarp& warp = pool.take();
    warp.count = 0;
    warp.mark = mark;
    ColorBeat beat;
    beat.mark = mark;
    send(warp, beat);
  }

  testkit::Bench bench;

 private:
  void send(const ShadedWarp& warp, const ColorBeat& beat) {
    if (items != nullptr) items->add({&warp});
    if (beats != nullptr) beats->add(beat);
  }

  testkit::Source<ShadedWarpItem>* items = nullptr;
  testkit::Source<ColorBeat>* beats = nullptr;
  ShadedWarpPool pool;
  std::uint32_t next_primitive = 0;
};

}  // namespace vrpipe::testing
