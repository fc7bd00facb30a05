// Effects of VPO, TGC, RASTER and TC.
#include "effects/effect_case.h"

namespace vrpipe::testing {

namespace {

/// As many tiles as there are bins.
Scene as_many_tiles_as_bins(Fidelity fidelity) {
  Scene scene = scene_of("baseline", fidelity);
  scene.request.settings = {{"tc", "bins", "6"}, {"tc", "idle_timeout_cycles", "0"}};
  return draw(scene, boxes(3, 2, 2, 46, 30, 0.5F));
}
Scene two_tiles_and_a_bin(Fidelity fidelity) {
  Scene scene = scene_of("baseline", fidelity);
  scene.request.settings = {{"tc", "bins", "1"}, {"tc", "idle_timeout_cycles", "0"}};
  return draw(scene, boxes(2, 8, 2, 24, 10, 0.5F));
}

Scene one_grid(Fidelity fidelity) {
  Scene scene = scene_of("qm", fidelity);
  scene.request.settings = {{"tgc", "bins", "1"}};
  return draw(scene, boxes(3, 2, 2, 60, 60, 0.5F));
}
Scene two_grids_and_a_bin(Fidelity fidelity) {
  Scene scene = scene_of("qm", fidelity);
  scene.request.settings = {{"tgc", "bins", "1"}, {"tgc", "grid_tiles", "2"}};
  return draw(scene, boxes(2, 24, 2, 40, 10, 0.5F));
}
Scene across_two_grids(Fidelity fidelity) {
  Scene scene = scene_of("qm", fidelity);
  scene.request.settings = {{"tgc", "grid_tiles", "2"}};
  return draw(scene, boxes(1, 24, 2, 40, 10, 0.5F));
}

Scene pauses(Fidelity fidelity, const char* cycles) {
  Scene scene = scene_of("baseline", fidelity);
  scene.request.settings = {{"draw", "warps_per_1024_cycles", "1"}, {"tc", "idle_timeout_cycles", cycles}};
  // A vertex warp and a splat of the next.
  return draw(scene, boxes(33, 2, 2, 14, 14, 0.1F));
}

Scene facing_mesh(Fidelity fidelity, CullMode cull) {
  Scene scene = scene_of("baseline", fidelity);
  DrawState state;
  state.shader = FragmentShader::vertex;
  state.cull = cull;
  scene.frame.draw(wall(0.5F), state);
  auto turned = std::make_shared<Draw>(*wall(0.5F));
  std::swap(turned->mesh[0].vertices[1], turned->mesh[0].vertices[2]);
  scene.frame.draw(turned, state);
  return scene;
}

Scene on_gpcs(Fidelity fidelity, const char* platform) {
  Scene scene = scene_of("baseline", fidelity);
  scene.request.platform = &platform_named(platform);
  return draw(scene, boxes(2, 2, 2, 60, 60, 0.5F));
}

/// A round splat so large in pixels.
Scene of_size(Fidelity fidelity, float sigma) {
  Scene scene = scene_of("baseline", fidelity);
  return draw(scene, {round_splat(20, 30, sigma, 0.9F), splat_at(11, 17, sigma, 1.5F, 0.7F, 0.9F)});
}

}  // namespace

std::vector<EffectCase> geometry_cases() {
  return {
      {"vpo.face_culling", [](Fidelity f) { return facing_mesh(f, CullMode::none); }, everywhere,
       [](Fidelity f) { return facing_mesh(f, CullMode::back); }, everywhere},
      {"tgc.binning",
       [](Fidelity f) { return plain_splats(f, "het"); },
       everywhere,
       across_two_grids,
       everywhere,
       {},
       true},
      {"tgc.eviction", one_grid, everywhere, two_grids_and_a_bin, everywhere},
      {"raster.wide_edges", [](Fidelity f) { return of_size(f, 150); }, everywhere,
       [](Fidelity f) { return of_size(f, 9000); }, everywhere},
      {"raster.tile_ownership", [](Fidelity f) { return on_gpcs(f, "mobile"); }, everywhere,
       [](Fidelity f) { return on_gpcs(f, "desktop"); }, everywhere},
      {"tc.eviction", as_many_tiles_as_bins, everywhere, two_tiles_and_a_bin, everywhere},
      {"tc.time_out", [](Fidelity f) { return pauses(f, "5000"); }, everywhere,
       [](Fidelity f) { return pauses(f, "300"); }, with_time},
  };
}

}  // namespace vrpipe::testing
