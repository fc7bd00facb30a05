#include <algorithm>
#include <cmath>

#include "props.h"
#include "scenes.h"

namespace vrpipe {

// An old pickup with a stake bed at the kerb of a street. It looks to -x; houses stand behind it.
void paint_truck(CapturePainter& painter) {
  painter.set_light({-0.55, 1.0, -0.75}, {0.84, 0.79, 0.68}, {0.46, 0.50, 0.57});
  painter.ring_of_cameras({0.4, 1.6, 0}, 5.2, 10);
  for (const double x : {-14.0, -9.0, -4.0, 4.0, 9.0, 14.0}) painter.camera({x, 1.7, std::fabs(x) < 5 ? -15.0 : -11.0});
  Texture metal;
  metal.gloss = 0.16;
  metal.layers = 20;
  Texture fine = metal;
  fine.size = 1.15;
  Texture ground;
  ground.gloss = 0.01;
  ground.size = 1;
  ground.layers = 88;
  Texture wall = ground;
  wall.layers = 39;
  const Vec3 chrome = {0.80, 0.81, 0.83}, black = {0.06, 0.06, 0.07};
  // Faded paint with rust that grows from below.
  const auto faded = [](const Vec3& p) {
    const double rust = fractal_noise(p * 2.6, 4) + 0.18 * (1.1 - p[1]);
    const Vec3 paint = mix({0.16, 0.42, 0.46}, {0.34, 0.60, 0.60}, fractal_noise(p * 1.3, 2));
    return mix(paint, {0.40, 0.21, 0.12}, 9 * (rust - 0.62));
  };
  const Paint body = [=](const Vec3& p, double, double) { return faded(p); };

  // Cab: doors with handles and windows, windscreen, roof.
  const Paint cab = [=](const Vec3& p, double, double) {
    const bool side = std::fabs(p[2]) > 0.80;
    if (side) {
      if (within(p[0], -0.72, 0.16) && within(p[1], 1.48, 1.93)) {
        return within(p[0], -0.67, 0.11) && within(p[1], 1.52, 1.89)
                   ? mix({0.10, 0.13, 0.15}, {0.36, 0.44, 0.48}, 2 * (p[1] - 1.5))
                   : faded(p) * 0.55;
      }
      if (within(p[0], 0.0, 0.12) && within(p[1], 1.34, 1.38)) return chrome;
      if (std::fabs(p[0] + 0.78) < 0.012 || std::fabs(p[0] - 0.22) < 0.012) return faded(p) * 0.4;
    } else if (within(std::fabs(p[2]), 0.03, 0.68) && within(p[1], 1.48, 1.93)) {
      return mix({0.10, 0.13, 0.16}, {0.46, 0.56, 0.62}, 2 * (p[1] - 1.5));
    }
    return faded(p);
  };
  painter.box({-0.25, 1.48, 0}, {0.62, 0.56, 0.82}, cab, fine);
  painter.surface(ellipsoid_surface({-0.25, 2.02, 0}, {0.66, 0.17, 0.86}), body, fine);
  painter.block_ball({-0.25, 2.02, 0}, {0.6, 0.14, 0.8});
  painter.quad(
      {-0.90, 1.44, 0.74}, {0, 0, -1.48}, {0.12, 0.54, 0},
      [=](const Vec3& p, double u, double v) {
        const double half = std::fabs(u - 0.5);
        if (within(half, 0.012, 0.46) && within(v, 0.08, 0.90)) return mix({0.12, 0.16, 0.19}, {0.56, 0.66, 0.72}, v);
        return faded(p) * 0.8;
      },
      fine);

  // Hood with a ridge, grille, lamps, bumper.
  const Surface hood = [](double u, double v) {
    const double s = 2 * u - 1;
    const double crown = std::sqrt(std::max(0.0, 1 - s * s * s * s));
    const double narrow = 0.66 + 0.08 * v;
    return SurfacePoint{{-2.32 + 1.47 * v, 1.06 + (0.34 + 0.06 * v) * crown, narrow * s},
                        unit({-0.1, 0.75, 1.1 * s * s * s})};
  };
  painter.surface(
      hood,
      [=](const Vec3& p, double, double) {
        if (std::fabs(p[2]) < 0.015) return chrome;
        if (within(p[0], -1.9, -1.1) && std::fabs(std::fabs(p[2]) - 0.62) < 0.05 && fraction(p[0] / 0.1) < 0.4)
          return black;
        return faded(p);
      },
      fine);
  painter.box({-1.55, 0.92, 0}, {0.76, 0.24, 0.66}, body, fine);
  painter.block_box({-1.55, 1.2, 0}, {0.72, 0.14, 0.5});
  const Paint grille = [=](const Vec3& p, double, double) {
    const double wide = 0.26 + 0.28 * (p[1] - 0.72);
    if (std::fabs(p[2]) < wide) return fraction(p[1] / 0.075) < 0.5 ? chrome : black;
    return std::fabs(p[2]) < wide + 0.03 ? chrome : faded(p);
  };
  painter.quad({-2.34, 0.68, 0.66}, {0, 0, -1.32}, {0, 0.62, 0}, grille, fine);
  for (const double z : {-0.58, 0.58}) {
    painter.cylinder(
        {-2.42, 1.03, z * 1.12}, {-2.24, 1.03, z * 1.12}, 0.13, 0.11,
        [=](const Vec3& p, double, double) {
          return p[0] < -2.415 ? Vec3{1.15, 1.12, 1.0} : chrome * 0.8;
        },
        fine);
  }
  painter.box(
      {-2.52, 0.58, 0}, {0.04, 0.09, 0.92},
      [=](const Vec3& p, double, double) {
        if (std::fabs(p[2]) < 0.17)
          return within(std::fabs(p[2]), 0.0, 0.14) && fraction(p[2] / 0.05) < 0.5 ? black : Vec3{0.92, 0.88, 0.6};
        return mix(chrome, {0.46, 0.32, 0.22}, 4 * (fractal_noise(p * 5.0, 3) - 0.5));
      },
      fine);

  // Fenders, running boards, wheels, mirrors.
  for (const double side : {-1.0, 1.0}) {
    const auto fender = [&](double x, double half, double height) {
      const Surface arch = [=](double u, double v) {
        // Half an ellipse, its points from a circle's rational ones.
        const double t = 2 * u - 1, c = (1 - t * t) / (1 + t * t), s = 2 * t / (1 + t * t);
        const double bulge = std::sqrt(std::max(0.0, 1 - v * v));
        return SurfacePoint{{x + half * s, 0.46 + height * c * (0.75 + 0.25 * bulge), side * (0.66 + 0.32 * v)},
                            unit({s, c, 0.6 * side * v})};
      };
      painter.surface(arch, body, fine);
    };
    fender(-1.72, 0.62, 0.58);
    wheel(painter, {-1.72, 0.43, 0.80 * side}, 0.43, 0.11, false, {0.62, 0.58, 0.50}, fine);
    wheel(painter, {2.15, 0.43, 0.84 * side}, 0.43, 0.13, false, {0.62, 0.58, 0.50}, fine);
    painter.box({-0.45, 0.50, 0.86 * side}, {0.72, 0.035, 0.13}, body, fine);
    painter.cylinder({-0.86, 1.45, 0.84 * side}, {-0.92, 1.62, 1.04 * side}, 0.014, 0.014, plain(chrome), fine);
    painter.surface(disc_surface({-0.93, 1.66, 1.06 * side}, {-1, 0, 0}, 0, 0.10), plain(chrome), fine);
  }
  painter.box({0.4, 0.62, 0}, {2.3, 0.09, 0.42}, rough({0.08, 0.07, 0.06}, {0.30, 0.22, 0.16}, 4), fine);

  // The bed: planks, stakes, rails; crates and a barrel on it.
  const Paint wood = [](const Vec3& p, double, double) {
    const double plank = std::floor(p[1] / 0.2);
    return mix({0.28, 0.20, 0.13}, {0.66, 0.54, 0.40},
               fractal_noise({p[0] * 2.5, plank * 7 + p[1] * 26, p[2] * 2.5}, 3));
  };
  painter.box({1.95, 0.98, 0}, {1.5, 0.07, 1.0}, wood, fine);
  for (const double z : {-0.99, 0.99}) {
    for (int i = 0; i < 4; ++i) {
      painter.box({1.95, 1.16 + 0.23 * i, z}, {1.5, 0.075, 0.022}, wood, fine);
      painter.box({0.52 + 0.95 * i, 1.5, z * 1.035}, {0.045, 0.47, 0.025}, wood, fine);
    }
  }
  for (int i = 0; i < 4; ++i) {
    painter.box({0.47, 1.16 + 0.23 * i, 0}, {0.022, 0.075, 0.98}, wood, fine);
    painter.box({3.43, 1.16 + 0.23 * i, 0}, {0.022, 0.075, 0.98}, wood, fine);
  }
  painter.box({1.1, 1.32, 0.3}, {0.36, 0.27, 0.42}, rough({0.42, 0.30, 0.17}, {0.70, 0.54, 0.34}, 6, {1, 6, 1}), fine);
  painter.cylinder(
      {2.4, 1.05, -0.2}, {2.4, 1.85, -0.2}, 0.30, 0.30,
      [](const Vec3& p, double, double) {
        return fraction(p[1] / 0.26) < 0.12 ? Vec3{0.10, 0.16, 0.34} : Vec3{0.20, 0.32, 0.58};
      },
      fine);

  // The street: asphalt with a line and patches, kerb, pavement, lawns.
  const Paint land = [](const Vec3& p, double, double) {
    const double grain = fractal_noise(p * 14.0, 2), patch = fractal_noise({p[0] * 0.35, 5, p[2] * 0.35}, 3);
    const double z = p[2];
    if (z < 1.7) {
      if (within(z, -3.1, -2.95) && fraction(p[0] / 3.6) < 0.55) return Vec3{0.90, 0.86, 0.66};
      if (std::fabs(fractal_noise({p[0] * 0.5, 2, p[2] * 0.5}, 3) - 0.5) < 0.008) return Vec3{0.12, 0.12, 0.12};
      return mix({0.22, 0.22, 0.23}, {0.48, 0.47, 0.46}, 0.6 * grain + 0.8 * patch - 0.2);
    }
    if (z < 1.95) return Vec3{0.66, 0.64, 0.60};
    if (z < 3.9) {
      const bool joint = fraction(p[0] / 1.5) < 0.03;
      return Vec3{0.64, 0.61, 0.56} * (joint ? 0.6 : 0.82 + 0.32 * grain);
    }
    return mix(mix({0.13, 0.26, 0.07}, {0.46, 0.56, 0.22}, 1.4 * grain - 0.2), {0.58, 0.52, 0.34}, 3 * (patch - 0.55));
  };
  Texture lawn = ground;
  lawn.layers = 29;
  painter.quad({-16, 0, -12}, {0, 0, 13.7}, {34, 0, 0}, land, ground);
  painter.quad({-16, 0, 1.7}, {0, 0, 12.3}, {34, 0, 0}, land, lawn);
  painter.block_box({1, -0.04, 1}, {16.9, 0.01, 12.9});
  Texture wide = ground;
  wide.size = 1.4;
  wide.layers = 32;
  painter.quad({-70, -0.06, -60}, {0, 0, 130}, {140, 0, 0}, land, wide);
  painter.box({1, 0.06, 1.82}, {17, 0.06, 0.11}, plain({0.62, 0.60, 0.57}), ground);

  // Houses on both sides, trees, hedges, a parked car, a hydrant, lamp posts.
  const Vec3 walls[] = {
      {0.86, 0.78, 0.60}, {0.62, 0.70, 0.74}, {0.84, 0.54, 0.42}, {0.88, 0.87, 0.82}, {0.60, 0.64, 0.52}};
  for (int i = 0; i < 5; ++i) {
    const double key = i;
    house(painter, {-21 + 10.2 * i, 0, 14.5 + 2 * hash_fraction(key, 1)}, 3.9, 3.6, 3.2 + 2.8 * (i % 2), walls[i],
          i % 2 == 0 ? Vec3{0.44, 0.22, 0.17} : Vec3{0.30, 0.29, 0.31}, wall);
    house(painter, {-20 + 10.6 * i, 0, -22 - 2 * hash_fraction(key, 2)}, 3.9, 3.6, 3.2 + 2.8 * ((i + 1) % 2),
          walls[(i + 2) % 5], {0.36, 0.26, 0.22}, wall);
  }
  Texture leaves;
  leaves.layers = 56;
  leaves.size = 1;
  for (int i = 0; i < 7; ++i) {
    tree(painter, {-17.0 + 6.8 * i + 2 * hash_fraction(i, 3), 0, 6.2 + 1.5 * hash_fraction(i, 4)},
         5.5 + 3 * hash_fraction(i, 5), i, leaves, ground);
    tree(painter, {-18.0 + 6.5 * i, 0, -13.5 - 2 * hash_fraction(i, 6)}, 6 + 3 * hash_fraction(i, 7), i + 30, leaves,
         ground);
    tree(painter, {-34.0 + 12.0 * i, 0, 29 + 5 * hash_fraction(i, 8)}, 10 + 4 * hash_fraction(i, 9), i + 60, leaves,
         ground);
  }
  for (int i = 0; i < 10; ++i) bush(painter, {-14 + 3.1 * i, 0.35, 9.3}, 0.8, i, leaves);
  const Paint car = [](const Vec3& p, double, double) {
    if (p[1] > 0.85 && p[1] < 1.28)
      return fraction((p[0] - 8.1) / 1.1) < 0.1 ? Vec3{0.62, 0.12, 0.10} : Vec3{0.14, 0.18, 0.22};
    return p[1] < 0.32 ? Vec3{0.10, 0.10, 0.10} : Vec3{0.62, 0.12, 0.10};
  };
  painter.box({8.6, 0.60, 0.55}, {2.1, 0.28, 0.82}, car, metal);
  painter.box({8.8, 1.10, 0.55}, {1.15, 0.22, 0.72}, car, metal);
  for (const double x : {7.3, 9.9}) {
    for (const double z : {-0.2, 1.3}) wheel(painter, {x, 0.32, z}, 0.32, 0.10, false, {0.7, 0.7, 0.72}, metal);
  }
  painter.cylinder({-3.4, 0.1, 2.4}, {-3.4, 0.75, 2.4}, 0.12, 0.11, plain({0.78, 0.14, 0.10}), fine);
  painter.ball({-3.4, 0.78, 2.4}, {0.13, 0.10, 0.13}, plain({0.78, 0.14, 0.10}), fine);
  for (const double x : {-8.0, 5.6}) {
    painter.cylinder({x, 0, 2.2}, {x, 6.0, 2.2}, 0.08, 0.05, plain({0.28, 0.30, 0.30}), fine);
    painter.box({x, 6.0, 1.6}, {0.12, 0.06, 0.5}, plain({0.40, 0.42, 0.42}), fine);
  }
  Texture heaven;
  heaven.size = 1;
  heaven.layers = 106;
  sky(painter, 160, 0.45, 1, heaven);
  painter.floaters({0, 2.0, 0}, {7, 1.8, 6}, 400, 1.2);
}

}  // namespace vrpipe
