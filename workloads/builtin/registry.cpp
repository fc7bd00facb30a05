#include <vrpipe/workloads/builtin_scenes.h>

#include <memory>

#include <vrpipe/component/error.h>

#include "scenes.h"

namespace vrpipe {
namespace {

using Painting = void (*)(ScenePainter&);

struct Entry {
  std::uint64_t seed;
  Painting paint;
  Mesh (*mesh)() = nullptr;  ///< null: splats alone
};

constexpr Entry kEntries[] = {{0x6f626a656374, paint_object},
                              {0x696e646f6f72, paint_indoor},
                              {0x6f7574646f6f72, paint_outdoor},
                              {0x636f757274, paint_courtyard, courtyard_mesh}};

}  // namespace

const std::vector<BuiltinSceneInfo>& builtin_scenes() {
  static const std::vector<BuiltinSceneInfo> scenes = {
      {"object",
       "a toy steam locomotive on a grassy base, 800x800, as the synthetic captures",
       {800, 800},
       {{2.85, -1.75, -3.3}, {0.0, -0.55, 0.1}, {0, -1, 0}, 42}},
      {"indoor",
       "a living room seen from its corner, 1552x1040, as the indoor captures",
       {1552, 1040},
       {{1.1, -1.6, -2.5}, {-0.05, -0.95, 1.4}, {0, -1, 0}, 62}},
      {"outdoor",
       "a street with houses and trees under a wide sky, 980x545, as the outdoor captures",
       {980, 545},
       {{-0.9, -1.9, -0.6}, {0.35, -2.2, 12}, {0, -1, 0}, 52}},
      {"courtyard",
       "a courtyard of triangles with splats before and behind its walls, 960x540",
       {960, 540},
       {{1.4, -2.1, -5.6}, {-0.25, -1.35, 3.0}, {0, -1, 0}, 48}}};
  return scenes;
}

std::vector<std::string> builtin_scene_names() {
  std::vector<std::string> names;
  for (const BuiltinSceneInfo& info : builtin_scenes()) names.push_back(info.name);
  return names;
}

BuiltinScene make_builtin_scene(const std::string& name) {
  const std::vector<BuiltinSceneInfo>& scenes = builtin_scenes();
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    if (scenes[i].name != name) continue;
    ScenePainter painter(kEntries[i].seed, scenes[i].view, scenes[i].size);
    kEntries[i].paint(painter);
    BuiltinScene scene{scenes[i], painter.build(), {}};
    if (kEntries[i].mesh != nullptr) scene.meshes.push_back(std::make_shared<const Mesh>(kEntries[i].mesh()));
    return scene;
  }
  std::string all;
  for (const BuiltinSceneInfo& info : scenes) all += (all.empty() ? "" : ", ") + info.name;
  throw UserError("unknown built-in scene", "builtin:" + name, "there is none of that name",
                  "did you mean builtin:" + nearest_name(name, builtin_scene_names()) + "? There are " + all);
}

}  // namespace vrpipe
