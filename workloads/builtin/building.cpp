#include <algorithm>
#include <cmath>

#include "props.h"
#include "scenes.h"

namespace vrpipe {
namespace {

/// Storeys of tall windows between piers, many of them broken or bricked up.
Paint factory_wall(const Vec3& centre, const Vec3& half, const Vec3& brick, double storey_height) {
  return [=](const Vec3& p, double, double) {
    const bool along_x = std::fabs(p[0] - centre[0]) < half[0] - 0.05;
    const double bay = (along_x ? p[0] : p[2]) / 4.2, storey = p[1] / storey_height;
    const double x = fraction(bay), y = fraction(storey);
    const double key = std::floor(bay) + 57 * std::floor(storey) + (along_x ? 0 : 5000);
    if (p[1] > centre[1] + half[1] - 0.6) return Vec3{0.60, 0.57, 0.52};
    if (within(x, 0.18, 0.82) && within(y, 0.22, 0.84)) {
      if (hash_fraction(key, 1) < 0.12) return brick * 1.25;
      if (fraction(x * 9) < 0.16 || fraction(y * 8) < 0.14) return Vec3{0.66, 0.66, 0.62};
      return hash_fraction(std::floor(x * 9) + 9 * std::floor(y * 8) + 80 * key, 2) < 0.2 ? Vec3{0.06, 0.07, 0.08}
                                                                                          : Vec3{0.34, 0.42, 0.46};
    }
    return brick * (0.8 + 0.35 * fractal_noise(p * 0.8, 3)) * (fraction(p[1] / 0.6) < 0.12 ? 0.85 : 1.0);
  };
}

}  // namespace

// A factory of several halls around yards, from a drone: sawtooth roofs, a tower, chimneys, tanks, sheds; lorries and cars,
// containers, roads, woods and fields around it.
void paint_building(CapturePainter& painter) {
  painter.set_light({-0.7, 1.0, -0.45}, {0.84, 0.79, 0.68}, {0.44, 0.48, 0.55});
  painter.set_contact_reach(9);
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) painter.camera({-150.0 + 75 * i, 62, -150.0 + 75 * j});
  }
  Texture solid;
  solid.layers = 40;
  solid.gloss = 0;
  Texture land = solid;
  land.size = 1.1;

  const Vec3 brick = {0.52, 0.27, 0.20};
  const auto flat_roof = [&](const Vec3& centre, const Vec3& half, double key) {
    const double y = centre[1] + half[1];
    const Paint tar = [=](const Vec3& p, double, double) {
      const double stain = fractal_noise({p[0] * 0.12, key, p[2] * 0.12}, 4);
      if (fraction(p[0] / 12.0) < 0.012 || fraction(p[2] / 9.0) < 0.014) return Vec3{0.20, 0.20, 0.20};
      return mix({0.26, 0.26, 0.27}, {0.62, 0.60, 0.56}, 1.8 * stain - 0.4);
    };
    painter.quad({centre[0] - half[0], y + 0.05, centre[2] - half[2]}, {0, 0, 2 * half[2]}, {2 * half[0], 0, 0}, tar,
                 land);
    const int units = static_cast<int>(half[0] * half[2] / 60);
    for (int i = 0; i < units; ++i) {  // fans, skylights
      const double x = centre[0] + half[0] * painter.random().uniform(-0.85, 0.85);
      const double z = centre[2] + half[2] * painter.random().uniform(-0.85, 0.85);
      const double size = painter.random().uniform(0.7, 1.6);
      if (i % 3 == 0) {
        painter.cylinder({x, y, z}, {x, y + 1.5, z}, 0.6, 0.6, plain({0.66, 0.67, 0.68}), solid);
      } else {
        painter.box({x, y + 0.6, z}, {size, 0.6, size * 0.7},
                    plain(i % 3 == 1 ? Vec3{0.70, 0.72, 0.74} : Vec3{0.36, 0.46, 0.52}), solid);
      }
    }
  };
  const auto block = [&](double x, double z, double hx, double height, double hz, const Vec3& colour, double storey) {
    const Vec3 centre = {x, 0.5 * height, z}, half = {hx, 0.5 * height, hz};
    painter.box(centre, half, factory_wall(centre, half, colour, storey), solid);
    flat_roof(centre, half, x);
  };
  // The main building: a long front of four storeys with wings, a tower with a tank.
  block(0, -14, 46, 17, 9, brick, 4.2);
  block(-38, 20, 8, 17, 25, brick, 4.2);
  block(38, 20, 8, 17, 25, brick * 1.1, 4.2);
  block(0, -14, 7, 27, 7, brick * 0.95, 4.2);
  painter.cylinder(
      {0, 27, -14}, {0, 35, -14}, 4.2, 4.2,
      [](const Vec3& p, double u, double) {
        return fraction(u * 12) < 0.1 || fraction(p[1] / 2.6) < 0.08 ? Vec3{0.46, 0.44, 0.42} : Vec3{0.74, 0.72, 0.68};
      },
      solid);
  painter.surface(frustum_surface({0, 35, -14}, {0, 37.5, -14}, 4.5, 0.2), plain({0.46, 0.30, 0.24}), solid);
  // Halls with sawtooth roofs in the yard between the wings.
  for (int i = 0; i < 5; ++i) {
    const double x0 = -24 + 9.6 * i;
    const Vec3 centre = {x0 + 4.8, 3.5, 24}, half = {4.8, 3.5, 18};
    painter.box(centre, half, factory_wall(centre, half, {0.60, 0.50, 0.42}, 7), solid);
    painter.quad(
        {x0, 7, 6}, {0, 0, 36}, {9.6, 4.2, 0},
        [](const Vec3& p, double, double) {
          const double rust = fractal_noise({p[0] * 0.3, 1, p[2] * 0.3}, 4);
          return mix({0.52, 0.53, 0.52}, {0.50, 0.28, 0.17}, 5 * (rust - 0.5)) *
                 (fraction(p[2] / 0.9) < 0.2 ? 0.8 : 1.0);
        },
        solid);
    painter.quad(
        {x0 + 9.6, 7, 42}, {0, 0, -36}, {0, 4.2, 0},
        [](const Vec3& p, double, double v) {
          return fraction(p[2] / 1.2) < 0.12 || !within(v, 0.08, 0.92) ? Vec3{0.70, 0.70, 0.66}
                                                                       : Vec3{0.26, 0.36, 0.42};
        },
        solid);
    painter.block_box({x0 + 7.0, 8, 24}, {2.4, 1.2, 18});
  }
  // The power house with two chimneys, tanks, a warehouse, offices, sheds.
  block(72, 4, 13, 14, 16, {0.58, 0.32, 0.24}, 7);
  for (const double z : {-3.0, 11.0}) {
    painter.cylinder(
        {88, 0, z}, {88, 44, z}, 2.6, 1.7,
        [](const Vec3& p, double, double) {
          if (p[1] > 38) return fraction(p[1] / 4) < 0.5 ? Vec3{0.86, 0.84, 0.80} : Vec3{0.66, 0.14, 0.10};
          return Vec3{0.56, 0.30, 0.22} * (fraction(p[1] / 0.8) < 0.15 ? 0.75 : 1.0);
        },
        solid);
  }
  for (int i = 0; i < 4; ++i) {
    painter.cylinder(
        {72.0 + 9.5 * (i % 2), 0, 34.0 + 9.5 * (i / 2)}, {72.0 + 9.5 * (i % 2), 9, 34.0 + 9.5 * (i / 2)}, 4.2, 4.2,
        [](const Vec3& p, double u, double) {
          return fraction(p[1] / 2.2) < 0.05 || fraction(u * 10) < 0.03 ? Vec3{0.56, 0.56, 0.55}
                                                                        : Vec3{0.86, 0.86, 0.83};
        },
        solid);
  }
  block(-86, 8, 17, 9, 30, {0.66, 0.62, 0.54}, 9);
  block(-80, -58, 22, 8, 12, {0.56, 0.58, 0.60}, 8);
  block(62, -58, 12, 11, 9, {0.74, 0.66, 0.52}, 3.7);
  block(0, 72, 38, 8, 10, {0.48, 0.30, 0.24}, 8);
  const auto shed = [&](double x, double z, double hx, double hz, const Vec3& tile) {
    const Vec3 centre = {x, 2, z}, half = {hx, 2, hz};
    painter.box(centre, half, factory_wall(centre, half, {0.64, 0.58, 0.48}, 4), solid);
    gable_roof(
        painter, {x, 4, z}, hx + 0.4, hz + 0.4, 0.5 * std::min(hx, hz) + 1, hx > hz,
        [=](const Vec3& p, double, double) {
          return tile * (fraction((hx > hz ? p[0] : p[2]) / 0.8) < 0.15 ? 0.8 : 0.9 + 0.25 * value_noise(p * 1.2));
        },
        plain({0.62, 0.56, 0.46}), solid);
  };
  for (int i = 0; i < 12; ++i) {  // a village beside it
    shed(-150.0 + 26.0 * i, i % 2 == 0 ? 128 : 150, 6, 4.5,
         i % 3 == 0 ? Vec3{0.34, 0.33, 0.35} : Vec3{0.56, 0.26, 0.18});
    shed(128 + (i % 2) * 22, -150.0 + 26.0 * i, 4.5, 6, i % 3 == 1 ? Vec3{0.34, 0.33, 0.35} : Vec3{0.54, 0.28, 0.20});
  }
  for (int i = 0; i < 5; ++i) shed(-48 + 20.0 * i, 54, 7, 3.5, {0.46, 0.40, 0.36});

  // Containers in rows, lorries and cars in the parking lot and on the road.
  for (int i = 0; i < 44; ++i) {
    const double x = -58 + 3.0 * (i % 11), z = -58 + 8.0 * static_cast<double>(i / 11);
    if (hash_fraction(i, 31) < 0.2) continue;
    const Vec3 colour = {0.2 + 0.6 * hash_fraction(i, 32), 0.2 + 0.35 * hash_fraction(i, 33),
                         0.15 + 0.5 * hash_fraction(i, 34)};
    const double height = hash_fraction(i, 35) > 0.6 ? 2.6 : 1.3;
    painter.box(
        {x, height, z}, {1.2, height, 3.0},
        [=](const Vec3& p, double, double) { return colour * (fraction((p[0] + p[2]) / 0.5) < 0.4 ? 0.75 : 1.0); },
        solid);
  }
  const auto car = [&](double x, double z, bool along_x, double key) {
    const Vec3 paints[] = {
        {0.85, 0.85, 0.86}, {0.12, 0.13, 0.15}, {0.62, 0.10, 0.09}, {0.16, 0.28, 0.52}, {0.5, 0.52, 0.54}};
    const Vec3 paint = paints[static_cast<std::size_t>(5 * hash_fraction(key, 41)) % 5];
    painter.box({x, 0.65, z}, along_x ? Vec3{2.2, 0.4, 0.9} : Vec3{0.9, 0.4, 2.2}, plain(paint), solid);
    painter.box(
        {x, 1.3, z}, along_x ? Vec3{1.1, 0.28, 0.8} : Vec3{0.8, 0.28, 1.1},
        [=](const Vec3& p, double, double) {
          return p[1] > 1.55 ? paint : Vec3{0.14, 0.18, 0.22};
        },
        solid);
  };
  for (int i = 0; i < 60; ++i) {
    if (hash_fraction(i, 42) < 0.35) continue;
    car(6 + 3.1 * (i % 20), -72 + 11.0 * static_cast<double>(i / 20) + 0.5 * hash_fraction(i, 43), false, i);
  }
  for (int i = 0; i < 14; ++i) car(-170 + 25.0 * i, i % 2 == 0 ? -92.0 : -96.0, true, i + 100);

  // The ground: fields, grass, yards of concrete, roads with lines.
  const Paint ground = [](const Vec3& p, double, double) {
    const double fine = fractal_noise({p[0] * 0.9, 0, p[2] * 0.9}, 3),
                 patch = fractal_noise({p[0] * 0.03, 4, p[2] * 0.03}, 4);
    const double road = std::min(std::fabs(p[2] + 94), std::fabs(p[0] - 108));
    if (road < 4.2) {
      const double along = std::fabs(p[2] + 94) < 4.2 ? p[0] : p[2];
      if (road < 0.14 && fraction(along / 6) < 0.5) return Vec3{0.92, 0.90, 0.84};
      if (within(road, 3.7, 3.9)) return Vec3{0.84, 0.83, 0.78};
      return Vec3{0.30, 0.30, 0.31} * (0.85 + 0.3 * fine);
    }
    if (within(p[0], 4, 70) && within(p[2], -78, -44)) {  // the parking lot
      if (fraction((p[0] - 4.4) / 3.1) < 0.06 && fraction((p[2] + 75.5) / 11) < 0.55) return Vec3{0.92, 0.92, 0.9};
      return Vec3{0.36, 0.36, 0.37} * (0.8 + 0.3 * fine + 0.15 * patch);
    }
    if (within(p[0], -112, 100) && within(p[2], -86, 88)) {  // the yards, weeds in their cracks
      const Vec3 concrete = mix({0.44, 0.42, 0.38}, {0.68, 0.65, 0.59}, fine);
      return mix(concrete, mix({0.20, 0.28, 0.10}, {0.44, 0.46, 0.22}, fine), 7 * (patch - 0.56));
    }
    if (patch > 0.60) return mix({0.50, 0.42, 0.28}, {0.68, 0.60, 0.42}, fraction(p[0] / 1.6) < 0.4 ? 0.3 : fine);
    return mix(mix({0.16, 0.26, 0.09}, {0.40, 0.48, 0.20}, fine), {0.50, 0.48, 0.26}, 3 * (patch - 0.48));
  };
  painter.quad({-185, 0, -185}, {0, 0, 370}, {370, 0, 0}, ground, land);
  Texture far = land;
  far.size = 2.5;
  painter.quad({-700, -0.5, -700}, {0, 0, 1400}, {1400, 0, 0}, ground, far);

  // Trees along the roads, a wood behind.
  Texture leaves = solid;
  leaves.layers = 22;
  const auto plant = [&](double x, double z, double key) {
    tree(painter, {x, 0, z}, 9 + 6 * hash_fraction(key, 51), key, leaves, solid);
  };
  for (int i = 0; i < 24; ++i) plant(-178 + 15.0 * i + 4 * hash_fraction(i, 52), -104 - 3 * hash_fraction(i, 53), i);
  for (int i = 0; i < 16; ++i) plant(-60 + 10.0 * i, -85 + 2 * hash_fraction(i, 54), i + 30);
  for (int i = 0; i < 14; ++i) plant(101 - 2 * hash_fraction(i, 55), -70 + 13.0 * i, i + 60);
  for (int i = 0; i < 70; ++i) {
    plant(-180 + 68 * hash_fraction(i, 56), -80 + 190 * hash_fraction(i, 57), i + 100);
    plant(-110 + 215 * hash_fraction(i, 58), 92 + 28 * hash_fraction(i, 59), i + 200);
    plant(-180 + 360 * hash_fraction(i, 60), -185 + 70 * hash_fraction(i, 61), i + 300);
    plant(-180 + 360 * hash_fraction(i, 62), 160 + 25 * hash_fraction(i, 63), i + 400);
  }
  Texture heaven;
  heaven.size = 4;
  heaven.layers = 24;
  sky(painter, 900, 0.4, 1, heaven);
  painter.floaters({0, 30, 0}, {150, 25, 150}, 3000, 1.2);
}

}  // namespace vrpipe
