#include <vrpipe/pipeline/order_monitor.h>

#include <fmt/format.h>

namespace vrpipe {

void BlendOrderMonitor::fault(const ShadedWarp& warp, unsigned index, std::uint32_t next, std::uint64_t cycle) {
  throw SimulationFault("crop", cycle,
                        fmt::format("primitive {} is blended after primitive {} in tile {},{} position {}",
                                    warp.first_primitive[index], next - 1, warp.tile.x, warp.tile.y,
                                    warp.position[index]));
}

}  // namespace vrpipe
