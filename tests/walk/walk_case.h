#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::walk {

/// One configuration and one scene of the random walk.
struct Case {
  std::uint64_t seed = 0;
  std::uint64_t index = 0;
  const Platform* platform = nullptr;
  Variant variant;
  ColorFormat format = ColorFormat::rgba16f;
  Termination termination = Termination::paper;
  std::vector<Setting> settings;
  std::vector<UnitChoice> units;
  bool refused = false;  ///< the last setting lies outside its declared range
  Draw draw;

  /// What is run twice, and once with stalls.
  Fidelity repeated = Fidelity::cycle;
  Fidelity stalled = Fidelity::cycle;
  std::uint64_t stall_seed = 1;

  RunRequest request(Fidelity fidelity) const;
};

/// The case of a seed and an index: always the same, whichever were drawn before. `real` is a large draw of a trained
/// scene, windows of which are among the scenes.
Case draw_case(std::uint64_t seed, std::uint64_t index, const Draw& real);

/// The case in words, and as a `vrpipe run` of the draw list `scene`.
std::string describe(const Case& c);
std::string command_line(const Case& c, Fidelity fidelity, const std::string& scene);

}  // namespace vrpipe::walk
