#include "support/measured_scenes.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "support/data.h"

namespace vrpipe::testing {

namespace {

/// Chosen by counts alone, never by cycles: size, sigma and anisotropy by fragments, quads and warps; opacity by the fragments
/// until termination; places by the triangles that clipping leaves and the pixels that terminate.
StandIn stand_in_of(const std::string& scene) {
  StandIn in;
  in.low_opacity = 0.1;
  in.high_opacity = 0.922;
  in.anisotropy = 0.87;
  in.margin = 0.034;
  in.clusters = 12;
  in.spread = 0.116;
  in.clustered = 0.405;
  const auto sizes = [&](double size, double sigma) {
    in.size = size;
    in.sigma = sigma;
  };
  if (scene == "object") {
    sizes(1.1737, 0.796);
    in.anisotropy = 0.677;
    in.high_opacity = 0.9527;
    in.clusters = 0;
    in.ball = 0.3861;
  } else if (scene == "indoor") {
    sizes(1.406, 0.858);
    in.anisotropy = 0.741;
    in.high_opacity = 0.8268;
    in.clustered = 0.399;
  } else if (scene == "outdoor") {
    sizes(1.063, 0.921);
    in.anisotropy = 0.772;
    in.high_opacity = 0.9026;
    in.margin = 0.038;
  } else if (scene.rfind("size-", 0) == 0) {
    in.margin = 0.038;
    if (scene == "size-4") sizes(0.317, 0.518);
    if (scene == "size-10") sizes(0.585, 0.717);
    if (scene == "size-25") sizes(1.505, 0.702);
    if (scene == "size-60") {
      sizes(3.668, 0.6985);
      in.high_opacity = 0.877;
    }
  } else {
    sizes(scene == "sweep-50k" ? 0.731 : scene == "sweep-100k" ? 0.735 : 0.739, 0.93);
  }
  return in;
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream rest(line);
  for (std::string cell; std::getline(rest, cell, ',');) cells.push_back(cell);
  return cells;
}

}  // namespace

std::uint64_t MeasuredScene::count(const std::string& column) const {
  return static_cast<std::uint64_t>(values.at(column));
}

Draw MeasuredScene::draw() const {
  return stand_in_scene(stand_in, count("splats"), static_cast<std::uint32_t>(count("width")),
                        static_cast<std::uint32_t>(count("height")));
}

std::vector<MeasuredScene> measured_scenes() {
  std::ifstream file(data_file("measured_scenes.csv"));
  std::string line;
  std::getline(file, line);
  const std::vector<std::string> columns = cells_of(line);
  std::vector<MeasuredScene> scenes;
  while (std::getline(file, line)) {
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() != columns.size()) throw std::runtime_error("measured_scenes.csv: " + line);
    MeasuredScene scene;
    scene.name = cells.front();
    for (std::size_t i = 1; i < cells.size(); ++i) {
      if (!cells[i].empty()) scene.values[columns[i]] = std::stod(cells[i]);
    }
    scene.stand_in = stand_in_of(scene.name);
    scenes.push_back(scene);
  }
  return scenes;
}

}  // namespace vrpipe::testing
