#include "mixed_reference.h"

#include <algorithm>
#include <cmath>

#include <vrpipe/pipeline/geometry.h>

#include "coverage.h"

namespace vrpipe::testing {

bool passes_by_table(Compare compare, double tested, double stored) {
  // NEVER, LESS, EQUAL, LEQUAL, GREATER, NOTEQUAL, GEQUAL, ALWAYS: a bit each for less, equal, greater.
  const unsigned relation = tested < stored ? 1 : tested == stored ? 2 : 4;
  return (static_cast<unsigned>(compare) & relation) != 0;
}

unsigned stencil_by_table(StencilOperation operation, unsigned stored, unsigned reference) {
  const auto value = static_cast<int>(stored);
  switch (operation) {
    case StencilOperation::keep: break;
    case StencilOperation::zero: return 0;
    case StencilOperation::replace: return reference;
    case StencilOperation::increment: return static_cast<unsigned>(std::min(value + 1, 127));
    case StencilOperation::decrement: return static_cast<unsigned>(std::max(value - 1, 0));
    case StencilOperation::invert: return static_cast<unsigned>(127 - value);
    case StencilOperation::increment_wrap: return static_cast<unsigned>((value + 1) % 128);
    case StencilOperation::decrement_wrap: return static_cast<unsigned>((value + 127) % 128);
  }
  return stored;
}

bool is_tested_late(const DrawState& state) {
  if (state.shader == FragmentShader::none) return false;
  bool tests = state.depth.test;
  bool writes = state.depth.test && state.depth.write && state.depth.compare != Compare::none;
  if (state.stencil.test) {
    tests = true;
    for (const StencilFace& face : {state.stencil.front, state.stencil.back}) {
      for (const StencilOperation operation : {face.stencil_fail, face.depth_fail, face.pass}) {
        writes = writes || (operation != StencilOperation::keep && face.write_mask % 128 != 0);
      }
    }
  }
  const bool may_discard = state.shader == FragmentShader::splat && state.pruning_threshold > 0;
  return tests && (state.late_tests || (may_discard && writes));
}

namespace {

using Exact = long double;

/// Of three weights, those of a triangle's vertices at a sample: the areas of the parts over the area of the whole.
std::array<Exact, 3> weights_at(const SnappedTriangle& t, unsigned bits, std::uint32_t x, std::uint32_t y) {
  const std::int64_t px = (std::int64_t{x} << bits) + (std::int64_t{1} << (bits - 1));
  const std::int64_t py = (std::int64_t{y} << bits) + (std::int64_t{1} << (bits - 1));
  const auto area = [](std::int64_t ax, std::int64_t ay, std::int64_t bx, std::int64_t by, std::int64_t cx,
                       std::int64_t cy) { return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax); };
  const Exact whole = static_cast<Exact>(area(t.x[0], t.y[0], t.x[1], t.y[1], t.x[2], t.y[2]));
  return {static_cast<Exact>(area(px, py, t.x[1], t.y[1], t.x[2], t.y[2])) / whole,
          static_cast<Exact>(area(t.x[0], t.y[0], px, py, t.x[2], t.y[2])) / whole,
          static_cast<Exact>(area(t.x[0], t.y[0], t.x[1], t.y[1], px, py)) / whole};
}

std::uint32_t quantized(DepthFormat format, Exact depth) {
  if (format == DepthFormat::d32f) return store_depth(format, static_cast<double>(depth));
  const Exact steps = format == DepthFormat::d16 ? 65535 : 16777215;
  return static_cast<std::uint32_t>(std::floor(std::min(std::max(depth, Exact{0}), Exact{1}) * steps + Exact{0.5}));
}

class Renderer {
 public:
  explicit Renderer(const RenderContext& context) : context_(context), frame_(*context.frame) {
    out_.width = frame_.width();
    out_.height = frame_.height();
    const std::size_t pixels = std::size_t{out_.width} * out_.height;
    out_.rgba.resize(pixels);
    out_.bound.resize(pixels);
    out_.depth.assign(pixels, quantized(frame_.depth_format(), 1));
    out_.stencil.assign(pixels, 0);
    out_.of_draw.resize(frame_.draws().size());
  }
  MixedReference render() {
    for (const Frame::Command& command : frame_.commands()) {
      if (command.is_draw) {
        draw(command.draw);
      } else {
        clear(command.clear);
      }
    }
    return out_;
  }

 private:
  void clear(const Clear& clear) {
    for (std::size_t i = 0; i < out_.rgba.size(); ++i) {
      if (clear.color) out_.rgba[i] = {};
      if (clear.color) out_.bound[i] = {};
      if (clear.depth) out_.depth[i] = quantized(frame_.depth_format(), static_cast<Exact>(clear.depth_value));
      if (clear.stencil) out_.stencil[i] = clear.stencil_value;
    }
  }
  /// The first pixel that may have a sample between three coordinates, and the one after the last.
  template <class Coordinates>
  std::pair<std::uint32_t, std::uint32_t> pixels_between(const Coordinates& of, std::uint32_t size) const {
    const auto pixel = [&](std::int64_t at) {
      return static_cast<std::uint32_t>(std::clamp<std::int64_t>(at >> context_.precision.subpixel_bits, 0, size));
    };
    return {pixel(std::min({of[0], of[1], of[2]})),
            pixel(std::int64_t{std::max({of[0], of[1], of[2]})} + (1 << context_.precision.subpixel_bits))};
  }
  void draw(DrawIndex index) {
    const DrawCall& call = frame_.draw_call(index);
    for (std::uint32_t i = 0; i < call.splats; ++i) {
      const std::uint32_t splat = call.base + i;
      for (unsigned triangle = 0; triangle < primitives_per_splat(call); ++triangle) {
        SnappedTriangle snapped;
        if (!snap_triangle(context_, index, splat, triangle, snapped)) continue;
        const bool is_mesh = call.geometry->is_mesh();
        // Counter-clockwise as one sees it: the cross product is negative where y points down.
        const std::int64_t cross =
            (std::int64_t{snapped.x[1]} - snapped.x[0]) * (std::int64_t{snapped.y[2]} - snapped.y[0]) -
            (std::int64_t{snapped.x[2]} - snapped.x[0]) * (std::int64_t{snapped.y[1]} - snapped.y[0]);
        if (cross == 0) continue;
        const bool is_back = is_mesh && cross > 0;
        if (is_mesh && call.state.cull == CullMode::back && is_back) continue;
        if (is_mesh && call.state.cull == CullMode::front && !is_back) continue;
        const auto [left, right] = pixels_between(snapped.x, out_.width);
        const auto [top, bottom] = pixels_between(snapped.y, out_.height);
        for (std::uint32_t y = top; y < bottom; ++y) {
          for (std::uint32_t x = left; x < right; ++x) {
            if (covers(snapped, context_.precision.subpixel_bits, x, y)) sample(index, splat, snapped, is_back, x, y);
          }
        }
      }
    }
  }
  void sample(DrawIndex index, std::uint32_t splat, const SnappedTriangle& snapped, bool is_back, std::uint32_t x,
              std::uint32_t y) {
    const DrawCall& call = frame_.draw_call(index);
    const std::size_t pixel = std::size_t{y} * out_.width + x;
    MixedCounts& counts = out_.of_draw[index];
    ++counts.rasterized;
    const bool is_mesh = call.geometry->is_mesh();
    const std::array<Exact, 3> weights =
        is_mesh ? weights_at(snapped, context_.precision.subpixel_bits, x, y) : std::array<Exact, 3>{};
    Exact depth = is_mesh ? 0 : static_cast<Exact>(call.splat(splat).depth);
    for (unsigned i = 0; is_mesh && i < 3; ++i) {
      depth += weights[i] * static_cast<Exact>(call.mesh_triangle(splat).vertices[i].depth);
    }
    const bool is_late = is_tested_late(call.state);
    const auto passes = [&] { return tested(call.state, is_back, quantized(frame_.depth_format(), depth), pixel); };
    if (!is_late && !passes()) {
      ++counts.failed;
      return;
    }
    if (call.state.shader == FragmentShader::none) {
      ++counts.unshaded;
      return;
    }
    std::array<double, 4> color{};
    if (is_mesh) {
      color = mesh_color(call, splat, weights);
    } else if (!splat_color(call, call.splat(splat), x, y, color)) {
      ++counts.pruned;
      return;
    }
    if (is_late && !passes()) {
      ++counts.late_failed;
      return;
    }
    ++counts.blended;
    blend(pixel, color);
  }
  bool tested(const DrawState& state, bool is_back, std::uint32_t depth, std::size_t pixel) {
    const StencilFace& face = is_back ? state.stencil.back : state.stencil.front;
    unsigned& stencil = out_.stencil[pixel];
    const bool passes_stencil =
        !state.stencil.test ||
        passes_by_table(face.compare, face.reference & face.read_mask & 127, stencil & face.read_mask & 127);
    bool passes_depth = true;
    if (passes_stencil && state.depth.test) {
      passes_depth = passes_by_table(state.depth.compare, depth, out_.depth[pixel]);
      if (passes_depth && state.depth.write) out_.depth[pixel] = depth;
    }
    if (state.stencil.test) {
      const unsigned value = stencil_by_table(!passes_stencil ? face.stencil_fail
                                              : passes_depth  ? face.pass
                                                              : face.depth_fail,
                                              stencil, face.reference);
      const unsigned mask = face.write_mask & 127;
      stencil = (stencil & ~mask) | (value & mask);
    }
    return passes_stencil && passes_depth;
  }
  std::array<double, 4> mesh_color(const DrawCall& call, std::uint32_t splat,
                                   const std::array<Exact, 3>& weights) const {
    const std::array<MeshVertex, 3>& vertices = call.mesh_triangle(splat).vertices;
    const auto attribute = [&](float MeshVertex::*member) {
      Exact sum = 0;
      Exact of_w = 0;
      for (unsigned i = 0; i < 3; ++i) {
        const Exact share = weights[i] * static_cast<Exact>(vertices[i].inverse_w);
        sum += share * static_cast<Exact>(vertices[i].*member);
        of_w += share;
      }
      return static_cast<double>(sum / of_w);
    };
    double light = 1;
    if (call.state.shader == FragmentShader::lit) {
      const double n[] = {attribute(&MeshVertex::nx), attribute(&MeshVertex::ny), attribute(&MeshVertex::nz)};
      const double length = std::hypot(n[0], n[1], n[2]);
      const Light& lamp = call.state.light;
      const double dot =
          n[0] * static_cast<double>(lamp.x) + n[1] * static_cast<double>(lamp.y) + n[2] * static_cast<double>(lamp.z);
      const double ambient = static_cast<double>(lamp.ambient);
      light = ambient + (1 - ambient) * (length > 0 ? std::fmax(0.0, dot / length) : 0);
    }
    return {attribute(&MeshVertex::red) * light, attribute(&MeshVertex::green) * light,
            attribute(&MeshVertex::blue) * light, 1};
  }
  bool splat_color(const DrawCall& call, const Splat& splat, std::uint32_t x, std::uint32_t y,
                   std::array<double, 4>& color) {
    const double ax = splat.ax, ay = splat.ay, bx = splat.bx, by = splat.by;
    const double dx = x + 0.5 - static_cast<double>(splat.cx);
    const double dy = y + 0.5 - static_cast<double>(splat.cy);
    const double determinant = ax * by - ay * bx;
    const double scale = determinant == 0 ? 0 : static_cast<double>(splat.r) / determinant;
    const double u = (dx * by - dy * bx) * scale;
    const double v = (dy * ax - dx * ay) * scale;
    const double alpha = static_cast<double>(splat.opacity) * std::exp(-0.5 * (u * u + v * v));
    const double threshold = static_cast<double>(call.state.pruning_threshold);
    if (std::fabs(alpha - threshold) <= 1e-5 * threshold) ++out_.near_prune_edge;
    if (alpha < threshold) return false;
    const double visible = std::fmin(alpha, 0.99);
    color = {visible * static_cast<double>(splat.red), visible * static_cast<double>(splat.green),
             visible * static_cast<double>(splat.blue), visible};
    return true;
  }
  void blend(std::size_t pixel, const std::array<double, 4>& color) {
    std::array<double, 4>& rgba = out_.rgba[pixel];
    const double before = rgba[3];
    for (unsigned i = 0; i < 4; ++i) rgba[i] += (1 - before) * color[i];
    running_.blended(out_.bound[pixel], color[3], std::max({color[0], color[1], color[2]}), before, rgba[3],
                     std::max({rgba[0], rgba[1], rgba[2]}));
  }

  const RenderContext& context_;
  const Frame& frame_;
  const RunningBound running_{ColorFormat::rgba16f, BlendRounding::rne, true};
  MixedReference out_;
};

}  // namespace

MixedReference render_mixed(const RenderContext& context) { return Renderer(context).render(); }

}  // namespace vrpipe::testing
