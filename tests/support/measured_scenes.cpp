#include "support/measured_scenes.h"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include <vrpipe/workloads/draw_list.h>
#include <vrpipe/workloads/measured_splats.h>

#include "support/data.h"

namespace vrpipe::testing {

namespace {

/// Rows of a file: the name, and values by column.
std::vector<MeasuredScene> rows_of(const std::filesystem::path& path) {
  const auto cells_of = [](const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream rest(line);
    for (std::string cell; std::getline(rest, cell, ',');) cells.push_back(cell);
    if (!line.empty() && line.back() == ',') cells.emplace_back();
    return cells;
  };
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  const std::vector<std::string> columns = cells_of(line);
  std::vector<MeasuredScene> rows;
  while (std::getline(file, line)) {
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() != columns.size()) throw std::runtime_error(path.string() + ": " + line);
    MeasuredScene row;
    row.name = cells.front();
    for (std::size_t i = 1; i < cells.size(); ++i) {
      if (!cells[i].empty()) row.values[columns[i]] = std::stod(cells[i]);
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace

std::uint64_t MeasuredScene::count(const std::string& column) const {
  return static_cast<std::uint64_t>(values.at(column));
}

const std::vector<std::string>& measured_scene_names() { return measured::synthetic_scene_names(); }

Draw measured_draw() {
  const UnpackedFile file("measured_draw.spl");
  return read_draw_list(file.path()).draw;
}

MeasuredScene measured_scene(const std::string& name) {
  for (MeasuredScene& scene : rows_of(data_file("measured_scenes.csv"))) {
    if (scene.name != name) continue;
    scene.draw = measured::synthetic_scene(name, static_cast<std::uint32_t>(scene.count("width")),
                                           static_cast<std::uint32_t>(scene.count("height")), scene.count("splats"));
    return scene;
  }
  throw std::logic_error("no measured scene " + name);
}

std::vector<MeasuredScene> measured_uniform_scenes() {
  std::vector<MeasuredScene> scenes = rows_of(std::filesystem::path(VRPIPE_MEASURED) / "equal_splats.csv");
  for (MeasuredScene& scene : scenes) {
    scene.draw.width = scene.draw.height = measured::equal_splats_side;
    scene.draw.splats = measured::equal_splats(scene.values.at("a"), scene.values.at("b"),
                                               static_cast<float>(scene.values.at("opacity")), scene.count("splats"),
                                               measured::equal_splats_side);
  }
  return scenes;
}

std::vector<MeasuredScene> measured_in_shader_scenes() {
  std::vector<MeasuredScene> scenes = rows_of(data_file("measured_in_shader.csv"));
  for (MeasuredScene& scene : scenes) {
    if (scene.values.count("half_side") != 0) {
      scene.draw.width = scene.draw.height = measured::equal_splats_side;
      scene.draw.splats = measured::equal_splats(scene.values.at("half_side"), scene.values.at("half_side"), 0.02F,
                                                 scene.count("splats"), scene.values.at("region"));
    } else if (scene.name != "trained") {
      scene.draw = measured_scene(scene.name).draw;
    }
  }
  return scenes;
}

std::vector<MeasuredScene> measured_passes() { return rows_of(data_file("measured_passes.csv")); }

}  // namespace vrpipe::testing
