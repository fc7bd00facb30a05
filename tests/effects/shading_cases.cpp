// Effects of draws, QRU, SM and CROP.
#include <sstream>

#include <vrpipe/arithmetic/half.h>
#include <vrpipe/platforms/wiring.h>
#include <vrpipe/workloads/multi_pass.h>

#include "effects/effect_case.h"

namespace vrpipe::testing {

namespace {

Scene one_draw(Fidelity fidelity) { return plain_splats(fidelity, "qm"); }
/// The same state in two draws: their quads share bins and warps.
Scene two_draws(Fidelity fidelity) {
  Scene scene = scene_of("baseline", fidelity);
  draw(scene, boxes(1, 2, 2, 14, 14, 0.5F));
  draw(scene, boxes(3, 2, 2, 14, 14, 0.5F));
  scene.looked_at = [](const RunResult& result) {
    std::ostringstream counts;
    for (const DrawReport& draw : result.draws) {
      for (const auto& [name, count] : draw.counts) counts << name << " " << count << "\n";
    }
    return counts.str();
  };
  return scene;
}

Scene in_passes(Fidelity fidelity, std::uint32_t passes) {
  Scene scene = scene_of("baseline", fidelity);
  draw_in_passes(scene.frame, geometry_of(scene_side, scene_side, boxes(40, 2, 2, 14, 14, 0.9F)),
                 draw_state_of(scene.request), passes);
  return scene;
}

/// Reads what nothing has written: no barrier.
Scene reads_the_background(Fidelity fidelity) {
  Scene scene = scene_of("baseline", fidelity);
  draw(scene, boxes(1, 2, 2, 14, 14, 0.9F), [](DrawState& state) { state = alpha_threshold_state(); });
  return draw(scene, boxes(1, 2, 2, 14, 14, 0.9F));
}

Scene overlapping(Fidelity fidelity, const std::string& variant) {
  Scene scene = scene_of(variant, fidelity);
  return draw(scene, boxes(2, 2, 2, 14, 14, 0.5F));
}

Scene mesh(Fidelity fidelity) {
  Scene scene = scene_of("baseline", fidelity);
  DrawState state;
  state.shader = FragmentShader::vertex;
  scene.frame.draw(wall(0.5F), state);
  return scene;
}

Scene fetched(Scene scene) {
  return on_platform(std::move(scene), "agx-orin-ideal-memory",
                     [](Netlist& netlist) { connect_attribute_traffic(netlist); });
}

Scene looked_at_by(Scene scene, const std::string& counter) {
  scene.looked_at = [counter](const RunResult& result) { return std::to_string(statistic(result, counter)); };
  return scene;
}

/// Nothing is lost where alpha grows by more than half a step of the format.
Scene of_alpha(Fidelity fidelity, unsigned count, float alpha) {
  Scene scene = scene_of("baseline", fidelity);
  return looked_at_by(draw(scene, boxes(count, 2, 2, 6, 6, alpha)), "crop.fragments_lost_to_rounding");
}

/// What rounding adds takes the largest colour of a format beyond it.
Scene of_color(Fidelity fidelity, ColorFormat format, float color) {
  Scene scene = scene_of("baseline", fidelity, [&](RunRequest& request) { request.format = format; });
  return looked_at_by(draw(scene, boxes(30, 2, 2, 6, 6, 0.2505F, color)), "crop.colors_saturated");
}

Scene forwarding(Fidelity fidelity, const char* on) {
  Scene scene = scene_of("baseline", fidelity);
  scene.request.settings = {{"crop", "forwarding", on}};
  return draw(scene, boxes(4, 2, 2, 6, 6, 0.5F));
}

}  // namespace

std::vector<EffectCase> shading_cases() {
  const auto plain = [](Fidelity f) { return plain_splats(f); };
  const auto passes = [](Fidelity f) { return in_passes(f, 2); };
  return {
      {"draw.several_draws", one_draw, everywhere, two_draws, everywhere},
      // Without time order alone decides what a draw reads, at a barrier or not.
      {"draw.barriers", reads_the_background, everywhere, passes, {Fidelity::cycle}},
      {"qru.pairing", [](Fidelity f) { return overlapping(f, "het"); }, everywhere,
       [](Fidelity f) { return overlapping(f, "qm"); }, everywhere},
      {"sm.mesh_shading", plain, everywhere, mesh, everywhere},
      {"sm.color_reads", [](Fidelity f) { return in_passes(f, 1); }, everywhere, passes, everywhere},
      {"sm.attribute_fetch", plain, everywhere, [](Fidelity f) { return fetched(plain_splats(f)); }, with_time},
      {"crop.rounding_loss", [](Fidelity f) { return of_alpha(f, 3, 0.5F); }, everywhere,
       [](Fidelity f) { return of_alpha(f, 300, 0.02F); }, everywhere},
      {"crop.saturation", [](Fidelity f) { return of_color(f, ColorFormat::rgba16f, 4094); }, everywhere,
       [](Fidelity f) { return of_color(f, ColorFormat::rgba16f, half_max); }, everywhere},
      {"crop.saturation", [](Fidelity f) { return of_color(f, ColorFormat::rgba32f, 100000); }, everywhere,
       [](Fidelity f) { return of_color(f, ColorFormat::rgba8, 1.5F); }, everywhere},
      {"crop.blend_hazard", [](Fidelity f) { return forwarding(f, "on"); }, everywhere,
       [](Fidelity f) { return forwarding(f, "off"); }, with_time},
  };
}

}  // namespace vrpipe::testing
