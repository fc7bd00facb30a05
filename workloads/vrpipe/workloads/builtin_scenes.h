#pragma once

#include <memory>
#include <string>
#include <vector>

#include <vrpipe/workloads/camera.h>
#include <vrpipe/workloads/gaussian_scene.h>
#include <vrpipe/workloads/mesh.h>

namespace vrpipe {

struct BuiltinSceneInfo {
  std::string name;         ///< without "builtin:"
  std::string description;  ///< one line
  ImageSize size;           ///< default image size; of the first three, one of the paper's
  View view;                ///< default camera
};

/// A generated scene and where it is looked at from.
struct BuiltinScene {
  BuiltinSceneInfo info;
  GaussianScene gaussians;
  std::vector<std::shared_ptr<const Mesh>> meshes;  ///< drawn with it; of `courtyard`
};

/// The scene that is drawn when none is named.
constexpr const char* kDefaultBuiltinScene = "object";

/// The built-in scenes, the default one first.
const std::vector<BuiltinSceneInfo>& builtin_scenes();
std::vector<std::string> builtin_scene_names();

/// Generates a scene; always the same bits. `name` without "builtin:".
/// Surfaces are made of flat, oriented, overlapping splats with log-normal sizes and mixed opacities, with floaters and
/// a background, as trained scenes are; y points down.
/// @throws UserError for an unknown name, with the nearest one
BuiltinScene make_builtin_scene(const std::string& name);

}  // namespace vrpipe
