#include <vrpipe/workloads/builtin_scenes.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include <vrpipe/component/error.h>

#include "courtyard.h"
#include "scene_painter.h"

namespace vrpipe {
namespace {

/// 1 inside [low, high], 0 outside.
bool within(double value, double low, double high) { return value >= low && value <= high; }

double fraction(double value) { return value - std::floor(value); }

/// A constant in [0, 1) for each whole number, for colours of books, windows, cars.
double hash_fraction(double index, double salt) {
  return fraction(value_noise({std::floor(index) * 17.37 + 0.5, salt * 7.13 + 0.5, 3.5}) * 9.7);
}

// ---------------------------------------------------------------------------------------------------------------------
// A toy steam locomotive on a grassy base. Faces +x; the viewer stands at its right front.

void paint_locomotive(ScenePainter& painter) {
  painter.set_hidden_share(0.07);
  painter.hide_behind({0, -0.61, 0}, {9, 0.25, 9});
  painter.set_light({0.75, 1.1, -0.7}, {0.85, 0.80, 0.70}, {0.42, 0.45, 0.52});
  const Vec3 green = {0.10, 0.36, 0.20}, red = {0.72, 0.11, 0.08}, black = {0.07, 0.07, 0.08};
  const Vec3 brass = {0.88, 0.66, 0.22}, cream = {0.93, 0.86, 0.66};

  Brush body;
  body.sigma_pixels = 2.1;
  body.layers = 50;
  body.opaque = 0.4;
  body.gloss = 0.22;
  body.grid = 6;
  Brush fine = body;
  fine.sigma_pixels = 1.8;
  fine.grid = 4;

  // Boiler with brass bands, smokebox, front door and lamp.
  const Paint boiler = [=](const Vec3& p, double, double) {
    if (p[0] > 0.78) return black;
    for (const double band : {-0.22, 0.12, 0.45, 0.77}) {
      if (std::fabs(p[0] - band) < 0.018) return brass;
    }
    return green;
  };
  Brush lengthwise = body;
  lengthwise.grid = 16;
  painter.cylinder({-0.4, 0.78, 0}, {1.02, 0.78, 0}, 0.33, 0.33, boiler, lengthwise);
  const Paint door = [=](const Vec3& p, double, double) {
    const double ring = std::sqrt((p[1] - 0.78) * (p[1] - 0.78) + p[2] * p[2]);
    if (within(ring, 0.20, 0.225)) return brass;
    if (ring < 0.035) return brass;
    return within(ring, 0.0, 0.2) ? Vec3{0.16, 0.16, 0.18} : black;
  };
  painter.surface(disc_surface({1.03, 0.78, 0}, {1, 0, 0}, 0, 0.32), door, fine);
  painter.cylinder(
      {1.0, 1.14, 0}, {1.12, 1.14, 0}, 0.075, 0.085,
      [=](const Vec3& p, double, double) {
        return p[0] > 1.115 ? Vec3{1.6, 1.5, 1.1} : brass;
      },
      fine);

  // Chimney, dome, whistle.
  const Paint chimney = [=](const Vec3& p, double, double) { return p[1] > 1.43 ? brass : black; };
  painter.cylinder({0.86, 1.06, 0}, {0.86, 1.44, 0}, 0.085, 0.12, chimney, fine);
  painter.cylinder({0.86, 1.43, 0}, {0.86, 1.49, 0}, 0.15, 0.15, chimney, fine);
  painter.block_ball({0.3, 1.1, 0}, {0.13, 0.18, 0.13});
  painter.surface(ellipsoid_surface({0.3, 1.1, 0}, {0.15, 0.2, 0.15}), plain(brass), fine);
  painter.cylinder({-0.1, 1.05, 0}, {-0.1, 1.22, 0}, 0.03, 0.03, plain(brass), fine);

  // Cab with windows and a roof.
  const Paint cab = [=](const Vec3& p, double, double) {
    const bool side = std::fabs(p[2]) > 0.37;
    if (side && within(p[0], -0.86, -0.56) && within(p[1], 0.95, 1.24)) return Vec3{0.55, 0.75, 0.85};
    if (side && within(p[0], -0.90, -0.52) && within(p[1], 0.91, 1.28)) return brass;
    if (!side && within(std::fabs(p[2]), 0.10, 0.32) && within(p[1], 1.0, 1.24)) return Vec3{0.55, 0.75, 0.85};
    if (within(p[1], 0.53, 0.57)) return brass;
    return p[1] > 0.9 ? cream : red;
  };
  Brush cab_brush = body;
  cab_brush.grid = 10;
  cab_brush.gloss = 0.12;
  painter.box({-0.71, 0.92, 0}, {0.33, 0.44, 0.41}, cab, cab_brush);
  painter.box({-0.71, 1.39, 0}, {0.42, 0.035, 0.49}, plain(black), body);

  // Frame, buffer beam, buffers, cow catcher.
  painter.box(
      {0.12, 0.43, 0}, {1.18, 0.05, 0.40},
      [=](const Vec3& p, double, double) {
        return std::fabs(p[2]) > 0.36 ? red : Vec3{0.13, 0.13, 0.14};
      },
      body);
  painter.box({1.33, 0.42, 0}, {0.04, 0.10, 0.43}, plain(red), fine);
  for (const double z : {-0.27, 0.27}) {
    painter.cylinder({1.37, 0.43, z}, {1.47, 0.43, z}, 0.04, 0.04, plain(black), fine);
    painter.cylinder({1.46, 0.43, z}, {1.49, 0.43, z}, 0.085, 0.085, plain(Vec3{0.45, 0.45, 0.48}), fine);
  }
  const Paint bars = [=](const Vec3&, double u, double) {
    return fraction(u * 7) < 0.55 ? red : Vec3{0.03, 0.03, 0.03};
  };
  painter.surface(quad_surface({1.36, 0.31, -0.36}, {0, 0, 0.72}, {0.24, -0.2, 0}), bars, fine);

  // Cylinders, wheels and rods on both sides.
  for (const double side : {-1.0, 1.0}) {
    const double z = 0.36 * side;
    painter.cylinder(
        {0.78, 0.36, z + 0.04 * side}, {1.14, 0.36, z + 0.04 * side}, 0.13, 0.13,
        [=](const Vec3& p, double, double) { return within(p[0], 0.82, 1.10) ? green : brass; }, fine);
    const auto wheel = [&](double x, double radius) {
      const Paint spokes = [=](const Vec3& p, double u, double) {
        const double dx = p[0] - x, dy = p[1] - radius;
        const double ring = std::sqrt(dx * dx + dy * dy) / radius;
        if (ring > 0.84) return Vec3{0.50, 0.50, 0.52};
        if (ring < 0.2) return brass;
        if (ring > 0.74) return red;
        return fraction(u * 10) < 0.42 ? red : Vec3{0.06, 0.04, 0.04};
      };
      painter.cylinder({x, radius, z - 0.035 * side}, {x, radius, z + 0.035 * side}, radius, radius, spokes, fine);
      painter.surface(disc_surface({x, radius, z + 0.037 * side}, {0, 0, side}, 0, radius), spokes, fine);
    };
    for (const double x : {-0.72, -0.18, 0.36}) wheel(x, 0.26);
    wheel(0.95, 0.16);
    wheel(-1.35, 0.17);
    wheel(-1.85, 0.17);
    painter.box({-0.1, 0.2, z + 0.07 * side}, {0.70, 0.028, 0.018}, plain(Vec3{0.75, 0.75, 0.78}), fine);
    painter.box({0.45, 0.33, z + 0.09 * side}, {0.42, 0.022, 0.016}, plain(Vec3{0.75, 0.75, 0.78}), fine);
    painter.cylinder({-0.4, 0.98, 0.32 * side}, {0.9, 0.98, 0.32 * side}, 0.016, 0.016, plain(brass), fine);
  }

  // Tender with coal.
  painter.box({-1.6, 0.38, 0}, {0.52, 0.05, 0.38}, plain(Vec3{0.13, 0.13, 0.14}), body);
  const Paint tender = [=](const Vec3& p, double, double) {
    if (within(p[1], 0.86, 0.90) || within(p[1], 0.46, 0.50)) return brass;
    if (std::fabs(p[2]) > 0.34 && within(p[0], -1.95, -1.25) && within(p[1], 0.55, 0.80)) return Vec3{0.13, 0.42, 0.25};
    return green;
  };
  painter.box({-1.6, 0.68, 0}, {0.5, 0.25, 0.37}, tender, cab_brush);
  painter.box({-1.6, 0.95, 0}, {0.44, 0.05, 0.32}, plain(black), body);
  for (int i = 0; i < 26; ++i) {
    const double x = -1.6 + painter.random().uniform(-0.36, 0.36);
    const double z = painter.random().uniform(-0.24, 0.24);
    const double size = painter.random().uniform(0.06, 0.11);
    const double height = 1.02 + 0.10 * (1 - (x + 1.6) * (x + 1.6) / 0.14);
    const double shade = painter.random().uniform(0.05, 0.15);
    painter.block_ball({x, height, z}, {size, size, size});
    painter.surface(ellipsoid_surface({x, height, z}, {size, size * 0.8, size}), plain({shade, shade, shade * 1.1}),
                    fine);
  }

  // Rails, sleepers.
  for (const double z : {-0.36, 0.36}) {
    painter.box({0.0, -0.025, z}, {3.3, 0.025, 0.03}, plain({0.52, 0.50, 0.50}), lengthwise);
  }
  for (int i = -12; i <= 12; ++i) {
    const double shade = 0.8 + 0.4 * hash_fraction(i, 1);
    painter.box({0.26 * i, -0.065, 0}, {0.06, 0.03, 0.55}, plain(Vec3{0.33, 0.22, 0.14} * shade), fine);
  }

  // Ground: a round base of gravel and grass with flowers on a wooden table.
  const Paint meadow = [](const Vec3& p, double, double) {
    const double blades = fractal_noise({p[0] * 22, 3.0, p[2] * 22}, 3);
    const double patches = fractal_noise({p[0] * 2.1, 1.0, p[2] * 2.1}, 3);
    const double edge = std::fabs(p[2]) + 0.12 * fractal_noise({p[0] * 6, 0.0, p[2] * 6}, 2);
    if (edge < 0.80) return mix({0.38, 0.35, 0.32}, {0.78, 0.74, 0.68}, 1.8 * blades - 0.4);
    if (value_noise({p[0] * 15, 8.0, p[2] * 15}) > 0.86) {
      return patches > 0.5 ? Vec3{0.98, 0.95, 0.88} : Vec3{0.98, 0.82, 0.25};
    }
    return mix(mix({0.16, 0.33, 0.07}, {0.46, 0.60, 0.16}, patches), {0.08, 0.20, 0.04}, 1.4 * blades - 0.35);
  };
  Brush ground;
  ground.sigma_pixels = 2.4;
  ground.layers = 52;
  ground.opaque = 0.4;
  ground.gloss = 0.02;
  ground.depth = 0.002;
  ground.grid = 48;
  painter.surface(disc_surface({0, -0.09, 0}, {0, 1, 0}, 0, 3.4), meadow, ground);
  Brush rim = ground;
  rim.sigma_pixels = 2.0;
  painter.surface(
      frustum_surface({0, -0.36, 0}, {0, -0.09, 0}, 3.45, 3.4),
      [](const Vec3& p, double u, double) {
        return mix({0.30, 0.17, 0.09}, {0.44, 0.27, 0.14}, fractal_noise({u * 60, p[1] * 30, 0}, 3));
      },
      rim);
  painter.block_box({0, -0.23, 0}, {2.4, 0.13, 2.4});
  const Paint table = [](const Vec3& p, double, double) {
    const double plank = std::floor(p[2] / 0.9);
    const double grain = fractal_noise({p[0] * 1.2 + plank * 5, plank, p[2] * 14}, 3);
    const Vec3 wood = mix({0.46, 0.30, 0.18}, {0.70, 0.50, 0.32}, grain + 0.25 * hash_fraction(plank, 2) - 0.1);
    return fraction(p[2] / 0.9) < 0.02 ? wood * 0.5 : wood;
  };
  Brush table_brush = ground;
  table_brush.sigma_pixels = 2.6;
  table_brush.gloss = 0.08;
  painter.surface(quad_surface({-9, -0.36, -9}, {0, 0, 18}, {18, 0, 0}), table, table_brush);

  // Bushes and small trees at the far side.
  const Paint leaves = [](const Vec3& p, double u, double) {
    return mix({0.10, 0.26, 0.06}, {0.40, 0.56, 0.16}, 0.5 * u + 0.6 * value_noise(p * 9.0) - 0.1);
  };
  Brush foliage;
  foliage.sigma_pixels = 2.0;
  foliage.layers = 26;
  foliage.gloss = 0.03;
  const double trees[][3] = {{-2.3, 1.35, 0.62}, {-0.9, 1.9, 0.5}, {-2.75, 0.1, 0.45}, {0.5, 2.35, 0.55}};
  for (const auto& tree : trees) {
    const double size = tree[2];
    painter.cylinder({tree[0], -0.1, tree[1]}, {tree[0], size * 1.3, tree[1]}, 0.10 * size, 0.06 * size,
                     plain({0.30, 0.20, 0.12}), fine);
    for (int i = 0; i < 7; ++i) {
      const double dx = painter.random().uniform(-0.35, 0.35) * size;
      const double dy = painter.random().uniform(-0.25, 0.7) * size;
      const double dz = painter.random().uniform(-0.35, 0.35) * size;
      const Vec3 centre = {tree[0] + dx, 1.6 * size + dy, tree[1] + dz};
      const Vec3 radii = {0.45 * size, 0.38 * size, 0.45 * size};
      painter.block_ball(centre, radii * 0.8);
      painter.cloud(centre, radii, leaves, foliage);
    }
  }

  // Smoke drifting back from the chimney.
  Brush smoke;
  smoke.sigma_pixels = 7;
  smoke.layers = 44;
  smoke.thickness = 0.8;
  smoke.opaque = 0.0;
  smoke.faint = 0.75;
  smoke.emission = 0.6;
  for (int i = 0; i < 9; ++i) {
    const double t = i / 8.0;
    const double sway = 0.10 * painter.random().uniform(-1, 1);
    painter.cloud({0.86 - 1.5 * t - 0.2 * t * t, 1.60 + 0.75 * t + sway * t, 0.25 * sway},
                  Vec3{0.16, 0.13, 0.16} * (0.7 + 1.6 * t), plain({0.93, 0.93, 0.95}), smoke);
  }

  // The room behind: out of focus, as a capture's far background is.
  const Paint backdrop = [](const Vec3& p, double u, double v) {
    const double clouds = fractal_noise({p[0] * 0.25, p[1] * 0.4, p[2] * 0.25}, 3);
    const Vec3 wall = mix({0.72, 0.76, 0.80}, {0.44, 0.55, 0.68}, 1.4 * v - 0.25 + 0.3 * (clouds - 0.5));
    return v < 0.33 ? mix(wall, Vec3{0.40, 0.33, 0.30}, 3 * (0.33 - v) + 0.1 * u) : wall;
  };
  Brush far;
  far.sigma_pixels = 6.5;
  far.layers = 36;
  far.emission = 0.75;
  far.gloss = 0;
  far.opaque = 0.35;
  far.depth = 0.06;
  far.grid = 40;
  painter.surface(dome_surface({0, 0, 0}, 13, -0.75, 0.85), backdrop, far);
  painter.surface(dome_surface({0, 0, 0}, 19, -0.75, 0.85), backdrop, far);
  painter.floaters({0, 1.3, 0}, {4, 1.6, 4}, 500, 4);
}

// ---------------------------------------------------------------------------------------------------------------------
// A living room, seen from a corner.

void paint_room(ScenePainter& painter) {
  painter.set_hidden_share(0.26);
  painter.hide_behind({0, -0.15, 0}, {3.1, 0.1, 2.9});
  painter.hide_behind({0, 2.85, 0}, {3.1, 0.1, 2.9});
  painter.hide_behind({-3.15, 1.35, 0}, {0.1, 1.35, 2.9});
  painter.hide_behind({3.15, 1.35, 0}, {0.1, 1.35, 2.9});
  painter.hide_behind({0, 1.35, 2.95}, {3.1, 1.35, 0.1});
  painter.set_light({-0.95, 0.75, -0.25}, {0.55, 0.50, 0.42}, {0.72, 0.70, 0.68});
  Brush wall;
  wall.sigma_pixels = 3.6;
  wall.layers = 50;
  wall.opaque = 0.36;
  wall.gloss = 0.03;
  wall.grid = 32;
  Brush ceiling = wall;
  ceiling.emission = 0.6;
  Brush thing = wall;
  thing.sigma_pixels = 2.5;
  thing.layers = 48;
  thing.grid = 10;
  Brush fine = thing;
  fine.sigma_pixels = 2.0;
  fine.grid = 6;

  // Floor with a rug.
  const Paint floor = [](const Vec3& p, double, double) {
    const double rx = (p[0] - 0.2) / 1.9, rz = (p[2] - 0.7) / 1.35;
    const double rug = std::max(std::fabs(rx), std::fabs(rz));
    if (rug < 1) {
      if (within(rug, 0.86, 0.92)) return Vec3{0.88, 0.80, 0.62};
      if (rug > 0.8) return Vec3{0.45, 0.12, 0.14};
      const double diamond = std::fabs(fraction(rx * 3.5) - 0.5) + std::fabs(fraction(rz * 2.5) - 0.5);
      if (diamond < 0.16) return Vec3{0.20, 0.26, 0.36};
      return diamond < 0.32 ? Vec3{0.85, 0.74, 0.55} : Vec3{0.58, 0.20, 0.18};
    }
    const double plank = std::floor(p[0] / 0.22);
    const double shift = hash_fraction(plank, 5) * 2;
    const double board = std::floor((p[2] + shift) / 1.4);
    const double grain = fractal_noise({p[0] * 30, plank + board * 3, p[2] * 2.5}, 3);
    const Vec3 wood =
        mix({0.50, 0.32, 0.18}, {0.76, 0.55, 0.34}, 0.6 * grain + 0.5 * hash_fraction(plank * 7 + board, 6) - 0.05);
    return fraction(p[0] / 0.22) < 0.04 || fraction((p[2] + shift) / 1.4) < 0.008 ? wood * 0.55 : wood;
  };
  Brush floor_brush = wall;
  floor_brush.sigma_pixels = 2.9;
  floor_brush.gloss = 0.10;
  painter.surface(quad_surface({-3, 0, -2.8}, {0, 0, 5.6}, {6, 0, 0}), floor, floor_brush);
  painter.surface(quad_surface({-3, 2.7, -2.8}, {6, 0, 0}, {0, 0, 5.6}), plain({0.93, 0.92, 0.90}), ceiling);

  // Walls: the back with pictures, the left with a window, the right with a door; skirting boards all round.
  const auto skirting = [](const Vec3& p, const Vec3& paint) { return p[1] < 0.12 ? Vec3{0.92, 0.91, 0.88} : paint; };
  const Paint back = [=](const Vec3& p, double, double) {
    const auto framed = [&](double x, double y, double w, double h) {
      const double d = std::max(std::fabs(p[0] - x) / w, std::fabs(p[1] - y) / h);
      return d < 1 ? (d > 0.9 ? 2 : 1) : 0;
    };
    if (const int part = framed(0.15, 1.72, 0.72, 0.46)) {
      if (part == 2) return Vec3{0.25, 0.16, 0.09};
      // A landscape: sky, hills, a lake and a sun.
      const double u = p[0] - 0.15, v = p[1] - 1.72;
      if ((u - 0.3) * (u - 0.3) + (v - 0.2) * (v - 0.2) < 0.008) return Vec3{1.0, 0.9, 0.5};
      const double hill = 0.10 * fractal_noise({u * 4, 2, 0}, 3) + 0.04;
      if (v > hill) return mix({0.96, 0.66, 0.42}, {0.36, 0.50, 0.76}, 3 * (v - 0.05));
      if (v > -0.10) return mix({0.13, 0.24, 0.26}, {0.26, 0.40, 0.36}, 6 * (v + 0.1));
      return mix({0.22, 0.36, 0.52}, {0.92, 0.66, 0.46}, value_noise({u * 4, v * 60, 0}) * 0.8);
    }
    for (int i = 0; i < 2; ++i) {
      if (const int part = framed(1.30, 1.98 - 0.55 * i, 0.22, 0.20)) {
        if (part == 2) return Vec3{0.10, 0.10, 0.10};
        const double spot = value_noise({p[0] * 9 + i * 10, p[1] * 9, 0});
        return spot > 0.5 ? Vec3{0.86, 0.50, 0.25} : (spot > 0.35 ? Vec3{0.20, 0.40, 0.50} : Vec3{0.93, 0.90, 0.82});
      }
    }
    return skirting(p, {0.56, 0.66, 0.64});
  };
  painter.surface(quad_surface({3, 0, 2.8}, {-6, 0, 0}, {0, 2.7, 0}), back, floor_brush);
  const Paint left = [=](const Vec3& p, double, double) {
    const double wz = (p[2] - 0.6) / 1.0, wy = (p[1] - 1.5) / 0.85;
    const double d = std::max(std::fabs(wz), std::fabs(wy));
    if (d < 1) {
      if (d > 0.92 || std::fabs(wz) < 0.035 || std::fabs(wy - 0.2) < 0.03) return Vec3{1.0, 1.0, 1.0};
      const double trees = -0.35 + 0.55 * fractal_noise({wz * 4, 1, 0}, 3);
      if (wy < trees) return mix({0.35, 0.55, 0.25}, {0.62, 0.78, 0.42}, value_noise({wz * 16, wy * 16, 0})) * 1.35;
      return mix({1.35, 1.38, 1.4}, {0.85, 1.15, 1.5}, wy);
    }
    return skirting(p, {0.90, 0.86, 0.78});
  };
  Brush lit = floor_brush;
  lit.emission = 0.3;
  painter.surface(quad_surface({-3, 0, 2.8}, {0, 0, -5.6}, {0, 2.7, 0}), left, lit);
  const Paint right = [=](const Vec3& p, double, double) {
    if (p[1] < 2.1 && within(p[2], 0.9, 1.9)) {
      const bool panel = within(fraction((p[2] - 0.9) * 2), 0.2, 0.8) && within(fraction(p[1] / 0.7), 0.15, 0.85);
      if (p[1] > 2.03 || !within(p[2], 0.97, 1.83)) return Vec3{0.95, 0.94, 0.92};
      return panel ? Vec3{0.50, 0.34, 0.22} : Vec3{0.58, 0.40, 0.26};
    }
    return skirting(p, {0.90, 0.86, 0.78});
  };
  painter.surface(quad_surface({3, 0, -2.8}, {0, 0, 5.6}, {0, 2.7, 0}), right, floor_brush);

  // Curtains.
  const Paint cloth = [](const Vec3& p, double, double) {
    return mix({0.50, 0.20, 0.16}, {0.86, 0.46, 0.34}, 0.5 + 0.5 * (2 * std::fabs(fraction(p[2] * 9) - 0.5) - 0.5) * 2);
  };
  for (const double z : {-0.62, 1.82}) {
    painter.surface(quad_surface({-2.93, 0.35, z + 0.2}, {0, 0, -0.42}, {0, 2.15, 0}), cloth, thing);
  }
  painter.cylinder({-2.92, 2.5, -1.0}, {-2.92, 2.5, 2.2}, 0.025, 0.025, plain({0.3, 0.2, 0.12}), fine);

  // Sofa along the back wall, with cushions.
  const Vec3 blue = {0.20, 0.32, 0.50};
  const Paint fabric = [=](const Vec3& p, double, double) { return blue * (0.85 + 0.35 * fractal_noise(p * 28.0, 2)); };
  painter.box({0.15, 0.26, 2.25}, {1.12, 0.16, 0.42}, fabric, thing);
  painter.box({0.15, 0.66, 2.62}, {1.12, 0.34, 0.13}, fabric, thing);
  for (const double x : {-1.05, 1.35}) painter.box({x, 0.42, 2.28}, {0.13, 0.32, 0.46}, fabric, thing);
  for (const double x : {-0.42, 0.72}) painter.box({x, 0.47, 2.18}, {0.54, 0.07, 0.40}, fabric, thing);
  const Vec3 cushions[] = {{0.90, 0.68, 0.20}, {0.86, 0.84, 0.78}, {0.72, 0.26, 0.22}};
  const double cushion_x[] = {-0.72, 0.02, 0.98};
  for (std::size_t i = 0; i < 3; ++i) {
    painter.block_ball({cushion_x[i], 0.70, 2.38}, {0.2, 0.2, 0.09});
    painter.surface(ellipsoid_surface({cushion_x[i], 0.71, 2.38}, {0.24, 0.22, 0.12}), plain(cushions[i]), thing);
  }

  // Coffee table with a bowl of oranges, books and a mug.
  const Paint oak = [](const Vec3& p, double, double) {
    return mix({0.40, 0.25, 0.13}, {0.62, 0.42, 0.24}, fractal_noise({p[0] * 4, p[1] * 30, p[2] * 30}, 3));
  };
  painter.box({0.2, 0.43, 0.75}, {0.70, 0.03, 0.40}, oak, fine);
  for (const double x : {-0.42, 0.82}) {
    for (const double z : {0.43, 1.07}) painter.cylinder({x, 0, z}, {x, 0.4, z}, 0.028, 0.035, oak, fine);
  }
  painter.cylinder({0.42, 0.46, 0.78}, {0.42, 0.56, 0.78}, 0.08, 0.19, plain({0.90, 0.90, 0.86}), fine);
  const double oranges[][3] = {{0.36, 0.58, 0.72}, {0.50, 0.58, 0.74}, {0.40, 0.58, 0.88}, {0.43, 0.66, 0.79}};
  for (const auto& o : oranges) {
    painter.block_ball({o[0], o[1], o[2]}, {0.06, 0.06, 0.06});
    painter.surface(ellipsoid_surface({o[0], o[1], o[2]}, {0.07, 0.07, 0.07}), plain({0.98, 0.52, 0.10}), fine);
  }
  painter.box({-0.18, 0.48, 0.80}, {0.19, 0.018, 0.13}, plain({0.15, 0.38, 0.36}), fine);
  painter.box({-0.16, 0.514, 0.79}, {0.17, 0.016, 0.12}, plain({0.82, 0.30, 0.20}), fine);
  painter.cylinder({0.08, 0.46, 0.58}, {0.08, 0.56, 0.58}, 0.045, 0.05, plain({0.94, 0.94, 0.94}), fine);

  // Bookshelf against the right wall, towards the back.
  const double shelf_x = 2.25, shelf_z = 2.58;
  painter.box({shelf_x, 1.05, 2.77}, {0.55, 1.05, 0.02}, plain({0.30, 0.20, 0.12}), thing);
  for (const double x : {-0.55, 0.55}) painter.box({shelf_x + x, 1.05, shelf_z}, {0.025, 1.05, 0.19}, oak, fine);
  for (int level = 0; level < 6; ++level) {
    const double y = 0.05 + 0.405 * level;
    painter.box({shelf_x, y, shelf_z}, {0.55, 0.02, 0.19}, oak, fine);
    if (level == 5) break;
    double x = shelf_x - 0.5;
    for (int book = 0; x < shelf_x + 0.40; ++book) {
      const double key = level * 31 + book;
      const double width = 0.025 + 0.03 * hash_fraction(key, 1), height = 0.12 + 0.06 * hash_fraction(key, 2);
      if (hash_fraction(key, 3) < 0.1) {
        x += 0.09;
        continue;
      }
      const Vec3 bright = {0.15 + 0.75 * hash_fraction(key, 4), 0.15 + 0.6 * hash_fraction(key, 5),
                           0.12 + 0.6 * hash_fraction(key, 6)};
      const Vec3 cover = mix(bright, {0.42, 0.34, 0.26}, 0.45);
      const Paint spine = [=](const Vec3& p, double, double) {
        return within(p[1] - y, 0.09, 0.12) ? mix(cover, {0.95, 0.85, 0.55}, 0.7) : cover;
      };
      painter.box({x + width, y + 0.02 + height, shelf_z - 0.02}, {width, height, 0.13}, spine, fine);
      x += 2 * width + 0.004;
    }
  }

  // Floor lamp, potted plant, armchair, television bench.
  painter.cylinder({-1.55, 0, 2.35}, {-1.55, 0.03, 2.35}, 0.17, 0.16, plain({0.16, 0.16, 0.17}), fine);
  painter.cylinder({-1.55, 0.03, 2.35}, {-1.55, 1.45, 2.35}, 0.016, 0.016, plain({0.16, 0.16, 0.17}), fine);
  Brush glow = thing;
  glow.emission = 0.85;
  painter.surface(
      frustum_surface({-1.55, 1.40, 2.35}, {-1.55, 1.76, 2.35}, 0.27, 0.17),
      [](const Vec3& p, double, double) {
        return mix({1.35, 1.05, 0.62}, {0.98, 0.80, 0.55}, (p[1] - 1.4) / 0.36);
      },
      glow);
  painter.cylinder({-2.35, 0, 2.2}, {-2.35, 0.42, 2.2}, 0.17, 0.23, plain({0.78, 0.42, 0.28}), fine);
  const Paint leaf = [](const Vec3& p, double u, double) {
    return mix({0.08, 0.26, 0.10}, {0.36, 0.58, 0.22}, 0.6 * u + 0.5 * value_noise(p * 12.0));
  };
  Brush foliage = thing;
  foliage.layers = 30;
  for (int i = 0; i < 14; ++i) {
    const double dx = painter.random().uniform(-0.35, 0.35), dz = painter.random().uniform(-0.35, 0.25);
    const double height = painter.random().uniform(0.65, 1.5);
    painter.block_ball({-2.35 + dx, height, 2.2 + dz}, {0.1, 0.12, 0.1});
    painter.cloud({-2.35 + dx, height, 2.2 + dz}, {0.15, 0.19, 0.15}, leaf, foliage);
  }
  const Paint leather = [](const Vec3& p, double, double) {
    return Vec3{0.58, 0.33, 0.17} * (0.8 + 0.4 * fractal_noise(p * 14.0, 2));
  };
  painter.box({-1.75, 0.27, 0.85}, {0.36, 0.16, 0.40}, leather, thing);
  painter.box({-2.05, 0.62, 0.85}, {0.12, 0.36, 0.40}, leather, thing);
  for (const double z : {0.37, 1.33}) painter.box({-1.78, 0.40, z}, {0.38, 0.24, 0.10}, leather, thing);
  painter.box({2.70, 0.26, 0.05}, {0.25, 0.24, 0.72}, oak, thing);
  painter.box({2.76, 0.90, 0.05}, {0.03, 0.36, 0.62}, plain({0.05, 0.05, 0.06}), thing);

  // Ceiling lamp.
  painter.cylinder({0.2, 2.25, 0.75}, {0.2, 2.7, 0.75}, 0.008, 0.008, plain({0.1, 0.1, 0.1}), fine);
  painter.surface(ellipsoid_surface({0.2, 2.14, 0.75}, {0.17, 0.14, 0.17}), plain({1.2, 1.12, 0.95}), glow);

  // What lies beyond the walls: other rooms, the garden, as a capture through doors and windows leaves them.
  Brush beyond = wall;
  beyond.sigma_pixels = 5.5;
  beyond.layers = 80;
  beyond.opaque = 0.35;
  beyond.depth = 0.03;
  const Vec3 dim = {0.45, 0.44, 0.42};
  painter.surface(quad_surface({4.5, -0.4, 4.4}, {-9, 0, 0}, {0, 3.6, 0}), plain(dim), beyond);
  painter.surface(quad_surface({-4.6, -0.4, 4.4}, {0, 0, -8}, {0, 3.6, 0}), plain({0.5, 0.6, 0.45}), beyond);
  painter.surface(quad_surface({4.6, -0.4, -3.6}, {0, 0, 8}, {0, 3.6, 0}), plain(dim), beyond);
  painter.surface(quad_surface({-4.6, -0.5, -3.6}, {0, 0, 8}, {9.2, 0, 0}), plain(dim), beyond);
  painter.surface(quad_surface({-4.6, 3.2, -3.6}, {9.2, 0, 0}, {0, 0, 8}), plain(dim), beyond);
  painter.floaters({0, 1.3, 0.6}, {2.8, 1.2, 2.0}, 700, 5);
}

// ---------------------------------------------------------------------------------------------------------------------
// A street with houses and trees.

void paint_street(ScenePainter& painter) {
  painter.set_hidden_share(0.13);
  painter.hide_behind({0, -0.5, 45}, {60, 0.4, 46});
  painter.set_light({0.65, 0.95, -0.35}, {0.82, 0.76, 0.64}, {0.48, 0.52, 0.60});
  Brush ground;
  ground.sigma_pixels = 2.5;
  ground.layers = 42;
  ground.gloss = 0.02;
  ground.opaque = 0.62;
  ground.faint = 0.12;
  ground.depth = 0.001;
  ground.grid = 64;
  Brush house = ground;
  house.sigma_pixels = 2.2;
  house.grid = 16;
  Brush fine = ground;
  fine.sigma_pixels = 1.75;
  fine.grid = 6;

  // Road, kerbs, pavements, lawns.
  const Paint land = [](const Vec3& p, double, double) {
    const double x = p[0];
    const double rough = fractal_noise({p[0] * 12, 0, p[2] * 12}, 3);
    if (std::fabs(x) < 3.0) {
      if (std::fabs(x) < 0.08 && fraction(p[2] / 3.0) < 0.55) return Vec3{0.95, 0.94, 0.88};
      if (within(std::fabs(x), 2.72, 2.82)) return Vec3{0.90, 0.88, 0.80};
      if (within(p[2], 8.4, 10.4) && fraction((x + 3) / 0.75) < 0.5) return Vec3{0.92, 0.92, 0.90};
      return Vec3{0.27, 0.27, 0.29} * (0.75 + 0.5 * rough);
    }
    if (std::fabs(x) < 3.2) return Vec3{0.66, 0.64, 0.60};
    if (std::fabs(x) < 5.0) {
      const bool joint = fraction(p[2] / 0.9) < 0.05 || fraction(x / 0.9) < 0.05;
      return Vec3{0.62, 0.58, 0.53} * (joint ? 0.6 : 0.85 + 0.3 * rough);
    }
    return mix({0.16, 0.34, 0.08}, {0.46, 0.58, 0.20}, rough + 0.3 * value_noise({x * 0.7, 0, p[2] * 0.7}) - 0.2);
  };
  painter.surface(quad_surface({-16, 0, -1.0}, {0, 0, 16}, {32, 0, 0}), land, ground);
  painter.surface(quad_surface({-40, 0, 15}, {0, 0, 75}, {80, 0, 0}), land, ground);

  // Houses on both sides, in a row.
  const Vec3 walls[] = {{0.80, 0.46, 0.34}, {0.92, 0.84, 0.66}, {0.58, 0.66, 0.72}, {0.88, 0.66, 0.42},
                        {0.72, 0.34, 0.28}, {0.86, 0.86, 0.82}, {0.66, 0.72, 0.56}, {0.94, 0.76, 0.52}};
  for (int row = 0; row < 2; ++row) {
    const double side = row == 0 ? -1.0 : 1.0;
    for (int i = 0; i < 7; ++i) {
      const double key = row * 13 + i;
      const double depth = 2.7, z = 6.5 + 6.6 * i + 1.5 * row;
      const double half_height = 2.1 + 1.5 * hash_fraction(key, 1);
      const double x = side * (8.6 + 0.5 * hash_fraction(key, 2));
      const Vec3 tint = walls[static_cast<std::size_t>((row * 3 + i) % 8)];
      const double top = 2 * half_height;
      const Paint facade = [=](const Vec3& p, double, double) {
        const bool front = std::fabs(p[0] - x) > 2.6;  // faces the street; otherwise a gable end
        const double along = front ? p[2] - z : p[0] - x;
        const double storey = fraction(p[1] / 1.55), bay = fraction((along + 2.7) / 1.35);
        if (p[1] > top - 0.14) return tint * 1.12;
        if (front && p[1] < 1.45 && within(along, -0.38, 0.38)) {
          return p[1] > 1.36 || std::fabs(along) > 0.32 ? Vec3{0.95, 0.94, 0.9}
                                                        : Vec3{0.30, 0.14, 0.08} * (1 + hash_fraction(key, 4));
        }
        if (p[1] > 0.1 && within(storey, 0.30, 0.80) && within(bay, 0.24, 0.76)) {
          if (!within(storey, 0.34, 0.76) || !within(bay, 0.29, 0.71)) return Vec3{0.96, 0.95, 0.92};
          if (std::fabs(bay - 0.5) < 0.02 || std::fabs(storey - 0.55) < 0.02) return Vec3{0.96, 0.95, 0.92};
          return mix({0.16, 0.22, 0.30}, {0.58, 0.70, 0.82}, 1.6 * (storey - 0.3));
        }
        const bool mortar = fraction(p[1] / 0.16) < 0.18;
        return tint * (mortar ? 0.82 : 0.95 + 0.15 * value_noise({p[0] * 3, p[1] * 9, p[2] * 3}));
      };
      painter.box({x, half_height, z}, {2.7, half_height, depth}, facade, house);
      // A roof with its ridge along the street.
      const Vec3 tile = hash_fraction(key, 7) > 0.5 ? Vec3{0.56, 0.24, 0.17} : Vec3{0.32, 0.30, 0.33};
      const Paint tiles = [=](const Vec3& p, double, double) {
        return tile * (fraction(p[1] / 0.2) < 0.22 ? 0.7 : 0.95 + 0.25 * value_noise({p[0] * 5, p[1] * 5, p[2] * 5}));
      };
      const double rise = 1.7, eave = 3.05;
      for (const double slope : {-1.0, 1.0}) {
        const Vec3 corner = {x + slope * eave, top - 0.15, z - slope * (depth + 0.15)};
        painter.surface(quad_surface(corner, {0, 0, slope * (2 * depth + 0.3)}, {-slope * eave, rise + 0.15, 0}), tiles,
                        house);
      }
      painter.block_box({x, top + 0.4, z}, {1.6, 0.5, depth});
      for (const double end : {-1.0, 1.0}) {
        const double zz = z + end * depth;
        const Surface gable = [=](double u, double v) {
          return SurfacePoint{{x + (u - 0.5) * 5.4 * (1 - v), top + rise * v, zz}, {0, 0, end}};
        };
        painter.surface(gable, plain(tint), house);
      }
      painter.box({x - side * 0.9, top + 1.5, z + 1.2}, {0.28, 0.7, 0.28}, plain({0.50, 0.28, 0.22}), fine);
    }
  }

  // Trees along the pavements.
  Brush foliage = ground;
  foliage.sigma_pixels = 2.3;
  foliage.layers = 20;
  foliage.opaque = 0.55;
  const auto tree = [&](double x, double z, double size, double key) {
    const Vec3 dark = mix({0.10, 0.26, 0.07}, {0.26, 0.28, 0.07}, hash_fraction(key, 11));
    const Vec3 light = mix({0.38, 0.58, 0.16}, {0.66, 0.60, 0.16}, hash_fraction(key, 12));
    const Paint leaves = [=](const Vec3& p, double u, double) {
      return mix(dark, light, 0.5 * u + 0.7 * value_noise(p * 3.0) - 0.1);
    };
    const Paint bark = [](const Vec3& p, double, double) {
      return mix({0.22, 0.15, 0.10}, {0.44, 0.33, 0.24}, value_noise({p[0] * 20, p[1] * 4, p[2] * 20}));
    };
    painter.cylinder({x, 0, z}, {x, 1.9 * size, z}, 0.15 * size, 0.09 * size, bark, fine);
    for (int i = 0; i < 9; ++i) {
      const double dx = painter.random().uniform(-0.85, 0.85) * size;
      const double dy = painter.random().uniform(-0.6, 1.1) * size;
      const double dz = painter.random().uniform(-0.85, 0.85) * size;
      const Vec3 centre = {x + dx, 2.7 * size + dy, z + dz};
      painter.block_ball(centre, Vec3{0.6, 0.5, 0.6} * size);
      painter.cloud(centre, Vec3{0.8, 0.66, 0.8} * size, leaves, foliage);
    }
  };
  for (int i = 0; i < 6; ++i) {
    tree(-4.4, 5.2 + 6.4 * i, 0.85 + 0.25 * hash_fraction(i, 21), i);
    tree(4.5, 3.4 + 6.6 * i, 0.80 + 0.30 * hash_fraction(i, 22), i + 40);
  }

  // Street lamps, cars, a letter box, a bench.
  for (int i = 0; i < 4; ++i) {
    const double z = 7.6 + 9.0 * i;
    for (const double side : {-1.0, 1.0}) {
      const double x = 3.5 * side;
      painter.cylinder({x, 0, z}, {x, 3.6, z}, 0.06, 0.04, plain({0.14, 0.20, 0.18}), fine);
      painter.cylinder({x, 3.58, z}, {x - 0.7 * side, 3.7, z}, 0.035, 0.03, plain({0.14, 0.20, 0.18}), fine);
      painter.box({x - 0.8 * side, 3.66, z}, {0.22, 0.05, 0.09}, plain({0.9, 0.88, 0.8}), fine);
    }
  }
  const auto car = [&](double x, double z, const Vec3& paint) {
    Brush shiny = fine;
    shiny.gloss = 0.25;
    shiny.grid = 8;
    const Paint body = [=](const Vec3& p, double, double) {
      if (p[2] < z - 1.62) {  // the end that faces the viewer
        if (within(std::fabs(p[0] - x), 0.45, 0.72) && within(p[1], 0.52, 0.68)) return Vec3{1.3, 0.2, 0.15};
        if (std::fabs(p[0] - x) < 0.26 && within(p[1], 0.38, 0.50)) return Vec3{0.95, 0.95, 0.9};
      }
      return p[1] < 0.32 ? Vec3{0.12, 0.12, 0.13} : paint;
    };
    painter.box({x, 0.53, z}, {0.80, 0.27, 1.70}, body, shiny);
    const Surface window_front = quad_surface({x - 0.72, 0.80, z - 1.15}, {1.44, 0, 0}, {0, 0.48, 0.42});
    const Surface window_back = quad_surface({x + 0.72, 0.80, z + 1.05}, {-1.44, 0, 0}, {0, 0.48, -0.42});
    const Paint glass = [](const Vec3&, double u, double v) {
      return !within(u, 0.05, 0.95) || v > 0.95 ? Vec3{0.1, 0.1, 0.1} : mix({0.20, 0.26, 0.32}, {0.62, 0.74, 0.84}, v);
    };
    painter.surface(window_front, glass, shiny);
    painter.surface(window_back, glass, shiny);
    painter.box(
        {x, 1.02, z - 0.05}, {0.70, 0.24, 0.72},
        [=](const Vec3& p, double, double) {
          if (p[1] > 1.22) return paint;
          return std::fabs(p[2] - z + 0.05) < 0.06 ? paint : Vec3{0.24, 0.30, 0.36};
        },
        shiny);
    painter.box({x, 1.28, z - 0.05}, {0.71, 0.03, 0.72}, plain(paint), shiny);
    for (const double side : {-1.0, 1.0}) {
      for (const double wz : {-1.05, 1.05}) {
        painter.cylinder(
            {x + 0.72 * side, 0.3, z + wz}, {x + 0.83 * side, 0.3, z + wz}, 0.3, 0.3,
            [=](const Vec3& p, double, double) {
              const double dy = p[1] - 0.3, dz = p[2] - z - wz;
              return dy * dy + dz * dz < 0.03 ? Vec3{0.7, 0.7, 0.72} : Vec3{0.08, 0.08, 0.08};
            },
            fine);
      }
    }
  };
  car(2.05, 6.6, {0.70, 0.10, 0.10});
  car(2.1, 13.5, {0.85, 0.85, 0.86});
  car(2.1, 24.0, {0.20, 0.24, 0.28});
  car(-2.05, 11.0, {0.14, 0.32, 0.58});
  car(-2.1, 18.5, {0.88, 0.70, 0.20});
  painter.cylinder({-3.75, 0, 4.2}, {-3.75, 1.1, 4.2}, 0.19, 0.19, plain({0.75, 0.10, 0.08}), fine);
  painter.surface(ellipsoid_surface({-3.75, 1.1, 4.2}, {0.22, 0.12, 0.22}), plain({0.75, 0.10, 0.08}), fine);

  // A church and hills where the street ends, sky over all.
  painter.box({1.0, 5.5, 62}, {2.0, 5.5, 2.0}, plain({0.78, 0.72, 0.62}), house);
  painter.surface(frustum_surface({1.0, 11, 62}, {1.0, 19, 62}, 2.6, 0.05), plain({0.30, 0.36, 0.38}), house);
  painter.box({5.5, 3.2, 64}, {4.0, 3.2, 2.2}, plain({0.74, 0.68, 0.58}), house);
  Brush far = ground;
  far.sigma_pixels = 3.2;
  far.layers = 48;
  far.emission = 0.45;
  far.depth = 0.01;
  const Paint woods = [](const Vec3& p, double, double) {
    return mix({0.22, 0.36, 0.28}, {0.46, 0.56, 0.40}, fractal_noise(p * 0.35, 3));
  };
  painter.surface(ellipsoid_surface({-45, -6, 110}, {70, 19, 22}), woods, far);
  painter.surface(ellipsoid_surface({60, -6, 120}, {75, 23, 22}), woods, far);
  const Paint sky = [](const Vec3& p, double, double) {
    const double height = p[1] / 180.0;
    const double clouds = fractal_noise({p[0] * 0.016, p[1] * 0.045 + 7, p[2] * 0.016}, 4);
    return mix(mix({0.86, 0.90, 0.95}, {0.30, 0.52, 0.84}, 1.7 * height), {1.02, 1.01, 1.0}, 5.0 * (clouds - 0.53));
  };
  Brush heaven = far;
  heaven.sigma_pixels = 6.5;
  heaven.layers = 50;
  heaven.emission = 1.0;
  heaven.gloss = 0;
  heaven.opaque = 0.5;
  painter.surface(dome_surface({0, 0, 0}, 180, -0.15, 0.85), sky, heaven);
  painter.surface(dome_surface({0, 0, 0}, 230, -0.15, 0.85), sky, heaven);

  // Below ground and behind the houses: the half-seen rest of a capture.
  Brush beyond = far;
  beyond.sigma_pixels = 6;
  beyond.layers = 36;
  const Paint murk = [](const Vec3& p, double, double) {
    return mix({0.28, 0.30, 0.22}, {0.46, 0.44, 0.36}, fractal_noise(p * 0.5, 2));
  };
  painter.surface(quad_surface({-60, -1.2, -1}, {0, 0, 110}, {120, 0, 0}), murk, beyond);
  painter.surface(quad_surface({-30, 0, 4}, {0, 0, 90}, {0, 6, 0}), murk, beyond);
  painter.surface(quad_surface({30, 0, 94}, {0, 0, -90}, {0, 6, 0}), murk, beyond);
  painter.floaters({0, 2.5, 18}, {9, 2.5, 14}, 600, 4);
}

using Painting = void (*)(ScenePainter&);

struct Entry {
  std::uint64_t seed;
  Painting paint;
  Mesh (*mesh)() = nullptr;  ///< null: splats alone
};

constexpr Entry kEntries[] = {{0x6f626a656374, paint_locomotive},
                              {0x696e646f6f72, paint_room},
                              {0x6f7574646f6f72, paint_street},
                              {0x636f757274, paint_courtyard, courtyard_mesh}};

}  // namespace

const std::vector<BuiltinSceneInfo>& builtin_scenes() {
  static const std::vector<BuiltinSceneInfo> scenes = {
      {"object",
       "a toy steam locomotive on a grassy base, 800x800, as the synthetic captures",
       {800, 800},
       {{2.85, -1.75, -3.3}, {0.0, -0.55, 0.1}, {0, -1, 0}, 42}},
      {"indoor",
       "a living room seen from its corner, 1552x1040, as the indoor captures",
       {1552, 1040},
       {{1.1, -1.6, -2.5}, {-0.05, -0.95, 1.4}, {0, -1, 0}, 62}},
      {"outdoor",
       "a street with houses and trees under a wide sky, 980x545, as the outdoor captures",
       {980, 545},
       {{-0.9, -1.9, -0.6}, {0.35, -2.2, 12}, {0, -1, 0}, 52}},
      {"courtyard",
       "a courtyard of triangles with splats before and behind its walls, 960x540",
       {960, 540},
       {{1.4, -2.1, -5.6}, {-0.25, -1.35, 3.0}, {0, -1, 0}, 48}}};
  return scenes;
}

std::vector<std::string> builtin_scene_names() {
  std::vector<std::string> names;
  for (const BuiltinSceneInfo& info : builtin_scenes()) names.push_back(info.name);
  return names;
}

BuiltinScene make_builtin_scene(const std::string& name) {
  const std::vector<BuiltinSceneInfo>& scenes = builtin_scenes();
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    if (scenes[i].name != name) continue;
    ScenePainter painter(kEntries[i].seed, scenes[i].view, scenes[i].size);
    kEntries[i].paint(painter);
    BuiltinScene scene{scenes[i], painter.build(), {}};
    if (kEntries[i].mesh != nullptr) scene.meshes.push_back(std::make_shared<const Mesh>(kEntries[i].mesh()));
    return scene;
  }
  std::string all;
  for (const BuiltinSceneInfo& info : scenes) all += (all.empty() ? "" : ", ") + info.name;
  throw UserError("unknown built-in scene", "builtin:" + name, "there is none of that name",
                  "did you mean builtin:" + nearest_name(name, builtin_scene_names()) + "? There are " + all);
}

}  // namespace vrpipe
