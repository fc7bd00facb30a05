// Effects of what is tested before shading and after it: depth, stencil, termination.
#include <vrpipe/platforms/wiring.h>

#include "effects/effect_case.h"

namespace vrpipe::testing {

namespace {

/// Splats behind a wall, whose depth is stored by the wall's colour.
Scene behind_a_wall(Fidelity fidelity, const char* hi_z, Termination termination = Termination::paper) {
  Scene scene = scene_of("baseline", fidelity, [&](RunRequest& request) { request.termination = termination; });
  scene.request.settings = {{"raster", "hi_z", hi_z}};
  DrawState stored;
  stored.shader = FragmentShader::vertex;
  stored.depth = {true, Compare::less, true};
  scene.frame.draw(wall(0.5F), stored);
  return draw(scene, boxes(1, 8, 8, 24, 24, 0.5F, 1, 0.75F), [](DrawState& state) {
    state.depth = {true, Compare::less, false};
  });
}

/// Depth that nothing stored can hide, as all of it passes.
Scene nothing_hides(Fidelity fidelity) {
  Scene scene = scene_of("baseline", fidelity);
  return draw(scene, boxes(2, 8, 8, 24, 24, 0.5F, 1, 0.75F), [](DrawState& state) {
    state.depth = {true, Compare::less, false};
  });
}

/// Two splats that store depth where they are not discarded: the second is hidden by the first.
Scene splats_that_store(Fidelity fidelity) {
  Scene scene = scene_of("baseline", fidelity);
  std::vector<Splat> two{round_splat(20, 20, 4, 0.9F), round_splat(20, 20, 4, 0.9F)};
  two[0].depth = 0.25F;
  two[1].depth = 0.5F;
  return draw(scene, two, [](DrawState& state) { state.depth = {true, Compare::less, true}; });
}
Scene splats_that_are_tested(Fidelity fidelity) { return behind_a_wall(fidelity, "on"); }

Scene opaque_boxes(const std::string& variant, Fidelity fidelity, Termination termination) {
  Scene scene = scene_of(variant, fidelity, [&](RunRequest& request) { request.termination = termination; });
  return draw(scene, boxes(6, 2, 2, 14, 14, 0.999F));
}

/// With a line, and a miss at a time.
Scene with_z_memory(Scene scene) {
  scene.request.settings.push_back({"zrop", "cache_bytes", "128"});
  scene.request.settings.push_back({"zrop", "mshrs", "1"});
  scene.request.settings.push_back({"zrop", "fast_clear", "off"});
  return on_platform(std::move(scene), "agx-orin-ideal-memory",
                     [](Netlist& netlist) { connect_depth_stencil_traffic(netlist); });
}

}  // namespace

std::vector<EffectCase> test_cases() {
  const auto plain = [](Fidelity f) { return plain_splats(f); };
  const auto terminated = [](Fidelity f) { return opaque_boxes("het", f, Termination::paper); };
  return {
      {"zrop.depth_stencil", plain, everywhere, [](Fidelity f) { return behind_a_wall(f, "off"); }, everywhere},
      {"zrop.depth_stencil", terminated, everywhere, splats_that_store, everywhere},
      // In strict order the splats wait for the wall's depth.
      {"raster.hi_z", nothing_hides, everywhere, [](Fidelity f) { return behind_a_wall(f, "on", Termination::strict); },
       everywhere},
      {"zrop.late_tests", splats_that_are_tested, everywhere, splats_that_store, everywhere},
      {"zrop.termination", [](Fidelity f) { return opaque_boxes("qm", f, Termination::paper); }, everywhere, terminated,
       everywhere},
      {"crop.late_drops", terminated, everywhere,
       [](Fidelity f) { return opaque_boxes("het", f, Termination::strict); }, everywhere},
      // Where its port is bound, and nothing reads the target; and where something does.
      {"zrop.z_cache", [](Fidelity f) { return with_z_memory(plain_splats(f)); }, everywhere,
       [](Fidelity f) { return with_z_memory(plain_splats(f, "het")); }, with_time},
      {"zrop.z_cache", [=](Fidelity f) { return terminated(f); }, everywhere,
       [](Fidelity f) { return with_z_memory(behind_a_wall(f, "on")); }, with_time},
  };
}

}  // namespace vrpipe::testing
