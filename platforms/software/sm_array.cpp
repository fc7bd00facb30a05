#include "software/sm_array.h"

#include <algorithm>
#include <functional>
#include <queue>
#include <utility>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/ring.h>

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

/// A block in flight on a core.
struct ResidentBlock {
  const BlockWork* block = nullptr;
  std::size_t batch = 0;
  std::uint32_t running = 0;  ///< warps before the barrier
};

struct FluidCore {
  std::vector<FluidScheduler> schedulers;
  std::vector<ResidentBlock> residents;

  void begin_batch(double now, std::size_t place) {
    ResidentBlock& resident = residents[place];
    const BlockWork& block = *resident.block;
    for (std::uint32_t warp = 0; warp < block.warps; ++warp) {
      schedulers[warp % schedulers.size()].begin(now, block.instructions[resident.batch * block.warps + warp], place);
    }
    resident.running = block.warps;
  }
};

/// A scheduler that issues in whole cycles.
class ClockedScheduler {
 public:
  struct Rates {
    std::uint64_t issue_thousandths, cycles_per_instruction, warp_interval;
  };
  void begin(std::uint64_t instructions, std::size_t place) { ready_.push({0, instructions, place}); }

  /// One cycle; `ended` gets the places of blocks of which a warp is at the barrier. Gives the next cycle in which there
  /// is anything to do.
  template <class Ended>
  Cycle tick(Cycle now, const Rates& rates, Ended&& ended) {
    for (; !waiting_.empty() && waiting_.front().ready_at <= now; waiting_.pop()) {
      if (waiting_.front().left == 0) {
        ended(waiting_.front().place);
      } else {
        ready_.push(waiting_.front());
      }
    }
    // In parts of a cycle, so that slots are lost evenly.
    if (!ready_.empty() && next_slot_ <= now * rates.issue_thousandths) {
      ClockedWarp warp = ready_.front();
      ready_.pop();
      --warp.left;
      warp.ready_at = now + rates.warp_interval;
      waiting_.push(warp);
      const std::uint64_t least = now == 0 ? 0 : (now - 1) * rates.issue_thousandths + 1;
      next_slot_ = std::max(next_slot_, least) + 1000 * rates.cycles_per_instruction;
    }
    const Cycle slot = (next_slot_ + rates.issue_thousandths - 1) / rates.issue_thousandths;
    const Cycle issue = ready_.empty() ? never : std::max(now + 1, slot);
    return waiting_.empty() ? issue : std::min(issue, waiting_.front().ready_at);
  }

 private:
  struct ClockedWarp {
    Cycle ready_at = 0;
    std::uint64_t left = 0;  ///< instructions to the barrier
    std::size_t place = 0;
  };
  Ring<ClockedWarp> ready_;    ///< the one that has waited the longest in front
  Ring<ClockedWarp> waiting_;  ///< for the instruction before, in the order in which those end
  std::uint64_t next_slot_ = 0;
};

struct ClockedCore {
  std::vector<ClockedScheduler> schedulers;
  std::vector<ResidentBlock> residents;
  std::vector<Cycle> next;         ///< of each scheduler, in which it has anything to do
  std::vector<std::size_t> ended;  ///< places of blocks, a warp each, in a cycle

  void begin_batch(Cycle now, std::size_t place) {
    ResidentBlock& resident = residents[place];
    const BlockWork& block = *resident.block;
    for (std::uint32_t warp = 0; warp < block.warps; ++warp) {
      const std::size_t scheduler = warp % schedulers.size();
      const std::uint64_t thousandths = block.instructions[resident.batch * block.warps + warp];
      schedulers[scheduler].begin(std::max<std::uint64_t>(1, (thousandths + 500) / 1000), place);
      next[scheduler] = std::min(next[scheduler], now);
    }
    resident.running = block.warps;
  }
};

/// No block is left for a core that has none.
template <class Core>
bool is_empty(const Core& core) {
  return std::all_of(core.residents.begin(), core.residents.end(),
                     [](const ResidentBlock& each) { return each.block == nullptr; });
}

}  // namespace

SmArray::SmArray(const SmTime& array, const RenderBehaviour::TimingParameters& kernel)
    : cores_(array.cores),
      blocks_per_core_(kernel.blocks_per_core),
      schedulers_(array.schedulers_per_core),
      scheduler_rate_(double{1} * kernel.issue_thousandths / array.cycles_per_instruction()),
      warp_rate_(1000.0 / kernel.warp_interval_cycles),
      issue_thousandths_(kernel.issue_thousandths),
      cycles_per_instruction_(array.cycles_per_instruction()),
      warp_interval_(kernel.warp_interval_cycles) {}

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

double SmArray::fluid(const std::vector<BlockWork>& blocks, double* core_cycles) const {
  std::vector<FluidCore> cores(cores_);
  std::size_t next = 0;
  const auto give = [&](FluidCore& core, double now, std::size_t place) {
    while (next < blocks.size() && blocks[next].instructions.empty()) ++next;
    if (next == blocks.size()) return;
    core.residents[place] = {&blocks[next++], 0, 0};
    core.begin_batch(now, place);
  };
  if (core_cycles != nullptr) *core_cycles = 0;
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
    ResidentBlock& resident = core->residents[place];
    if (--resident.running > 0) continue;
    if (++resident.batch < resident.block->batches()) {
      core->begin_batch(now, place);
    } else {
      resident.block = nullptr;
      give(*core, now, place);
      if (core_cycles != nullptr && is_empty(*core)) *core_cycles += now;
    }
  }
}

std::uint64_t SmArray::clocked(const std::vector<BlockWork>& blocks, double* core_cycles) const {
  std::vector<ClockedCore> cores(cores_);
  std::size_t next_block = 0;
  const auto give = [&](ClockedCore& core, Cycle now, std::size_t place) {
    while (next_block < blocks.size() && blocks[next_block].instructions.empty()) ++next_block;
    if (next_block == blocks.size()) return false;
    core.residents[place] = {&blocks[next_block++], 0, 0};
    core.begin_batch(now, place);
    return true;
  };
  for (ClockedCore& core : cores) {
    core.schedulers.resize(schedulers_);
    core.next.assign(schedulers_, never);
    core.residents.resize(blocks_per_core_);
  }
  for (std::size_t place = 0; place < blocks_per_core_; ++place) {
    for (ClockedCore& core : cores) give(core, 0, place);
  }
  if (core_cycles != nullptr) *core_cycles = 0;
  const ClockedScheduler::Rates rates{issue_thousandths_, cycles_per_instruction_, warp_interval_};
  Cycle now = 0;
  for (;;) {
    Cycle next = never;
    for (ClockedCore& core : cores) {
      for (std::size_t i = 0; i < schedulers_; ++i) {
        if (core.next[i] <= now) {
          core.next[i] = core.schedulers[i].tick(now, rates, [&](std::size_t place) { core.ended.push_back(place); });
        }
        next = std::min(next, core.next[i]);
      }
    }
    // What begins now is seen by all schedulers in the next cycle.
    for (ClockedCore& core : cores) {
      for (const std::size_t place : core.ended) {
        ResidentBlock& resident = core.residents[place];
        if (--resident.running > 0) continue;
        if (++resident.batch < resident.block->batches()) {
          core.begin_batch(now + 1, place);
        } else {
          resident.block = nullptr;
          if (!give(core, now + 1, place)) {
            if (core_cycles != nullptr && is_empty(core)) *core_cycles += static_cast<double>(now);
            continue;
          }
        }
        next = now + 1;
      }
      core.ended.clear();
    }
    if (next == never) return now;
    now = next;
  }
}

}  // namespace vrpipe
