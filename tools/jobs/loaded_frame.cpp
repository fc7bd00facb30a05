#include "jobs/loaded_frame.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/mesh.h>
#include <vrpipe/workloads/mixed_frame.h>

namespace vrpipe::tools {
namespace {

/// The same options with all of a camera, so that it is the same for every scene.
SceneRequest seen_from(const Viewpoint& viewpoint, SceneRequest options) {
  options.size = ImageSize{viewpoint.camera.width, viewpoint.camera.height};
  if (viewpoint.view) {
    options.eye = viewpoint.view->eye;
    options.look_at = viewpoint.view->look_at;
    options.up = viewpoint.view->up;
    options.orthographic_height = viewpoint.view->orthographic_height;
    options.fovy_degrees = viewpoint.view->fovy_degrees;
    if (options.orthographic_height) options.fovy_degrees.reset();
  }
  return options;
}

void add(const SceneSummary& scene, SceneSummary& sum) {
  sum.gaussians_total += scene.gaussians_total;
  sum.gaussians_visible += scene.gaussians_visible;
  sum.gaussians_compensated += scene.gaussians_compensated;
  sum.rejected.not_finite += scene.rejected.not_finite;
  sum.rejected.zero_quaternion += scene.rejected.zero_quaternion;
  sum.triangles += scene.triangles;
  sum.triangles_rejected += scene.triangles_rejected;
  // Those of the camera, which all scenes share, once.
  for (const std::string& note : scene.notes) {
    if (std::find(sum.notes.begin(), sum.notes.end(), note) == sum.notes.end()) sum.notes.push_back(note);
  }
}

void check(const FrameCommand& command, const Draw& geometry, const LoadedFrame& frame) {
  const SceneDraw& draw = *command.draw;
  if (geometry.width != frame.width || geometry.height != frame.height) {
    throw UserError("cannot draw " + draw.scene, command.where,
                    fmt::format("it is a draw list for {}x{} pixels, and the frame has {}x{}", geometry.width,
                                geometry.height, frame.width, frame.height),
                    frame.viewpoint ? fmt::format("give --size {}x{}", geometry.width, geometry.height)
                                    : "use draw lists of one size");
  }
  if (draw.depth && !draw.is_mesh && is_draw_list(draw.scene)) {
    throw UserError("cannot test the depth of " + draw.scene, command.where + ", state.depth",
                    "it is a draw list, whose splats have no depth", "leave out the depth test, or draw the .ply");
  }
  const std::size_t there = geometry.splats.size();
  const bool is_part = draw.splats != ~0U;
  if (is_part && (draw.first > there || draw.splats > there - draw.first)) {
    throw UserError("cannot draw " + draw.scene, command.where + ", splats",
                    fmt::format("{} from {} on are not there: {} are visible", draw.splats, draw.first, there),
                    "draw what is there");
  }
}

}  // namespace

LoadedFrame load_frame(const FrameDescription& frame, const SceneRequest& options) {
  LoadedFrame loaded;
  struct Scene {
    std::shared_ptr<const Draw> splats;
    std::vector<std::shared_ptr<const Draw>> meshes;
  };
  std::map<std::string, Scene> scenes;
  SceneRequest view = options;
  // Draw lists come last: whether the options of a camera have a meaning is known by then.
  for (const bool draw_lists : {false, true}) {
    for (const FrameCommand& command : frame.commands) {
      const SceneDraw* const draw = command.draw ? &*command.draw : nullptr;
      if (draw == nullptr || draw->is_mesh || is_draw_list(draw->scene) != draw_lists ||
          scenes.count(draw->scene) > 0) {
        continue;
      }
      SceneRequest request = draw_lists && loaded.viewpoint ? SceneRequest() : view;
      request.scene = command.draw->scene;
      LoadedScene scene = load_scene(request);
      if (scenes.empty()) {
        loaded.width = scene.draw.width;
        loaded.height = scene.draw.height;
        loaded.viewpoint = scene.viewpoint;
        loaded.preprocessed_here = scene.preprocessed_here;
        if (scene.viewpoint) view = seen_from(*scene.viewpoint, options);
      }
      add(scene.summary, loaded.summary);
      Scene& added = scenes[request.scene];
      added.splats = std::make_shared<const Draw>(std::move(scene.draw));
      for (Draw& mesh : scene.meshes) added.meshes.push_back(std::make_shared<const Draw>(std::move(mesh)));
    }
  }
  // A mesh has no camera of its own.
  for (const FrameCommand& command : frame.commands) {
    if (!command.draw || !command.draw->is_mesh || scenes.count(command.draw->scene) > 0) continue;
    if (!loaded.viewpoint) {
      throw UserError("cannot draw " + command.draw->scene, command.where,
                      "it is a mesh, and the frame draws no scene that has a camera", "draw a scene as well");
    }
    RejectedTriangles rejected;
    const Mesh mesh = read_mesh(command.draw->scene, rejected);
    const auto draw = std::make_shared<const Draw>(project_mesh(mesh, loaded.viewpoint->camera, rejected));
    loaded.summary.triangles += draw->mesh.size();
    loaded.summary.triangles_rejected += rejected.total();
    scenes[command.draw->scene].splats = draw;
  }
  loaded.summary.name = frame.name;
  for (const FrameCommand& command : frame.commands) {
    const Scene scene = command.draw ? scenes.at(command.draw->scene) : Scene{};
    loaded.geometry.push_back(scene.splats);
    loaded.meshes.push_back(scene.meshes);
    if (command.draw) check(command, *loaded.geometry.back(), loaded);
  }
  return loaded;
}

LoadedFrame load_frame(const FrameDescription& frame, const OpenedScene& scene, const PreprocessOptions& options) {
  LoadedScene preprocessed = preprocess_scene(scene, options);
  LoadedFrame loaded;
  loaded.width = preprocessed.draw.width;
  loaded.height = preprocessed.draw.height;
  loaded.summary = preprocessed.summary;
  loaded.summary.name = frame.name;
  loaded.viewpoint = preprocessed.viewpoint;
  loaded.preprocessed_here = preprocessed.preprocessed_here;
  loaded.geometry.push_back(std::make_shared<const Draw>(std::move(preprocessed.draw)));
  loaded.meshes.emplace_back();
  for (Draw& mesh : preprocessed.meshes) loaded.meshes.back().push_back(std::make_shared<const Draw>(std::move(mesh)));
  return loaded;
}

std::shared_ptr<const Frame> make_frame(const RunRequest& request, const FrameDescription& description,
                                        const LoadedFrame& loaded) {
  auto frame = std::make_shared<Frame>(loaded.width, loaded.height);
  frame->set_depth_format(depth_format_of(request));
  for (std::size_t i = 0; i < description.commands.size(); ++i) {
    const FrameCommand& command = description.commands[i];
    if (!command.draw) {
      frame->clear(command.clear);
      continue;
    }
    const SceneDraw& draw = *command.draw;
    MixedFrameOptions options;
    options.passes = description.passes;
    options.splats = draw_state_of(request, draw.settings);
    options.splats.blend = draw.blend;
    options.splats.early_termination = draw.early_termination.value_or(draw.blend);
    options.splats.late_tests = draw.late_tests;
    if (draw.depth) options.splats.depth = *draw.depth;
    if (draw.stencil) options.splats.stencil = *draw.stencil;
    options.splats.cull = draw.cull.value_or(draw.is_mesh ? CullMode::back : CullMode::none);
    if (draw.is_mesh) {
      options.splats.shader = draw.shader.value_or(FragmentShader::lit);
      options.splats.light = MixedFrameOptions().light;
      options.splats.early_termination = false;
    } else if (draw.shader) {
      options.splats.shader = *draw.shader;
    }
    const bool is_mixed_scene = description.commands.size() == 1 && !loaded.meshes[i].empty();
    draw_mixed(*frame, loaded.geometry[i], loaded.meshes[i], options, is_mixed_scene ? "splats" : draw.name, draw.first,
               draw.splats);
  }
  return frame;
}

}  // namespace vrpipe::tools
