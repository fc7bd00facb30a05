#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// The stages of an accelerator, in the order in which a step passes them: Gaussians to splats, order, pixels.
enum class AcceleratorStage : std::uint8_t { conversion, sorting, rendering };
constexpr std::size_t accelerator_stages = 3;

/// A part of a frame that goes through the stages as one, a chunk of a tile's list for example: what it takes of each.
struct AcceleratorStep {
  struct Part {
    std::uint64_t items = 0;   ///< Gaussians converted, entries sorted, entries drawn in sub-tiles
    std::uint64_t cycles = 0;  ///< of the stage's units
    std::uint64_t bytes = 0;   ///< read from memory and written to it, beside that
  };
  std::array<Part, accelerator_stages> parts;

  Part& of(AcceleratorStage stage) { return parts[static_cast<std::size_t>(stage)]; }
  const Part& of(AcceleratorStage stage) const { return parts[static_cast<std::size_t>(stage)]; }
};

/// Slot `accelerator`: a unit beside the GPU, or in its place, that draws whole frames of splats. It is in no netlist, as
/// kernels are in none (slots/kernel_work.h), but has a clock and a memory of its own
/// (<vrpipe/platforms/accelerator.h>).
class AcceleratorBehaviour : public Behaviour {
 public:
  /// Draws the frame into the surface of use_surfaces(), once. Gives its steps in the order in which they pass every stage.
  /// @param gaussians  of the scene; none where splats are given, and nothing is converted
  virtual std::vector<AcceleratorStep> draw(std::optional<std::uint64_t> gaussians) = 0;

  struct TimingParameters {
    std::uint32_t frequency_mhz;
    std::uint32_t memory_mb_per_second;                            ///< of 10^6 bytes, shared by all stages
    std::array<std::uint32_t, accelerator_stages> latency_cycles;  ///< from a step's last cycle in a stage to the next
    std::uint32_t buffers;                                         ///< steps between two stages, 2: double-buffered
    std::array<const char*, accelerator_stages> units;             ///< of a stage, in words: what may bound it
  };
  virtual TimingParameters timing() const = 0;

  Counter pairs{*this, "pairs", "pairs", "entries of all lists: splats, once for each tile that they touch"};
  Counter subtile_pairs{*this, "subtile_pairs", "pairs", "of a splat and a sub-tile that it touches, by the masks"};
  Counter subtile_pairs_drawn{*this, "subtile_pairs_drawn", "pairs", "of these, until the sub-tile has terminated"};
  Counter chunks{*this, "chunks", "chunks", "of all lists"};
  Counter chunks_skipped{*this, "chunks_skipped", "chunks", "of these, of tiles that had terminated"};
  Counter fragments_blended{*this, "fragments_blended", "fragments", "blended"};
};

}  // namespace vrpipe
