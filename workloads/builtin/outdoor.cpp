#include <algorithm>
#include <cmath>

#include "scenes.h"

namespace vrpipe {

// A street with houses and trees.
void paint_outdoor(ScenePainter& painter) {
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

}  // namespace vrpipe
