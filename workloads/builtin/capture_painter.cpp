#include "capture_painter.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <thread>

#include <glm/geometric.hpp>

#include <vrpipe/workloads/portable_math.h>

#include "for_each_chunk.h"

#include "../spherical_harmonics.h"

namespace vrpipe {
namespace {

/// Median sigma, pixels, at scale 1: patches are laid out for it.
constexpr double kSigma = 2.0;
/// Side of a patch, in sigmas.
constexpr double kPatch = 12.0;
constexpr int kProbes = 6;
/// Patches that are planned or painted at a time.
constexpr std::size_t kPatches = 64;

/// Another stream for each patch and each purpose.
RandomStream stream_of(std::uint64_t seed, std::uint64_t purpose, std::uint64_t index) {
  RandomStream mixer(seed ^ (purpose * 0xd1342543de82ef95u + index * 0xaf251af3b0f025b5u));
  return RandomStream(mixer.next());
}

/// About normal, mean 0, deviation 1, within 3.5: the sum of four uniform values of 16 bits. Splats need many.
double bell(RandomStream& random) {
  const std::uint64_t bits = random.next();
  const std::uint64_t sum = (bits & 0xffff) + (bits >> 16 & 0xffff) + (bits >> 32 & 0xffff) + (bits >> 48);
  return (static_cast<double>(sum) - 131070.0) * (1.7320508075688772 / 65536.0);
}

}  // namespace

// Median opacities of 0.93, 0.73 and 0.70; of a tenth of all at most 0.27, 0.13 and 0.20.
const Population kOutdoorPopulation{2.2, 1.6, 3.0, 1.9, 0.5, 0.5, 0.16};
const Population kIndoorPopulation{0.65, 1.45, 3.2, 1.4, 0.62, 0.5, 0.16};
const Population kObjectPopulation{0.45, 1.15, 4.5, 0.8, 0.35, 0.64, 0.1};

double Population::box_area() const {
  // Weighted by area, the logarithm of the size is normal as well, its mean two variances higher.
  const double typical = logit - 2 * size_deviation * logit_by_size;
  const double opacity = 1 / (1 + portable_exp(-typical));
  const double reach_squared = 2 * std::max(0.5, portable_log(255 * opacity));
  return 4 * reach_squared * portable_exp(2 * size_deviation * size_deviation + axis_deviation * axis_deviation);
}

struct CapturePainter::Tools {
  BlockerTree blockers;
};

CapturePainter::CapturePainter(std::uint64_t seed, const View& view, std::uint32_t height, const Population& population,
                               int sh_degree)
    : seed_(seed),
      random_(seed),
      population_(population),
      sh_degree_(sh_degree),
      pixel_angle_(2.0 * portable_tan_degrees(0.5 * view.fovy_degrees) / height) {
  if (sh_degree != 0 && sh_degree != 1) throw std::invalid_argument("CapturePainter: SH degree 0 or 1");
  cameras_.push_back({view.eye[0], -view.eye[1], view.eye[2]});
}

void CapturePainter::ring_of_cameras(const Vec3& centre, double radius, int count) {
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * kPi * (i + 0.5) / count;
    camera(centre + Vec3{radius * portable_cos(angle), 0, radius * portable_sin(angle)});
  }
}

void CapturePainter::surface(const Surface& surface, const Paint& paint, const Texture& texture) {
  strokes_.push_back({Kind::surface, surface, paint, texture});
}

void CapturePainter::quad(const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v, const Paint& paint,
                          const Texture& texture) {
  strokes_.push_back({Kind::quad, quad_surface(corner, edge_u, edge_v), paint, texture, edge_u, edge_v});
}

void CapturePainter::slab(const Vec3& corner, const Vec3& a, const Vec3& b, const Vec3& c, const Paint& paint,
                          const Texture& texture) {
  quad(corner, b, a, paint, texture);
  quad(corner + c, a, b, paint, texture);
  quad(corner, a, c, paint, texture);
  quad(corner + b, c, a, paint, texture);
  quad(corner, c, b, paint, texture);
  quad(corner + a, b, c, paint, texture);
}

void CapturePainter::box(const Vec3& centre, const Vec3& half, const Paint& paint, const Texture& texture) {
  block_box(centre, half);
  slab(centre - half, {2 * half[0], 0, 0}, {0, 2 * half[1], 0}, {0, 0, 2 * half[2]}, paint, texture);
}

void CapturePainter::cylinder(const Vec3& base, const Vec3& top, double base_radius, double top_radius,
                              const Paint& paint, const Texture& texture) {
  const Vec3 axis = unit(top - base);
  const double inner = 0.7 * std::min(base_radius, top_radius);
  Vec3 half = (top - base) * 0.5;
  for (std::size_t i = 0; i < 3; ++i) {
    half[i] = std::fabs(half[i]) + inner * std::sqrt(std::max(0.0, 1 - axis[i] * axis[i]));
  }
  // Of a slanted one the box would be far too large.
  if (std::max(std::fabs(axis[0]), std::max(std::fabs(axis[1]), std::fabs(axis[2]))) > 0.99) {
    block_box((base + top) * 0.5, half);
  }
  surface(frustum_surface(base, top, base_radius, top_radius), paint, texture);
  surface(disc_surface(base, axis * -1.0, 0, base_radius), paint, texture);
  surface(disc_surface(top, axis, 0, top_radius), paint, texture);
}

void CapturePainter::ball(const Vec3& centre, const Vec3& radii, const Paint& paint, const Texture& texture) {
  block_ball(centre, radii * 0.97);
  surface(ellipsoid_surface(centre, radii), paint, texture);
}

void CapturePainter::cloud(const Vec3& centre, const Vec3& radii, const Paint& paint, const Texture& texture) {
  strokes_.push_back({Kind::cloud, {}, paint, texture, centre, radii});
}

void CapturePainter::floaters(const Vec3& centre, const Vec3& half, std::uint64_t count, double size) {
  Texture texture;
  texture.size = size;
  texture.logit = -3;
  texture.emission = 1;
  strokes_.push_back({Kind::floaters, {}, plain({0.7, 0.7, 0.72}), texture, centre, half, count});
}

double CapturePainter::distance_of_cameras(const Vec3& position, const Vec3& normal) const {
  double sum = 0;
  for (const Vec3& camera : cameras_) {
    const Vec3 offset = camera - position;
    const double squared = std::max(0.09, dot(offset, offset));
    const double facing = std::fabs(dot(offset, normal)) / std::sqrt(squared);
    sum += (normal == Vec3{} ? 0.5 : std::max(0.02, facing)) / squared;
  }
  return std::sqrt(static_cast<double>(cameras_.size()) / sum);
}

void CapturePainter::divide(std::uint32_t stroke, double u, double v, double du, double dv, int depth,
                            std::vector<Cell>& cells) const {
  const Stroke& s = strokes_[stroke];
  const SurfacePoint middle = s.surface(u + 0.5 * du, v + 0.5 * dv);
  const auto length = [&](double u0, double v0, double u1, double v1) {
    return glm::length(s.surface(u1, v1).position - s.surface(u0, v0).position);
  };
  // Of a curved side the middle lies off the line between its ends.
  const double um = u + 0.5 * du, vm = v + 0.5 * dv;
  const double along_u = length(u, vm, um, vm) + length(um, vm, u + du, vm);
  const double along_v = length(um, v, um, vm) + length(um, vm, um, v + dv);
  const double distance = distance_of_cameras(middle.position, s.kind == Kind::quad ? middle.normal : Vec3{});
  const double side = kPatch * kSigma * s.texture.size * pixel_angle_ * distance;
  // Between the ends of a half or of a whole circle there is no area to see.
  const bool bent = s.kind == Kind::surface && du > 0.25;
  if (bent || (std::max(along_u, along_v) > side && depth < 24)) {
    if (bent || along_u >= along_v) {
      divide(stroke, u, v, 0.5 * du, dv, depth + 1, cells);
      divide(stroke, um, v, 0.5 * du, dv, depth + 1, cells);
    } else {
      divide(stroke, u, v, du, 0.5 * dv, depth + 1, cells);
      divide(stroke, u, vm, du, 0.5 * dv, depth + 1, cells);
    }
    return;
  }
  const Vec3 diagonal = s.surface(u + du, v + dv).position - s.surface(u, v).position;
  const Vec3 other = s.surface(u, v + dv).position - s.surface(u + du, v).position;
  const double area = 0.5 * glm::length(cross(diagonal, other));
  const double sigma = kSigma * s.texture.size * pixel_angle_ * distance;
  Cell cell{stroke, u, v, du, dv, distance};
  cell.weight = s.texture.layers * area / (population_.box_area() * sigma * sigma);
  if (cell.weight > 0) cells.push_back(cell);
}

SurfacePoint CapturePainter::point(const Stroke& stroke, const Cell& cell, RandomStream& random, double& u,
                                   double& v) const {
  if (stroke.kind == Kind::floaters) {
    u = v = 0;
    const Vec3 where = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    return {stroke.a + stroke.b * where, random.direction()};
  }
  if (stroke.kind == Kind::cloud) {
    const Vec3 out = random.direction();
    // More near the outside.
    const double first = random.uniform();
    v = 1 - 0.6 * (first * random.uniform());
    u = random.uniform();
    return {stroke.a + out * stroke.b * v, unit(out + random.direction() * 0.9)};
  }
  u = cell.u + cell.du * random.uniform();
  v = cell.v + cell.dv * random.uniform();
  return stroke.surface(u, v);
}

bool CapturePainter::sees(const Vec3& camera, const SurfacePoint& point, const Tools& tools) {
  const Vec3 ray = camera - point.position;
  if (dot(ray, point.normal) < -0.05 * glm::length(ray)) return false;
  // Starts clear of the surface, stops short of the camera.
  return !tools.blockers.blocks(point.position + ray * 0.004, ray, 0.98);
}

bool CapturePainter::seen(const SurfacePoint& point, const Tools& tools) const {
  return std::any_of(cameras_.begin(), cameras_.end(), [&](const Vec3& camera) { return sees(camera, point, tools); });
}

void CapturePainter::weigh(Cell& cell, RandomStream& random, const Tools& tools) const {
  const Stroke& stroke = strokes_[cell.stroke];
  if (stroke.kind == Kind::floaters) return;
  Vec3 low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
  int visible = 0;
  std::ptrdiff_t views = 0;
  for (int i = 0; i < kProbes; ++i) {
    double u, v;
    const SurfacePoint p = point(stroke, cell, random, u, v);
    const Vec3 colour = stroke.paint(p.position, u, v);
    low = glm::min(low, colour);
    high = glm::max(high, colour);
    const auto from =
        std::count_if(cameras_.begin(), cameras_.end(), [&](const Vec3& camera) { return sees(camera, p, tools); });
    visible += from > 0;
    views += from;
  }
  const Vec3 spread = high - low;
  const double detail = std::max(spread[0], std::max(spread[1], spread[2]));
  if (stroke.kind != Kind::cloud) cell.size = 1.45 - 0.8 * std::min(1.0, std::max(0.0, (detail - 0.04) / 0.36));
  const double share = static_cast<double>(views) / (kProbes * static_cast<double>(cameras_.size()));
  cell.weight *= (share + (1 - share) * hidden_share_) / (cell.size * cell.size);
  cell.partly_seen = visible > 0 && visible < kProbes;
}

GaussianAttributes CapturePainter::splat(const Stroke& stroke, const Cell& cell, const SurfacePoint& point, double u,
                                         double v, double scale, RandomStream& random, const Tools& tools) const {
  const Texture& texture = stroke.texture;
  const Vec3& normal = point.normal;
  const double spacing = pixel_angle_ * cell.distance;
  Vec3 albedo = stroke.paint(point.position, u, v);
  if (stroke.kind == Kind::floaters) albedo *= random.uniform(0.5, 1.3);

  // One ray to a sun of some width and one into the sky; over the many splats of a pixel they add up to soft shadows.
  const double facing = dot(normal, to_sun_);
  const Vec3 sun_ray = unit(to_sun_ + random.direction() * 0.06);
  const Vec3 sky_rays[] = {unit(normal + random.direction() * 0.98), unit(normal + random.direction() * 0.98)};
  Vec3 light = {1, 1, 1};
  if (texture.emission < 1) {
    const Vec3 from = point.position + normal * (0.5 * kSigma * spacing);
    const double direct = facing > 0 && !tools.blockers.blocks(from, sun_ray, 1e4) ? facing : 0.0;
    double open = 0.4;
    for (const Vec3& ray : sky_rays) open += tools.blockers.blocks(from, ray, contact_reach_) ? 0 : 0.3;
    light = sun_ * direct + sky_ * (open * (0.75 + 0.25 * normal[1]));
    light = light * (1 - texture.emission) + Vec3{1, 1, 1} * texture.emission;
  }
  const Vec3 colour = albedo * light * (1 + 0.06 * bell(random));

  double along_normal = bell(random) * texture.depth;
  if (random.uniform() < texture.behind) along_normal = -10 * std::fabs(along_normal);
  const Vec3 position = point.position + normal * (along_normal * cell.distance);

  const double deviations = bell(random);
  const double log_size =
      portable_log(kSigma * scale * texture.size * cell.size * spacing) + population_.size_deviation * deviations;
  double log_t = log_size + population_.axis_deviation * bell(random);
  double log_b = log_size + population_.axis_deviation * bell(random);

  // A frame around the normal, which wobbles a little, turned at random about it.
  Vec3 n = normal, t, b;
  Vec3 turn = random.direction();
  const Vec3 wobble = random.direction() * 0.12;
  if (stroke.kind == Kind::quad) {
    // Close to an edge: along it, and not beyond.
    const double lu = glm::length(stroke.a), lv = glm::length(stroke.b);
    const double to_u = std::min(u, 1 - u) * lu, to_v = std::min(v, 1 - v) * lv;
    const bool along_v = to_u < to_v;
    const double room = portable_log(std::max(0.5 * std::min(to_u, to_v), 0.3 * spacing));
    const double far_room = portable_log(std::max(0.5 * std::max(to_u, to_v), 0.3 * spacing));
    if (std::max(log_t, log_b) > room) {
      turn = along_v ? stroke.b : stroke.a;
      if (log_b > log_t) std::swap(log_t, log_b);
      log_b = std::min(log_b, room);
      log_t = std::min(log_t, far_room);
    } else {
      n = unit(normal + wobble);
    }
  } else {
    n = unit(normal + wobble);
  }
  n = {n[0], -n[1], n[2]};  // y turns down here
  turn = {turn[0], -turn[1], turn[2]};
  tangents(n, t, b);
  turn = turn - n * dot(turn, n);
  if (dot(turn, turn) > 1e-12) {
    t = unit(turn);
    b = cross(n, t);
  }
  const std::array<double, 4> q = quaternion(t, b, n);

  const double rank = bell(random);
  const double logit = population_.logit + texture.logit - population_.logit_by_size * deviations +
                       (rank < 0 ? population_.logit_below : population_.logit_above) * rank;

  GaussianAttributes gaussian;
  gaussian.position = {static_cast<float>(position[0]), static_cast<float>(-position[1]),
                       static_cast<float>(position[2])};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    gaussian.f_dc[channel] = static_cast<float>((colour[channel] - 0.5) / kShC0);
  }
  gaussian.opacity_logit = static_cast<float>(logit);
  gaussian.log_scale = {static_cast<float>(log_t), static_cast<float>(log_b),
                        static_cast<float>(log_size + portable_log(population_.thickness) + 0.4 * bell(random))};
  for (std::size_t i = 0; i < q.size(); ++i) gaussian.rotation[i] = static_cast<float>(q[i]);
  if (sh_degree_ == 0) return gaussian;
  // Degree 1: brighter when seen along the mirrored sun ray.
  const Vec3 mirrored = normal * (2 * facing) - to_sun_;
  const double strength = texture.gloss * (facing > 0 ? 1.0 : 0.3);
  const Vec3 lobe = {-strength * mirrored[1], -strength * mirrored[2], strength * mirrored[0]};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t c = 0; c < 3; ++c) {
      gaussian.f_rest[channel][c] = static_cast<float>((lobe[c] + 0.01 * bell(random)) / kShC1);
    }
  }
  return gaussian;
}

void CapturePainter::paint(const Cell& cell, double scale, RandomStream& random, const Tools& tools,
                           GaussianArray& gaussians) const {
  const Stroke& stroke = strokes_[cell.stroke];
  for (std::uint64_t i = 0; i < cell.count; ++i) {
    double u = 0, v = 0;
    SurfacePoint p{};
    // Where a part of the patch is hidden, most of the splats go elsewhere.
    for (int attempt = 0; attempt < 40; ++attempt) {
      p = point(stroke, cell, random, u, v);
      if (!cell.partly_seen || seen(p, tools) || random.uniform() < hidden_share_) break;
    }
    gaussians.set(cell.first + i, splat(stroke, cell, p, u, v, scale, random, tools));
  }
}

GaussianScene CapturePainter::build(std::uint64_t count, unsigned threads) {
  if (threads == 0) threads = std::max(1U, std::thread::hardware_concurrency());
  const Tools tools{BlockerTree(blockers_)};

  // Patches, each of about as many Gaussians as another.
  std::vector<std::vector<Cell>> of_stroke(strokes_.size());
  for_each_chunk(strokes_.size(), threads, [&](std::uint64_t i) {
    const Stroke& stroke = strokes_[i];
    std::vector<Cell>& cells = of_stroke[i];
    const auto index = static_cast<std::uint32_t>(i);
    if (stroke.kind == Kind::surface || stroke.kind == Kind::quad) {
      divide(index, 0, 0, 1, 1, 0, cells);
      return;
    }
    Cell cell{index};
    cell.distance = distance_of_cameras(stroke.a, {});
    if (stroke.kind == Kind::floaters) {
      cell.count = stroke.count;
      cells.push_back(cell);
      return;
    }
    const double sigma = kSigma * stroke.texture.size * pixel_angle_ * cell.distance;
    const double shadow = kPi * std::max(stroke.b[0], stroke.b[2]) * stroke.b[1];  // about what it covers of the view
    const double weight = stroke.texture.layers * shadow / (population_.box_area() * sigma * sigma);
    const double parts = std::max(1.0, std::floor(weight / 64));
    cell.weight = weight / parts;
    cells.assign(static_cast<std::size_t>(parts), cell);
  });
  std::vector<Cell> cells;
  for (std::vector<Cell>& some : of_stroke) {
    cells.insert(cells.end(), some.begin(), some.end());
    some = {};
  }
  const std::uint64_t chunks = (cells.size() + kPatches - 1) / kPatches;
  const auto of_chunk = [&](std::uint64_t chunk, const auto& work) {
    const std::size_t end = std::min<std::size_t>(cells.size(), (chunk + 1) * kPatches);
    for (std::size_t i = chunk * kPatches; i < end; ++i) work(i);
  };
  for_each_chunk(chunks, threads, [&](std::uint64_t chunk) {
    of_chunk(chunk, [&](std::size_t i) {
      RandomStream random = stream_of(seed_, 1, i);
      weigh(cells[i], random, tools);
    });
  });

  // Every patch gets its share of the Gaussians, rounded so that the shares add up.
  std::uint64_t lone = 0;
  double total = 0;
  for (const Cell& cell : cells) {
    total += cell.weight;
    lone += cell.count;
  }
  if (lone >= count || !(total > 0)) throw std::invalid_argument("CapturePainter: more floaters than Gaussians");
  const auto spread = static_cast<double>(count - lone);
  double sum = 0;
  std::uint64_t given = 0, place = 0;
  for (Cell& cell : cells) {
    cell.first = place;
    if (cell.weight > 0) {
      sum += cell.weight;
      const auto until = static_cast<std::uint64_t>(spread * (sum / total));
      cell.count = until - given;
      given = until;
    }
    place += cell.count;
  }
  const double scale = std::sqrt(total / spread);

  GaussianArray gaussians(count, sh_degree_, "a built-in scene");
  for_each_chunk(chunks, threads, [&](std::uint64_t chunk) {
    of_chunk(chunk, [&](std::size_t i) {
      RandomStream random = stream_of(seed_, 2, i);
      paint(cells[i], scale, random, tools, gaussians);
    });
  });
  return gaussians.build();
}

}  // namespace vrpipe
