#include <cmath>
#include <vector>

#include "scenes.h"

namespace vrpipe {
namespace {

struct Box {
  Vec3 centre, half;
};

/// The back wall with its gate, the side walls, low to the left.
const std::vector<Box>& walls() {
  static const std::vector<Box> boxes = {{{-4.1, 1.6, 5.2}, {2.9, 1.6, 0.2}},
                                         {{4.1, 1.6, 5.2}, {2.9, 1.6, 0.2}},
                                         {{0.0, 2.85, 5.2}, {1.2, 0.35, 0.2}},
                                         {{-6.8, 0.6, 1.5}, {0.2, 0.6, 3.5}},
                                         {{6.8, 1.6, 1.5}, {0.2, 1.6, 3.5}}};
  return boxes;
}

struct Column {
  Vec3 base;
  double height;
};

const std::vector<Column>& columns() {
  static const std::vector<Column> both = {{{-2.5, 0, 2.4}, 2.9}, {{2.7, 0, 1.2}, 2.9}};
  return both;
}

const Box kPedestal = {{0.1, 0.4, 1.9}, {0.5, 0.4, 0.5}};
const Box kCrate = {{2.0, 0.35, -0.9}, {0.45, 0.35, 0.45}};

}  // namespace

Mesh courtyard_mesh() {
  MeshPainter painter;
  const Paint paving = [](const Vec3& p, double, double) {
    const Vec3 stone = mix({0.52, 0.48, 0.43}, {0.72, 0.68, 0.60}, value_noise({p[0] * 1.3, 2.0, p[2] * 1.3}));
    return stone * (0.85 + 0.3 * value_noise({p[0] * 5, 7.0, p[2] * 5}));
  };
  painter.surface(quad_surface({-7, 0, -5}, {0, 0, 10}, {14, 0, 0}), paving, 20, 28);
  const Paint plaster = [](const Vec3& p, double, double) {
    const Vec3 wall = mix({0.80, 0.62, 0.42}, {0.90, 0.80, 0.62}, fractal_noise(p * 0.9, 2));
    // Damp at the foot.
    return mix(wall * 0.6, wall, p[1] * 1.4 + 0.3 * value_noise(p * 2.0));
  };
  for (const Box& wall : walls()) painter.box(wall.centre, wall.half, plaster, 0.6);
  const Paint marble = [](const Vec3& p, double, double) {
    return mix({0.78, 0.76, 0.74}, {0.95, 0.94, 0.90}, fractal_noise(p * 2.5, 3));
  };
  for (const Column& column : columns()) {
    const Vec3 base = column.base, up = {0, 1, 0};
    painter.box(base + up * 0.1, {0.34, 0.1, 0.34}, marble, 1);
    painter.cylinder(base + up * 0.2, base + up * (column.height - 0.2), 0.26, 0.21, marble, 20, 6);
    painter.box(base + up * (column.height - 0.1), {0.32, 0.1, 0.32}, marble, 1);
  }
  painter.box(kPedestal.centre, kPedestal.half, marble, 0.5);
  const Paint planks = [](const Vec3& p, double, double) {
    return mix({0.36, 0.22, 0.11}, {0.58, 0.40, 0.22}, value_noise({p[0] * 2, p[1] * 9, p[2] * 2}));
  };
  painter.box(kCrate.centre, kCrate.half, planks, 0.25);
  return painter.take();
}

void paint_courtyard(ScenePainter& painter) {
  // As mixed_frame() lights meshes unless told otherwise. The mesh casts its shadows on the splats.
  painter.set_light({0.36, 0.8, -0.48}, {0.80, 0.76, 0.68}, {0.40, 0.42, 0.46});
  for (const Box& wall : walls()) painter.block_box(wall.centre, wall.half);
  for (const Column& column : columns()) {
    const double half = 0.5 * column.height;
    painter.block_box(column.base + Vec3{0, half, 0}, {0.18, half, 0.18});
  }
  painter.block_box(kPedestal.centre, kPedestal.half);
  painter.block_box(kCrate.centre, kCrate.half);

  Brush fine;
  fine.sigma_pixels = 2.4;
  fine.layers = 40;
  fine.gloss = 0.15;
  fine.grid = 6;
  // A statue of bronze on the pedestal.
  const Paint bronze = [](const Vec3& p, double, double) {
    return mix({0.30, 0.20, 0.10}, {0.36, 0.52, 0.42}, 1.3 * fractal_noise(p * 4.0, 3) - 0.2);
  };
  painter.surface(ellipsoid_surface({0.1, 1.25, 1.9}, {0.28, 0.48, 0.22}), bronze, fine);
  painter.surface(ellipsoid_surface({0.1, 1.86, 1.88}, {0.15, 0.19, 0.16}), bronze, fine);
  painter.cylinder({-0.15, 1.55, 1.9}, {-0.55, 1.95, 1.75}, 0.08, 0.05, bronze, fine);
  painter.cylinder({0.35, 1.5, 1.9}, {0.5, 1.05, 1.7}, 0.08, 0.05, bronze, fine);

  Brush foliage = fine;
  foliage.sigma_pixels = 2.8;
  foliage.layers = 34;
  foliage.gloss = 0.03;
  const Paint leaves = [](const Vec3& p, double u, double) {
    return mix({0.08, 0.24, 0.06}, {0.42, 0.58, 0.18}, 0.5 * u + 0.6 * value_noise(p * 7.0) - 0.1);
  };
  const auto bush = [&](const Vec3& centre, double size, int clumps) {
    for (int i = 0; i < clumps; ++i) {
      const double dx = painter.random().uniform(-0.6, 0.6) * size;
      const double dy = painter.random().uniform(-0.3, 0.5) * size;
      const double dz = painter.random().uniform(-0.4, 0.4) * size;
      painter.cloud(centre + Vec3{dx, dy, dz}, Vec3{0.5, 0.42, 0.45} * size, leaves, foliage);
    }
  };
  // Before the walls: bushes that reach into them, ivy close to them, a plant in front of the crate.
  bush({-4.6, 0.5, 4.4}, 0.8, 5);
  bush({4.9, 0.45, 4.3}, 0.7, 5);
  bush({-6.1, 0.4, 0.5}, 0.7, 4);
  bush({1.45, 0.3, -1.7}, 0.4, 4);
  Brush ivy = foliage;
  ivy.depth = 0.008;
  ivy.layers = 12;
  painter.surface(quad_surface({3.0, 0.0, 4.94}, {0, 2.9, 0}, {2.6, 0, 0}), leaves, ivy);
  painter.surface(quad_surface({-3.4, 1.9, 4.94}, {0, 1.2, 0}, {1.6, 0, 0}), leaves, ivy);
  painter.surface(frustum_surface({-2.5, 0.3, 2.4}, {-2.5, 1.9, 2.4}, 0.30, 0.27), leaves, ivy);

  // Behind them: a garden through the gate and over the low wall, trees above, a hedge that nobody sees.
  Brush ground = foliage;
  ground.sigma_pixels = 3.4;
  ground.layers = 26;
  const Paint lawn = [](const Vec3& p, double, double) {
    return mix({0.20, 0.36, 0.10}, {0.52, 0.62, 0.24}, fractal_noise({p[0] * 1.5, 1.0, p[2] * 1.5}, 3));
  };
  painter.surface(quad_surface({-16, -0.02, 5.6}, {0, 0, 20}, {32, 0, 0}), lawn, ground);
  painter.surface(quad_surface({-16, -0.02, -4}, {0, 0, 9.6}, {8.9, 0, 0}), lawn, ground);
  for (const double x : {-4.2, -2.6, 2.4, 4.0, 5.5}) bush({x, 0.7, 6.4}, 0.9, 3);
  const double trees[][3] = {{-4.5, 9.5, 1.5}, {0.9, 12.0, 1.3}, {4.8, 8.8, 1.6}, {-10.0, 4.0, 1.4}};
  for (const auto& tree : trees) {
    painter.cylinder({tree[0], 0, tree[1]}, {tree[0], 2.2 * tree[2], tree[1]}, 0.2, 0.12, plain({0.32, 0.22, 0.14}),
                     ground);
    bush({tree[0], 2.6 * tree[2], tree[1]}, 1.5 * tree[2], 6);
  }

  // Haze before, between and behind; the sky.
  Brush haze;
  haze.sigma_pixels = 14;
  haze.layers = 7;
  haze.opaque = 0;
  haze.faint = 0.95;
  haze.emission = 0.7;
  haze.thickness = 0.8;
  for (const double z : {-1.0, 3.6, 7.5, 11.0})
    painter.cloud({0, 0.9, z}, {5.5, 0.7, 0.7}, plain({0.86, 0.88, 0.92}), haze);
  painter.floaters({0, 1.5, 1}, {6, 1.5, 4}, 400, 4);
  Brush heaven;
  heaven.sigma_pixels = 9;
  heaven.layers = 36;
  heaven.emission = 1;
  heaven.gloss = 0;
  heaven.opaque = 0.5;
  heaven.depth = 0.01;
  const Paint sky = [](const Vec3& p, double, double) {
    const double clouds = fractal_noise({p[0] * 0.03, p[1] * 0.08 + 5, p[2] * 0.03}, 4);
    return mix(mix({0.84, 0.89, 0.95}, {0.32, 0.54, 0.86}, p[1] / 60), {1.0, 1.0, 1.0}, 4.0 * (clouds - 0.52));
  };
  painter.surface(dome_surface({0, 0, 0}, 90, -0.1, 0.8), sky, heaven);
  painter.surface(dome_surface({0, 0, 0}, 120, -0.1, 0.8), sky, heaven);
}

}  // namespace vrpipe
