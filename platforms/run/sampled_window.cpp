#include "run/sampled_window.h"

#include <algorithm>
#include <vector>

#include "elaboration/untimed_gpu.h"

namespace vrpipe {

namespace {

struct Look {
  double cycle = 0;
  double in = 0, out = 0;  ///< quads that the rasteriser, and the end of the pipeline, had passed
  std::uint64_t primitives = 0;
};
/// When a count reached a value; between two looks it goes on evenly.
double cycle_at(const std::vector<Look>& looks, double Look::*count, double value) {
  const auto next = std::find_if(looks.begin(), looks.end(), [&](const Look& look) { return look.*count >= value; });
  if (next == looks.begin() || next == looks.end()) return next == looks.end() ? looks.back().cycle : 0;
  const Look& before = *(next - 1);
  return next->cycle - ((*next).*count - value) / ((*next).*count - before.*count) * (next->cycle - before.cycle);
}
/// Primitives before quads of the rasteriser.
std::uint64_t primitives_at(const std::vector<Look>& looks, double quads) {
  std::uint64_t primitives = 0;
  for (const Look& look : looks) {
    if (look.in < quads) primitives = look.primitives;
  }
  return primitives;
}

/// Quads that nobody does anything with any more.
std::uint64_t retired(const Counts& counts) {
  return counts.quads_depth_stencil_failed + counts.quads_terminated + counts.quads_unshaded + counts.quads_pruned +
         counts.quads_merged + counts.quads_dropped_late + counts.quads_late_failed + counts.quads_unblended +
         counts.quads_blended;
}

}  // namespace

SampledWindow::SampledWindow(const RunRequest& request, const Frame& rest, Range range, const UntimedGpu& before,
                             Framebuffer& drawn)
    : range_(range),
      configuration_(request, rest, before.configuration()),
      gpu_(configuration_, drawn),
      progress_(gpu_) {
  for (const Gpu::Placed& placed : gpu_.units()) {
    if (UntimedUnit* const held = before.unit(placed.instance->path))
      placed.unit->behaviour().hold_as(held->behaviour().unit());
  }
  for (const Gpu::PlacedMemory& placed : gpu_.memories()) {
    if (const MemoryBehaviour* const held = before.memory(placed.instance->path))
      placed.memory->behaviour().hold_as(*held);
  }
  measured_ = std::async(std::launch::async, [this] { return measure(); });
}

/// Passes of the rasteriser and of the end of the pipeline, whose mean each is: the one alone would see what is between them fill
/// and empty.
SampledWindow::Measured SampledWindow::measure() {
  constexpr Cycle looks_every = 64;
  std::vector<Look> looks(1);
  std::optional<double> from;
  if (!range_.around) from = range_.from;
  gpu_.clock().look_between_edges(looks_every, [&](Cycle now) {
    const Counts counts = progress_.counts();
    looks.push_back({static_cast<double>(now), static_cast<double>(counts.quads_rasterized),
                     static_cast<double>(retired(counts)), counts.primitives});
    if (!from) {
      const auto before = static_cast<double>(progress_.rasterized_before(*range_.around));
      if (looks.back().in > before) from = std::max(0.0, before - range_.quads / 2);
    }
    if (from && !range_.to_end && looks.back().out >= *from + range_.quads) gpu_.clock().stop_at(now + 1);
    return now + looks_every;
  });
  const auto end = static_cast<double>(gpu_.run(nullptr));
  Measured measured;
  measured.kernel_events = gpu_.clock().activations();
  if (!from) return measured;
  measured.from = *from;
  measured.to = *from + range_.quads;
  const auto in = [&](double quads) { return cycle_at(looks, &Look::in, quads); };
  const auto out = [&](double quads) { return cycle_at(looks, &Look::out, quads); };
  const double in_from = in(measured.from), in_to = in(measured.to);
  const double out_from = out(measured.from), out_to = out(measured.to);
  measured.primitives_from = primitives_at(looks, measured.from);
  measured.primitives_to = primitives_at(looks, measured.to);
  if (measured.from > 0) measured.cycle_from = (in_from + out_from) / 2;
  measured.delay_growth = (out_to - in_to) - (out_from - in_from);
  measured.cycle_to = range_.to_end ? end : (in_to + out_to) / 2;
  measured.is_whole = looks.back().out >= (range_.to_end ? measured.from : measured.to);
  return measured;
}

}  // namespace vrpipe
