#include <vrpipe/pipeline/geometry.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <iterator>

namespace vrpipe {

namespace {

struct Point {
  double x, y;
};

std::int32_t to_steps(double pixels, double steps_per_pixel) {
  return static_cast<std::int32_t>(std::floor(pixels * steps_per_pixel + 0.5));
}

/// False for NaN.
bool in_guard_band(const Point& point) {
  return std::fabs(point.x) <= guard_band_pixels && std::fabs(point.y) <= guard_band_pixels;
}
bool in_guard_band(const std::array<Point, 4>& corners) {
  return in_guard_band(corners[0]) && in_guard_band(corners[1]) && in_guard_band(corners[2]) &&
         in_guard_band(corners[3]);
}

/// The part of [-1, 1] along an axis that can reach the viewport's circumcircle.
void cut_axis(const Point& center, const Point& axis, const Point& view_center, double view_radius, double& low,
              double& high) {
  const double squared = axis.x * axis.x + axis.y * axis.y;
  if (!(squared > 0)) return;
  const double length = std::sqrt(squared);
  const double middle = ((view_center.x - center.x) * axis.x + (view_center.y - center.y) * axis.y) / squared;
  low = std::min(std::max(low, middle - view_radius / length), 1.0);
  high = std::max(std::min(high, middle + view_radius / length), -1.0);
}

bool box_corners(const RenderContext& context, const DrawState& state, const Splat& splat,
                 std::array<Point, 4>& corners) {
  const Point center{splat.cx, splat.cy};
  Point a{splat.ax, splat.ay};
  Point b{splat.bx, splat.by};
  if (state.splat_extent == SplatExtent::axis_aligned_box || state.splat_extent == SplatExtent::fill_rectangle) {
    const double half_width = std::sqrt(a.x * a.x + b.x * b.x);
    const double half_height = std::sqrt(a.y * a.y + b.y * b.y);
    a = {half_width, 0.0};
    b = {0.0, half_height};
  } else if (state.splat_extent == SplatExtent::three_sigma && splat.r > 0) {
    const double scale = 3.0 / static_cast<double>(splat.r);
    a = {a.x * scale, a.y * scale};
    b = {b.x * scale, b.y * scale};
  }
  const double padding =
      static_cast<double>(state.obb_padding) / static_cast<double>(1U << context.precision.subpixel_bits);
  for (Point* axis : {&a, &b}) {
    const double length = std::sqrt(axis->x * axis->x + axis->y * axis->y);
    if (length > 0) {
      const double scale = (length + padding) / length;
      axis->x *= scale;
      axis->y *= scale;
    }
  }
  // A box of no extent has no direction; it still covers a sample that lies on its centre.
  if (a.x == 0 && a.y == 0 && b.x == 0 && b.y == 0) {
    a.x = padding;
    b.y = padding;
  }
  double a0 = -1;
  double a1 = 1;
  double b0 = -1;
  double b1 = 1;
  const auto corner = [&](double u, double v) {
    return Point{center.x + u * a.x + v * b.x, center.y + u * a.y + v * b.y};
  };
  const auto set_corners = [&] { corners = {corner(a0, b0), corner(a1, b0), corner(a0, b1), corner(a1, b1)}; };
  set_corners();
  if (in_guard_band(corners)) return true;
  const double width = context.frame->width();
  const double height = context.frame->height();
  const Point view_center{width / 2, height / 2};
  const double view_radius = 0.5 * std::sqrt(width * width + height * height) + 2.0;
  cut_axis(center, a, view_center, view_radius, a0, a1);
  cut_axis(center, b, view_center, view_radius, b0, b1);
  set_corners();
  // A box off to one side of the screen keeps a far corner only when it misses the viewport.
  return in_guard_band(corners);
}

}  // namespace

bool TriangleSnapper::snap(DrawIndex draw, std::uint32_t splat, unsigned triangle, SnappedTriangle& out) {
  constexpr unsigned order[2][3] = {{0, 1, 2}, {1, 3, 2}};
  const DrawCall& call = context_.draw(draw);
  const auto steps = static_cast<double>(1U << context_.precision.subpixel_bits);
  const bool is_mesh = call.geometry->is_mesh();
  if (const ScreenTriangle* const given = call.triangle(splat); is_mesh || given != nullptr) {
    for (unsigned vertex = 0; vertex < 3; ++vertex) {
      const MeshVertex* const of_mesh = is_mesh ? &call.mesh_triangle(splat).vertices[vertex] : nullptr;
      const Point point = is_mesh ? Point{of_mesh->x, of_mesh->y} : Point{given->x[vertex], given->y[vertex]};
      if (!in_guard_band(point)) return false;
      out.x[vertex] = to_steps(point.x, steps);
      out.y[vertex] = to_steps(point.y, steps);
    }
    return true;
  }
  if (splat_ != splat) {
    splat_ = splat;
    std::array<Point, 4> corners;
    is_finite_ = box_corners(context_, call.state, call.splat(splat), corners);
    for (unsigned corner = 0; is_finite_ && corner < 4; ++corner) {
      x_[corner] = to_steps(corners[corner].x, steps);
      y_[corner] = to_steps(corners[corner].y, steps);
    }
  }
  if (!is_finite_) return false;
  for (unsigned vertex = 0; vertex < 3; ++vertex) {
    out.x[vertex] = x_[order[triangle][vertex]];
    out.y[vertex] = y_[order[triangle][vertex]];
  }
  return true;
}

bool snap_triangle(const RenderContext& context, DrawIndex draw, std::uint32_t splat, unsigned triangle,
                   SnappedTriangle& out) {
  return TriangleSnapper(context).snap(draw, splat, triangle, out);
}

std::int64_t doubled_area(const SnappedTriangle& t) {
  const std::int64_t x1 = std::int64_t{t.x[1]} - t.x[0];
  const std::int64_t y1 = std::int64_t{t.y[1]} - t.y[0];
  const std::int64_t x2 = std::int64_t{t.x[2]} - t.x[0];
  const std::int64_t y2 = std::int64_t{t.y[2]} - t.y[0];
  return x1 * y2 - x2 * y1;
}

PixelRect covered_bounds(const SnappedTriangle& t, unsigned subpixel_bits, std::uint32_t width, std::uint32_t height) {
  const std::int32_t half = std::int32_t{1} << (subpixel_bits - 1);
  // The sample of pixel p is at p + 1/2: the first at or right of x is ceil(x - 1/2), the last at or left is floor.
  const auto first = [&](std::int32_t v) {
    return (v - half + (std::int32_t{1} << subpixel_bits) - 1) >> subpixel_bits;
  };
  const auto last = [&](std::int32_t v) { return (v - half) >> subpixel_bits; };
  PixelRect bounds;
  bounds.x0 = std::max(first(*std::min_element(t.x.begin(), t.x.end())), 0);
  bounds.y0 = std::max(first(*std::min_element(t.y.begin(), t.y.end())), 0);
  bounds.x1 = std::min(last(*std::max_element(t.x.begin(), t.x.end())) + 1, static_cast<std::int32_t>(width));
  bounds.y1 = std::min(last(*std::max_element(t.y.begin(), t.y.end())) + 1, static_cast<std::int32_t>(height));
  return bounds;
}

bool is_finite(const Splat& splat) {
  // Of all fields but the depth, by their exponents: all at once, since every splat is asked for.
  constexpr unsigned fields = sizeof(Splat) / sizeof(std::uint32_t);
  constexpr std::uint32_t exponent = 0x7f800000;
  std::uint32_t bits[fields];
  std::memcpy(bits, &splat, sizeof bits);
  bits[offsetof(Splat, depth) / sizeof(std::uint32_t)] = 0;
  std::uint32_t any = 0;
  for (const std::uint32_t each : bits) any |= (each & exponent) == exponent ? 1U : 0U;
  return any == 0;
}

bool is_finite(const MeshTriangle& triangle) {
  return std::all_of(triangle.vertices.begin(), triangle.vertices.end(), [](const MeshVertex& vertex) {
    const float fields[] = {vertex.x,     vertex.y,    vertex.depth, vertex.inverse_w, vertex.red,
                            vertex.green, vertex.blue, vertex.nx,    vertex.ny,        vertex.nz};
    return std::all_of(std::begin(fields), std::end(fields), [](float field) { return std::isfinite(field); });
  });
}

bool is_finite(const DrawCall& draw, std::uint32_t splat) {
  return draw.geometry->is_mesh() ? is_finite(draw.mesh_triangle(splat)) : is_finite(draw.splat(splat));
}

bool is_back_face(const Draw& draw, const SnappedTriangle& triangle) {
  return draw.is_mesh() && doubled_area(triangle) > 0;
}

Culling cull_triangle(const RenderContext& context, DrawIndex draw, std::uint32_t splat, unsigned triangle,
                      PixelRect& bounds) {
  TriangleSnapper snapper(context);
  return cull_triangle(context, snapper, draw, splat, triangle, bounds);
}

Culling cull_triangle(const RenderContext& context, TriangleSnapper& snapper, DrawIndex draw, std::uint32_t splat,
                      unsigned triangle, PixelRect& bounds) {
  SnappedTriangle snapped;
  if (!snapper.snap(draw, splat, triangle, snapped)) return Culling::not_finite;
  if (doubled_area(snapped) == 0) return Culling::zero_area;
  const DrawCall& call = context.draw(draw);
  if (draws_rectangles(call)) {
    // Samples on the right and on the lower edge belong to the neighbours.
    --snapped.x[1];
    --snapped.y[2];
  }
  bounds = covered_bounds(snapped, context.precision.subpixel_bits, context.frame->width(), context.frame->height());
  if (call.state.cull != CullMode::none &&
      is_back_face(*call.geometry, snapped) == (call.state.cull == CullMode::back) && call.geometry->is_mesh()) {
    return Culling::facing;
  }
  return bounds.empty() ? Culling::outside : Culling::none;
}

}  // namespace vrpipe
