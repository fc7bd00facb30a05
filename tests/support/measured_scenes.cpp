#include "support/measured_scenes.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "support/data.h"

namespace vrpipe::testing {

namespace {

/// The random numbers that the scenes were made with.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ULL + 1) {
    for (unsigned i = 0; i < 10; ++i) next();
  }
  std::uint32_t next() {
    state_ ^= state_ << 13U;
    state_ ^= state_ >> 7U;
    state_ ^= state_ << 17U;
    return static_cast<std::uint32_t>(state_ >> 16U);
  }
  /// From 0 to 1.
  double uniform() { return (next() >> 4U) * (1.0 / 268435456.0); }
  double normal() {
    const double length = std::sqrt(-2 * std::log(uniform() + 1e-12));
    return length * std::cos(2 * M_PI * uniform());
  }

 private:
  std::uint64_t state_;
};

struct Kind {
  const char* name;
  bool is_object;        ///< all in a disc in the middle; else near clusters, or anywhere
  double size, spread;   ///< of the longer semi-axis: median in pixels, deviation of the logarithm
  double near, nearing;  ///< the perspective's factor of the first splat, and what the last has less
  std::uint64_t seed;
};
constexpr Kind kinds[] = {{"object", true, 1.8, 0.75, 1.25, 0.5, 11},
                          {"sweep-50k", false, 1.2, 0.8, 1.6, 1.1, 21},
                          {"size-25", false, 2.5, 0.5, 1.6, 1.1, 22}};

struct Cluster {
  double x, y, radius, depth;
};

void place(Draws& random, const Kind& kind, double depth, const std::vector<Cluster>& clusters, Splat& splat,
           double width, double height) {
  double x = 0, y = 0;
  if (kind.is_object) {
    const double angle = 2 * M_PI * random.uniform();
    const double radius = std::sqrt(random.uniform()) * 0.36 * height;
    x = width / 2 + std::cos(angle) * radius;
    y = height / 2 + std::sin(angle) * radius;
  } else if (random.uniform() < 0.45) {
    const Cluster* nearest = nullptr;
    for (unsigned i = 0; i < 6; ++i) {
      const Cluster& other = clusters[random.next() % clusters.size()];
      if (nearest == nullptr || std::fabs(other.depth - depth) < std::fabs(nearest->depth - depth)) nearest = &other;
    }
    x = nearest->x + random.normal() * nearest->radius;
    y = nearest->y + random.normal() * nearest->radius;
  } else {
    x = (1.1 * random.uniform() - 0.05) * width;
    y = (1.1 * random.uniform() - 0.05) * height;
  }
  splat.cx = static_cast<float>(x);
  splat.cy = static_cast<float>(y);
}

double opacity_of(Draws& random) {
  constexpr double low = 0.45;
  const double kind = random.uniform();
  if (kind < low) return 0.01 + 0.19 * random.uniform();
  if (kind < low + (1 - low) / 2) return 0.2 + 0.6 * random.uniform();
  return 0.8 + 0.19 * random.uniform();
}

Draw scene_of(const Kind& kind, std::uint32_t width, std::uint32_t height, std::uint64_t splats) {
  Draw draw;
  draw.width = width;
  draw.height = height;
  Draws random(kind.seed);
  std::vector<Cluster> clusters(160);
  for (Cluster& cluster : clusters) {
    cluster.x = random.uniform() * width;
    cluster.y = random.uniform() * height;
    cluster.radius = (0.03 + 0.12 * random.uniform()) * height;
    cluster.depth = random.uniform();
  }
  for (std::uint64_t i = 0; i < splats; ++i) {
    const double depth = (static_cast<double>(i) + 0.5) / static_cast<double>(splats);
    Splat splat{};
    place(random, kind, depth, clusters, splat, width, height);
    const double perspective = kind.near - kind.nearing * depth;
    double longer = std::min(60.0, std::max(0.4, kind.size * perspective * std::exp(kind.spread * random.normal())));
    double shorter = std::max(0.4, longer * std::exp(-std::fabs(0.9 * random.normal())));
    longer = std::sqrt(longer * longer + 0.3);
    shorter = std::sqrt(shorter * shorter + 0.3);
    const double opacity = opacity_of(random);
    const double radius = std::max(0.05, std::sqrt(2 * std::log(255 * opacity)));
    const double angle = 3.14159265 * random.uniform();
    splat.ax = static_cast<float>(std::cos(angle) * longer * radius);
    splat.ay = static_cast<float>(std::sin(angle) * longer * radius);
    splat.bx = static_cast<float>(-std::sin(angle) * shorter * radius);
    splat.by = static_cast<float>(std::cos(angle) * shorter * radius);
    splat.r = static_cast<float>(radius);
    splat.red = static_cast<float>(random.uniform());
    splat.green = static_cast<float>(random.uniform());
    splat.blue = static_cast<float>(random.uniform());
    splat.opacity = static_cast<float>(opacity);
    draw.splats.push_back(splat);
  }
  return draw;
}

Draw uniform_of(double a, double b, float opacity, std::uint64_t splats) {
  Draw draw;
  draw.width = draw.height = 1024;
  Draws random(31);
  for (std::uint64_t i = 0; i < splats; ++i) {
    Splat splat{};
    const double angle = random.uniform() * 3.14159265;
    splat.cx = static_cast<float>(random.uniform() * 1024);
    splat.cy = static_cast<float>(random.uniform() * 1024);
    splat.ax = static_cast<float>(std::cos(angle) * a);
    splat.ay = static_cast<float>(std::sin(angle) * a);
    splat.bx = static_cast<float>(-std::sin(angle) * b);
    splat.by = static_cast<float>(std::cos(angle) * b);
    splat.r = 1;
    splat.red = static_cast<float>(random.uniform());
    splat.green = static_cast<float>(random.uniform());
    splat.blue = static_cast<float>(random.uniform());
    splat.opacity = opacity;
    draw.splats.push_back(splat);
  }
  return draw;
}

/// Rows of a file: the name, and values by column.
std::vector<MeasuredScene> rows_of(const std::string& name) {
  const auto cells_of = [](const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream rest(line);
    for (std::string cell; std::getline(rest, cell, ',');) cells.push_back(cell);
    return cells;
  };
  std::ifstream file(data_file(name));
  std::string line;
  std::getline(file, line);
  const std::vector<std::string> columns = cells_of(line);
  std::vector<MeasuredScene> rows;
  while (std::getline(file, line)) {
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() != columns.size()) throw std::runtime_error(name + ": " + line);
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

const std::vector<std::string>& measured_scene_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Kind& kind : kinds) all.emplace_back(kind.name);
    return all;
  }();
  return names;
}

MeasuredScene measured_scene(const std::string& name) {
  for (MeasuredScene& scene : rows_of("measured_scenes.csv")) {
    if (scene.name != name) continue;
    const auto kind =
        std::find_if(std::begin(kinds), std::end(kinds), [&](const Kind& each) { return name == each.name; });
    scene.draw = scene_of(*kind, static_cast<std::uint32_t>(scene.count("width")),
                          static_cast<std::uint32_t>(scene.count("height")), scene.count("splats"));
    return scene;
  }
  throw std::logic_error("no measured scene " + name);
}

std::vector<MeasuredScene> measured_uniform_scenes() {
  std::vector<MeasuredScene> scenes = rows_of("measured_uniform.csv");
  for (MeasuredScene& scene : scenes) {
    scene.draw = uniform_of(scene.values.at("a"), scene.values.at("b"), static_cast<float>(scene.values.at("opacity")),
                            scene.count("splats"));
  }
  return scenes;
}

}  // namespace vrpipe::testing
