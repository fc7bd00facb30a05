#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "support/builders.h"

/// Where splats' boxes and ellipses lie, by polygons.
namespace vrpipe::testing {

struct Point {
  double x, y;
};

/// Distance of the origin to a polygon, 0 inside.
inline double distance_to(const std::array<Point, 4>& polygon) {
  double least = std::numeric_limits<double>::infinity();
  bool left = true, right = true;
  for (unsigned i = 0; i < 4; ++i) {
    const Point a = polygon[i];
    const Point b = polygon[(i + 1) % 4];
    const Point d{b.x - a.x, b.y - a.y};
    const double along = -(a.x * d.x + a.y * d.y) / (d.x * d.x + d.y * d.y);
    const double t = std::fmin(1, std::fmax(0, along));
    least = std::fmin(least, std::hypot(a.x + t * d.x, a.y + t * d.y));
    const double side = a.x * b.y - a.y * b.x;
    left = left && side >= 0;
    right = right && side <= 0;
  }
  return left || right ? 0 : least;
}

/// The corners in the splat's own axes, in units of its half extents.
inline std::array<Point, 4> in_axes(const Splat& splat, std::array<Point, 4> corners) {
  const double a = double{splat.ax} * splat.ax + double{splat.ay} * splat.ay;
  const double b = double{splat.bx} * splat.bx + double{splat.by} * splat.by;
  for (Point& corner : corners) {
    const Point d{corner.x - splat.cx, corner.y - splat.cy};
    corner = {(d.x * splat.ax + d.y * splat.ay) / a, (d.x * splat.bx + d.y * splat.by) / b};
  }
  return corners;
}

/// The part of a polygon in [-1, 1] x [-1, 1], cut side by side; whether anything is left.
inline bool meets_square(const std::array<Point, 4>& polygon) {
  std::vector<Point> left(polygon.begin(), polygon.end());
  for (const auto& [nx, ny] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
    const auto beyond = [nx = nx, ny = ny](const Point& p) { return nx * p.x + ny * p.y - 1; };
    std::vector<Point> cut;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const Point& a = left[i];
      const Point& b = left[(i + 1) % left.size()];
      const double da = beyond(a), db = beyond(b);
      if (da <= 0) cut.push_back(a);
      if ((da < 0) != (db < 0)) cut.push_back({a.x + (b.x - a.x) * da / (da - db), a.y + (b.y - a.y) * da / (da - db)});
    }
    left = cut;
  }
  return !left.empty();
}

/// Large enough for each to meet samples; some reach over all of the image, some are outside.
inline Draw large_splats(std::uint32_t width, std::uint32_t height, std::uint32_t splats, std::uint64_t seed) {
  Draw draw = random_draw(width, height, splats, seed);
  for (Splat& splat : draw.splats) {
    const float thin = std::hypot(splat.bx, splat.by);
    if (thin >= 1.0F) continue;
    splat.bx *= 1 / thin;
    splat.by *= 1 / thin;
  }
  return draw;
}

}  // namespace vrpipe::testing
