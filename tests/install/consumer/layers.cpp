// A frame of two draws with a state each, and a clear between them; what became of each draw.
#include <cstdio>
#include <memory>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/scene.h>

int main() try {
  vrpipe::RunRequest request;
  request.platform = &vrpipe::platform_named("agx-orin");
  request.variant = vrpipe::variant_named("het+qm");

  vrpipe::SceneRequest scene;
  scene.scene = "builtin:object";
  scene.size = vrpipe::ImageSize{160, 120};
  const auto object = std::make_shared<const vrpipe::Draw>(vrpipe::load_scene(scene).draw);

  vrpipe::DrawState state = vrpipe::draw_state_of(request);
  vrpipe::Frame frame(160, 120);
  frame.draw(object, state, "near", 0, 50000);
  vrpipe::Clear clear;
  clear.termination = true;
  frame.clear(clear);
  state.pruning_threshold = 0.02F;
  frame.draw(object, state, "far", 50000);

  const vrpipe::RunResult result = vrpipe::simulate(request, frame);
  for (const vrpipe::DrawReport& draw : result.draws) {
    for (const auto& [name, count] : draw.counts) {
      if (name != "quads_blended") continue;
      std::printf("%s: %llu quads blended\n", draw.name.c_str(), static_cast<unsigned long long>(count));
    }
  }
  return 0;
} catch (const vrpipe::UserError& error) {
  std::fprintf(stderr, "layers: error: %s\n", error.what());
  return 2;
}
