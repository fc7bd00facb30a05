#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

#include "support/builders.h"
#include "support/simulate.h"

namespace vrpipe::testing {

inline constexpr std::uint32_t scene_side = 64;

/// What is run, and what of it an effect may change.
struct Scene {
  RunRequest request;
  Frame frame{scene_side, scene_side};
  std::shared_ptr<const Platform> platform;  ///< of the request, if it is none of the catalogue's
  /// By default the hash of counts, cycles and image.
  std::function<std::string(const RunResult&)> looked_at = [](const RunResult& result) { return result.result_hash; };
};

inline RunResult run_with(Scene scene, const EffectChoice& choice) {
  scene.request.effects = choice;
  return run(scene.request, scene.frame);
}

/// A frame that can do without an effect, and the smallest that cannot.
struct EffectCase {
  std::string effect;
  std::function<Scene(Fidelity)> without;
  std::vector<Fidelity> without_at;
  std::function<Scene(Fidelity)> with;
  std::vector<Fidelity> with_at;
  /// Where the platform cannot be run without it: part of what a run is refused with if it is left out in silence.
  std::string refusal = {};
  bool faults = false;  ///< left out in silence, the run comes to no result: a check of the simulator's ends it
};

/// Of all effects; some have several.
const std::vector<EffectCase>& effect_cases();
std::vector<EffectCase> geometry_cases();
std::vector<EffectCase> test_cases();
std::vector<EffectCase> shading_cases();
std::vector<EffectCase> time_cases();

inline const std::vector<Fidelity> everywhere = {Fidelity::functional, Fidelity::bound, Fidelity::lt, Fidelity::cycle};
inline const std::vector<Fidelity> with_time = {Fidelity::lt, Fidelity::cycle};
inline const std::vector<Fidelity> with_cycles = {Fidelity::bound, Fidelity::lt, Fidelity::cycle};
inline const std::vector<Fidelity> without_time = {Fidelity::functional, Fidelity::bound};

inline Scene scene_of(const std::string& variant, Fidelity fidelity,
                      const std::function<void(RunRequest&)>& change = nullptr) {
  Scene scene;
  scene.request = request_of(variant, fidelity, change);
  return scene;
}

/// On the platform of a name, wired in another way.
inline Scene on_platform(Scene scene, const std::string& name, const std::function<void(Netlist&)>& rewire) {
  auto platform = std::make_shared<Platform>(platform_named(name));
  platform->wire = [wire = platform->wire, rewire](Netlist& netlist) {
    wire(netlist);
    rewire(netlist);
  };
  scene.request.platform = platform.get();
  scene.platform = std::move(platform);
  return scene;
}

/// Another draw, with the state of the variant and the settings.
inline Scene& draw(
    Scene& scene, std::vector<Splat> splats, const std::function<void(DrawState&)>& change = [](DrawState&) {}) {
  DrawState state = draw_state_of(scene.request);
  change(state);
  scene.frame.draw(geometry_of(scene.frame.width(), scene.frame.height(), std::move(splats)), state);
  return scene;
}

/// A triangle before all of the screen.
inline std::shared_ptr<const Draw> wall(float depth) {
  auto draw = std::make_shared<Draw>(draw_of(scene_side, scene_side));
  const auto corner = [&](float x, float y) { return MeshVertex{x, y, depth, 1, 0.5F, 0.5F, 0.5F, 0, 0, 1}; };
  draw->mesh.push_back({{corner(-9, -9), corner(-9, 200), corner(200, -9)}});
  return draw;
}

/// So many boxes one over the other, of one alpha and a window depth.
inline std::vector<Splat> boxes(unsigned count, float x0, float y0, float x1, float y1, float alpha, float color = 1,
                                float depth = 0) {
  std::vector<Splat> stack(count, flat_box(x0, y0, x1, y1, alpha, color, color, color));
  for (Splat& splat : stack) splat.depth = depth;
  return stack;
}

/// A frame of splats alone, that calls for little.
inline Scene plain_splats(Fidelity fidelity, const std::string& variant = "baseline") {
  Scene scene = scene_of(variant, fidelity);
  return draw(scene, random_draw(scene_side, scene_side, 25, 3).splats);
}

}  // namespace vrpipe::testing
