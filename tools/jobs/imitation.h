#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

#include "jobs/energy.h"

namespace vrpipe::tools {

/// What the paper measured energy by (VI-D): hardware without its extensions that imitates them. Early termination is a number
/// in the stencil of each pixel, of its fragments until it terminates, which each fragment decrements, before it is shaded; at
/// 0 they are killed. Merging are shuffles, blends and discards in the shader, as many as HET+QM has merges. Both
/// are counted without time and in strict termination. The image has lost what merging would have kept.
struct Imitation {
  std::shared_ptr<const Frame> frame;
  RunRequest request;              ///< the baseline's, with the shader that imitates
  double paired_quads = 0;         ///< share of all that are shaded
  double discarded_quads = 0;      ///< share of those that have a fragment left
  std::uint64_t pixels_short = 0;  ///< that go on behind fragment 255, the most that 8 bits count, and are cut there
};

/// @param baseline  how the draw is drawn that is compared with
/// @param state     of that draw
/// Throws UserError for a state that tests the stencil itself, and as simulate().
Imitation imitation_of(const RunRequest& baseline, std::shared_ptr<const Draw> splats, const DrawState& state);

/// The paper's energy efficiency by its own method: the energy of the baseline over that of the imitation. None where
/// energy_ratio() has none.
std::optional<Range> imitated_efficiency(const RunResult& baseline, const RunResult& imitation,
                                         const EnergyTable& table);

}  // namespace vrpipe::tools
