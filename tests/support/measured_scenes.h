#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <vrpipe/pipeline/draw.h>

namespace vrpipe::testing {

/// Splats that were drawn on a GPU, with what was counted and timed there.
struct MeasuredScene {
  std::string name;
  std::map<std::string, double> values;  ///< by column of its file; what was not measured is not there
  Draw draw;

  std::uint64_t count(const std::string& column) const;
};

/// The trained scene that was (tests/data/README.md).
Draw measured_draw();

/// Three scenes of splats of all sizes, some in clusters (tests/data/measured_scenes.csv: counts, and millions of cycles).
MeasuredScene measured_scene(const std::string& name);
const std::vector<std::string>& measured_scene_names();

/// Splats of one size each, anywhere in 1024x1024 (tools/jobs/measured/equal_splats.csv: cycles a splat).
std::vector<MeasuredScene> measured_uniform_scenes();

/// What was blended in the shader (tests/data/measured_in_shader.csv: cycles): splats of one size in a square of so many
/// pixels, and draws, of which the trained scene is not made here.
std::vector<MeasuredScene> measured_in_shader_scenes();

/// What was drawn in passes (tests/data/measured_passes.csv: counts, and millions of cycles), by scene, without the draws.
std::vector<MeasuredScene> measured_passes();

}  // namespace vrpipe::testing
