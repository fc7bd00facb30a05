#include "props.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

namespace vrpipe {

Paint rough(const Vec3& dark, const Vec3& light, double frequency, const Vec3& stretch) {
  return [=](const Vec3& p, double, double) { return mix(dark, light, fractal_noise(p * stretch * frequency, 3)); };
}

void tree(CapturePainter& painter, const Vec3& foot, double height, double key, const Texture& leaves,
          const Texture& bark) {
  const Vec3 dark = mix({0.08, 0.20, 0.06}, {0.20, 0.24, 0.08}, hash_fraction(key, 11));
  const Vec3 light = mix({0.36, 0.54, 0.18}, {0.56, 0.60, 0.24}, hash_fraction(key, 12));
  const double grain = 9 / height;
  const Paint leaf = [=](const Vec3& p, double u, double) {
    return mix(dark, light, 0.35 * u + 0.9 * fractal_noise(p * grain, 2) - 0.15);
  };
  const double trunk = 0.42 * height;
  painter.cylinder(foot, foot + Vec3{0, trunk, 0}, 0.035 * height, 0.022 * height,
                   rough({0.20, 0.14, 0.10}, {0.46, 0.36, 0.28}, 60 / height, {1, 0.2, 1}), bark);
  const double crown = 0.30 * height;
  for (int i = 0; i < 9; ++i) {
    const double x = painter.random().uniform(-0.6, 0.6) * crown;
    const double y = painter.random().uniform(-0.55, 0.85) * crown;
    const double z = painter.random().uniform(-0.6, 0.6) * crown;
    const Vec3 centre = foot + Vec3{x, 0.64 * height + y, z};
    const double size = painter.random().uniform(0.42, 0.62) * crown;
    painter.block_ball(centre, Vec3{0.75, 0.65, 0.75} * size);
    painter.cloud(centre, Vec3{1.0, 0.85, 1.0} * size, leaf, leaves);
  }
}

void bush(CapturePainter& painter, const Vec3& centre, double radius, double key, const Texture& leaves) {
  const Vec3 light = mix({0.34, 0.50, 0.16}, {0.50, 0.54, 0.26}, hash_fraction(key, 13));
  const Paint leaf = [=](const Vec3& p, double u, double) {
    return mix({0.07, 0.17, 0.05}, light, 0.35 * u + 0.9 * fractal_noise(p * (5 / radius), 2) - 0.15);
  };
  for (int i = 0; i < 4; ++i) {
    const double x = painter.random().uniform(-0.6, 0.6) * radius;
    const double y = painter.random().uniform(-0.1, 0.4) * radius;
    const double z = painter.random().uniform(-0.6, 0.6) * radius;
    painter.block_ball(centre + Vec3{x, y, z}, Vec3{0.4, 0.35, 0.4} * radius);
    painter.cloud(centre + Vec3{x, y, z}, Vec3{0.62, 0.5, 0.62} * radius, leaf, leaves);
  }
}

void wheel(CapturePainter& painter, const Vec3& centre, double radius, double half, bool along_x, const Vec3& rim,
           const Texture& texture) {
  const Vec3 axis = along_x ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
  const Paint face = [=](const Vec3& p, double u, double) {
    const double ring = glm::length(p - centre - axis * dot(p - centre, axis)) / radius;
    if (ring > 0.66) return Vec3{0.09, 0.09, 0.10} * (fraction(u * 24) < 0.5 ? 0.8 : 1.2);
    if (ring < 0.16) return rim * 0.5;
    return ring > 0.58 || fraction(u * 6) < 0.75 ? rim : rim * 0.25;
  };
  painter.cylinder(centre - axis * half, centre + axis * half, radius, radius, face, texture);
}

void gable_roof(CapturePainter& painter, const Vec3& centre, double half_x, double half_z, double rise, bool along_x,
                const Paint& tiles, const Paint& wall, const Texture& texture) {
  const Vec3 ridge = along_x ? Vec3{half_x, 0, 0} : Vec3{0, 0, half_z};
  const Vec3 slope = along_x ? Vec3{0, 0, half_z} : Vec3{half_x, 0, 0};
  for (const double side : {-1.0, 1.0}) {
    // The quad's normal is to point up and outwards.
    Vec3 along = ridge * (2.0 * side * (along_x ? 1.0 : -1.0));
    const Vec3 eave = centre + slope * (1.06 * side) - Vec3{0, 0.06 * rise, 0};
    const Vec3 up = Vec3{0, 1.06 * rise, 0} - slope * (1.06 * side);
    painter.quad(eave - along * 0.5, along, up, tiles, texture);
    const Vec3 end = centre + ridge * side;
    const Surface gable = [=](double u, double v) {
      return SurfacePoint{end + slope * ((2 * u - 1) * (1 - v)) + Vec3{0, rise * v, 0}, unit(ridge * side)};
    };
    painter.surface(gable, wall, texture);
  }
  painter.block_box(centre + Vec3{0, 0.3 * rise, 0},
                    {(along_x ? 1 : 0.6) * half_x, 0.3 * rise, (along_x ? 0.6 : 1) * half_z});
}

void house(CapturePainter& painter, const Vec3& centre, double half_width, double half_depth, double height,
           const Vec3& wall, const Vec3& tile, const Texture& texture) {
  const double key = centre[0] * 3.1 + centre[2];
  const double storeys = std::max(1.0, std::floor(height / 2.8)), storey_height = height / storeys;
  const Paint facade = [=](const Vec3& p, double, double) {
    const bool front = std::fabs(p[2] - centre[2]) > half_depth - 0.02;
    const double half = front ? half_width : half_depth;
    const double along = (front ? p[0] - centre[0] : p[2] - centre[2]) + half;
    const double bays = std::max(2.0, std::floor(half * 0.8));
    const double bay = along / (2 * half) * bays, storey = (p[1] - centre[1]) / storey_height;
    const double x = fraction(bay), y = fraction(storey);
    if (front && storey < 0.78 && std::floor(bay) == std::floor(bays * (0.2 + 0.6 * hash_fraction(key, 3)))) {
      if (within(x, 0.24, 0.76)) {
        return within(x, 0.3, 0.7) && storey < 0.74 ? Vec3{0.36, 0.16, 0.10} : Vec3{0.94, 0.93, 0.9};
      }
    } else if (within(x, 0.22, 0.78) && within(y, 0.30, 0.82)) {
      if (!within(x, 0.27, 0.73) || !within(y, 0.34, 0.78) || std::fabs(x - 0.5) < 0.025 ||
          std::fabs(y - 0.56) < 0.02) {
        return Vec3{0.94, 0.93, 0.9};
      }
      return mix({0.10, 0.14, 0.18}, {0.50, 0.60, 0.70}, 1.6 * (y - 0.3) + 0.3 * hash_fraction(std::floor(bay), key));
    }
    return wall * (fraction(p[1] / 0.2) < 0.16 ? 0.84 : 0.95 + 0.12 * value_noise(p * 3.0));
  };
  painter.box(centre + Vec3{0, 0.5 * height, 0}, {half_width, 0.5 * height, half_depth}, facade, texture);
  const Paint tiles = [=](const Vec3& p, double, double) {
    return tile * (fraction(p[1] / 0.16) < 0.25 ? 0.7 : 0.9 + 0.3 * value_noise(p * 5.0));
  };
  gable_roof(painter, centre + Vec3{0, height, 0}, half_width + 0.3, half_depth + 0.3, 0.75 * half_depth, true, tiles,
             plain(wall * 0.95), texture);
  painter.box(centre + Vec3{0.5 * half_width, height + 0.7 * half_depth, 0.2 * half_depth}, {0.35, 0.7, 0.35},
              rough({0.40, 0.22, 0.17}, {0.60, 0.36, 0.28}, 4), texture);
}

void bulldozer(CapturePainter& painter, const Vec3& origin, double scale, const Texture& texture) {
  const Vec3 yellow = {0.93, 0.68, 0.06}, grey = {0.46, 0.47, 0.48}, dark = {0.13, 0.13, 0.14};
  const Vec3 red = {0.72, 0.10, 0.07}, plate = {0.36, 0.38, 0.40};
  const auto at = [=](double x, double y, double z) { return origin + Vec3{x, y, z} * scale; };
  const auto brick = [&](double x, double y, double z, double hx, double hy, double hz, const Vec3& colour) {
    // Seams between bricks, one stud long.
    const Paint seams = [=](const Vec3& p, double, double) {
      const Vec3 local = (p - origin) * (1 / scale);
      const double line = std::min(fraction(local[1] / 0.096), 1 - fraction(local[1] / 0.096)) * 0.096;
      const double row = std::floor(local[1] / 0.096);
      const double joint = fraction((local[0] + local[2]) / 0.32 + 0.5 * row) * 0.32;
      return colour * (line < 0.006 || joint < 0.008 ? 0.55 : 1.0);
    };
    painter.box(at(x, y, z), Vec3{hx, hy, hz} * scale, seams, texture);
  };
  const auto studs = [&](double x0, double x1, double z0, double z1, double y, const Vec3& colour) {
    for (double x = x0 + 0.04; x < x1; x += 0.08) {
      for (double z = z0 + 0.04; z < z1; z += 0.08) {
        painter.cylinder(at(x, y, z), at(x, y + 0.018, z), 0.025 * scale, 0.025 * scale, plain(colour), texture);
      }
    }
  };

  // Baseplate.
  painter.box(at(0, 0.012, 0), Vec3{1.12, 0.012, 0.8} * scale, plain(plate), texture);
  studs(-1.12, 1.12, -0.8, 0.8, 0.024, plate);

  // Tracks around three wheels on each side.
  for (const double side : {-1.0, 1.0}) {
    const double z = 0.42 * side;
    const Paint links = [=](const Vec3& p, double, double) {
      const Vec3 local = (p - origin) * (1 / scale);
      const double along = local[0] + (local[1] > 0.2 ? 0.02 : 0.0);
      return fraction(along / 0.07) < 0.3 ? Vec3{0.04, 0.04, 0.04} : Vec3{0.20, 0.20, 0.21};
    };
    painter.box(at(0.12, 0.36, z), Vec3{0.52, 0.022, 0.12} * scale, links, texture);
    painter.box(at(0.12, 0.046, z), Vec3{0.52, 0.022, 0.12} * scale, links, texture);
    for (const double x : {-0.40, 0.64}) {
      const Paint cogs = [=](const Vec3& p, double u, double) {
        const double ring = glm::length(p - at(x, 0.203, p[2] > origin[2] ? 0.42 : -0.42)) / scale;
        if (ring < 0.05) return Vec3{0.75, 0.75, 0.76};
        if (ring < 0.13) return yellow;
        return fraction(u * 14) < 0.35 ? Vec3{0.05, 0.05, 0.05} : Vec3{0.21, 0.21, 0.22};
      };
      painter.cylinder(at(x, 0.203, z - 0.12), at(x, 0.203, z + 0.12), 0.178 * scale, 0.178 * scale, cogs, texture);
    }
    for (const double x : {-0.14, 0.12, 0.38}) {
      painter.cylinder(at(x, 0.15, z - 0.10), at(x, 0.15, z + 0.10), 0.085 * scale, 0.085 * scale,
                       plain({0.62, 0.62, 0.63}), texture);
    }
    brick(0.12, 0.24, z - 0.01 * side, 0.46, 0.05, 0.09, yellow);
  }

  // Body, engine, cab.
  brick(0.12, 0.27, 0, 0.60, 0.10, 0.29, grey);
  brick(0.10, 0.42, 0, 0.64, 0.06, 0.40, yellow);
  studs(-0.54, 0.74, -0.40, 0.40, 0.48, yellow);
  brick(-0.30, 0.58, 0, 0.24, 0.12, 0.22, yellow);
  studs(-0.54, -0.06, -0.22, 0.22, 0.70, yellow);
  for (const double z : {-0.225, 0.225}) brick(-0.30, 0.60, z, 0.16, 0.05, 0.01, dark);
  brick(-0.55, 0.57, 0, 0.012, 0.10, 0.18, dark);
  for (const double z : {-0.13, 0.13}) {
    painter.cylinder(at(-0.20, 0.70, z), at(-0.20, 0.98, z), 0.026 * scale, 0.026 * scale, plain(dark), texture);
    painter.ball(at(-0.54, 0.72, z), Vec3{0.05, 0.05, 0.05} * scale, plain({1.2, 1.1, 0.8}), texture);
  }
  brick(0.28, 0.53, 0, 0.20, 0.05, 0.24, dark);
  for (const double x : {0.04, 0.50}) {
    for (const double z : {-0.27, 0.27}) {
      painter.cylinder(at(x, 0.48, z), at(x, 1.06, z), 0.024 * scale, 0.024 * scale, plain(yellow * 0.85), texture);
    }
  }
  brick(0.34, 0.70, 0, 0.09, 0.13, 0.12, red);
  brick(0.27, 1.08, 0, 0.30, 0.028, 0.32, yellow);
  studs(-0.03, 0.57, -0.32, 0.32, 1.108, yellow);
  painter.cylinder(at(0.12, 1.11, 0), at(0.12, 1.20, 0), 0.04 * scale, 0.035 * scale, plain({1.2, 0.5, 0.1}), texture);

  // The ripper behind, its arm and its teeth.
  painter.slab(at(0.72, 0.34, -0.06), Vec3{0.34, 0.30, 0} * scale, Vec3{-0.06, 0.07, 0} * scale,
               Vec3{0, 0, 0.12} * scale, plain(grey), texture);
  painter.slab(at(0.98, 0.66, -0.05), Vec3{0.08, -0.46, 0} * scale, Vec3{0.09, 0.02, 0} * scale,
               Vec3{0, 0, 0.10} * scale, plain(yellow), texture);
  brick(0.80, 0.40, 0, 0.05, 0.05, 0.30, yellow);

  // The blade in front: curved, on two arms with pistons.
  const Surface blade = [=](double u, double v) {
    const double x = -0.86 - 0.16 * (4 * (v - 0.5) * (v - 0.5)) + 0.05;
    const Vec3 n = unit({-1, 1.2 * (v - 0.5), 0});
    return SurfacePoint{at(x, 0.05 + 0.42 * v, -0.62 + 1.24 * u), n};
  };
  const Paint blade_paint = [=](const Vec3& p, double u, double) {
    const double y = (p[1] - origin[1]) / scale;
    if (y < 0.09) return grey;
    return fraction(u * 16) < 0.06 || fraction(y / 0.096) < 0.08 ? yellow * 0.6 : yellow;
  };
  painter.surface(blade, blade_paint, texture);
  painter.surface(
      [=](double u, double v) {
        SurfacePoint p = blade(u, v);
        return SurfacePoint{p.position - p.normal * (0.03 * scale), p.normal * -1.0};
      },
      blade_paint, texture);
  painter.block_box(at(-0.86, 0.26, 0), Vec3{0.02, 0.18, 0.6} * scale);
  for (const double z : {-0.58, 0.58}) {
    brick(-0.36, 0.18, z, 0.46, 0.035, 0.03, yellow);
  }
  for (const double z : {-0.3, 0.3}) {
    painter.cylinder(at(-0.80, 0.30, z), at(-0.44, 0.46, z), 0.03 * scale, 0.03 * scale, plain({0.7, 0.7, 0.72}),
                     texture);
  }
}

void sky(CapturePainter& painter, double radius, double cloudiness, double circle, const Texture& texture) {
  const Paint air = [=](const Vec3& p, double, double) {
    const Vec3 d = p * (1 / radius);
    const double clouds = fractal_noise({d[0] * 3.2, d[1] * 8 + 7, d[2] * 3.2}, 4);
    return mix(mix({0.86, 0.90, 0.95}, {0.30, 0.52, 0.84}, 1.9 * d[1]), {1.02, 1.01, 1.0},
               5.0 * (clouds - 0.62 + 0.2 * cloudiness));
  };
  Texture heaven = texture;
  heaven.emission = 1;
  heaven.gloss = 0;
  heaven.behind = 0.3;
  const Surface dome = dome_surface({0, 0, 0}, radius, -0.12, 0.6);
  painter.surface([=](double u, double v) { return dome(0.25 + circle * (u - 0.5), v); }, air, heaven);
}

}  // namespace vrpipe
