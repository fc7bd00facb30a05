// PlayCanvas' streamed SOG: a lod-meta.json with a tree of regions, each of which has, for every level of detail, a run of the
// Gaussians of one SOG scene.
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "formats/attribute_codes.h"
#include "formats/scene_format.h"
#include "formats/sog_scene.h"

namespace vrpipe {
namespace {

constexpr char kStreamedSogRemedy[] = "export the scene again";

Match matches_streamed_sog(const SceneFile& file) { return file.name == "lod-meta.json" ? Match::by_name : Match::no; }

std::uint64_t chosen_level(const SceneFile& file, std::uint64_t levels) {
  const auto choice = file.choices.find("lod");
  if (choice == file.choices.end()) return 0;
  const std::string& text = choice->second;
  std::uint64_t level = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), level);
  if (result.ec != std::errc{} || result.ptr != text.data() + text.size() || level >= levels) {
    file.bytes.fail("it has no level of detail `" + text + "`",
                    "give #lod=0, the finest, to #lod=" + std::to_string(levels - 1));
  }
  return level;
}

/// A run of the Gaussians of file `file`.
struct Region {
  std::uint64_t file, from, count;
};

/// The runs of one level, region by region in the order of the tree. A region without this level has nothing in it there.
std::vector<Region> regions(const nlohmann::json& tree, const std::string& level, std::uint64_t files,
                            const FileBytes& where) {
  std::vector<Region> found;
  std::vector<const nlohmann::json*> open = {&tree};
  while (!open.empty()) {
    const nlohmann::json& node = *open.back();
    open.pop_back();
    if (!node.is_object()) where.fail("a node of `tree` is not an object", kStreamedSogRemedy);
    if (node.contains("children") && node["children"].is_array()) {
      const nlohmann::json& children = node["children"];
      for (auto child = children.rbegin(); child != children.rend(); ++child) open.push_back(&*child);
    }
    if (!node.contains("lods") || !node["lods"].is_object() || !node["lods"].contains(level)) continue;
    const nlohmann::json& run = node["lods"][level];
    const auto number = [&](const char* name) { return json_count(json_member(run, name, where), name, where); };
    found.push_back({number("file"), number("offset"), number("count")});
    if (found.back().file >= files) {
      where.fail("a region lies in file " + std::to_string(found.back().file) + " of " + std::to_string(files),
                 kStreamedSogRemedy);
    }
  }
  return found;
}

/// The scene that `name` leads to from the folder of `file`.
SogScene open_scene(const SceneFile& file, const std::string& name) {
  const std::size_t slash = name.rfind('/');
  const std::string folder = slash == std::string::npos ? "" : name.substr(0, slash + 1);
  return SogScene(file.neighbour(name),
                  [&file, folder](const std::string& image) { return file.neighbour(folder + image); });
}

GaussianFile read_streamed_sog(const SceneFile& file) {
  const FileBytes& where = file.bytes;
  const nlohmann::json meta = parse_scene_json(where);
  const nlohmann::json& names = json_member(meta, "filenames", where);
  if (!names.is_array()) where.fail("`filenames` is not an array", kStreamedSogRemedy);
  const std::uint64_t levels = json_count(json_member(meta, "lodLevels", where), "lodLevels", where);
  if (levels == 0) where.fail("`lodLevels` is 0", kStreamedSogRemedy);
  const std::uint64_t level = chosen_level(file, levels);

  // What several scenes name is read once, and counts once.
  std::map<std::string, FileBytes> images;
  SceneFile source = file;
  source.neighbour = [&](const std::string& name) {
    const std::string plain = std::filesystem::path(name).lexically_normal().string();
    const auto found = images.find(plain);
    return found != images.end() ? found->second : images.emplace(plain, file.neighbour(name)).first->second;
  };
  struct Part {
    SogScene scene;
    std::vector<SogScene::Run> runs;
    std::uint64_t taken = 0;
  };
  std::map<std::uint64_t, Part> parts;
  std::set<std::string> opened;
  std::uint64_t total = 0;
  int degree = 0;
  for (const Region& region : regions(json_member(meta, "tree", where), std::to_string(level), names.size(), where)) {
    auto part = parts.find(region.file);
    if (part == parts.end()) {
      const std::string name = json_text(names[region.file], "filenames", where);
      if (!opened.insert(std::filesystem::path(name).lexically_normal().string()).second) {
        where.fail("`filenames` has `" + name.substr(0, 100) + "` twice", kStreamedSogRemedy);
      }
      part = parts.emplace(region.file, Part{open_scene(source, name), {}, 0}).first;
    }
    // A region has its Gaussians to itself, so the runs of a file are not more than it has.
    Part& of = part->second;
    of.taken += region.count;
    if (region.from > of.scene.count() || region.count > of.scene.count() - region.from ||
        of.taken > of.scene.count()) {
      where.fail("a region has Gaussians " + std::to_string(region.from) + " to " +
                     std::to_string(region.from + region.count) + " of file " + std::to_string(region.file) +
                     ", which has " + std::to_string(of.scene.count()),
                 kStreamedSogRemedy);
    }
    of.runs.push_back({region.from, region.count, total});
    total += region.count;
    degree = std::max(degree, of.scene.sh_degree());
  }
  // What lies around everything, at every level of detail.
  std::optional<SogScene> environment;
  if (meta.contains("environment") && !meta["environment"].is_null()) {
    environment.emplace(open_scene(source, json_text(meta["environment"], "environment", where)));
    degree = std::max(degree, environment->sh_degree());
  }
  std::uint64_t bytes = 0;
  for (const auto& image : images) bytes += image.second.size();
  check_count(total + (environment ? environment->count() : 0), bytes, where);
  GaussianArray gaussians(total + (environment ? environment->count() : 0), degree, where.where());
  for (const auto& part : parts) part.second.scene.decode(part.second.runs, gaussians);
  if (environment) environment->decode({{0, environment->count(), total}}, gaussians);
  GaussianFile result;
  result.gaussians = gaussians.build();
  for (const auto& part : parts) {
    if (!part.second.scene.anti_aliased().empty()) set_anti_aliased(result, part.second.scene.anti_aliased());
  }
  return result;
}

const SceneFormatRegistrar streamed_sog_registrar({"PlayCanvas streamed SOG",
                                                   "FOLDER, or its lod-meta.json",
                                                   "SOG scenes in levels of detail",
                                                   {{"lod", "the level of detail, 0 (the finest, the default) and up"}},
                                                   matches_streamed_sog,
                                                   read_streamed_sog});

}  // namespace
}  // namespace vrpipe
