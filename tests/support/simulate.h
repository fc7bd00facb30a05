#pragma once

#include <cmath>
#include <cstring>
#include <functional>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include <vrpipe/platforms/simulation.h>

#include "support/builders.h"
#include "support/reference_renderer.h"

namespace vrpipe::testing {

/// A request for agx-orin-ideal-memory; `change` makes it what the test is about.
inline RunRequest request_of(const std::string& variant, Fidelity fidelity = Fidelity::cycle,
                             const std::function<void(RunRequest&)>& change = nullptr) {
  RunRequest request;
  request.platform = &platform_named("agx-orin-ideal-memory");
  request.variant = variant_named(variant);
  request.fidelity = fidelity;
  if (change) change(request);
  return request;
}

/// A platform, edited.
inline Platform edited(const std::string& base, std::function<void(Netlist&)> edit) {
  Platform platform = platform_named(base);
  platform.name = "edited";
  platform.wire = [wire = platform.wire, edit = std::move(edit)](Netlist& netlist) {
    wire(netlist);
    edit(netlist);
  };
  return platform;
}

inline RunResult run(const RunRequest& request, const Draw& draw) {
  fresh_simulation();
  return simulate(request, draw);
}

inline RunResult run(const RunRequest& request, const Frame& frame) {
  fresh_simulation();
  return simulate(request, frame);
}

inline void strictly(RunRequest& request) { request.termination = Termination::strict; }

/// Whether two targets hold the same bits in every pixel.
inline bool same_image(const ColorSurface& a, const ColorSurface& b) {
  for (std::uint32_t y = 0; y < a.height(); ++y) {
    for (std::uint32_t x = 0; x < a.width(); ++x) {
      const auto p = a.pixel(x, y);
      const auto q = b.pixel(x, y);
      if (std::memcmp(p.data(), q.data(), sizeof p) != 0) return false;
    }
  }
  return true;
}

inline double percent_above(std::uint64_t value, std::uint64_t reference) {
  return 100 * (static_cast<double>(value) / static_cast<double>(reference) - 1);
}

inline std::uint64_t statistic(const RunResult& result, const std::string& name) {
  for (const StatisticReport& report : result.statistics) {
    if (report.name == name) return report.value;
  }
  ADD_FAILURE() << "no statistic " << name;
  return 0;
}

/// What a draw of a frame counted.
inline std::uint64_t count(const DrawReport& draw, const std::string& name) {
  for (const auto& [each, value] : draw.counts) {
    if (each == name) return value;
  }
  ADD_FAILURE() << "no count " << name;
  return 0;
}

inline double utilization(const RunResult& result, const std::string& unit) {
  for (const auto& [name, share] : result.utilization) {
    if (name == unit) return share;
  }
  ADD_FAILURE() << "no utilization of " << unit;
  return 0;
}

/// Checks every pixel against the double-precision reference: within its running bound, `slack` times the largest
/// colour (what termination may leave out), and what fragments at the very edge of pruning can change.
inline void expect_near_reference(const RunResult& result, const Draw& draw, double slack) {
  ReferenceOptions options;
  options.bound_format = result.request.format;
  const ReferenceImage reference = render_reference(draw, options);
  double largest = 1;
  for (const Splat& splat : draw.splats) {
    largest = std::fmax(largest, static_cast<double>(std::fmax(splat.red, std::fmax(splat.green, splat.blue))));
  }
  const auto most = static_cast<double>(largest_color_of(result.request.format));
  std::size_t wrong = 0;
  std::string first;
  for (std::uint32_t y = 0; y < draw.height; ++y) {
    for (std::uint32_t x = 0; x < draw.width; ++x) {
      const std::size_t index = std::size_t{y} * draw.width + x;
      const auto pixel = result.framebuffer.color.pixel(x, y);
      const PixelBound& rounding = reference.bound[index];
      const auto& exact = reference.rgba[index];
      // The shader's alpha is off by some ulps of u, v and the exponential; 2e-5 of what is blended covers them.
      const double shader = 2e-5 * largest;
      const double edge = reference.near_edge_per_pixel[index] * largest / 255.0;
      for (unsigned channel = 0; channel < 4; ++channel) {
        const double bound =
            (channel == 3 ? rounding.alpha : rounding.color) + slack * (channel == 3 ? 1 : largest) + shader + edge;
        const double want = std::fmin(exact[channel], most);
        const double off = std::fabs(static_cast<double>(pixel[channel]) - want);
        if (off <= bound) continue;
        if (wrong++ == 0) {
          first = "pixel " + std::to_string(x) + "," + std::to_string(y) + " channel " + std::to_string(channel) +
                  ": " + std::to_string(pixel[channel]) + " instead of " + std::to_string(want) + ", off by " +
                  std::to_string(off) + " where " + std::to_string(bound) + " is allowed";
        }
      }
    }
  }
  EXPECT_EQ(wrong, 0U) << first;
}

}  // namespace vrpipe::testing
