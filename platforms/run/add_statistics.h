#pragma once

#include <string>

#include <vrpipe/component/statistic.h>
#include <vrpipe/platforms/gpu.h>

namespace vrpipe {

// Statistics go to a StatisticCollector at the end of a run, to a StatisticSampler in its course.

/// Those of a unit: of its functional model, and of the one that gives it ports and time.
template <class Statistics>
void add_statistics(const Instance& instance, const Behaviour& behaviour, const Component& unit,
                    Statistics& statistics) {
  statistics.add(instance.slot, instance.path, behaviour.unit());
  statistics.add(instance.slot, instance.path, unit);
}

/// Those of a memory of another make that has any.
template <class Statistics>
void add_statistics(const std::string& path, const sc_core::sc_module& memory, Statistics& statistics) {
  if (const auto* const set = dynamic_cast<const StatisticSet*>(&memory)) statistics.add(path, path, *set);
}

template <class Statistics>
void add_statistics(const Gpu& gpu, Statistics& statistics) {
  for (const Gpu::Placed& placed : gpu.units()) {
    add_statistics(*placed.instance, *placed.behaviour, *placed.unit, statistics);
  }
  for (const Gpu::PlacedMemory& placed : gpu.memories()) {
    const Instance& instance = *placed.instance;
    statistics.add(instance.slot, instance.path, placed.memory->behaviour().unit());
    statistics.add(instance.slot, instance.path, placed.memory->statistics());
  }
  for (const Gpu::PlacedForeign& placed : gpu.foreign_memories()) {
    add_statistics(placed.instance->path, *placed.module, statistics);
  }
}

}  // namespace vrpipe
