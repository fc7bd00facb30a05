#include "run/frame_progress.h"

#include <numeric>

#include "elaboration/untimed_gpu.h"

#include <vrpipe/platforms/gpu.h>

namespace vrpipe {

namespace {

struct CounterName {
  const char* slot;
  const char* name;
};
/// What may bound a frame at one place or another, in the order of SampledWork.
constexpr std::array<CounterName, counted_work_kinds> work_names{{{"raster", "raster_tiles_tested"},
                                                                  {"raster", "raster_tiles_kept"},
                                                                  {"raster", "screen_tile_pairs"},
                                                                  {"raster", "setups"},
                                                                  {"sm", "fragment_warps"},
                                                                  {"crop", "quads_blended"}}};

}  // namespace

FrameProgress::FrameProgress(const UntimedGpu& gpu) {
  for (const UntimedGpu::Placed& placed : gpu.units()) add(placed.instance->slot, placed.unit->behaviour());
}

FrameProgress::FrameProgress(const Gpu& gpu) {
  for (const Gpu::Placed& placed : gpu.units()) add(placed.instance->slot, *placed.behaviour);
}

void FrameProgress::add(const std::string& slot, const Behaviour& behaviour) {
  behaviours_.push_back(&behaviour.unit());
  for (const DrawCounter* const counter : behaviours_.back()->draw_counters()) {
    if (slot == "raster" && counter->name() == std::string("quads_rasterized")) quads_.push_back(counter);
  }
  for (const Counter* const counter : behaviours_.back()->counters()) {
    const auto is = [&](const CounterName& name) { return slot == name.slot && counter->name() == name.name; };
    if (is({"draw", "splats"})) splats_.push_back(counter);
    if (is({"raster", "setups"})) setups_.push_back(counter);
    if (is({"tgc", "entries"})) entries_.push_back(counter);
    for (std::size_t kind = 0; kind < work_names.size(); ++kind) {
      if (is(work_names[kind])) work_[kind].push_back(counter);
    }
  }
}

std::uint64_t FrameProgress::rasterized_before(DrawIndex draw) const {
  std::uint64_t sum = 0;
  for (const DrawCounter* const counter : quads_) {
    const std::vector<std::uint64_t>& of_draw = counter->of_draw();
    sum = std::accumulate(of_draw.begin(), of_draw.begin() + draw, sum);
  }
  return sum;
}

Counts FrameProgress::counts() const {
  Counts counts;
  for (const Behaviour* const behaviour : behaviours_) behaviour->add_to(counts, CountOf());
  return counts;
}

SampledWork FrameProgress::work() const {
  SampledWork work{};
  for (std::size_t kind = 0; kind < work_.size(); ++kind) work[kind] = static_cast<double>(sum(work_[kind]));
  return work;
}

}  // namespace vrpipe
