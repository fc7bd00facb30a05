#include <algorithm>
#include <cmath>

#include "scenes.h"

namespace vrpipe {

// A living room, seen from a corner.
void paint_indoor(ScenePainter& painter) {
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

}  // namespace vrpipe
