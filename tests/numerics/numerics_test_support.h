#pragma once

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/camera.h>
#include <vrpipe/workloads/preprocess.h>

#include "support/builders.h"
#include "support/floating_point.h"
#include "workloads/workload_test_support.h"

namespace vrpipe::testing {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr float one_255th = 1.0F / 255.0F;

/// At the origin, looking along +z, 90 degrees of view over 64x64: focal length 32.
inline Camera plain_camera() { return look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 90, 64, 64); }

inline Draw projected(const std::vector<GaussianAttributes>& gaussians, const Camera& camera = plain_camera(),
                      int degree = 0, SceneSummary* summary = nullptr) {
  SceneSummary ignored;
  PreprocessOptions options;
  options.threads = 1;
  return preprocess(scene_of(gaussians, degree), camera, options, summary != nullptr ? *summary : ignored);
}

inline RunRequest untimed(const char* variant = "baseline", ColorFormat format = ColorFormat::rgba16f,
                          std::vector<Setting> settings = {}) {
  RunRequest request;
  request.platform = &platform_named("agx-orin-ideal-memory");
  request.variant = variant_named(variant);
  request.fidelity = Fidelity::functional;
  request.format = format;
  request.settings = std::move(settings);
  return request;
}

inline std::uint64_t statistic(const RunResult& result, const std::string& name) {
  for (const StatisticReport& report : result.statistics) {
    if (report.name == name) return report.value;
  }
  ADD_FAILURE() << "no statistic " << name;
  return 0;
}

inline bool same_bits(const ColorSurface& a, const ColorSurface& b) {
  if (a.width() != b.width() || a.height() != b.height()) return false;
  for (std::uint32_t y = 0; y < a.height(); ++y) {
    for (std::uint32_t x = 0; x < a.width(); ++x) {
      const std::array<float, 4> p = a.pixel(x, y);
      const std::array<float, 4> q = b.pixel(x, y);
      if (std::memcmp(p.data(), q.data(), sizeof p) != 0) return false;
    }
  }
  return true;
}

}  // namespace vrpipe::testing
