#pragma once

#include <optional>
#include <string>
#include <vector>

namespace vrpipe {

/// NAME=FILE: a file in the place of a built-in scene, a trained model in that of its stand-in.
struct SceneSubstitution {
  std::string name;  ///< of the built-in scene, without "builtin:"
  std::string file;
};

/// Reads NAME=FILE. None if `scene` is something else: nothing, builtin:NAME, or a path, of which the part before its
/// first `=`, if there is one, is one too (it has a / or a dot, as ./a=b.ply, or a #, as scene#lod=2).
/// @throws UserError when there is no built-in scene of that name, with the nearest one, or FILE is none
std::optional<SceneSubstitution> scene_substitution(const std::string& scene);

/// Reads several, for commands that draw many of the built-in scenes.
/// @throws UserError as above, for what is no NAME=FILE, and for a name that is given twice; `option` says where
std::vector<SceneSubstitution> scene_substitutions(const std::vector<std::string>& texts, const std::string& option);

/// What SceneRequest::scene is for a built-in scene: NAME=FILE if it is substituted, otherwise builtin:NAME.
std::string scene_in_place(const std::string& name, const std::vector<SceneSubstitution>& substitutions);

/// The file that a scene is read from: FILE of NAME=FILE, otherwise `scene` itself.
std::string scene_file(const std::string& scene);

}  // namespace vrpipe
