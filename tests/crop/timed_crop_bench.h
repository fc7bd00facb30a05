#pragma once

#include "support/fidelities.h"

namespace vrpipe::testing {

using testkit::Bench;
using testkit::Sink;
using testkit::Source;

/// CROP with a source of warps and a memory around it.
struct TimedCropBench {
  /// `latency`: of a fill, in cycles, at least 2.
  TimedCropBench(Fidelity fidelity, const RenderContext& context, const Bench::Settings& settings = {},
                 unsigned latency = 100, unsigned depth = 7, unsigned signal_depth = 64)
      : bench(fidelity, "crop", "color-rop", context, settings),
        memory("memory", bench.clock(), latency - 1, 4096, 1),  // the last cycle moves the bytes
        signals(bench.sink<TerminationBeat>("out_terminations", signal_depth)),
        width(static_cast<unsigned>(64 / (4 * bytes_per_pixel(context.format)))) {
    bench.bind_memory(memory.port(0));
    if (fidelity == Fidelity::cycle) {
      beats = &bench.source<ColorBeat>("in_color", depth);
      beats->set_rate(1);
    } else {
      items = &bench.source<ShadedWarpItem>("in_color", depth);
    }
  }

  /// Adds a quad to the warp in hand, which goes when it is full.
  void quad(TileId tile, unsigned position, float alpha = 0.01F, LaneMask live = all_lanes, Cycle earliest = 0) {
    if (warp != nullptr && warp->tile != tile) flush(earliest);
    if (warp == nullptr) {
      warp = &pool.take();
      ++taken;
      warp->tile = tile;
      warp->count = 0;
      warp->mark = Mark::none;
    }
    const unsigned i = warp->count++;
    warp->position[i] = static_cast<std::uint8_t>(position);
    warp->live[i] = live;
    warp->first_primitive[i] = warp->last_primitive[i] = next_quad++ / quads_of_a_primitive;
    warp->color[i] = color_of(alpha, alpha, alpha, alpha);
    if (warp->count == quads_per_warp) flush(earliest);
  }
  /// Sends the warp in hand, as many quads a cycle as the format lets PROP hand on.
  void flush(Cycle earliest = 0) {
    if (warp == nullptr) return;
    const unsigned cycles = (warp->count + width - 1) / width;
    if (items != nullptr) items->add({warp}, {earliest, earliest + cycles - 1}, cycles);
    for (unsigned i = 0; beats != nullptr && i < warp->count;) {
      ColorBeat beat;
      while (i < warp->count && beat.count < width) beat.quads[beat.count++] = {warp, i++};
      beats->add(beat, earliest);
    }
    warp = nullptr;
  }
  /// The cycles of the draw, `never` if it did not end.
  Cycle run() {
    flush();
    end_mark.mark = Mark::end_of_frame;
    ColorBeat last;
    last.mark = Mark::end_of_frame;
    if (items != nullptr) items->add({&end_mark});
    if (beats != nullptr) beats->add(last);
    bench.run();
    return bench.unit().end_of_frame();
  }

  Bench bench;
  FixedLatencyMemory memory;
  Sink<TerminationBeat>& signals;
  Source<ShadedWarpItem>* items = nullptr;
  Source<ColorBeat>* beats = nullptr;
  const unsigned width;
  ShadedWarp* warp = nullptr;  ///< in hand
  ShadedWarp end_mark;
  ShadedWarpPool pool;
  unsigned taken = 0;  ///< warps, from the pool
  std::uint32_t next_quad = 0;
  std::uint32_t quads_of_a_primitive = 1;
};

}  // namespace vrpipe::testing
