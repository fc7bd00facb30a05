#include "software/sm_array.h"

#include <algorithm>
#include <functional>
#include <queue>
#include <utility>

namespace vrpipe {

namespace {

/// A core in the time of its own: `served` is what each of its warps has been given since the beginning.
struct FluidCore {
  struct Resident {
    const BlockWork* block = nullptr;
    std::size_t batch = 0;
    std::uint32_t running = 0;  ///< warps before the barrier
  };
  using End = std::pair<std::uint64_t, std::size_t>;  ///< served, by when a warp of a resident block is at the barrier
  std::priority_queue<End, std::vector<End>, std::greater<>> ends;
  std::vector<Resident> residents;
  std::uint64_t served = 0;
  double now = 0;

  void begin_batch(std::size_t place) {
    Resident& resident = residents[place];
    const BlockWork& block = *resident.block;
    for (std::uint32_t warp = 0; warp < block.warps; ++warp) {
      ends.push({served + block.instructions[resident.batch * block.warps + warp], place});
    }
    resident.running = block.warps;
  }
};

}  // namespace

SmArray::SmArray(const SmBehaviour::TimingParameters& array, const RenderBehaviour::TimingParameters& kernel)
    : cores_(array.cores),
      blocks_per_core_(kernel.blocks_per_core),
      core_rate_(double{1} * array.schedulers_per_core * kernel.issue_thousandths / array.cycles_per_instruction()),
      warp_rate_(1000.0 / kernel.warp_interval_cycles) {}

SmArray::Least SmArray::least(const std::vector<BlockWork>& blocks) const {
  std::uint64_t all = 0;
  std::uint64_t longest = 0;
  for (const BlockWork& block : blocks) {
    std::uint64_t length = 0;
    for (std::size_t batch = 0; batch < block.batches(); ++batch) {
      std::uint64_t most = 0;
      for (std::uint32_t warp = 0; warp < block.warps; ++warp) {
        const std::uint64_t instructions = block.instructions[batch * block.warps + warp];
        all += instructions;
        most = std::max(most, instructions);
      }
      length += most;
    }
    longest = std::max(longest, length);
  }
  return {static_cast<double>(all) / (core_rate_ * static_cast<double>(cores_)),
          static_cast<double>(longest) / warp_rate_};
}

double SmArray::fluid(const std::vector<BlockWork>& blocks) const {
  std::vector<FluidCore> cores(cores_);
  std::size_t next = 0;
  const auto give = [&](FluidCore& core, std::size_t place) {
    while (next < blocks.size() && blocks[next].instructions.empty()) ++next;
    if (next == blocks.size()) return;
    core.residents[place] = {&blocks[next++], 0, 0};
    core.begin_batch(place);
  };
  for (FluidCore& core : cores) core.residents.resize(blocks_per_core_);
  for (std::size_t place = 0; place < blocks_per_core_; ++place) {
    for (FluidCore& core : cores) give(core, place);
  }
  const auto next_end = [&](const FluidCore& core) {
    const double rate = std::min(warp_rate_, core_rate_ / static_cast<double>(core.ends.size()));
    return core.now + static_cast<double>(core.ends.top().first - core.served) / rate;
  };
  double end = 0;
  for (;;) {
    FluidCore* first = nullptr;
    double at = 0;
    for (FluidCore& core : cores) {
      if (core.ends.empty()) continue;
      const double ends_at = next_end(core);
      if (first != nullptr && ends_at >= at) continue;
      first = &core;
      at = ends_at;
    }
    if (first == nullptr) return end;
    end = first->now = at;
    first->served = first->ends.top().first;
    const std::size_t place = first->ends.top().second;
    first->ends.pop();
    FluidCore::Resident& resident = first->residents[place];
    if (--resident.running > 0) continue;
    if (++resident.batch < resident.block->batches()) {
      first->begin_batch(place);
    } else {
      give(*first, place);
    }
  }
}

}  // namespace vrpipe
