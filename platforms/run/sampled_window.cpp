#include "run/sampled_window.h"

#include "elaboration/untimed_gpu.h"

namespace vrpipe {

namespace {

/// When a count that is looked at now and then reaches a value.
class Passing {
 public:
  explicit Passing(double value) : value_(value) {}
  bool has_been() const { return has_been_; }
  double cycle() const { return cycle_; }
  /// Between two looks it goes on evenly.
  void look(double count, double cycle) {
    if (!has_been_ && count >= value_) {
      has_been_ = true;
      const double share = count > count_before_ ? (count - value_) / (count - count_before_) : 0;
      cycle_ = cycle - share * (cycle - cycle_before_);
    }
    count_before_ = count;
    cycle_before_ = cycle;
  }

 private:
  double value_;
  double cycle_ = 0;
  double count_before_ = 0, cycle_before_ = 0;
  bool has_been_ = false;
};

/// Quads that nobody does anything with any more.
std::uint64_t retired(const Counts& counts) {
  return counts.quads_depth_stencil_failed + counts.quads_terminated + counts.quads_unshaded + counts.quads_pruned +
         counts.quads_merged + counts.quads_dropped_late + counts.quads_late_failed + counts.quads_unblended +
         counts.quads_blended;
}

}  // namespace

SampledWindow::SampledWindow(const RunRequest& request, const Frame& part, Range range, const UntimedGpu& before,
                             Framebuffer& drawn)
    : range_(range),
      configuration_(request, part, before.configuration()),
      gpu_(configuration_, drawn),
      progress_(gpu_) {
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
  Measured measured;
  const double to = range_.from + range_.quads;
  Passing in_from(range_.from), in_to(to), out_from(range_.from), out_to(to);
  gpu_.clock().look_between_edges(looks_every, [&](Cycle now) {
    const Counts counts = progress_.counts();
    const auto in = static_cast<double>(counts.quads_rasterized);
    const auto out = static_cast<double>(retired(counts));
    const auto cycle = static_cast<double>(now);
    for (Passing* const passing : {&in_from, &in_to}) passing->look(in, cycle);
    for (Passing* const passing : {&out_from, &out_to}) passing->look(out, cycle);
    if (!in_from.has_been()) measured.primitives_from = counts.primitives;
    if (!in_to.has_been()) measured.primitives_to = counts.primitives;
    if (!range_.to_end && out_to.has_been()) gpu_.clock().stop_at(now + 1);
    return now + looks_every;
  });
  const auto end = static_cast<double>(gpu_.run(nullptr));
  measured.kernel_events = gpu_.clock().activations();
  if (range_.from > 0) measured.cycle_from = (in_from.cycle() + out_from.cycle()) / 2;
  measured.delay_growth = (out_to.cycle() - in_to.cycle()) - (out_from.cycle() - in_from.cycle());
  measured.cycle_to = range_.to_end ? end : (in_to.cycle() + out_to.cycle()) / 2;
  measured.is_whole = out_from.has_been() && (range_.to_end || out_to.has_been());
  return measured;
}

}  // namespace vrpipe
