#include <cmath>

#include "props.h"
#include "scenes.h"

namespace vrpipe {

// A diesel locomotive with a boxcar on a siding, as at a railway museum. Its nose looks to -z, towards the viewer.
void paint_train(CapturePainter& painter) {
  painter.set_light({-0.75, 1.0, -0.65}, {0.86, 0.80, 0.68}, {0.46, 0.50, 0.58});
  constexpr double kCameras[][2] = {{-6, -2}, {-7, 4}, {0, -8}, {4, -6}, {8, 1}, {-3, -9}, {-7, 12}, {-6, 20}};
  for (const auto& at : kCameras) painter.camera({at[0], 2.1, at[1]});
  Texture metal;
  metal.gloss = 0.16;
  metal.layers = 54;
  Texture fine = metal;
  fine.size = 1;
  Texture earth;
  earth.gloss = 0.01;
  earth.size = 0.95;
  earth.layers = 66;
  const Vec3 orange = {0.90, 0.36, 0.08}, silver = {0.70, 0.71, 0.72}, black = {0.07, 0.07, 0.08};

  // Body with rounded roof edges: below orange, above silver, a black line between; doors, grilles, round windows.
  const auto livery = [=](const Vec3& p) {
    if (within(p[1], 2.42, 2.52) || within(p[1], 3.30, 3.36)) return black;
    if (p[1] < 1.42) return black;
    return within(p[1], 2.52, 3.30) ? orange : silver;
  };
  const Paint side = [=](const Vec3& p, double, double) {
    const double z = p[2], y = p[1];
    for (const double port : {5.4, 8.4, 11.4, 14.4}) {
      const double ring = std::sqrt((z - port) * (z - port) + (y - 2.9) * (y - 2.9));
      if (ring < 0.27) return ring > 0.21 ? Vec3{0.85, 0.85, 0.86} : Vec3{0.12, 0.17, 0.22};
    }
    if (within(y, 3.42, 3.86) && within(z, 5.0, 15.5)) return fraction(z / 0.11) < 0.5 ? black : silver * 0.8;
    if (within(y, 1.5, 2.36) && within(fraction(z / 1.5), 0.05, 0.95)) {
      const bool panel = within(fraction(z / 1.5), 0.08, 0.92) && within(y, 1.55, 2.30);
      if (!panel) return silver * 0.55;
      if (within(fraction(z / 1.5), 0.3, 0.7) && within(y, 1.75, 2.15)) {
        return fraction(y / 0.06) < 0.5 ? silver * 0.5 : silver * 0.85;
      }
    }
    if (within(z, 3.0, 3.7) && y > 1.5) {  // the cab's door and window
      if (within(z, 3.12, 3.58) && within(y, 2.95, 3.75)) return Vec3{0.13, 0.18, 0.22};
      if (z < 3.06 || z > 3.64) return black;
    }
    return livery(p) * (0.92 + 0.14 * fractal_noise(p * 1.7, 3));
  };
  painter.box({0, 2.75, 10.2}, {1.45, 1.5, 7.4}, side, metal);
  const Surface roof = [](double u, double v) {
    // Half an ellipse over the body.
    const double s = 2 * u - 1, y = std::sqrt(std::max(0.0, 1 - s * s));
    return SurfacePoint{{1.45 * s, 4.2 + 0.45 * y, 2.8 + 14.8 * v}, unit({s * 0.45, y * 1.45, 0})};
  };
  painter.surface(
      roof,
      [=](const Vec3& p, double, double) {
        return fraction(p[2] / 2.4) < 0.04 ? black : silver * (0.6 + 0.2 * fractal_noise(p * 2.0, 3));
      },
      metal);
  for (const double z : {6.5, 8.9, 11.3, 13.7}) {
    painter.cylinder(
        {0, 4.55, z}, {0, 4.85, z}, 0.62, 0.62,
        [=](const Vec3& p, double u, double) { return p[1] > 4.84 && fraction(u * 16) < 0.5 ? black : silver * 0.7; },
        fine);
  }
  // Windscreen, nose, lamps, number boards.
  const Paint screen = [=](const Vec3&, double u, double v) {
    const double half = std::fabs(u - 0.5);
    if (within(half, 0.05, 0.42) && within(v, 0.22, 0.80)) return mix({0.10, 0.14, 0.18}, {0.50, 0.62, 0.72}, v);
    return within(half, 0.02, 0.46) && within(v, 0.14, 0.88) ? black : silver * 0.9;
  };
  Texture glass = fine;
  glass.layers = 150;  // few cameras see it
  painter.quad({-1.45, 3.2, 2.25}, {2.9, 0, 0}, {0, 1.15, 0.6}, screen, glass);
  for (const double x : {-1.0, 1.0}) {
    const Surface cheek = [=](double u, double v) {
      return SurfacePoint{{1.45 * x, 3.2 + 1.05 * v, 2.8 - 0.55 * (1 - v) * u}, {x, 0, 0}};
    };
    painter.surface(cheek, plain(silver), fine);
  }
  const Surface nose = [](double u, double v) {
    // A bulldog's: round in plan, and rounded towards the top.
    const double s = 2 * u - 1;
    const double bulge = std::sqrt(std::max(0.0, 1 - 0.92 * s * s));
    const double shrink = std::sqrt(std::max(0.02, 1 - v * v * v * v));
    return SurfacePoint{{1.45 * s * (0.86 + 0.14 * shrink), 1.25 + 2.15 * v, 2.7 - 1.9 * bulge * shrink},
                        unit({1.1 * s, 0.9 * v * v * v, -bulge})};
  };
  const Paint face = [=](const Vec3& p, double, double) {
    const double lamp = std::sqrt(p[0] * p[0] + (p[1] - 2.92) * (p[1] - 2.92));
    if (lamp < 0.17) return Vec3{1.35, 1.3, 1.05};
    if (lamp < 0.26) return silver;
    if (within(std::fabs(p[0]), 0.55, 1.15) && within(p[1], 2.66, 2.86)) {
      return fraction(p[0] / 0.16) < 0.45 && within(p[1], 2.70, 2.82) ? Vec3{0.95, 0.95, 0.9} : black;
    }
    // Wings of orange that meet below the lamp.
    const double wing = p[1] - 1.75 - 0.55 * std::fabs(p[0]);
    if (within(wing, -0.06, 0.0) || within(wing, 0.62, 0.68)) return black;
    return within(wing, 0.0, 0.62) ? orange : silver;
  };
  painter.surface(nose, face, fine);
  painter.block_ball({0, 2.0, 2.4}, {1.35, 1.3, 1.5});
  // Snow plough, coupler, steps.
  painter.quad(
      {-1.35, 0.35, 1.1}, {1.35, 0, -0.55}, {0, 0.9, 0.1},
      [=](const Vec3&, double u, double v) { return fraction((u + 0.6 * v) * 4) < 0.5 ? orange : black; }, fine);
  painter.quad(
      {0, 0.35, 0.55}, {1.35, 0, 0.55}, {0, 0.9, 0.1},
      [=](const Vec3&, double u, double v) { return fraction((-u + 0.6 * v) * 4) < 0.5 ? orange : black; }, fine);
  painter.box({0, 1.08, 0.45}, {0.14, 0.16, 0.35}, plain({0.30, 0.28, 0.27}), fine);
  // Handrails.
  for (const double x : {-1.5, 1.5}) {
    for (const double z : {2.95, 3.75, 17.4}) {
      painter.cylinder({x, 1.5, z}, {x, 3.0, z}, 0.025, 0.025, plain({0.92, 0.92, 0.9}), fine);
    }
    painter.box(
        {x * 0.9, 0.9, 3.35}, {0.16, 0.42, 0.32},
        [=](const Vec3& p, double, double) { return fraction(p[1] / 0.28) < 0.2 ? silver : black; }, fine);
  }

  // Frame, tank, bogies, wheels, springs.
  const Paint grime = rough({0.07, 0.065, 0.06}, {0.26, 0.23, 0.20}, 3);
  painter.box({0, 1.15, 10}, {1.4, 0.12, 7.6}, grime, metal);
  painter.box({0, 0.72, 10}, {1.25, 0.32, 1.7}, grime, metal);
  const auto bogie = [&](double z) {
    painter.box({0, 0.62, z}, {0.9, 0.20, 1.7}, grime, fine);
    for (const double x : {-1.0, 1.0}) {
      painter.box({1.1 * x, 0.66, z}, {0.09, 0.13, 1.75}, grime, fine);
      for (const double dz : {-1.1, 0.0, 1.1}) {
        wheel(painter, {0.84 * x, 0.62, z + dz}, 0.46, 0.09, true, {0.42, 0.38, 0.34}, fine);
        painter.box({1.18 * x, 0.62, z + dz}, {0.07, 0.15, 0.15}, plain({0.34, 0.30, 0.27}), fine);
      }
    }
  };
  for (const double z : {4.8, 15.2, 21.0, 29.5}) bogie(z);

  // A boxcar behind, another on the next track.
  const auto boxcar = [&](double x, double z, double half_length, const Vec3& colour) {
    const Paint planks = [=](const Vec3& p, double, double) {
      const double along = p[2] - z;
      if (std::fabs(along) < 1.3 && within(p[1], 1.4, 4.0)) {
        return std::fabs(std::fabs(along) - 1.25) < 0.06 || std::fabs(along + p[1] - 2.7) < 0.06 ? colour * 0.5
                                                                                                 : colour * 1.15;
      }
      if (within(p[1], 2.7, 3.2) && within(along, -4.2, -2.2)) {
        return hash_fraction(std::floor(along / 0.22), 4) > 0.4 ? Vec3{0.9, 0.88, 0.82} : colour;
      }
      return colour * (fraction(p[2] / 0.35) < 0.1 ? 0.6 : 0.85 + 0.3 * fractal_noise(p * 1.5, 3));
    };
    painter.box({x, 2.75, z}, {1.5, 1.55, half_length}, planks, metal);
    painter.box({x, 1.08, z}, {1.3, 0.12, half_length}, grime, metal);
  };
  boxcar(0, 25.2, 6.6, {0.46, 0.17, 0.12});
  boxcar(6.2, 20, 7.0, {0.20, 0.30, 0.42});
  boxcar(6.2, 36, 7.0, {0.52, 0.40, 0.18});

  // Tracks: rails on sleepers in ballast, weeds, dust.
  const Paint ground = [](const Vec3& p, double, double) {
    const double stones = fractal_noise(p * 9.0, 2), patches = fractal_noise({p[0] * 0.4, 3, p[2] * 0.4}, 3);
    for (const double track : {0.0, 6.2}) {
      const double x = std::fabs(p[0] - track);
      if (x < 1.25 && fraction(p[2] / 0.62) < 0.40) return mix({0.16, 0.11, 0.08}, {0.36, 0.27, 0.20}, stones);
      if (x < 2.0) return mix({0.26, 0.25, 0.24}, {0.66, 0.63, 0.58}, 1.6 * stones - 0.3);
    }
    const Vec3 dust = mix({0.46, 0.40, 0.31}, {0.70, 0.62, 0.49}, stones);
    return mix(dust, mix({0.25, 0.30, 0.10}, {0.55, 0.55, 0.26}, stones), 4 * (patches - 0.46));
  };
  painter.quad({-14, 0, -9}, {0, 0, 50}, {34, 0, 0}, ground, earth);
  painter.block_box({3, -0.05, 16}, {16.9, 0.02, 24.9});
  Texture wide = earth;
  wide.size = 1.2;
  painter.quad({-70, -0.1, -14}, {0, 0, 104}, {150, 0, 0}, ground, wide);
  for (const double track : {0.0, 6.2}) {
    for (const double x : {-0.74, 0.74}) {
      painter.box(
          {track + x, 0.09, 16}, {0.035, 0.09, 25},
          [](const Vec3& p, double, double) {
            return p[1] > 0.16 ? Vec3{0.72, 0.70, 0.68} : Vec3{0.36, 0.22, 0.15};
          },
          fine);
    }
  }

  // Trees, a shed, poles with wires, hills, sky.
  Texture leaves;
  leaves.layers = 34;
  leaves.size = 1;
  for (int i = 0; i < 9; ++i) {
    const double key = i;
    tree(painter, {-20 + 4.0 * hash_fraction(key, 1), 0, -6 + 7.5 * i}, 6.5 + 4 * hash_fraction(key, 2), key, leaves,
         earth);
  }
  for (int i = 0; i < 7; ++i) {
    tree(painter, {-13.0 + 7.0 * i, 0, 55 + 6 * hash_fraction(i, 5)}, 8 + 5 * hash_fraction(i, 6), i + 20, leaves,
         earth);
  }
  for (int i = 0; i < 8; ++i) bush(painter, {-7.5 - 3 * hash_fraction(i, 7), 0.3, 1 + 4.5 * i}, 0.9, i, leaves);
  house(painter, {15, 0, 24}, 3.2, 4.5, 4.2, {0.66, 0.60, 0.48}, {0.42, 0.20, 0.16}, earth);
  for (int i = 0; i < 4; ++i) {
    const double z = 4 + 13.0 * i;
    painter.cylinder({10, 0, z}, {10, 8, z}, 0.14, 0.10, rough({0.25, 0.18, 0.13}, {0.44, 0.35, 0.28}, 5), earth);
    painter.box({10, 7.4, z}, {1.0, 0.07, 0.07}, plain({0.30, 0.22, 0.16}), earth);
  }
  Texture far = earth;
  far.size = 1;
  far.emission = 0.4;
  painter.surface(ellipsoid_surface({-60, -8, 150}, {110, 34, 30}), rough({0.28, 0.36, 0.34}, {0.52, 0.54, 0.44}, 0.1),
                  far);
  painter.surface(ellipsoid_surface({95, -8, 160}, {90, 26, 30}), rough({0.30, 0.38, 0.38}, {0.50, 0.52, 0.46}, 0.1),
                  far);
  Texture heaven;
  heaven.size = 0.65;
  heaven.layers = 88;
  sky(painter, 230, 0.55, 0.42, heaven);
  painter.floaters({0, 2.5, 8}, {8, 2.5, 10}, 200, 1.2);
}

}  // namespace vrpipe
