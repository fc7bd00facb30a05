#include <vrpipe/workloads/scene_substitution.h>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/builtin_scenes.h>

namespace vrpipe {
namespace {

bool begins(const std::string& text, const std::string& start) { return text.rfind(start, 0) == 0; }

}  // namespace

std::optional<SceneSubstitution> scene_substitution(const std::string& scene) {
  const std::size_t equals = scene.find('=');
  if (equals == std::string::npos || equals == 0) return std::nullopt;
  std::string name = scene.substr(0, equals);
  if (begins(name, builtin_prefix)) name.erase(0, builtin_prefix.size());
  if (name.find_first_of("/.#") != std::string::npos) return std::nullopt;
  const std::vector<std::string> known = builtin_scene_names();
  bool is_known = false;
  for (const std::string& one : known) is_known = is_known || one == name;
  if (!is_known) {
    throw UserError("unknown built-in scene", scene,
                    "there is none that is named " + name + ", to put a file in its place",
                    suggestion(name, known, "a file whose name has a = is given as ./" + scene));
  }
  std::string file = scene.substr(equals + 1);
  if (file.empty() || begins(file, builtin_prefix)) {
    throw UserError("cannot replace a built-in scene", scene,
                    file.empty() ? "no file is named" : "`" + file + "` is a built-in scene as well",
                    "give " + name + "=FILE, or builtin:NAME alone");
  }
  return SceneSubstitution{name, file};
}

std::vector<SceneSubstitution> scene_substitutions(const std::vector<std::string>& texts, const std::string& option) {
  std::vector<SceneSubstitution> substitutions;
  for (const std::string& text : texts) {
    const std::optional<SceneSubstitution> read = scene_substitution(text);
    if (!read) {
      throw UserError("cannot replace a built-in scene", option + " " + text, "it names no scene to replace",
                      "give NAME=FILE, e.g. train=point_cloud.ply");
    }
    for (const SceneSubstitution& earlier : substitutions) {
      if (earlier.name != read->name) continue;
      throw UserError("option given twice", option + " " + read->name,
                      "as '" + earlier.file + "' and as '" + read->file + "'", "give it once");
    }
    substitutions.push_back(*read);
  }
  return substitutions;
}

std::string scene_in_place(const std::string& name, const std::vector<SceneSubstitution>& substitutions) {
  for (const SceneSubstitution& substitution : substitutions) {
    if (substitution.name == name) return name + "=" + substitution.file;
  }
  return builtin_prefix + name;
}

std::string scene_file(const std::string& scene) {
  const std::optional<SceneSubstitution> substitution = scene_substitution(scene);
  return substitution ? substitution->file : scene;
}

}  // namespace vrpipe
