#pragma once

#include "crop/in_shader.h"
#include "support/fidelities.h"

namespace vrpipe::testing {

/// A shader that blends, with a source of warps, as they come from PROP, and a memory.
struct InShaderBench {
  /// `latency`: of a load or a store, in cycles, at least 2.
  InShaderBench(Fidelity fidelity, const RenderContext& context, const testkit::Bench::Settings& settings = {},
                unsigned latency = 100)
      : bench(fidelity, "crop", "in-shader", context, settings),
        memory("memory", bench.clock(), latency - 1, 4096, 1) {  // the last cycle moves the bytes
    bench.bind_memory(memory.port(0));
    if (fidelity == Fidelity::cycle) {
      beats = &bench.source<ColorBeat>("in_color", 64);
    } else {
      items = &bench.source<ShadedWarpItem>("in_color", 64);
    }
  }

  struct Quad {
    unsigned position;
    float alpha;
    LaneMask live = all_lanes;
  };
  /// A warp of a primitive.
  void warp(TileId tile, const std::vector<Quad>& quads, Cycle earliest = 0) {
    ShadedWarp& made = taken();
    made.tile = tile;
    for (const Quad& quad : quads) {
      const unsigned i = made.count++;
      made.position[i] = static_cast<std::uint8_t>(quad.position);
      made.live[i] = quad.live;
      made.first_primitive[i] = made.last_primitive[i] = primitive++;
      made.draw[i] = 0;
      made.color[i] = color_of(quad.alpha, quad.alpha, quad.alpha, quad.alpha);
    }
    if (items != nullptr) items->add({&made}, earliest);
    for (unsigned i = 0; beats != nullptr && i < made.count;) {
      ColorBeat beat;
      while (i < made.count && beat.count < ColorBeat::capacity) beat.quads[beat.count++] = {&made, i++};
      beats->add(beat, earliest);
    }
  }
  void mark(Mark mark) {
    ShadedWarp& made = taken();
    made.mark = mark;
    ColorBeat beat;
    beat.mark = mark;
    if (items != nullptr) items->add({&made});
    if (beats != nullptr) beats->add(beat);
  }
  /// The cycles of the frame, `never` if it did not end.
  Cycle run() {
    mark(Mark::end_of_frame);
    bench.run();
    return bench.unit().end_of_frame();
  }
  std::uint64_t lost() { return bench.behaviour<InShaderBlending>().updates_lost.value(); }
  float alpha(TileId tile, unsigned position, unsigned lane = 0) {
    return bench.surface().quad(tile, position).alpha[lane];
  }

  testkit::Bench bench;
  FixedLatencyMemory memory;
  testkit::Source<ShadedWarpItem>* items = nullptr;
  testkit::Source<ColorBeat>* beats = nullptr;
  ShadedWarpPool pool;
  std::uint32_t primitive = 0;

 private:
  ShadedWarp& taken() {
    ShadedWarp& made = pool.take();
    made.count = 0;
    made.mark = Mark::none;
    return made;
  }
};

}  // namespace vrpipe::testing
