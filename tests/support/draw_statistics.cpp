#include "draw_statistics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace vrpipe::testing {
namespace {

/// The value that a share of all does not exceed.
double quantile(std::vector<float>& values, double share) {
  const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

void measure_splats(const Draw& draw, DrawStatistics& statistics) {
  constexpr float kLarge = 32;
  std::vector<float> opacities, sides, elongations;
  double area = 0, large = 0;
  for (const Splat& s : draw.splats) {
    const float a = std::hypot(s.ax, s.ay), b = std::hypot(s.bx, s.by), side = 2 * std::sqrt(a * b);
    opacities.push_back(s.opacity);
    sides.push_back(side);
    elongations.push_back(b > 0 ? a / b : 1);
    area += side * side;
    large += side > kLarge ? side * side : 0;
  }
  statistics.opacity_low = quantile(opacities, 0.1);
  statistics.opacity_median = quantile(opacities, 0.5);
  statistics.side_median = quantile(sides, 0.5);
  statistics.elongation_median = quantile(elongations, 0.5);
  statistics.elongation_99 = quantile(elongations, 0.99);
  statistics.boxes_per_pixel = area / (static_cast<double>(draw.width) * draw.height);
  statistics.area_of_large = large / area;
}

/// Narrows [low, high] to the x at which |slope x + offset| <= 1.
void narrow(float slope, float offset, float& low, float& high) {
  if (std::fabs(slope) < 1e-9f) return;  // the test of each sample follows
  const float a = (-1 - offset) / slope, b = (1 - offset) / slope;
  low = std::max(low, std::min(a, b));
  high = std::min(high, std::max(a, b));
}

}  // namespace

DrawStatistics statistics_of(const Draw& draw, float threshold) {
  if (!draw.triangles.empty() || draw.splats.empty()) throw std::invalid_argument("statistics_of: splats only");
  DrawStatistics statistics;
  statistics.splats = draw.splats.size();
  measure_splats(draw, statistics);

  const int width = static_cast<int>(draw.width), height = static_cast<int>(draw.height);
  std::vector<float> accumulated(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::uint64_t fragments = 0, living = 0, quads = 0, living_quads = 0;
  // Of a row of quads, those that each of a splat's two triangles covers: bit 0 for any fragment, bit 1 for a living one.
  std::vector<std::array<std::uint8_t, 2>> covered(static_cast<std::size_t>(width) / 2 + 1);
  for (const Splat& s : draw.splats) {
    const float aa = s.ax * s.ax + s.ay * s.ay, bb = s.bx * s.bx + s.by * s.by;
    if (!(aa > 0 && bb > 0)) continue;
    const float reach_y = std::fabs(s.ay) + std::fabs(s.by);
    const int top = static_cast<int>(std::max(0.0f, std::floor(s.cy - reach_y - 0.5f)));
    const int bottom = static_cast<int>(std::min(static_cast<float>(height - 1), std::ceil(s.cy + reach_y - 0.5f)));
    int first = width, last = -1;  // quads that this row of them covers
    const auto count_quads = [&] {
      for (int quad = first; quad <= last; ++quad) {
        for (std::uint8_t& flags : covered[static_cast<std::size_t>(quad)]) {
          quads += flags & 1U;
          living_quads += flags >> 1U;
          flags = 0;
        }
      }
      first = width;
      last = -1;
    };
    for (int y = top; y <= bottom; ++y) {
      if (y % 2 == 0) count_quads();
      // Place in the box, -1 to 1 along both of its axes.
      const float dy = static_cast<float>(y) + 0.5f - s.cy;
      const float u_slope = s.ax / aa, u_offset = dy * s.ay / aa, v_slope = s.bx / bb, v_offset = dy * s.by / bb;
      float low = -s.cx, high = static_cast<float>(width) - s.cx;
      narrow(u_slope, u_offset, low, high);
      narrow(v_slope, v_offset, low, high);
      if (!(low <= high)) continue;
      const int x_end = std::min(width - 1, static_cast<int>(std::ceil(s.cx + high)));
      for (int x = std::max(0, static_cast<int>(std::floor(s.cx + low)) - 1); x <= x_end; ++x) {
        const float dx = static_cast<float>(x) + 0.5f - s.cx;
        const float u = u_slope * dx + u_offset, v = v_slope * dx + v_offset;
        if (std::fabs(u) > 1 || std::fabs(v) > 1) continue;
        const float weight = s.opacity * std::exp(-0.5f * s.r * s.r * (u * u + v * v));
        if (weight < 1.0f / 255) continue;
        float& alpha =
            accumulated[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
        const bool lives = alpha < threshold;
        ++fragments;
        living += lives;
        alpha += (1 - alpha) * std::min(0.99f, weight);
        covered[static_cast<std::size_t>(x / 2)][u < v ? 0 : 1] |= lives ? 3U : 1U;
        first = std::min(first, x / 2);
        last = std::max(last, x / 2);
      }
    }
    count_quads();
  }

  std::uint64_t mixed = 0, terminated = 0;
  for (int y = 0; y < height; y += 2) {
    for (int x = 0; x < width; x += 2) {
      int of_quad = 0, pixels = 0;
      for (int py = y; py < std::min(height, y + 2); ++py) {
        for (int px = x; px < std::min(width, x + 2); ++px) {
          ++pixels;
          of_quad += accumulated[static_cast<std::size_t>(py) * static_cast<std::size_t>(width) +
                                 static_cast<std::size_t>(px)] >= threshold;
        }
      }
      terminated += static_cast<std::uint64_t>(of_quad);
      mixed += of_quad > 0 && of_quad < pixels;
    }
  }
  const double pixels = static_cast<double>(width) * height;
  const auto filled = std::count_if(accumulated.begin(), accumulated.end(), [](float alpha) { return alpha > 0.9f; });
  statistics.filled = static_cast<double>(filled) / pixels;
  statistics.fragments_per_pixel = static_cast<double>(fragments) / pixels;
  statistics.quads_per_pixel = static_cast<double>(quads) / pixels;
  statistics.termination_ratio = static_cast<double>(fragments) / static_cast<double>(living);
  statistics.quad_termination_ratio = static_cast<double>(quads) / static_cast<double>(living_quads);
  statistics.mixed_quads = static_cast<double>(mixed) / (0.25 * pixels);
  statistics.terminated = static_cast<double>(terminated) / pixels;
  return statistics;
}

}  // namespace vrpipe::testing
