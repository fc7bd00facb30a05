#include <vrpipe/pipeline/frame_facts.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include <vrpipe/pipeline/geometry.h>

namespace vrpipe {

/// Boxes over the screen tiles, of which it counts those that any box touches: corners of boxes are summed up at the end.
class FrameFacts::Boxes {
 public:
  explicit Boxes(const Frame& frame)
      : width_((frame.width() + screen_tile_pixels - 1) / screen_tile_pixels),
        height_((frame.height() + screen_tile_pixels - 1) / screen_tile_pixels),
        corners_(std::size_t{width_ + 1} * (height_ + 1)) {}
  std::uint32_t tiles() const { return width_ * height_; }

  /// In pixels; a sample's rounding to the sub-pixel grid is within a pixel.
  void add(double x0, double y0, double x1, double y1) {
    const auto tile = [](double pixels, std::uint32_t tiles) {
      return static_cast<std::uint32_t>(std::clamp(std::floor(pixels / screen_tile_pixels), 0.0, double{1} * tiles));
    };
    if (x1 < -1 || y1 < -1) return;
    const std::uint32_t left = tile(x0 - 1, width_);
    const std::uint32_t top = tile(y0 - 1, height_);
    const std::uint32_t right = std::min(tile(x1 + 1, width_) + 1, width_);
    const std::uint32_t bottom = std::min(tile(y1 + 1, height_) + 1, height_);
    if (left >= right || top >= bottom) return;
    ++at(left, top);
    --at(right, top);
    --at(left, bottom);
    ++at(right, bottom);
  }
  std::uint32_t touched() {
    std::uint32_t count = 0;
    for (std::uint32_t y = 0; y < height_; ++y) {
      for (std::uint32_t x = 0; x < width_; ++x) {
        if (x > 0) at(x, y) += at(x - 1, y);
        if (y > 0) at(x, y) += at(x, y - 1);
        if (x > 0 && y > 0) at(x, y) -= at(x - 1, y - 1);
        count += at(x, y) != 0 ? 1 : 0;
      }
    }
    return count;
  }

 private:
  std::int64_t& at(std::uint32_t x, std::uint32_t y) { return corners_[std::size_t{y} * (width_ + 1) + x]; }
  std::uint32_t width_;
  std::uint32_t height_;
  std::vector<std::int64_t> corners_;
};

namespace {
/// Of the triangle that is drawn in place of a splat, if one is.
bool has_finite_vertices(const DrawCall& call, std::uint32_t number) {
  const ScreenTriangle* const triangle = call.geometry->is_mesh() ? nullptr : call.triangle(number);
  if (triangle == nullptr) return true;
  const auto is_finite_number = [](float value) { return std::isfinite(value); };
  return std::all_of(triangle->x.begin(), triangle->x.end(), is_finite_number) &&
         std::all_of(triangle->y.begin(), triangle->y.end(), is_finite_number);
}
}  // namespace

void FrameFacts::add(const RenderContext& context, const DrawCall& call, Boxes& boxes) {
  const Draw& geometry = *call.geometry;
  const double padding = 1 + static_cast<double>(call.state.obb_padding) / (1U << context.precision.subpixel_bits);
  const auto add_triangle = [&](const double(&x)[3], const double(&y)[3]) {
    const auto [left, right] = std::minmax({x[0], x[1], x[2]});
    const auto [top, bottom] = std::minmax({y[0], y[1], y[2]});
    boxes.add(left, top, right, bottom);
    widest_edge = std::max(widest_edge, right - left + bottom - top + 2);
  };
  for (std::uint32_t i = 0; i < call.splats; ++i) {
    const std::uint32_t number = call.base + i;
    ++primitives;
    if (!is_finite(call, number) || !has_finite_vertices(call, number)) {
      ++not_finite;
      continue;
    }
    if (geometry.is_mesh()) {
      double x[3];
      double y[3];
      const std::array<MeshVertex, 3>& vertices = call.mesh_triangle(number).vertices;
      for (unsigned vertex = 0; vertex < 3; ++vertex) {
        x[vertex] = vertices[vertex].x;
        y[vertex] = vertices[vertex].y;
        for (const float color : {vertices[vertex].red, vertices[vertex].green, vertices[vertex].blue})
          largest_color = std::max(largest_color, color);
      }
      largest_opacity = std::max(largest_opacity, 1.0F);
      add_triangle(x, y);
      continue;
    }
    const Splat& splat = call.splat(number);
    largest_opacity = std::max(largest_opacity, splat.opacity);
    largest_color = std::max({largest_color, splat.red, splat.green, splat.blue});
    if (const ScreenTriangle* const triangle = call.triangle(number)) {
      double x[3];
      double y[3];
      for (unsigned vertex = 0; vertex < 3; ++vertex) {
        x[vertex] = triangle->x[vertex];
        y[vertex] = triangle->y[vertex];
      }
      add_triangle(x, y);
      continue;
    }
    double scale = 1;
    if (call.state.splat_extent == SplatExtent::three_sigma && splat.r > 0)
      scale = std::max(scale, 3.0 / static_cast<double>(splat.r));
    const auto of = [&](float a, float b) {
      return scale * (std::fabs(static_cast<double>(a)) + std::fabs(static_cast<double>(b))) + 2 * padding;
    };
    const double half_width = of(splat.ax, splat.bx);
    const double half_height = of(splat.ay, splat.by);
    boxes.add(splat.cx - half_width, splat.cy - half_height, splat.cx + half_width, splat.cy + half_height);
    widest_edge = std::max(widest_edge, 2 * (half_width + half_height));
  }
}

FrameFacts::FrameFacts(const RenderContext& context) {
  const Frame& frame = *context.frame;
  Boxes boxes(frame);
  tiles = boxes.tiles();
  for (const DrawCall& call : frame.draws()) {
    const DrawState& state = call.state;
    ++draws;
    ++(call.geometry->is_mesh() ? of_meshes : of_splats);
    testing_depth_stencil += state.tests_depth_stencil() ? 1 : 0;
    tested_late += state.tests_late() ? 1 : 0;
    terminating += state.early_termination ? 1 : 0;
    shading_nothing += state.shader == FragmentShader::none ? 1 : 0;
    reading_color += reads_color(state.shader) ? 1 : 0;
    culling_faces += state.cull != CullMode::none && call.geometry->is_mesh() ? 1 : 0;
    add(context, call, boxes);
  }
  clears = static_cast<unsigned>(frame.commands().size() - frame.draws().size());
  tiles_touched = boxes.touched();
  addresses = address_map(frame, context.format);
}

}  // namespace vrpipe
