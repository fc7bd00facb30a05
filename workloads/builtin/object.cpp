#include <algorithm>
#include <cmath>

#include "scenes.h"

namespace vrpipe {

// A toy steam locomotive on a grassy base. Faces +x; the viewer stands at its right front.
void paint_object(ScenePainter& painter) {
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

}  // namespace vrpipe
