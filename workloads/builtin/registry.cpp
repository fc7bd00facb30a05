#include <vrpipe/workloads/builtin_scenes.h>

#include <memory>
#include <utility>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/scene_substitution.h>

#include "scene_cache.h"
#include "scenes.h"

namespace vrpipe {
namespace {

/// A built-in scene and how it is made.
struct Entry {
  BuiltinSceneInfo info;
  std::uint64_t seed = 0;
  void (*paint)(ScenePainter&) = nullptr;      ///< of what is no capture
  void (*capture)(CapturePainter&) = nullptr;  ///< of a stand-in
  int sh_degree = 1;                           ///< of a stand-in
  Mesh (*mesh)() = nullptr;                    ///< null: splats alone
};

Entry own(const std::string& name, const std::string& description, ImageSize size, const View& view, std::uint64_t seed,
          void (*paint)(ScenePainter&), Mesh (*mesh)() = nullptr) {
  return {{name, description, size, view, {}}, seed, paint, nullptr, 1, mesh};
}

Entry stand_in(const std::string& name, const std::string& description, ImageSize size, const View& view,
               const PaperScene& paper, void (*capture)(CapturePainter&), int sh_degree = 1) {
  std::uint64_t seed = 0;
  for (const char c : name) seed = seed << 8 | static_cast<unsigned char>(c);
  return {{name, description, size, view, paper}, seed, nullptr, capture, sh_degree, nullptr};
}

const Population& population_of(const PaperScene& paper) {
  if (paper.kind == "indoor") return kIndoorPopulation;
  return paper.kind == "synthetic" ? kObjectPopulation : kOutdoorPopulation;
}

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = {
      own("object", "a toy steam locomotive on a grassy base, 800x800, as the synthetic captures", {800, 800},
          {{2.85, -1.75, -3.3}, {0.0, -0.55, 0.1}, {0, -1, 0}, 42}, 0x6f626a656374, paint_object),
      own("indoor", "a living room seen from its corner, 1552x1040, as the indoor captures", {1552, 1040},
          {{1.1, -1.6, -2.5}, {-0.05, -0.95, 1.4}, {0, -1, 0}, 62}, 0x696e646f6f72, paint_indoor),
      own("outdoor", "a street with houses and trees under a wide sky, 980x545, as the outdoor captures", {980, 545},
          {{-0.9, -1.9, -0.6}, {0.35, -2.2, 12}, {0, -1, 0}, 52}, 0x6f7574646f6f72, paint_outdoor),
      own("courtyard", "a courtyard of triangles with splats before and behind its walls, 960x540", {960, 540},
          {{1.4, -2.1, -5.6}, {-0.25, -1.35, 3.0}, {0, -1, 0}, 48}, 0x636f757274, paint_courtyard, courtyard_mesh),
      stand_in("kitchen", "a toy bulldozer on a laid table in a kitchen, 1552x1040", {1552, 1040},
               {{-1.05, -1.55, -1.35}, {0.12, -0.88, 0.35}, {0, -1, 0}, 50},
               {"Kitchen", "Mip-NeRF 360", "indoor", 1'850'000}, paint_kitchen),
      stand_in("bonsai", "a bonsai in a pot on a round table in a living room, 1552x1040", {1552, 1040},
               {{-0.85, -1.35, -1.15}, {0.03, -0.98, 0.05}, {0, -1, 0}, 48},
               {"Bonsai", "Mip-NeRF 360", "indoor", 1'240'000}, paint_bonsai),
      stand_in("train", "a diesel locomotive and boxcars on a siding before trees and hills, 980x545", {980, 545},
               {{-5.6, -2.3, -6.4}, {0.6, -2.2, 5.5}, {0, -1, 0}, 46}, {"Train", "Tanks&Temples", "outdoor", 1'030'000},
               paint_train),
      stand_in("truck", "an old pickup with a stake bed, parked in a street of houses, 979x546", {979, 546},
               {{-4.3, -1.75, -4.9}, {0.15, -1.05, 0.1}, {0, -1, 0}, 46},
               {"Truck", "Tanks&Temples", "outdoor", 2'540'000}, paint_truck),
      stand_in("lego", "a model bulldozer of bricks on a baseplate, nothing around it, 800x800", {800, 800},
               {{-2.15, -2.0, -2.55}, {-0.02, -0.42, 0}, {0, -1, 0}, 39.6},
               {"Lego", "Synthetic-NeRF", "synthetic", 358'000}, paint_lego),
      stand_in("palace", "a palace with towers and domes on a terrace, nothing around it, 800x800", {800, 800},
               {{-2.3, -1.9, -2.75}, {0, -0.62, 0}, {0, -1, 0}, 39.6},
               {"Palace", "Synthetic-NSVF", "synthetic", 327'000}, paint_palace),
      stand_in("building", "a factory among yards, roads and trees, from the air, 1152x864", {1152, 864},
               {{-84, -118, -108}, {6, -4, 2}, {0, -1, 0}, 50}, {"Building", "Mega-NeRF", "aerial", 9'060'000},
               paint_building, 0),
      stand_in("rubble", "a heap of rubble between excavators, trees and a road, from the air, 1152x864", {1152, 864},
               {{-48, -60, -66}, {2, -3, 3}, {0, -1, 0}, 50}, {"Rubble", "Mega-NeRF", "aerial", 5'210'000},
               paint_rubble, 0)};
  return all;
}

const Entry& entry_named(const std::string& name) {
  return entries()[static_cast<std::size_t>(&builtin_scene_named(name) - builtin_scenes().data())];
}

void add_mesh(const Entry& entry, BuiltinScene& scene) {
  if (entry.mesh != nullptr) scene.meshes.push_back(std::make_shared<const Mesh>(entry.mesh()));
}

}  // namespace

const std::vector<BuiltinSceneInfo>& builtin_scenes() {
  static const std::vector<BuiltinSceneInfo> scenes = [] {
    std::vector<BuiltinSceneInfo> infos;
    for (const Entry& entry : entries()) infos.push_back(entry.info);
    return infos;
  }();
  return scenes;
}

std::vector<std::string> builtin_scene_names() {
  std::vector<std::string> names;
  for (const BuiltinSceneInfo& info : builtin_scenes()) names.push_back(info.name);
  return names;
}

std::optional<std::string> builtin_name_of(const std::string& scene) {
  if (scene.rfind(builtin_prefix, 0) != 0 || scene_substitution(scene)) return std::nullopt;
  return scene.substr(builtin_prefix.size());
}

const BuiltinSceneInfo& builtin_scene_named(const std::string& name) {
  for (const BuiltinSceneInfo& info : builtin_scenes()) {
    if (info.name == name) return info;
  }
  throw UserError("unknown built-in scene", builtin_prefix + name, "there is none of that name",
                  suggestion(name, builtin_scene_names(), "", builtin_prefix));
}

BuiltinScene make_builtin_scene(const std::string& name, unsigned threads) {
  const Entry& entry = entry_named(name);
  const BuiltinSceneInfo& info = entry.info;
  BuiltinScene scene{info, {}, {}};
  if (entry.capture != nullptr) {
    CapturePainter painter(entry.seed, info.view, info.size.height, population_of(*info.stands_for), entry.sh_degree);
    entry.capture(painter);
    scene.gaussians = painter.build(info.stands_for->gaussians, threads);
  } else {
    ScenePainter painter(entry.seed, info.view, info.size);
    entry.paint(painter);
    scene.gaussians = painter.build();
  }
  add_mesh(entry, scene);
  return scene;
}

BuiltinScene cached_builtin_scene(const std::string& name) {
  const Entry& entry = entry_named(name);
  BuiltinScene scene{entry.info, {}, {}};
  if (auto gaussians = cached_scene(name)) {
    scene.gaussians = std::move(*gaussians);
    add_mesh(entry, scene);
    return scene;
  }
  scene = make_builtin_scene(name);
  cache_scene(name, scene.gaussians);
  return scene;
}

}  // namespace vrpipe
