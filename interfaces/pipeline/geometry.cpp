#include <vrpipe/pipeline/geometry.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <iterator>

#include <vrpipe/arithmetic/lanes.h>

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

/// Of a box's corners, each side by side: the four signs of its axes in turn.
using Four = double __attribute__((vector_size(32)));
struct Corners {
  Four x, y;
};

bool in_guard_band(const Corners& corners) {
  constexpr double band = guard_band_pixels;
  const auto inside = (corners.x <= band) & (corners.x >= -band) & (corners.y <= band) & (corners.y >= -band);
  return sign_mask(reinterpret_cast<Words>(inside)) == all_lanes;
}

Four floors(const Four& values) {
#if defined(__AVX__)
  return __builtin_ia32_roundpd256(values, 1);
#else
  return Four{std::floor(values[0]), std::floor(values[1]), std::floor(values[2]), std::floor(values[3])};
#endif
}
Four square_roots(const Four& squares) {
#if defined(__AVX__)
  return __builtin_ia32_sqrtpd256(squares);
#else
  return Four{std::sqrt(squares[0]), std::sqrt(squares[1]), std::sqrt(squares[2]), std::sqrt(squares[3])};
#endif
}

LaneBits to_steps(const Four& pixels, double steps_per_pixel) {
  return __builtin_convertvector(floors(pixels * steps_per_pixel + 0.5), LaneBits);
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

/// @param axes  x and y of the first, then of the second
Corners corners_of(const Point& center, const Four& axes, const Four& a, const Four& b) {
  return {center.x + a * axes[0] + b * axes[2], center.y + a * axes[1] + b * axes[3]};
}

/// The corners of the part of a box that can be seen. A box off to one side of the screen keeps a far corner only when it
/// misses the viewport.
[[gnu::noinline]] bool cut_box(const RenderContext& context, const Point& center, const Four& axes, Corners& corners) {
  const double width = context.frame->width();
  const double height = context.frame->height();
  const Point view_center{width / 2, height / 2};
  const double view_radius = 0.5 * std::sqrt(width * width + height * height) + 2.0;
  double a0 = -1;
  double a1 = 1;
  double b0 = -1;
  double b1 = 1;
  cut_axis(center, {axes[0], axes[1]}, view_center, view_radius, a0, a1);
  cut_axis(center, {axes[2], axes[3]}, view_center, view_radius, b0, b1);
  corners = corners_of(center, axes, Four{a0, a1, a0, a1}, Four{b0, b0, b1, b1});
  return in_guard_band(corners);
}

bool box_corners(const RenderContext& context, const DrawState& state, const Splat& splat, Corners& corners) {
  const Point center{splat.cx, splat.cy};
  Four axes{splat.ax, splat.ay, splat.bx, splat.by};
  if (state.splat_extent == SplatExtent::axis_aligned_box || state.splat_extent == SplatExtent::fill_rectangle) {
    const Four squares = axes * axes;
    axes = Four{std::sqrt(squares[0] + squares[2]), 0.0, 0.0, std::sqrt(squares[1] + squares[3])};
  } else if (state.splat_extent == SplatExtent::three_sigma && splat.r > 0) {
    axes *= 3.0 / static_cast<double>(splat.r);
  }
  const double padding =
      static_cast<double>(state.obb_padding) / static_cast<double>(1U << context.precision.subpixel_bits);
  const Four squares = axes * axes;
  const Four lengths = square_roots(squares + __builtin_shufflevector(squares, squares, 1, 0, 3, 2));
  axes *= lengths > 0.0 ? (lengths + padding) / lengths : Four{} + 1.0;
  // A box of no extent has no direction; it still covers a sample that lies on its centre.
  if (sign_mask(reinterpret_cast<Words>(axes != 0.0)) == 0) axes = Four{padding, 0.0, 0.0, padding};
  corners = corners_of(center, axes, Four{-1, 1, -1, 1}, Four{-1, -1, 1, 1});
  return in_guard_band(corners) || cut_box(context, center, axes, corners);
}

}  // namespace

void TriangleSnapper::snap_box(const DrawCall& call, std::uint32_t splat) {
  splat_ = splat;
  Corners corners;
  is_finite_ = box_corners(context_, call.state, call.splat(splat), corners);
  if (!is_finite_) return;
  const auto steps = static_cast<double>(1U << context_.precision.subpixel_bits);
  x_ = to_steps(corners.x, steps);
  y_ = to_steps(corners.y, steps);
}

bool TriangleSnapper::snap(DrawIndex draw, std::uint32_t splat, unsigned triangle, SnappedTriangle& out) {
  const DrawCall& call = context_.draw(draw);
  const bool is_mesh = call.geometry->is_mesh();
  if (const ScreenTriangle* const given = call.triangle(splat); is_mesh || given != nullptr) {
    const auto steps = static_cast<double>(1U << context_.precision.subpixel_bits);
    for (unsigned vertex = 0; vertex < 3; ++vertex) {
      const MeshVertex* const of_mesh = is_mesh ? &call.mesh_triangle(splat).vertices[vertex] : nullptr;
      const Point point = is_mesh ? Point{of_mesh->x, of_mesh->y} : Point{given->x[vertex], given->y[vertex]};
      if (!in_guard_band(point)) return false;
      out.x[vertex] = to_steps(point.x, steps);
      out.y[vertex] = to_steps(point.y, steps);
    }
    return true;
  }
  if (splat_ != splat) snap_box(call, splat);
  const unsigned second = triangle == 0 ? 1 : 3;
  out.x = {x_[triangle], x_[second], x_[2]};
  out.y = {y_[triangle], y_[second], y_[2]};
  return is_finite_;
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
  const auto first = [&](const std::array<std::int32_t, 3>& of) {
    return std::max((std::min({of[0], of[1], of[2]}) + half - 1) >> subpixel_bits, 0);
  };
  const auto end = [&](const std::array<std::int32_t, 3>& of, std::uint32_t size) {
    return std::min(((std::max({of[0], of[1], of[2]}) - half) >> subpixel_bits) + 1, static_cast<std::int32_t>(size));
  };
  return {first(t.x), first(t.y), end(t.x, width), end(t.y, height)};
}

bool is_finite(const Splat& splat) {
  // Of all fields but the depth, by their exponents: all at once, since every splat is asked for.
  static_assert(sizeof(Splat) == 3 * sizeof(LaneBits) && offsetof(Splat, depth) == 7 * sizeof(float));
  constexpr LaneBits exponent = {0x7f800000, 0x7f800000, 0x7f800000, 0x7f800000};
  constexpr LaneBits but_depth = {-1, -1, -1, 0};
  LaneBits fields[3];
  std::memcpy(fields, &splat, sizeof fields);
  return sign_mask(((fields[0] & exponent) == exponent) | ((fields[1] & but_depth & exponent) == exponent) |
                   ((fields[2] & exponent) == exponent)) == 0;
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
