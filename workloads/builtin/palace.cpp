#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "props.h"
#include "scenes.h"

namespace vrpipe {

// A palace on a terrace, as rendered pictures show it: a hall with a great dome, four towers with onion domes, walls with
// battlements and a gate, stairs, minarets. Nothing around it.
void paint_palace(CapturePainter& painter) {
  painter.set_light({-0.65, 1.0, -0.5}, {0.84, 0.78, 0.66}, {0.44, 0.47, 0.54});
  painter.set_contact_reach(0.2);
  painter.ring_of_cameras({0, 1.0, 0}, 3.9, 8);
  painter.ring_of_cameras({0, 2.9, 0}, 2.6, 5);
  Texture stone;
  stone.layers = 78;
  stone.gloss = 0.05;
  stone.size = 0.75;
  stone.depth = 0.0006;
  stone.behind = 0.12;
  Texture fine = stone;
  fine.size = 0.85;
  Texture gilt = fine;
  gilt.gloss = 0.3;
  const Vec3 sand = {0.84, 0.70, 0.50}, pale = {0.93, 0.87, 0.74}, teal = {0.10, 0.50, 0.54}, gold = {0.90, 0.68, 0.20};

  // Ashlar, a band below the top, arched windows in rows.
  const auto ashlar = [](const Vec3& p, const Vec3& colour) {
    const double row = std::floor(p[1] / 0.045);
    const double along = (p[0] + p[2]) / 0.10 + 0.5 * row;
    const double shade = 0.88 + 0.2 * hash_fraction(std::floor(along) * 7 + row, 3);
    return colour * (fraction(p[1] / 0.045) < 0.12 || fraction(along) < 0.06 ? 0.66 : shade);
  };
  const auto arches = [=](double along, double y, double low, double high, double spacing) {
    const double x = std::fabs(fraction(along / spacing) - 0.5) * spacing, half = 0.27 * spacing;
    const double spring = high - half;
    if (y < low || y > high + 0.02) return 0;
    const double d = y < spring ? x : std::sqrt(x * x + (y - spring) * (y - spring));
    return d < half ? 2 : (d < half + 0.016 ? 1 : 0);
  };
  const auto facade = [=](const Vec3& centre, double half_x, double low, double high, double spacing) {
    return [=](const Vec3& p, double, double) {
      const bool along_x = std::fabs(p[0] - centre[0]) < half_x - 0.004;
      const int part = arches(along_x ? p[0] - centre[0] : p[2] - centre[2], p[1], low, high, spacing);
      if (part == 2) return Vec3{0.12, 0.11, 0.14};
      return part == 1 ? pale : ashlar(p, sand);
    };
  };
  const auto battlements = [&](const Vec3& from, const Vec3& step, int count, double size) {
    for (int i = 0; i < count; ++i)
      painter.box(from + step * static_cast<double>(i), Vec3{1, 1.1, 1} * size, plain(sand * 1.05), fine);
  };
  const auto dome = [&](const Vec3& foot, double radius, double height, const Vec3& colour) {
    const Surface onion = [=](double u, double v) {
      // Swells above its foot, then draws in to a point.
      const double r = v < 0.35 ? 0.82 + 0.36 * (v / 0.35) - 0.18 * (v / 0.35) * (v / 0.35)
                                : 1.0 * std::sqrt(std::max(0.0, 1 - (v - 0.35) * (v - 0.35) / 0.4225)) *
                                      (1 - 0.35 * (v - 0.35) / 0.65);
      const SurfacePoint ring = frustum_surface(foot, foot + Vec3{0, height, 0}, radius, radius)(u, v);
      const Vec3 axis = {foot[0], ring.position[1], foot[2]};
      const Vec3 out = (ring.position - axis) * (1 / radius);
      return SurfacePoint{axis + out * (radius * std::max(0.02, r)), unit(out + Vec3{0, 2.2 * (v - 0.3), 0})};
    };
    painter.surface(
        onion,
        [=](const Vec3& p, double u, double v) {
          if (v < 0.05) return gold;
          const double rib = std::fabs(fraction(u * 16) - 0.5);
          return (rib > 0.44 ? gold * 0.9 : colour * (0.85 + 0.3 * value_noise(p * 18.0)));
        },
        gilt);
    painter.block_ball(foot + Vec3{0, 0.4 * height, 0}, {0.8 * radius, 0.45 * height, 0.8 * radius});
    painter.cylinder(foot + Vec3{0, 0.97 * height, 0}, foot + Vec3{0, 1.35 * height, 0}, 0.05 * radius, 0.01 * radius,
                     plain(gold), gilt);
    painter.ball(foot + Vec3{0, 1.12 * height, 0}, Vec3{1, 1, 1} * (0.11 * radius), plain(gold), gilt);
  };

  // Terrace in two steps, with paving, a pool and stairs in front.
  const Paint paving = [=](const Vec3& p, double, double) {
    if (std::fabs(p[0]) < 0.12 && within(p[2], -1.06, -0.76)) return Vec3{0.16, 0.44, 0.56};
    if (std::fabs(p[0]) < 0.15 && within(p[2], -1.09, -0.73)) return pale;
    const int parity = static_cast<int>(std::floor(p[0] / 0.12) + std::floor(p[2] / 0.12) + 200) % 2;
    return (parity == 0 ? sand : pale) * (0.82 + 0.25 * value_noise(p * 12.0));
  };
  painter.box(
      {0, 0.05, 0}, {1.2, 0.05, 1.2},
      [=](const Vec3& p, double u, double v) { return p[1] > 0.099 ? paving(p, u, v) : ashlar(p, sand * 0.85); },
      stone);
  painter.box(
      {0, 0.14, 0.08}, {0.98, 0.04, 0.88},
      [=](const Vec3& p, double u, double v) { return p[1] > 0.179 ? paving(p * 1.02, u, v) : ashlar(p, sand * 0.9); },
      stone);
  for (int i = 0; i < 4; ++i) {
    painter.box({0, 0.11 + 0.02 * i, -0.90 + 0.035 * i}, {0.22, 0.01, 0.06}, plain(pale * (0.8 + 0.05 * i)), fine);
  }

  // The outer wall with its gate.
  const double wall_z = -0.64;
  for (const double side : {-1.0, 1.0}) {
    const Vec3 front = {0.50 * side, 0.33, wall_z};
    painter.box(front, {0.32, 0.15, 0.045}, facade(front, 0.32, 0.22, 0.38, 0.16), fine);
    battlements(front + Vec3{-0.29, 0.17, 0}, {0.083, 0, 0}, 8, 0.022);
    const Vec3 flank = {0.86 * side, 0.33, 0.1};
    painter.box(flank, {0.045, 0.15, 0.70}, facade(flank, 0.045, 0.22, 0.38, 0.16), fine);
    battlements(flank + Vec3{0, 0.17, -0.62}, {0, 0, 0.083}, 16, 0.022);
  }
  painter.box({0, 0.33, 0.84}, {0.82, 0.15, 0.045}, facade({0, 0.33, 0.84}, 0.82, 0.22, 0.38, 0.16), fine);
  battlements({-0.75, 0.50, 0.84}, {0.083, 0, 0}, 19, 0.022);
  const Paint gate = [=](const Vec3& p, double, double) {
    const double spring = 0.40;
    const double d = p[1] < spring ? std::fabs(p[0]) : std::sqrt(p[0] * p[0] + (p[1] - spring) * (p[1] - spring));
    if (p[2] < wall_z - 0.04 && d < 0.105)
      return fraction(p[0] / 0.04) < 0.2 || fraction(p[1] / 0.06) < 0.15 ? Vec3{0.22, 0.13, 0.07}
                                                                         : Vec3{0.40, 0.25, 0.13};
    if (p[2] < wall_z - 0.04 && d < 0.135) return teal;
    if (within(p[1], 0.60, 0.63)) return teal;
    return ashlar(p, pale);
  };
  painter.box({0, 0.43, wall_z}, {0.19, 0.25, 0.085}, gate, fine);
  battlements({-0.165, 0.70, wall_z - 0.06}, {0.066, 0, 0}, 6, 0.018);

  // Four round towers, two slender minarets.
  for (const double x : {-0.86, 0.86}) {
    for (const double z : {-0.64, 0.84}) {
      painter.cylinder(
          {x, 0.10, z}, {x, 0.86, z}, 0.155, 0.13,
          [=](const Vec3& p, double u, double) {
            const int part = arches(u, p[1] - 0.4 * std::floor((p[1] - 0.1) / 0.3) * 0.75, 0.2, 0.32, 0.125);
            if (within(p[1], 0.80, 0.84)) return teal;
            return part == 2 && u > 0 && within(fraction(u * 4), 0.3, 0.7) ? Vec3{0.12, 0.11, 0.14} : ashlar(p, sand);
          },
          fine);
      painter.cylinder({x, 0.86, z}, {x, 0.90, z}, 0.17, 0.18, plain(pale), fine);
      dome({x, 0.90, z}, 0.14, 0.30, teal);
    }
  }
  for (const double x : {-0.52, 0.52}) {
    painter.cylinder(
        {x, 0.18, 0.60}, {x, 1.30, 0.60}, 0.062, 0.045,
        [=](const Vec3& p, double u, double) { return fraction(p[1] / 0.28 + 0.5 * u) < 0.1 ? teal : ashlar(p, pale); },
        fine);
    for (const double y : {0.80, 1.20})
      painter.cylinder({x, y, 0.60}, {x, y + 0.03, 0.60}, 0.085, 0.09, plain(pale), fine);
    dome({x, 1.30, 0.60}, 0.055, 0.14, gold * 0.95);
  }

  // The hall: two storeys of arches, a drum of windows, the great dome, half domes beside it.
  painter.box({0, 0.44, 0.18}, {0.52, 0.26, 0.42}, facade({0, 0.44, 0.18}, 0.52, 0.24, 0.56, 0.17), fine);
  painter.box({0, 0.72, 0.18}, {0.56, 0.02, 0.46}, plain(pale), fine);
  battlements({-0.52, 0.76, -0.26}, {0.08, 0, 0}, 14, 0.02);
  painter.box({0, 0.85, 0.18}, {0.38, 0.13, 0.30}, facade({0, 0.85, 0.18}, 0.38, 0.77, 0.93, 0.11), fine);
  painter.box({0, 0.99, 0.18}, {0.41, 0.015, 0.33}, plain(pale), fine);
  painter.cylinder(
      {0, 1.0, 0.18}, {0, 1.15, 0.18}, 0.25, 0.25,
      [=](const Vec3& p, double u, double) {
        const int part = arches(u, p[1], 1.02, 1.12, 0.0625);
        if (within(std::fabs(fraction(u * 16) - 0.5), 0, 0.27) && part > 0) return Vec3{0.12, 0.11, 0.14};
        return ashlar(p, pale);
      },
      fine);
  painter.cylinder({0, 1.15, 0.18}, {0, 1.18, 0.18}, 0.27, 0.27, plain(gold), gilt);
  dome({0, 1.18, 0.18}, 0.27, 0.46, teal);
  for (const double x : {-0.34, 0.34}) {
    for (const double z : {-0.08, 0.44}) dome({x, 1.0, z}, 0.075, 0.17, gold * 0.95);
  }
  // A portal with columns before the hall, palms in the court.
  painter.box({0, 0.50, -0.30}, {0.17, 0.02, 0.08}, plain(pale), fine);
  for (const double x : {-0.14, -0.05, 0.05, 0.14}) {
    painter.cylinder({x, 0.18, -0.35}, {x, 0.48, -0.35}, 0.017, 0.014, plain(pale), fine);
  }
  Texture leaves = fine;
  leaves.layers = 22;
  for (const double x : {-0.66, 0.66}) {
    for (const double z : {-0.40, 0.0, 0.40}) {
      painter.cylinder({x, 0.18, z}, {x, 0.40, z}, 0.012, 0.009, plain({0.40, 0.28, 0.17}), fine);
      painter.cloud(
          {x, 0.42, z}, {0.085, 0.05, 0.085},
          [](const Vec3& p, double u, double) {
            return mix({0.08, 0.22, 0.06}, {0.36, 0.58, 0.20}, 0.5 * u + 0.5 * value_noise(p * 60.0));
          },
          leaves);
    }
  }
  painter.floaters({0, 0.7, 0}, {1.1, 0.6, 1.1}, 300, 1.5);
}

}  // namespace vrpipe
