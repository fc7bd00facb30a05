#include "support/stand_in_scene.h"

#include <cmath>
#include <utility>
#include <vector>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/workloads/portable_math.h>

namespace vrpipe::testing {

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double low_pass_variance = 0.3;  // of 3D Gaussian splatting, pixels squared

/// The draws of one splat, or one cluster, by number.
class Stream {
 public:
  Stream(std::uint64_t seed, std::uint64_t number) : state_(mix(seed ^ mix(number))) {}

  double uniform() {
    state_ = mix(state_);
    return static_cast<double>(state_ >> 11U) * 0x1p-53;
  }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double normal() {
    const double radius = std::sqrt(-2 * portable_log(1 - uniform()));
    return radius * portable_cos(2 * pi * uniform());
  }

 private:
  std::uint64_t state_;
};

/// In widths and heights of the image.
struct Place {
  double x, y;
};

Place anywhere(Stream& stream, double margin) {
  const double x = stream.uniform(-margin, 1 + margin);
  return {x, stream.uniform(-margin, 1 + margin)};
}

/// A point of a ball, projected.
Place in_ball(Stream& stream, double radius) {
  const double distance = radius * portable_exp(portable_log(1 - stream.uniform()) / 3);
  const double z = stream.uniform(-1, 1);
  const double across = distance * std::sqrt(1 - z * z);
  const double angle = stream.uniform(0, 2 * pi);
  return {0.5 + across * portable_cos(angle), 0.5 + across * portable_sin(angle)};
}

Place place_of(Stream& stream, const StandIn& parameters, const std::vector<Place>& clusters) {
  if (clusters.empty() || stream.uniform() >= parameters.clustered) {
    return parameters.ball > 0 ? in_ball(stream, parameters.ball) : anywhere(stream, parameters.margin);
  }
  const Place& centre = clusters[static_cast<std::size_t>(stream.uniform() * static_cast<double>(clusters.size()))];
  const double x = centre.x + parameters.spread * stream.normal();
  return {x, centre.y + parameters.spread * stream.normal()};
}

Splat splat_of(Stream& stream, const StandIn& parameters, const Place& place) {
  Splat splat = {};
  splat.opacity = static_cast<float>(stream.uniform(parameters.low_opacity, parameters.high_opacity));
  const double r = std::sqrt(2 * portable_log(255 * static_cast<double>(splat.opacity)));
  const double size = parameters.size * portable_exp(parameters.sigma * stream.normal());
  const double ratio = portable_exp(parameters.anisotropy * stream.normal() / 2);
  const auto extent = [&](double deviation) { return r * std::sqrt(deviation * deviation + low_pass_variance); };
  const double a = extent(size * ratio), b = extent(size / ratio);
  const double angle = stream.uniform(0, pi);
  const double cosine = portable_cos(angle), sine = portable_sin(angle);
  splat.cx = static_cast<float>(place.x);
  splat.cy = static_cast<float>(place.y);
  splat.ax = static_cast<float>(a * cosine);
  splat.ay = static_cast<float>(a * sine);
  splat.bx = static_cast<float>(-b * sine);
  splat.by = static_cast<float>(b * cosine);
  splat.r = static_cast<float>(r);
  splat.red = static_cast<float>(stream.uniform());
  splat.green = static_cast<float>(stream.uniform());
  splat.blue = static_cast<float>(stream.uniform());
  return splat;
}

}  // namespace

Draw stand_in_scene(const StandIn& parameters, std::uint64_t splats, std::uint32_t width, std::uint32_t height) {
  std::vector<Place> clusters;
  for (unsigned i = 0; i < parameters.clusters; ++i) {
    Stream stream(~parameters.seed, i);
    clusters.push_back(anywhere(stream, 0));
  }
  Draw draw;
  draw.width = width;
  draw.height = height;
  draw.splats.reserve(splats);
  for (std::uint64_t i = 0; i < splats; ++i) {
    Stream stream(parameters.seed, i);
    const Place place = place_of(stream, parameters, clusters);
    draw.splats.push_back(splat_of(stream, parameters, {place.x * width, place.y * height}));
  }
  return draw;
}

}  // namespace vrpipe::testing
