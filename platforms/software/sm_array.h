#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/slots/render.h>
#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

/// The time that blocks of threads take on an SM array. The warps of a block are spread over the schedulers of its core; a
/// scheduler issues for all of its warps together so many instructions a cycle at most, each has the same share of them, and
/// none gets more than its dependent instructions allow; warps of a block wait for one another behind each batch. A
/// fluid: no instruction has a cycle of its own.
class SmArray {
 public:
  SmArray(const SmTime& array, const RenderBehaviour::TimingParameters& kernel);

  /// Cycles that no schedule of the blocks can undercut: that of all their instructions, and that of the longest block.
  struct Least {
    double issue = 0;
    double longest_block = 0;
  };
  Least least(const std::vector<BlockWork>& blocks) const;

  /// Cycles until the last block is done. Blocks are given to cores in their order: at first to each core in turn, then
  /// to the core that has room first.
  /// @param core_cycles  where told: cycles in which a core has blocks, of all cores
  double fluid(const std::vector<BlockWork>& blocks, double* core_cycles = nullptr) const;

  /// The same with every instruction in a cycle of its own: of the warps of a scheduler that may issue, the one that has
  /// waited the longest does. A barrier takes a cycle. Instructions are rounded to whole ones for each warp and batch.
  std::uint64_t clocked(const std::vector<BlockWork>& blocks, double* core_cycles = nullptr) const;

 private:
  std::size_t cores_;
  std::size_t blocks_per_core_;
  std::size_t schedulers_;  ///< of a core
  double scheduler_rate_;   ///< thousandths of instructions a cycle
  double warp_rate_;
  std::uint64_t issue_thousandths_;
  std::uint64_t cycles_per_instruction_;  ///< of a scheduler
  std::uint64_t warp_interval_;           ///< cycles
};

}  // namespace vrpipe
