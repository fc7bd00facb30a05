#pragma once

#include <cstdint>
#include <optional>

#include <nlohmann/json_fwd.hpp>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

/// What comes before a scene's draw, and ways to draw it without the graphics pipeline, at `lt`: simulated milliseconds and counts.
struct WholeFrame {
  /// By one unit of slot `preparation`.
  struct Preparation {
    double software = 0;              ///< Gaussians projected for lists of tiles; 0 of a draw list
    double projection = 0, sort = 0;  ///< and for a draw by hardware
    double hardware() const { return projection + sort; }
  };
  Preparation measured;  ///< `published`, whose prices were measured on a GPU
  Preparation papers;    ///< `papers-orin`, as slow as the paper has it
  // By `render=published`, which terminates, and `render=endless`, which does not.
  double lists = 0;  ///< count, scan, duplicate, sort, ranges
  double render = 0, endless_render = 0;
  std::uint64_t fragments_blended = 0, endless_fragments_blended = 0;
  std::uint64_t lanes = 0;  ///< of all iterations of warps, with termination
  double accelerator = 0;   ///< a frame by `accelerator=gscore`

  double software(const Preparation& by) const { return by.software + lists + render; }
  double share_of_lanes_blending() const { return static_cast<double>(fragments_blended) / static_cast<double>(lanes); }
};

/// @param base       platform and settings
/// @param gaussians  of the scene; none of a draw list
/// Throws UserError or SimulationFault.
WholeFrame simulate_whole_frame(const RunRequest& base, const Frame& frame, std::optional<std::uint64_t> gaussians);

void to_json(nlohmann::json& json, const WholeFrame& frame);
/// Throws json::exception.
void from_json(const nlohmann::json& json, WholeFrame& frame);

}  // namespace vrpipe::tools
