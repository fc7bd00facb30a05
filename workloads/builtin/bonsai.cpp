#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "props.h"
#include "scenes.h"

namespace vrpipe {

// A bonsai in a glazed pot on a round table with a cloth; around it a living room with a piano, shelves, chairs, a window.
void paint_bonsai(CapturePainter& painter) {
  painter.set_light({-0.9, 0.85, -0.35}, {0.52, 0.49, 0.43}, {0.66, 0.65, 0.63});
  painter.set_contact_reach(0.3);
  painter.ring_of_cameras({0, 1.25, 0}, 1.3, 9);
  painter.ring_of_cameras({0, 1.65, 0}, 0.9, 4);
  Texture wall;
  wall.size = 1.7;
  wall.layers = 66;
  wall.gloss = 0.03;
  Texture thing;
  thing.layers = 58;
  thing.gloss = 0.08;
  thing.size = 1.1;
  Texture fine = thing;
  fine.size = 0.65;

  // The table and its cloth.
  const Paint cloth = [](const Vec3& p, double, double) {
    const double r = std::sqrt(p[0] * p[0] + p[2] * p[2]);
    const double stripe = std::max(std::fabs(fraction(p[0] / 0.16) - 0.5), std::fabs(fraction(p[2] / 0.16) - 0.5));
    if (r > 0.60) return Vec3{0.30, 0.12, 0.14};
    if (within(r, 0.54, 0.57)) return Vec3{0.86, 0.78, 0.56};
    if (stripe > 0.46) return Vec3{0.80, 0.70, 0.52};
    const double diamond = std::fabs(fraction(p[0] / 0.16) - 0.5) + std::fabs(fraction(p[2] / 0.16) - 0.5);
    return diamond < 0.22 ? Vec3{0.82, 0.66, 0.38} : Vec3{0.50, 0.16, 0.17};
  };
  painter.cylinder({0, 0.70, 0}, {0, 0.735, 0}, 0.62, 0.62, cloth, fine);
  painter.surface(
      frustum_surface({0, 0.46, 0}, {0, 0.735, 0}, 0.645, 0.625),
      [](const Vec3& p, double u, double) {
        if (p[1] < 0.48) return Vec3{0.86, 0.78, 0.56};
        return Vec3{0.50, 0.16, 0.17} * (0.75 + 0.25 * std::fabs(2 * fraction(u * 26) - 1));
      },
      thing);
  painter.cylinder({0, 0.0, 0}, {0, 0.70, 0}, 0.06, 0.06, plain({0.26, 0.16, 0.09}), thing);

  // Pot, stand, soil with moss.
  const Paint glaze = [](const Vec3& p, double, double) {
    if (p[1] > 0.862) return Vec3{0.16, 0.30, 0.42};
    return mix({0.10, 0.22, 0.34}, {0.26, 0.44, 0.54}, fractal_noise({p[0] * 20, p[1] * 8, p[2] * 20}, 3));
  };
  painter.box({0, 0.745, 0}, {0.22, 0.012, 0.16}, plain({0.20, 0.11, 0.06}), fine);
  for (const double side : {-1.0, 1.0}) {
    painter.quad({-0.17 * side, 0.765, -0.115 * side}, {0.34 * side, 0, 0}, {0, 0.11, -0.02 * side}, glaze, fine);
    painter.quad({0.17 * side, 0.765, -0.115 * side}, {0, 0, 0.23 * side}, {0.025 * side, 0.11, 0}, glaze, fine);
    painter.box({0, 0.875, 0.138 * side}, {0.205, 0.008, 0.012}, glaze, fine);
    painter.box({0.197 * side, 0.875, 0}, {0.012, 0.008, 0.145}, glaze, fine);
  }
  painter.block_box({0, 0.81, 0}, {0.16, 0.05, 0.11});
  painter.quad(
      {-0.19, 0.868, -0.13}, {0, 0, 0.26}, {0.38, 0, 0},
      [](const Vec3& p, double, double) {
        const double moss = fractal_noise(p * 16.0, 2), grain = fractal_noise(p * 70.0, 2);
        return moss > 0.5 ? mix({0.14, 0.26, 0.06}, {0.42, 0.52, 0.16}, grain)
                          : mix({0.16, 0.11, 0.07}, {0.40, 0.30, 0.21}, grain);
      },
      fine);

  // The tree: a trunk that winds upwards, boughs, pads of leaves.
  const Paint bark = rough({0.16, 0.11, 0.08}, {0.50, 0.39, 0.30}, 55, {1, 0.35, 1});
  const Vec3 trunk[] = {{-0.02, 0.865, 0.0}, {0.035, 0.93, 0.012}, {-0.02, 0.995, 0.0}, {-0.055, 1.06, -0.02},
                        {0.0, 1.12, -0.015}, {0.03, 1.17, 0.0},    {0.01, 1.22, 0.01}};
  for (int i = 0; i < 6; ++i) {
    const double thick = 0.036 - 0.0045 * i;
    painter.cylinder(trunk[i], trunk[i + 1], thick, thick - 0.0045, bark, fine);
    painter.ball(trunk[i + 1], Vec3{1, 1, 1} * (thick - 0.004), bark, fine);
  }
  const Vec3 roots[] = {{0.07, 0, 0.02}, {-0.06, 0, 0.045}, {-0.065, 0, -0.03}, {0.03, 0, -0.06}};
  for (const Vec3& root : roots) {
    painter.cylinder(trunk[0] + Vec3{0, 0.025, 0}, trunk[0] + root, 0.014, 0.007, bark, fine);
  }
  struct Pad {
    int joint;
    Vec3 centre, radii;
  };
  const Pad pads[] = {{2, {-0.17, 1.02, 0.02}, {0.10, 0.035, 0.09}},  {2, {0.15, 1.05, -0.03}, {0.10, 0.035, 0.085}},
                      {3, {-0.20, 1.12, -0.05}, {0.09, 0.032, 0.08}}, {4, {0.17, 1.16, 0.05}, {0.10, 0.036, 0.09}},
                      {4, {-0.02, 1.13, 0.13}, {0.09, 0.032, 0.075}}, {5, {-0.12, 1.21, 0.02}, {0.09, 0.034, 0.08}},
                      {5, {0.06, 1.20, -0.12}, {0.09, 0.034, 0.08}},  {6, {0.01, 1.27, 0.01}, {0.13, 0.05, 0.11}},
                      {6, {0.09, 1.25, 0.05}, {0.08, 0.035, 0.07}},   {6, {0.0, 1.32, 0.0}, {0.07, 0.035, 0.06}}};
  Texture leaves = fine;
  leaves.layers = 40;
  leaves.size = 0.6;
  const Paint leaf = [](const Vec3& p, double u, double) {
    return mix({0.05, 0.15, 0.04}, {0.40, 0.60, 0.16}, 0.45 * u + 0.75 * fractal_noise(p * 75.0, 2) - 0.15);
  };
  for (const Pad& pad : pads) {
    painter.cylinder(trunk[pad.joint], pad.centre, 0.012, 0.006, bark, fine);
    for (int i = 0; i < 5; ++i) {
      const double x = painter.random().uniform(-0.55, 0.55) * pad.radii[0];
      const double z = painter.random().uniform(-0.55, 0.55) * pad.radii[2];
      const double y = painter.random().uniform(-0.2, 0.35) * pad.radii[1];
      const Vec3 centre = pad.centre + Vec3{x, y, z};
      painter.block_ball(centre, pad.radii * 0.4);
      painter.cloud(centre, pad.radii * 0.62, leaf, leaves);
    }
  }
  // On the table: a cup, a pair of shears, a book.
  painter.cylinder({0.36, 0.737, -0.26}, {0.36, 0.82, -0.26}, 0.034, 0.042, plain({0.90, 0.88, 0.82}), fine);
  painter.box({-0.36, 0.75, 0.28}, {0.12, 0.014, 0.09}, plain({0.16, 0.30, 0.48}), fine);
  painter.slab({0.26, 0.738, 0.30}, {0.14, 0, 0.05}, {-0.01, 0, 0.016}, {0, 0.008, 0}, plain({0.16, 0.16, 0.17}), fine);

  // The room.
  const Paint boards = [](const Vec3& p, double, double) {
    const double plank = std::floor(p[0] / 0.16), shift = 1.7 * hash_fraction(plank, 5);
    const double board = std::floor((p[2] + shift) / 1.2);
    const double grain = fractal_noise({p[0] * 30, plank + 3 * board, p[2] * 2.5}, 3);
    const Vec3 wood =
        mix({0.40, 0.24, 0.12}, {0.70, 0.48, 0.28}, 0.6 * grain + 0.5 * hash_fraction(plank * 7 + board, 6));
    return fraction(p[0] / 0.16) < 0.05 || fraction((p[2] + shift) / 1.2) < 0.01 ? wood * 0.5 : wood;
  };
  painter.quad({-2.4, 0, -2.4}, {0, 0, 5.0}, {5.2, 0, 0}, boards, wall);
  painter.quad({-2.4, 2.5, -2.4}, {5.2, 0, 0}, {0, 0, 5.0}, plain({0.88, 0.87, 0.84}), wall);
  const auto skirting = [](const Vec3& p, const Vec3& paint) {
    return p[1] < 0.11 ? Vec3{0.90, 0.89, 0.86} : paint * (0.96 + 0.07 * value_noise(p * 3.0));
  };
  const Paint back = [=](const Vec3& p, double, double) {
    const auto framed = [&](double x, double y, double w, double h) {
      const double d = std::max(std::fabs(p[0] - x) / w, std::fabs(p[1] - y) / h);
      return d < 1 ? (d > 0.88 ? 2 : 1) : 0;
    };
    if (const int part = framed(1.55, 1.6, 0.34, 0.42)) {
      if (part == 2) return Vec3{0.55, 0.40, 0.16};
      return mix({0.16, 0.26, 0.38}, {0.88, 0.72, 0.46}, 1.2 * fractal_noise({p[0] * 5, p[1] * 9, 1}, 3) - 0.1);
    }
    if (const int part = framed(-0.1, 1.72, 0.30, 0.22)) {
      if (part == 2) return Vec3{0.08, 0.08, 0.08};
      return value_noise(p * 14.0) > 0.5 ? Vec3{0.88, 0.84, 0.76} : Vec3{0.60, 0.26, 0.18};
    }
    return skirting(p, {0.74, 0.72, 0.64});
  };
  painter.quad({2.8, 0, 2.6}, {-5.2, 0, 0}, {0, 2.5, 0}, back, wall);
  const Paint right = [=](const Vec3& p, double, double) {
    const double dz = std::fabs(p[2] - 0.9) / 0.85, dy = std::fabs(p[1] - 1.45) / 0.75;
    const double d = std::max(dz, dy);
    if (d < 1) {
      if (d > 0.93 || dz < 0.03 || std::fabs(dy) < 0.025) return Vec3{0.98, 0.98, 0.96};
      const double trees = 1.15 + 0.6 * fractal_noise({p[2] * 3, 2, 0}, 3);
      return p[1] < trees ? mix({0.30, 0.48, 0.20}, {0.80, 0.92, 0.56}, fractal_noise(p * 16.0, 3)) * 1.2
                          : Vec3{1.25, 1.32, 1.4};
    }
    return skirting(p, {0.80, 0.76, 0.66});
  };
  Texture lit = wall;
  lit.emission = 0.3;
  painter.quad({2.8, 0, -2.4}, {0, 0, 5.0}, {0, 2.5, 0}, right, lit);
  const Paint other = [=](const Vec3& p, double, double) { return skirting(p, {0.80, 0.76, 0.66}); };
  painter.quad({-2.4, 0, 2.6}, {0, 0, -5.0}, {0, 2.5, 0}, other, wall);
  painter.quad({-2.4, 0, -2.4}, {5.2, 0, 0}, {0, 2.5, 0}, other, wall);
  const Paint curtain = [](const Vec3& p, double, double) {
    return mix({0.40, 0.44, 0.36}, {0.78, 0.78, 0.64}, std::fabs(2 * fraction(p[2] * 8) - 1));
  };
  for (const double z : {-0.25, 1.75}) painter.quad({2.72, 0.2, z - 0.05}, {0, 0, 0.4}, {0, 2.1, 0}, curtain, thing);

  // A piano against the back wall, with its stool; sheet music on it.
  const Vec3 lacquer = {0.10, 0.07, 0.06};
  Texture glossy = thing;
  glossy.gloss = 0.25;
  const Paint piano = [=](const Vec3& p, double, double) {
    if (within(p[1], 0.20, 0.58) && within(std::fabs(p[0] - 0.62), 0.08, 0.60) && p[2] < 2.24) return lacquer * 1.7;
    return lacquer;
  };
  painter.box({0.62, 0.64, 2.40}, {0.75, 0.64, 0.18}, piano, glossy);
  painter.box({0.62, 0.70, 2.12}, {0.75, 0.04, 0.12}, piano, glossy);
  painter.quad(
      {-0.08, 0.745, 2.005}, {0, 0, 0.14}, {1.4, 0, 0},
      [](const Vec3& p, double, double v) {
        const double key = v * 52;
        const int tone = static_cast<int>(std::floor(key)) % 7;
        if (p[2] > 2.06 && fraction(key) > 0.65 && tone != 2 && tone != 6) return Vec3{0.04, 0.04, 0.04};
        return fraction(key) < 0.08 ? Vec3{0.35, 0.35, 0.34} : Vec3{0.94, 0.93, 0.89};
      },
      fine);
  painter.slab(
      {0.40, 0.86, 2.19}, {0.44, 0, 0}, {0, 0.30, 0.04}, {0, 0.001, 0.006},
      [](const Vec3&, double u, double v) {
        return fraction(v * 9) < 0.5 && within(fraction(u * 2), 0.08, 0.92) && fraction(v * 45) < 0.4
                   ? Vec3{0.30, 0.30, 0.30}
                   : Vec3{0.94, 0.93, 0.88};
      },
      fine);
  painter.box({0.62, 0.46, 1.68}, {0.26, 0.05, 0.17}, rough({0.10, 0.05, 0.04}, {0.26, 0.12, 0.09}, 20), thing);
  for (const double x : {0.40, 0.84}) {
    for (const double z : {1.55, 1.80}) painter.cylinder({x, 0, z}, {x, 0.42, z}, 0.02, 0.02, plain(lacquer), fine);
  }
  painter.cylinder({0.15, 1.28, 2.40}, {0.15, 1.31, 2.40}, 0.09, 0.08, plain({0.60, 0.46, 0.18}), fine);
  painter.surface(frustum_surface({0.15, 1.46, 2.40}, {0.15, 1.62, 2.40}, 0.13, 0.07), plain({1.1, 0.92, 0.62}), lit);
  painter.cylinder({0.15, 1.31, 2.40}, {0.15, 1.48, 2.40}, 0.014, 0.014, plain({0.60, 0.46, 0.18}), fine);

  // Shelves of books to the left, an armchair, a plant in the corner.
  const Paint oak = rough({0.34, 0.20, 0.10}, {0.58, 0.38, 0.21}, 12, {0.5, 3, 3});
  painter.box({-1.45, 1.0, 2.57}, {0.72, 1.0, 0.02}, plain({0.24, 0.15, 0.09}), thing);
  for (const double x : {-2.17, -1.45, -0.73}) painter.box({x, 1.0, 2.43}, {0.02, 1.0, 0.15}, oak, thing);
  for (int level = 0; level < 6; ++level) {
    const double y = 0.05 + 0.385 * level;
    painter.box({-1.45, y, 2.43}, {0.72, 0.016, 0.15}, oak, thing);
    if (level == 5) break;
    double x = -2.13;
    for (int book = 0; x < -0.80; ++book) {
      const double key = level * 41 + book;
      const double width = 0.012 + 0.018 * hash_fraction(key, 1), height = 0.10 + 0.06 * hash_fraction(key, 2);
      if (hash_fraction(key, 3) < 0.06) x += 0.08;
      const Vec3 bright = {0.15 + 0.7 * hash_fraction(key, 4), 0.15 + 0.55 * hash_fraction(key, 5),
                           0.12 + 0.55 * hash_fraction(key, 6)};
      const Vec3 cover = mix(bright, {0.40, 0.32, 0.24}, 0.4);
      painter.box(
          {x + width, y + 0.016 + height, 2.41}, {width, height, 0.10},
          [=](const Vec3& p, double, double) {
            return within(p[1] - y, 0.09, 0.11) ? mix(cover, {0.95, 0.85, 0.55}, 0.7) : cover;
          },
          fine);
      x += 2 * width + 0.003;
    }
  }
  const Paint velvet = rough({0.16, 0.26, 0.22}, {0.32, 0.46, 0.38}, 20);
  painter.box({1.9, 0.24, 1.0}, {0.40, 0.18, 0.40}, velvet, thing);
  painter.box({2.25, 0.62, 1.0}, {0.10, 0.36, 0.40}, velvet, thing);
  for (const double z : {0.55, 1.45}) painter.box({1.95, 0.36, z}, {0.42, 0.26, 0.09}, velvet, thing);
  painter.cylinder({2.35, 0, 2.2}, {2.35, 0.38, 2.2}, 0.15, 0.20, plain({0.74, 0.42, 0.28}), thing);
  Texture foliage = thing;
  foliage.layers = 24;
  for (int i = 0; i < 4; ++i) bush(painter, {2.35, 0.62 + 0.25 * i, 2.2}, 0.30 - 0.03 * i, i, foliage);
  // A chair at the table's far side.
  painter.box({0.75, 0.45, 0.80}, {0.21, 0.02, 0.21}, oak, thing);
  for (const double dx : {-0.18, 0.18}) {
    for (const double dz : {-0.18, 0.18}) {
      painter.cylinder({0.75 + dx, 0, 0.80 + dz}, {0.75 + dx, dz > 0 ? 0.98 : 0.44, 0.80 + dz}, 0.018, 0.018, oak,
                       thing);
    }
  }
  for (int i = 0; i < 3; ++i) painter.box({0.75, 0.62 + 0.15 * i, 0.98}, {0.18, 0.03, 0.012}, oak, thing);
  Texture beyond;
  beyond.size = 3;
  beyond.layers = 26;
  beyond.emission = 0.5;
  painter.surface(dome_surface({0, 1, 0}, 6.5, -0.6, 0.8), rough({0.34, 0.36, 0.30}, {0.62, 0.62, 0.58}, 0.8), beyond);
  painter.floaters({0, 1.3, 0}, {2.0, 1.0, 2.0}, 500, 1.5);
}

}  // namespace vrpipe
