#include "run/conservation.h"

#include <string>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

namespace vrpipe {

void check_conservation(const Counts& c) {
  const auto check = [](const char* what, std::uint64_t in, std::uint64_t out) {
    if (in == out) return;
    throw SimulationFault("conservation", 0, fmt::format("{}: {} went in, {} came out", what, in, out));
  };
  check("quads rasterized = depth_stencil_failed + terminated + unshaded + shaded", c.quads_rasterized,
        c.quads_depth_stencil_failed + c.quads_terminated + c.quads_unshaded + c.quads_shaded);
  check("fragments rasterized = depth_stencil_failed + terminated + unshaded + shaded", c.fragments_rasterized,
        c.fragments_depth_stencil_failed + c.fragments_terminated + c.fragments_unshaded + c.fragments_shaded);
  check("quads shaded = pruned + merged + dropped_late + late_failed + unblended + blended", c.quads_shaded,
        c.quads_pruned + c.quads_merged + c.quads_dropped_late + c.quads_late_failed + c.quads_unblended +
            c.quads_blended);
  check("fragments shaded = pruned + merged + dropped_late + late_failed + unblended + blended", c.fragments_shaded,
        c.fragments_pruned + c.fragments_merged + c.fragments_dropped_late + c.fragments_late_failed +
            c.fragments_unblended + c.fragments_blended);
}

namespace {

/// What units and memories have asked a memory for is what it delivered. `asked_by` gives that of a path.
template <class AskedBy>
void check_conservation(const Netlist& netlist, const std::string& memory, const MemoryBytes& delivered,
                        const AskedBy& asked_by) {
  MemoryBytes asked;
  for (const std::string& path : netlist.bound_to(memory)) asked += asked_by(path);
  const auto check = [&](const char* what, std::uint64_t wanted, std::uint64_t moved) {
    if (wanted == moved) return;
    throw SimulationFault("conservation", 0,
                          fmt::format("bytes {} {}: {} asked for, {} delivered", what, memory, wanted, moved));
  };
  check("read from", asked.read, delivered.read);
  check("written to", asked.written, delivered.written);
}

}  // namespace

void check_conservation(const Gpu& gpu, const Netlist& netlist) {
  const auto asked_by = [&](const std::string& path) -> MemoryBytes {
    for (const Gpu::Placed& placed : gpu.units()) {
      if (placed.instance->path == path) return placed.unit->memory_bytes();
    }
    for (const Gpu::PlacedMemory& placed : gpu.memories()) {
      if (placed.instance->path == path) return placed.memory->memory_bytes();
    }
    return {};
  };
  for (const Gpu::PlacedMemory& placed : gpu.memories()) {
    check_conservation(netlist, placed.instance->path, placed.memory->delivered(), asked_by);
  }
}

void check_conservation(const UntimedGpu& gpu, const Netlist& netlist) {
  const auto asked_by = [&](const std::string& path) -> MemoryBytes {
    for (const UntimedGpu::Placed& placed : gpu.units()) {
      if (placed.instance->path == path && placed.unit->memory_port() != nullptr)
        return placed.unit->memory_port()->moved();
    }
    for (const UntimedGpu::PlacedMemory& placed : gpu.memories()) {
      if (placed.instance->path == path) return placed.memory->memory_bytes();
    }
    return {};
  };
  for (const UntimedGpu::PlacedMemory& placed : gpu.memories()) {
    check_conservation(netlist, placed.instance->path, placed.memory->delivered(), asked_by);
  }
}

}  // namespace vrpipe
