#include <vrpipe/workloads/measured_splats.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <vrpipe/workloads/portable_math.h>

namespace vrpipe::measured {

namespace {

/// The random numbers that the scenes were made with.
class MeasuredRandom {
 public:
  explicit MeasuredRandom(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ULL + 1) {
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
    const double length = std::sqrt(-2 * portable_log(uniform() + 1e-12));
    return length * portable_cos(2 * kPi * uniform());
  }

 private:
  std::uint64_t state_;
};

struct SyntheticKind {
  const char* name;
  bool is_object;        ///< all in a disc in the middle; else near clusters, or anywhere
  double size, spread;   ///< of the longer semi-axis: median in pixels, deviation of the logarithm
  double near, nearing;  ///< the perspective's factor of the first splat, and what the last has less
  std::uint64_t seed;
};
constexpr SyntheticKind synthetic_kinds[] = {{"object", true, 1.8, 0.75, 1.25, 0.5, 11},
                                             {"sweep-50k", false, 1.2, 0.8, 1.6, 1.1, 21},
                                             {"size-25", false, 2.5, 0.5, 1.6, 1.1, 22}};

struct SyntheticCluster {
  double x, y, radius, depth;
};

void place_splat(MeasuredRandom& random, const SyntheticKind& kind, double depth,
                 const std::vector<SyntheticCluster>& clusters, Splat& splat, double width, double height) {
  double x = 0, y = 0;
  if (kind.is_object) {
    const double angle = 2 * kPi * random.uniform();
    const double radius = std::sqrt(random.uniform()) * 0.36 * height;
    x = width / 2 + portable_cos(angle) * radius;
    y = height / 2 + portable_sin(angle) * radius;
  } else if (random.uniform() < 0.45) {
    const SyntheticCluster* nearest = nullptr;
    for (unsigned i = 0; i < 6; ++i) {
      const SyntheticCluster& other = clusters[random.next() % clusters.size()];
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

double synthetic_opacity(MeasuredRandom& random) {
  constexpr double low = 0.45;
  const double kind = random.uniform();
  if (kind < low) return 0.01 + 0.19 * random.uniform();
  if (kind < low + (1 - low) / 2) return 0.2 + 0.6 * random.uniform();
  return 0.8 + 0.19 * random.uniform();
}

Draw synthetic_scene_of(const SyntheticKind& kind, std::uint32_t width, std::uint32_t height, std::uint64_t splats) {
  Draw draw;
  draw.width = width;
  draw.height = height;
  MeasuredRandom random(kind.seed);
  std::vector<SyntheticCluster> clusters(160);
  for (SyntheticCluster& cluster : clusters) {
    cluster.x = random.uniform() * width;
    cluster.y = random.uniform() * height;
    cluster.radius = (0.03 + 0.12 * random.uniform()) * height;
    cluster.depth = random.uniform();
  }
  for (std::uint64_t i = 0; i < splats; ++i) {
    const double depth = (static_cast<double>(i) + 0.5) / static_cast<double>(splats);
    Splat splat{};
    place_splat(random, kind, depth, clusters, splat, width, height);
    const double perspective = kind.near - kind.nearing * depth;
    double longer =
        std::min(60.0, std::max(0.4, kind.size * perspective * portable_exp(kind.spread * random.normal())));
    double shorter = std::max(0.4, longer * portable_exp(-std::fabs(0.9 * random.normal())));
    longer = std::sqrt(longer * longer + 0.3);
    shorter = std::sqrt(shorter * shorter + 0.3);
    const double opacity = synthetic_opacity(random);
    const double radius = std::max(0.05, std::sqrt(2 * portable_log(255 * opacity)));
    const double angle = 3.14159265 * random.uniform();
    splat.ax = static_cast<float>(portable_cos(angle) * longer * radius);
    splat.ay = static_cast<float>(portable_sin(angle) * longer * radius);
    splat.bx = static_cast<float>(-portable_sin(angle) * shorter * radius);
    splat.by = static_cast<float>(portable_cos(angle) * shorter * radius);
    splat.r = static_cast<float>(radius);
    splat.red = static_cast<float>(random.uniform());
    splat.green = static_cast<float>(random.uniform());
    splat.blue = static_cast<float>(random.uniform());
    splat.opacity = static_cast<float>(opacity);
    draw.splats.push_back(splat);
  }
  return draw;
}

}  // namespace

std::vector<Splat> equal_splats(double a, double b, float opacity, std::uint64_t count, double region) {
  std::vector<Splat> splats;
  MeasuredRandom random(31);
  for (std::uint64_t i = 0; i < count; ++i) {
    Splat splat{};
    const double angle = random.uniform() * 3.14159265;
    splat.cx = static_cast<float>(random.uniform() * region);
    splat.cy = static_cast<float>(random.uniform() * region);
    splat.ax = static_cast<float>(portable_cos(angle) * a);
    splat.ay = static_cast<float>(portable_sin(angle) * a);
    splat.bx = static_cast<float>(-portable_sin(angle) * b);
    splat.by = static_cast<float>(portable_cos(angle) * b);
    splat.r = 1;
    splat.red = static_cast<float>(random.uniform());
    splat.green = static_cast<float>(random.uniform());
    splat.blue = static_cast<float>(random.uniform());
    splat.opacity = opacity;
    splats.push_back(splat);
  }
  return splats;
}

Draw synthetic_scene(const std::string& name, std::uint32_t width, std::uint32_t height, std::uint64_t splats) {
  const auto kind = std::find_if(std::begin(synthetic_kinds), std::end(synthetic_kinds),
                                 [&](const SyntheticKind& each) { return name == each.name; });
  if (kind == std::end(synthetic_kinds)) throw std::logic_error("no synthetic scene " + name);
  return synthetic_scene_of(*kind, width, height, splats);
}

const std::vector<std::string>& synthetic_scene_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const SyntheticKind& kind : synthetic_kinds) all.emplace_back(kind.name);
    return all;
  }();
  return names;
}

}  // namespace vrpipe::measured
