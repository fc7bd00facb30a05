#include "scene_painter.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include <vrpipe/workloads/portable_math.h>

#include "../spherical_harmonics.h"

namespace vrpipe {
namespace {

/// Mean area of a splat's box over the square of its median sigma, for the sizes and opacities of splat().
constexpr double kBoxArea = 45.0;

}  // namespace

ScenePainter::ScenePainter(std::uint64_t seed, const View& view, const ImageSize& size)
    : random_(seed),
      viewer_{view.eye[0], -view.eye[1], view.eye[2]},
      camera_(look_at(view, size)),
      pixel_angle_(2.0 * portable_tan_degrees(0.5 * view.fovy_degrees) / size.height),
      builder_(1) {}

void ScenePainter::block_box(const Vec3& centre, const Vec3& half) { blockers_.push_back({centre, half, false}); }
void ScenePainter::block_ball(const Vec3& centre, const Vec3& radii) { blockers_.push_back({centre, radii, true}); }

bool ScenePainter::blocked(const std::vector<Blocker>& blockers, const Vec3& from, const Vec3& direction,
                           double reach) {
  return std::any_of(blockers.begin(), blockers.end(),
                     [&](const Blocker& blocker) { return blocker.blocks(from, direction, reach); });
}

bool ScenePainter::hidden(const Vec3& position, const Vec3& normal) const {
  const Vec3 ray = viewer_ - position;
  if (dot(ray, normal) < -0.05 * std::sqrt(dot(ray, ray))) return true;
  // Stops short of the viewer and starts clear of the surface.
  return blocked(blockers_, position + ray * 0.01, ray, 0.98) || blocked(screens_, position + ray * 0.01, ray, 0.98);
}

bool ScenePainter::out_of_view(const Vec3& position) const {
  const Vec3 offset = {position[0] - camera_.eye[0], -position[1] - camera_.eye[1], position[2] - camera_.eye[2]};
  Vec3 seen{};
  for (std::size_t row = 0; row < 3; ++row) seen = seen + camera_.rotation[row] * offset[row];
  constexpr double kMargin = 1.15;
  return seen[2] < 0.3 || std::fabs(seen[0]) * camera_.fx > kMargin * 0.5 * camera_.width * seen[2] ||
         std::fabs(seen[1]) * camera_.fy > kMargin * 0.5 * camera_.height * seen[2];
}

double ScenePainter::splat_size(const Vec3& position, double sigma_pixels) const {
  const Vec3 offset = position - viewer_;
  const double distance = std::max(0.5, std::sqrt(dot(offset, offset)));
  return sigma_pixels * pixel_angle_ * distance;
}

void ScenePainter::splat(const Vec3& position, const Vec3& normal, const Paint& paint, double u, double v,
                         const Brush& brush) {
  if (hidden_share_ < 1 && hidden(position, normal) && random_.uniform() > hidden_share_) return;
  const Vec3 albedo = paint(position, u, v);
  const double size = splat_size(position, brush.sigma_pixels);
  // One ray to a sun of some width and one into the sky; over the many splats of a pixel they add up to soft shadows.
  const Vec3 sun_ray = unit(to_sun_ + random_.direction() * 0.06);
  const double facing = dot(normal, to_sun_);
  const double direct = facing > 0 && !blocked(blockers_, position, sun_ray, 1e3) ? facing : 0.0;
  const Vec3 sky_ray = unit(normal + random_.direction() * 0.98);
  const double open = blocked(blockers_, position, sky_ray, 1.5) ? 0.35 : 1.0;
  const Vec3 light = sun_ * direct + sky_ * (open * (0.75 + 0.25 * normal[1]));
  Vec3 colour = albedo * (light * (1 - brush.emission) + Vec3{1, 1, 1} * brush.emission);
  const double tone = 1 + 0.06 * random_.normal();
  colour = colour * tone;

  GaussianAttributes g;
  const Vec3 shifted =
      position + normal * (random_.normal() * brush.depth * size / (brush.sigma_pixels * pixel_angle_));
  g.position = {static_cast<float>(shifted[0]), static_cast<float>(-shifted[1]), static_cast<float>(shifted[2])};

  // A frame around the normal, which wobbles a little, turned at random about it. y turns down here.
  const Vec3 tilted = unit(normal + random_.direction() * 0.15);
  const Vec3 n = {tilted[0], -tilted[1], tilted[2]};
  Vec3 t, b;
  tangents(n, t, b);
  Vec3 turn = random_.direction();
  turn = turn - n * dot(turn, n);
  if (dot(turn, turn) > 1e-4) {
    t = unit(turn);
    b = cross(n, t);
  }
  const std::array<double, 4> q = quaternion(t, b, n);
  for (std::size_t i = 0; i < 4; ++i) g.rotation[i] = static_cast<float>(q[i]);

  // Log-normal sizes, flat along the normal. A few splats are much larger and faint.
  double log_size = portable_log(size);
  double kind = random_.uniform();
  const bool large = random_.uniform() < 0.012;
  if (large) {
    log_size += 1.1;
    kind = 1 - 0.5 * brush.faint;
  }
  g.log_scale = {static_cast<float>(log_size + 0.45 * random_.normal()),
                 static_cast<float>(log_size + 0.45 * random_.normal()),
                 static_cast<float>(log_size + portable_log(brush.thickness) + 0.3 * random_.normal())};
  double logit;
  if (kind < brush.opaque) {
    logit = 3.2 + 1.3 * random_.normal();
  } else if (kind < 1 - brush.faint) {
    logit = -0.2 + 1.0 * random_.normal();
  } else {
    logit = -2.4 + 0.8 * random_.normal();
  }
  g.opacity_logit = static_cast<float>(logit);

  // Degree 1: brighter when seen along the mirrored sun ray.
  const Vec3 mirrored = normal * (2 * facing) - to_sun_;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    g.f_dc[channel] = static_cast<float>((colour[channel] - 0.5) / kShC0);
    const double strength = brush.gloss * (facing > 0 ? 1.0 : 0.3);
    const auto noise = [this] { return 0.01 * random_.normal(); };
    g.f_rest[channel][0] = static_cast<float>((-strength * mirrored[1] + noise()) / kShC1);
    g.f_rest[channel][1] = static_cast<float>((-strength * mirrored[2] + noise()) / kShC1);
    g.f_rest[channel][2] = static_cast<float>((strength * mirrored[0] + noise()) / kShC1);
  }
  builder_.add(g);
}

void ScenePainter::surface(const Surface& surface, const Paint& paint, const Brush& brush) {
  const double step = 1.0 / brush.grid;
  for (int i = 0; i < brush.grid; ++i) {
    for (int j = 0; j < brush.grid; ++j) {
      const double u = i * step, v = j * step;
      const Vec3 corner = surface(u, v).position;
      const Vec3 far_corner = surface(u + step, v + step).position;
      const Vec3 diagonal = far_corner - corner;
      const Vec3 other = surface(u, v + step).position - surface(u + step, v).position;
      const Vec3 twice_area = cross(diagonal, other);
      const double area = 0.5 * std::sqrt(dot(twice_area, twice_area));
      Brush cell_brush = brush;
      if (out_of_view(corner + diagonal * 0.5)) {
        cell_brush.sigma_pixels *= 4;
        cell_brush.layers *= 0.5;
      }
      const double size = splat_size(corner + diagonal * 0.5, cell_brush.sigma_pixels);
      const double expected = cell_brush.layers * area / (kBoxArea * size * size);
      const int count = static_cast<int>(std::min(1e6, expected + random_.uniform()));
      for (int k = 0; k < count; ++k) {
        const double pu = u + step * random_.uniform(), pv = v + step * random_.uniform();
        const SurfacePoint point = surface(pu, pv);
        splat(point.position, point.normal, paint, pu, pv, cell_brush);
      }
    }
  }
}

void ScenePainter::box(const Vec3& centre, const Vec3& half, const Paint& paint, const Brush& brush) {
  block_box(centre, half);
  // Splats reach beyond their centres: drawn in a little, the box's edges stay sharp.
  const double inset =
      std::min(0.3 * std::min(half[0], std::min(half[1], half[2])), splat_size(centre, 0.8 * brush.sigma_pixels));
  const Vec3 h = half - Vec3{inset, inset, inset};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t second = (axis + 1) % 3, third = (axis + 2) % 3;
    for (const double side : {-1.0, 1.0}) {
      Vec3 corner = centre - h, edge_u{}, edge_v{};
      corner[axis] = centre[axis] + side * h[axis];
      edge_u[side > 0 ? second : third] = 2 * h[side > 0 ? second : third];
      edge_v[side > 0 ? third : second] = 2 * h[side > 0 ? third : second];
      surface(quad_surface(corner, edge_u, edge_v), paint, brush);
    }
  }
}

void ScenePainter::cylinder(const Vec3& base, const Vec3& top, double base_radius, double top_radius,
                            const Paint& paint, const Brush& brush) {
  const Vec3 axis = unit(top - base);
  const double inner = 0.7 * std::min(base_radius, top_radius);
  Vec3 half = (top - base) * 0.5;
  for (std::size_t i = 0; i < 3; ++i)
    half[i] = std::fabs(half[i]) + inner * std::sqrt(std::max(0.0, 1 - axis[i] * axis[i]));
  block_box((base + top) * 0.5, half);
  surface(frustum_surface(base, top, base_radius, top_radius), paint, brush);
  surface(disc_surface(base, axis * -1.0, 0, base_radius), paint, brush);
  surface(disc_surface(top, axis, 0, top_radius), paint, brush);
}

void ScenePainter::cloud(const Vec3& centre, const Vec3& radii, const Paint& paint, const Brush& brush) {
  const double size = splat_size(centre, brush.sigma_pixels);
  const double shadow = kPi * std::max(radii[0], radii[2]) * radii[1];  // about what it covers of the view
  const int count = static_cast<int>(std::min(1e6, brush.layers * shadow / (kBoxArea * size * size) + 1));
  for (int i = 0; i < count; ++i) {
    const Vec3 out = random_.direction();
    // One draw per statement: the order of evaluation inside an expression is the compiler's. More near the outside.
    const double first = random_.uniform();
    const double reach = 1 - 0.6 * (first * random_.uniform());
    const Vec3 position = centre + out * radii * reach;
    const Vec3 normal = unit(out + random_.direction() * 0.9);
    splat(position, normal, paint, random_.uniform(), reach, brush);
  }
}

void ScenePainter::floaters(const Vec3& centre, const Vec3& half, int count, double sigma_pixels) {
  Brush brush;
  brush.opaque = 0.0;
  brush.faint = 0.9;
  brush.emission = 0.6;
  for (int i = 0; i < count; ++i) {
    const Vec3 position = centre + half * Vec3{random_.uniform(-1, 1), random_.uniform(-1, 1), random_.uniform(-1, 1)};
    brush.sigma_pixels = sigma_pixels * random_.uniform(0.5, 2.0);
    const Vec3 normal = random_.direction();
    splat(position, normal, plain(Vec3{0.6, 0.6, 0.62} * random_.uniform(0.5, 1.3)), 0, 0, brush);
  }
}

}  // namespace vrpipe
