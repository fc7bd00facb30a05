#pragma once

#include <cstdint>
#include <string>

#include <vrpipe/pipeline/draw.h>

namespace vrpipe::tools {

/// What a scene asks of the pipeline, of the counts at the fidelity `functional`, where termination is strict. Splats alone:
/// meshes of the scene are left out.
struct SceneMeasurement {
  std::string name;  ///< as results have it
  std::uint32_t width = 0, height = 0;
  std::uint64_t gaussians_total = 0, gaussians_visible = 0;
  std::uint64_t fragments_rasterized = 0;
  std::uint64_t fragments_blended = 0;    ///< without early termination
  std::uint64_t fragments_remaining = 0;  ///< blended with it
  std::uint64_t quads_rasterized = 0;
  /// Side of a square as large as a splat's box, pixels: of half the visible splats and of nine in ten no larger.
  double side_median = 0, side_ninth_decile = 0;
  double load_seconds = 0;  ///< wall time of making or reading the scene, and of preprocessing

  double pixels() const { return static_cast<double>(width) * height; }
  /// Fragments blended without over with early termination; 0 if none are.
  double early_termination_ratio() const;
};

/// Side of a square as large as the box of a splat, pixels, which a given share of splats does not exceed; 0 of none.
double splat_side(const Draw& draw, double share);

/// Loads a scene (SceneRequest::scene) with its own camera and size, and counts what it draws. Throws UserError.
SceneMeasurement measure_scene(const std::string& scene);

}  // namespace vrpipe::tools
