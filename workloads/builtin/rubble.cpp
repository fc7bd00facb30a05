#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include "props.h"
#include "scenes.h"

namespace vrpipe {
namespace {

/// A block of concrete or brick, turned at random.
void debris(CapturePainter& painter, const Vec3& centre, double size, double key, const Texture& texture) {
  const Vec3 a = painter.random().direction();
  Vec3 t, b;
  tangents(a, t, b);
  const double x = painter.random().uniform(0.5, 1.0) * size, y = painter.random().uniform(0.25, 0.7) * size,
               z = painter.random().uniform(0.12, 0.4) * size;
  const Vec3 tints[] = {
      {0.62, 0.60, 0.56}, {0.70, 0.67, 0.61}, {0.56, 0.31, 0.24}, {0.50, 0.49, 0.47}, {0.60, 0.50, 0.38}};
  const Vec3 tint = tints[static_cast<std::size_t>(5 * hash_fraction(key, 3)) % 5];
  // Lies flatter than chance would have it.
  const Vec3 ea = unit(Vec3{t[0], 0.45 * t[1], t[2]}) * (2 * x);
  Vec3 eb = unit(cross(unit({0.3 * a[0], 1.0, 0.3 * a[2]}), ea)) * (2 * y);
  const Vec3 ec = unit(cross(ea, eb)) * (2 * z);
  painter.slab(
      centre - (ea + eb + ec) * 0.5, ea, eb, ec,
      [=](const Vec3& p, double, double) { return tint * (0.72 + 0.5 * fractal_noise(p * (3 / size), 3)); }, texture);
  painter.block_ball(centre, Vec3{0.55 * x, std::max(0.45 * z, 0.1), 0.55 * y});
}

void excavator(CapturePainter& painter, const Vec3& at, double side, const Texture& texture) {
  const Vec3 yellow = {0.92, 0.64, 0.08}, dark = {0.14, 0.14, 0.15};
  for (const double z : {-1.2, 1.2}) {
    painter.box(
        at + Vec3{0, 0.5, z}, {2.2, 0.5, 0.35},
        [=](const Vec3& p, double, double) { return fraction(p[0] / 0.4) < 0.3 ? dark * 0.4 : dark * 1.6; }, texture);
  }
  painter.box(at + Vec3{0.4 * side, 1.7, 0}, {1.7, 0.6, 1.3}, plain(yellow), texture);
  painter.box(at + Vec3{1.5 * side, 2.4, 0}, {0.6, 0.4, 1.2}, plain(yellow * 0.9), texture);
  painter.box(
      at + Vec3{-0.5 * side, 2.9, -0.7}, {0.7, 0.75, 0.55},
      [=](const Vec3& p, double, double) {
        return p[1] > at[1] + 3.5 ? yellow : (p[1] < at[1] + 2.4 ? yellow : Vec3{0.18, 0.24, 0.28});
      },
      texture);
  const auto beam = [&](const Vec3& from, const Vec3& to, double half) {
    const Vec3 along = to - from, across = {0, 0, 2 * half};
    const Vec3 up = unit(cross(across, along)) * (2 * half);
    painter.slab(at + from - (across + up) * 0.5, along, up, across, plain(yellow), texture);
  };
  beam({-1.2 * side, 2.0, 0.4}, {-4.0 * side, 5.2, 0.4}, 0.32);
  beam({-4.0 * side, 5.2, 0.4}, {-6.4 * side, 3.0, 0.4}, 0.26);
  painter.box(at + Vec3{-6.5 * side, 2.3, 0.4}, {0.6, 0.6, 0.8}, plain(dark * 2.0), texture);
}

}  // namespace

// A demolition site from a drone: heaps of concrete and brick, what is left of a house, excavators and lorries between
// them, a fence, a road and trees around.
void paint_rubble(CapturePainter& painter) {
  painter.set_light({-0.65, 1.0, -0.5}, {0.84, 0.79, 0.68}, {0.44, 0.48, 0.55});
  painter.set_contact_reach(3);
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j) painter.camera({-90.0 + 45 * i, 38, -90.0 + 45 * j});
  }
  Texture solid;
  solid.layers = 40;
  solid.gloss = 0;
  Texture land = solid;
  land.size = 1.1;

  // The ground: dust and grit with the ruts of lorries, grass outside of the fence, a road.
  struct Heap {
    double x, z, radius, height;
  };
  static constexpr Heap kHeaps[] = {{0, 4, 24, 10},      {-26, 14, 15, 6.5}, {22, 22, 17, 7},  {26, -12, 13, 5},
                                    {-22, -16, 12, 4.5}, {0, 40, 16, 5},     {-44, 40, 12, 4}, {48, 4, 10, 3.5}};
  const auto height = [](double x, double z) {
    double sum = 0;
    for (const Heap& heap : kHeaps) {
      const double d = ((x - heap.x) * (x - heap.x) + (z - heap.z) * (z - heap.z)) / (heap.radius * heap.radius);
      if (d < 1)
        sum = std::max(sum, heap.height * (1 - d) * (1 - d) * (0.7 + 0.6 * fractal_noise({x * 0.16, 3, z * 0.16}, 3)));
    }
    return sum;
  };
  const auto inside = [](const Vec3& p) { return within(p[0], -68, 68) && within(p[2], -52, 66); };
  const Paint ground = [=](const Vec3& p, double, double) {
    const double fine = fractal_noise({p[0] * 1.6, 0, p[2] * 1.6}, 3),
                 patch = fractal_noise({p[0] * 0.06, 4, p[2] * 0.06}, 4);
    if (std::fabs(p[2] + 66) < 4) {
      if (std::fabs(p[2] + 66) < 0.12 && fraction(p[0] / 5) < 0.5) return Vec3{0.92, 0.90, 0.84};
      if (within(std::fabs(p[2] + 66), 3.5, 3.7)) return Vec3{0.84, 0.83, 0.78};
      return Vec3{0.32, 0.32, 0.33} * (0.85 + 0.3 * fine);
    }
    if (inside(p)) {
      const double rut = std::fabs(p[2] + 34 + 6 * fractal_noise({p[0] * 0.04, 1, 0}, 2));
      const Vec3 dust = mix({0.46, 0.38, 0.29}, {0.74, 0.66, 0.54}, 0.7 * fine + 0.5 * patch);
      if (p[1] > 0.4) return mix({0.36, 0.33, 0.30}, {0.74, 0.70, 0.64}, 1.5 * fine - 0.25);
      return std::fabs(rut - 1.6) < 0.5 || std::fabs(rut - 4.4) < 0.5 ? dust * 0.68 : dust;
    }
    return mix(mix({0.16, 0.26, 0.09}, {0.42, 0.50, 0.22}, fine), {0.54, 0.50, 0.30}, 3 * (patch - 0.48));
  };
  const Surface terrain = [=](double u, double v) {
    const double x = -70 + 140 * v, z = -54 + 122 * u;
    const double y = height(x, z), step = 0.3;
    return SurfacePoint{{x, y, z}, unit({(y - height(x + step, z)) / step, 1, (y - height(x, z + step)) / step})};
  };
  painter.surface(terrain, ground, solid);
  for (const Heap& heap : kHeaps) {
    painter.block_ball({heap.x, 0, heap.z}, {0.62 * heap.radius, 0.72 * heap.height, 0.62 * heap.radius});
  }
  Texture around = land;
  painter.quad({-120, -0.05, -120}, {0, 0, 66}, {240, 0, 0}, ground, around);
  painter.quad({-120, -0.05, 68}, {0, 0, 52}, {240, 0, 0}, ground, around);
  painter.quad({-120, -0.05, -54}, {0, 0, 122}, {50, 0, 0}, ground, around);
  painter.quad({70, -0.05, -54}, {0, 0, 122}, {50, 0, 0}, ground, around);
  Texture far = land;
  far.size = 2.5;
  painter.quad({-500, -0.5, -500}, {0, 0, 1000}, {1000, 0, 0}, ground, far);

  // Blocks on the heaps, small ones everywhere, slabs, bars and pipes.
  double key = 0;
  for (const Heap& heap : kHeaps) {
    const int count = static_cast<int>(0.55 * heap.radius * heap.radius);
    for (int i = 0; i < count; ++i) {
      const double x = heap.x + heap.radius * painter.random().uniform(-0.95, 0.95);
      const double z = heap.z + heap.radius * painter.random().uniform(-0.95, 0.95);
      const double first = painter.random().uniform();
      const double size = 0.35 + 1.9 * first * first * first;
      debris(painter, {x, height(x, z) + 0.25 * size, z}, size, ++key, solid);
    }
    for (int i = 0; i < 10; ++i) {  // bars that stick out
      const double x = heap.x + heap.radius * painter.random().uniform(-0.6, 0.6);
      const double z = heap.z + heap.radius * painter.random().uniform(-0.6, 0.6);
      const Vec3 foot = {x, height(x, z), z};
      const Vec3 out = painter.random().direction() * 2.4;
      painter.cylinder(foot, foot + Vec3{out[0], std::fabs(out[1]) + 0.6, out[2]}, 0.07, 0.06,
                       plain({0.42, 0.22, 0.13}), solid);
    }
  }
  for (int i = 0; i < 260; ++i) {
    const double x = painter.random().uniform(-64, 64), z = painter.random().uniform(-48, 62);
    debris(painter, {x, height(x, z) + 0.08, z}, painter.random().uniform(0.2, 0.7), ++key, solid);
  }

  // What is left of a house: walls of two storeys with holes, floors that sag.
  const auto ruin_wall = [&](const Vec3& corner, const Vec3& along, double top, double salt) {
    const double length = glm::length(along);
    const Surface wall = [=](double u, double v) {
      // Its top has broken off.
      const double broken = top * (0.45 + 0.55 * fractal_noise({u * 0.35 * length, salt, 1}, 3));
      return SurfacePoint{corner + along * u + Vec3{0, broken * v, 0}, unit(cross(along, Vec3{0, 1, 0}))};
    };
    const Paint face = [=](const Vec3& p, double u, double) {
      const double x = fraction(u * length / 3.4), y = fraction(p[1] / 3.2);
      if (within(x, 0.25, 0.75) && within(y, 0.28, 0.78)) return Vec3{0.09, 0.09, 0.10};
      if (fractal_noise(p * 0.5, 3) > 0.58) return mix({0.46, 0.24, 0.18}, {0.62, 0.36, 0.27}, fraction(p[1] / 0.3));
      return Vec3{0.74, 0.70, 0.62} * (0.8 + 0.3 * fractal_noise(p * 1.2, 3));
    };
    painter.surface(wall, face, solid);
    painter.surface(
        [=](double u, double v) {
          SurfacePoint p = wall(u, v);
          return SurfacePoint{p.position - p.normal * 0.4, p.normal * -1.0};
        },
        face, solid);
    const Vec3 middle = corner + along * 0.5;
    painter.block_box(middle + Vec3{0, 0.3 * top, 0} + unit(cross(along, Vec3{0, 1, 0})) * -0.2,
                      {std::max(0.15, 0.5 * std::fabs(along[0])), 0.3 * top,
                       std::max(0.15, 0.5 * std::fabs(along[2]))});
  };
  ruin_wall({-58, 0, -4}, {0, 0, -26}, 9.5, 1);
  ruin_wall({-40, 0, -4}, {-18, 0, 0}, 9.5, 2);
  ruin_wall({-58, 0, -30}, {13, 0, 0}, 8, 3);
  painter.slab({-57, 3.1, -18}, {11, -0.8, 0}, {0, 0.35, 0}, {0, 0, 13},
               rough({0.46, 0.44, 0.41}, {0.70, 0.67, 0.62}, 1), solid);
  painter.slab({-57, 6.3, -16}, {8, -2.6, 0}, {0, 0.35, 0}, {0, 0, 11},
               rough({0.46, 0.44, 0.41}, {0.70, 0.67, 0.62}, 1), solid);

  // Excavators, lorries, containers, a fence, trees, a few houses over the road.
  excavator(painter, {18, 0, -26}, 1, solid);
  excavator(painter, {-14, 0, 34}, -1, solid);
  excavator(painter, {40, 0, 36}, 1, solid);
  const auto lorry = [&](double x, double z, const Vec3& colour) {
    painter.box(
        {x - 2.9, 1.7, z}, {0.9, 1.1, 1.15},
        [=](const Vec3& p, double, double) {
          return within(p[1], 1.8, 2.5) ? Vec3{0.16, 0.2, 0.24} : colour;
        },
        solid);
    painter.slab({x - 1.8, 0.9, z - 1.2}, {0, 0, 2.4}, {5, 0, 0}, {0, 1.5, 0}, plain(colour * 0.85), solid);
    painter.block_box({x + 0.7, 1.6, z}, {2.4, 0.7, 1.1});
    painter.ball({x + 0.7, 2.3, z}, {2.3, 0.7, 1.0}, rough({0.40, 0.34, 0.28}, {0.70, 0.63, 0.54}, 3), solid);
    for (const double wx : {-2.6, 1.2, 2.4}) {
      for (const double wz : {-1.1, 1.1})
        wheel(painter, {x + wx, 0.5, z + wz}, 0.5, 0.18, false, {0.6, 0.6, 0.6}, solid);
    }
  };
  lorry(4, -34, {0.86, 0.44, 0.10});
  lorry(-22, -38, {0.80, 0.80, 0.80});
  lorry(52, -30, {0.16, 0.34, 0.62});
  for (int i = 0; i < 6; ++i) {
    const Vec3 colour = mix({0.18, 0.36, 0.60}, {0.70, 0.30, 0.14}, hash_fraction(i, 4));
    painter.box(
        {60, 1.3 + 2.6 * (i / 4), 14 + 7.0 * (i % 4)}, {1.25, 1.3, 3.1},
        [=](const Vec3& p, double, double) { return colour * (fraction((p[0] + p[2]) / 0.5) < 0.4 ? 0.75 : 1.0); },
        solid);
  }
  const Paint mesh = [](const Vec3& p, double, double) {
    return fraction((p[0] + p[2]) / 3) < 0.05 ? Vec3{0.30, 0.30, 0.30} : Vec3{0.60, 0.62, 0.64};
  };
  Texture thin = solid;
  thin.logit = -3;
  thin.layers = 16;
  painter.quad({-70, 0, -54}, {140, 0, 0}, {0, 2, 0}, mesh, thin);
  painter.quad({70, 0, 68}, {-140, 0, 0}, {0, 2, 0}, mesh, thin);
  painter.quad({70, 0, -54}, {0, 0, 122}, {0, 2, 0}, mesh, thin);
  painter.quad({-70, 0, 68}, {0, 0, -122}, {0, 2, 0}, mesh, thin);
  Texture leaves = solid;
  leaves.layers = 22;
  const auto plant = [&](double x, double z, double number) {
    tree(painter, {x, 0, z}, 7 + 5 * hash_fraction(number, 51), number, leaves, solid);
  };
  for (int i = 0; i < 26; ++i) {
    plant(-116 + 9.2 * i + 3 * hash_fraction(i, 52), -75 - 6 * hash_fraction(i, 53), i);
    plant(-116 + 9.2 * i + 3 * hash_fraction(i, 54), 76 + 30 * hash_fraction(i, 55), i + 40);
    plant(-76 - 34 * hash_fraction(i, 56), -50 + 120 * hash_fraction(i, 57), i + 80);
    plant(76 + 34 * hash_fraction(i, 58), -50 + 120 * hash_fraction(i, 59), i + 120);
  }
  for (int i = 0; i < 7; ++i) {
    house(painter, {-90.0 + 30 * i, 0, -96}, 6, 5, 5.6,
          mix({0.84, 0.76, 0.60}, {0.70, 0.46, 0.38}, hash_fraction(i, 6)), {0.48, 0.24, 0.18}, solid);
  }
  Texture heaven;
  heaven.size = 4;
  heaven.layers = 24;
  sky(painter, 700, 0.4, 1, heaven);
  painter.floaters({0, 20, 0}, {90, 15, 90}, 2000, 1.2);
}

}  // namespace vrpipe
