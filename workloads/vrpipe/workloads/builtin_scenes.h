#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/workloads/camera.h>
#include <vrpipe/workloads/gaussian_scene.h>
#include <vrpipe/workloads/mesh.h>

namespace vrpipe {

/// A scene that the paper was evaluated with.
struct PaperScene {
  std::string name;
  std::string dataset;
  std::string kind;             ///< indoor, outdoor, synthetic, aerial
  std::uint64_t gaussians = 0;  ///< of the trained model, as far as the paper prints digits
};

struct BuiltinSceneInfo {
  std::string name;         ///< without "builtin:"
  std::string description;  ///< one line
  ImageSize size;           ///< default image size; of `courtyard` none of the paper's
  View view;                ///< default camera
  /// What it stands in for, with the same size and number of Gaussians; none of the first four. The paper names no size of
  /// its aerial scenes: theirs is a quarter of their photographs' 4608x3456, as these are trained.
  std::optional<PaperScene> stands_for;
};

/// A generated scene and where it is looked at from.
struct BuiltinScene {
  BuiltinSceneInfo info;
  GaussianScene gaussians;
  std::vector<std::shared_ptr<const Mesh>> meshes;  ///< drawn with it; of `courtyard`
};

/// The scene that is drawn when none is named.
constexpr const char* kDefaultBuiltinScene = "object";

/// What stands before the name of a built-in scene where scenes are named.
inline const std::string builtin_prefix = "builtin:";
/// NAME of builtin:NAME; none of what names a file, such as builtin:NAME=FILE.
/// @throws UserError as scene_substitution()
std::optional<std::string> builtin_name_of(const std::string& scene);

/// The built-in scenes, the default one first.
const std::vector<BuiltinSceneInfo>& builtin_scenes();
std::vector<std::string> builtin_scene_names();

/// `name` without "builtin:".
/// @throws UserError for an unknown name, with the nearest one
const BuiltinSceneInfo& builtin_scene_named(const std::string& name);

/// Generates a scene; always the same bits. `name` without "builtin:".
/// Surfaces are made of flat, oriented, overlapping splats with log-normal sizes and mixed opacities, with floaters and
/// a background, as trained scenes are; y points down. A stand-in has as many Gaussians as the model it stands for; most of
/// a capture's lie out of the default view.
/// @param threads  that make a stand-in; 0: one for each processor
/// @throws UserError for an unknown name, with the nearest one
BuiltinScene make_builtin_scene(const std::string& name, unsigned threads = 0);

/// The same bits, from the user's cache folder if this build has made the scene before; else it is made and stored there.
/// @throws UserError for an unknown name, with the nearest one
BuiltinScene cached_builtin_scene(const std::string& name);

}  // namespace vrpipe
