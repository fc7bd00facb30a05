#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// What the block of threads of a tile issues. Its warps wait for one another behind each batch.
struct BlockWork {
  std::uint32_t warps = 0;
  /// Of batch `b` and warp `w` at [b * warps + w]: warp instructions, in thousandths.
  std::vector<std::uint64_t> instructions;
  std::uint64_t lane_instructions = 0;  ///< of the lanes that take part in these, in thousandths; 0: of all 32

  std::size_t batches() const { return warps == 0 ? 0 : instructions.size() / warps; }
};

/// Slot `render`: the kernel that renders tiles from their lists, a block of threads each.
class RenderBehaviour : public Behaviour {
 public:
  /// Renders a tile from its list into the surface of use_surfaces(), whole numbers of the stored format or not. Tiles
  /// come in the order of their numbers, each once. What `out` held is replaced.
  virtual void render(std::size_t tile, const std::uint32_t* splats, std::uint32_t length, BlockWork& out) = 0;

  struct TimingParameters {
    std::uint32_t blocks_per_core;       ///< in flight at a time
    std::uint32_t issue_thousandths;     ///< of its issue slots that a scheduler fills at most
    std::uint32_t warp_interval_cycles;  ///< from an instruction of a warp to its next, at least, in the mean
    double launch_microseconds;
  };
  virtual TimingParameters timing() const = 0;
  /// Read from memory and written to it, by what was rendered.
  virtual std::uint64_t bytes() const = 0;

  // An iteration is a warp's look at a splat; each of its 32 lanes blends, stops, is pruned, or is dead: it had stopped
  // before, or is of no pixel of the frame. A warp looks on until all are dead.
  Counter warp_iterations{*this, "warp_iterations", "iterations", "of warps, a splat each"};
  Counter lanes_blending{*this, "lanes_blending", "lanes", "that blend: fragments blended"};
  Counter lanes_stopping{*this, "lanes_stopping", "lanes", "that end without blending"};
  Counter lanes_pruned{*this, "lanes_pruned", "lanes", "alive, for which the splat's alpha is too small"};
  Counter lanes_dead{*this, "lanes_dead", "lanes", "dead, beside one that is alive"};
  Counter iterations_without_blending{*this, "iterations_without_blending", "iterations", "in which no lane blends"};
  Counter batches{*this, "batches", "batches", "of splats, fetched by a warp each"};
  Counter batches_of_dead_warps{*this, "batches_of_dead_warps", "batches", "of these, by warps without a lane alive"};
  Ratio blending{*this,
                 CounterSum(lanes_blending),
                 lanes_blending + lanes_stopping + lanes_pruned + lanes_dead,
                 "blending",
                 "lanes",
                 "that blend, of all in iterations"};

  void check_end() override {
    const std::uint64_t lanes =
        lanes_blending.value() + lanes_stopping.value() + lanes_pruned.value() + lanes_dead.value();
    if (lanes == 32 * warp_iterations.value()) return;
    throw SimulationFault("render", 0, "lanes are not 32 an iteration");
  }
};

}  // namespace vrpipe
