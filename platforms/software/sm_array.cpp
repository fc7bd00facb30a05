#include "software/sm_array.h"

#include <algorithm>
#include <functional>
#include <queue>
#include <utility>

namespace vrpipe {

namespace {

/// A scheduler in the time of its own: `served` is what each of its warps has been given since the beginning.
class FluidScheduler {
 public:
  FluidScheduler(double rate, double warp_rate) : rate_(rate), warp_rate_(warp_rate) {}
  bool idle() const { return ends_.empty(); }
  /// Cycle in which the next of its warps has been given all; not idle.
  double next_end() const { return now_ + (ends_.top().first - served_) / rate_of_each(); }

  /// A warp of a resident block has that much to do from now on.
  void begin(double now, std::uint64_t instructions, std::size_t place) {
    if (!idle()) served_ += (now - now_) * rate_of_each();
    now_ = now;
    ends_.push({served_ + static_cast<double>(instructions), place});
  }
  /// The block of the warp of next_end(), which goes.
  std::size_t end() {
    now_ = next_end();
    const auto [served, place] = ends_.top();
    served_ = served;
    ends_.pop();
    return place;
  }

 private:
  using End = std::pair<double, std::size_t>;  ///< served, by when a warp of a resident block has been given all
  double rate_of_each() const { return std::min(warp_rate_, rate_ / static_cast<double>(ends_.size())); }

  double rate_, warp_rate_;
  double now_ = 0, served_ = 0;
  std::priority_queue<End, std::vector<End>, std::greater<>> ends_;
};

struct FluidCore {
  struct Resident {
    const BlockWork* block = nullptr;
    std::size_t batch = 0;
    std::uint32_t running = 0;  ///< warps before the barrier
  };
  std::vector<FluidScheduler> schedulers;
  std::vector<Resident> residents;

  void begin_batch(double now, std::size_t place) {
    Resident& resident = residents[place];
    const BlockWork& block = *resident.block;
    for (std::uint32_t warp = 0; warp < block.warps; ++warp) {
      schedulers[warp % schedulers.size()].begin(now, block.instructions[resident.batch * block.warps + warp], place);
    }
    resident.running = block.warps;
  }
};

}  // namespace

SmArray::SmArray(const SmBehaviour::TimingParameters& array, const RenderBehaviour::TimingParameters& kernel)
    : cores_(array.cores),
      blocks_per_core_(kernel.blocks_per_core),
      schedulers_(array.schedulers_per_core),
      scheduler_rate_(double{1} * kernel.issue_thousandths / array.cycles_per_instruction()),
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
  return {static_cast<double>(all) / (scheduler_rate_ * static_cast<double>(cores_ * schedulers_)),
          static_cast<double>(longest) / warp_rate_};
}

double SmArray::fluid(const std::vector<BlockWork>& blocks) const {
  std::vector<FluidCore> cores(cores_);
  std::size_t next = 0;
  const auto give = [&](FluidCore& core, double now, std::size_t place) {
    while (next < blocks.size() && blocks[next].instructions.empty()) ++next;
    if (next == blocks.size()) return;
    core.residents[place] = {&blocks[next++], 0, 0};
    core.begin_batch(now, place);
  };
  for (FluidCore& core : cores) {
    core.schedulers.assign(schedulers_, FluidScheduler(scheduler_rate_, warp_rate_));
    core.residents.resize(blocks_per_core_);
  }
  for (std::size_t place = 0; place < blocks_per_core_; ++place) {
    for (FluidCore& core : cores) give(core, 0, place);
  }
  double now = 0;
  for (;;) {
    FluidCore* core = nullptr;
    FluidScheduler* first = nullptr;
    double end = 0;
    for (FluidCore& each : cores) {
      for (FluidScheduler& scheduler : each.schedulers) {
        if (scheduler.idle()) continue;
        const double its_end = scheduler.next_end();
        if (first != nullptr && its_end >= end) continue;
        core = &each;
        first = &scheduler;
        end = its_end;
      }
    }
    if (first == nullptr) return now;
    now = end;
    const std::size_t place = first->end();
    FluidCore::Resident& resident = core->residents[place];
    if (--resident.running > 0) continue;
    if (++resident.batch < resident.block->batches()) {
      core->begin_batch(now, place);
    } else {
      give(*core, now, place);
    }
  }
}

}  // namespace vrpipe
