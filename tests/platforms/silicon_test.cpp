// The very draw that was measured on a real GPU: counts of its hardware counters, and its image.

#include <cmath>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/half.h>

#include "support/data.h"
#include "support/measured_scenes.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

class MeasuredDraw : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    draw = std::make_unique<Draw>(testing::measured_draw());
    result = std::make_unique<RunResult>(testing::run(request_of(Fidelity::functional), *draw));
  }
  /// On the platform that is after that GPU. The list has the boxes that were drawn there: nothing is added to them.
  static RunRequest request_of(Fidelity fidelity) {
    return testing::request_of("baseline", fidelity, [](RunRequest& request) {
      request.platform = &platform_named("gh100-gpc");
      request.settings = {{"state", "obb_padding", "0"}};
    });
  }
  static const RunResult* lt() {
    static const RunResult timed = testing::run(request_of(Fidelity::lt), *draw);
    return &timed;
  }
  static void TearDownTestSuite() {
    result.reset();
    draw.reset();
  }
  static std::unique_ptr<Draw> draw;
  static std::unique_ptr<RunResult> result;
};
std::unique_ptr<Draw> MeasuredDraw::draw;
std::unique_ptr<RunResult> MeasuredDraw::result;

void expect_within(std::uint64_t got, std::uint64_t measured, double share) {
  EXPECT_NEAR(static_cast<double>(got), static_cast<double>(measured), share * static_cast<double>(measured));
}

TEST_F(MeasuredDraw, LaunchesTheQuadsAndFragmentsOfTheGpu) {
  expect_within(result->counts.quads_shaded, 16'950'276, 0.0002);
  expect_within(result->counts.fragments_shaded, 55'154'535, 0.0002);
}

TEST_F(MeasuredDraw, PrunesAsTheGpu) {
  expect_within(result->counts.quads_blended, 13'421'300, 0.0002);
  expect_within(result->counts.fragments_blended, 43'348'660, 0.0002);
}

TEST_F(MeasuredDraw, LaunchesTheWarpsOfTheGpu) { expect_within(result->counts.warps, 2'397'186, 0.001); }

// docs/silicon.md has all modes; this one is a prediction as well, and not what the platform was made from.
TEST_F(MeasuredDraw, TakesTheCyclesOfTheGpuWithinEightPerCent) {
  const RunResult& timed = *lt();
  expect_within(*timed.cycles, 15'885'000, 0.08);
  EXPECT_EQ(timed.bottleneck->unit, "gpc0.crop") << "91 to 95 % active on the GPU";
}

TEST_F(MeasuredDraw, MovesTheColourSectorsOfTheGpu) {
  // A first draw over a cleared target: 18.28 million sectors, read and written.
  const RunResult& timed = *lt();
  const std::uint64_t bytes = testing::statistic(timed, "crop.cache.bytes_filled") +
                              testing::statistic(timed, "crop.cache.bytes_written_back") +
                              32 * testing::statistic(timed, "crop.cache.sectors_fetched_again");
  expect_within(bytes / 32, 18'280'000, 0.03);
}

TEST_F(MeasuredDraw, HasTheImageOfTheGpuAt50Decibel) {
  const ColorSurface& surface = result->framebuffer.color;
  const std::string bytes = testing::unpacked("measured_image.rgba16f");  // of its rows 0, 2, 4, ...
  std::vector<std::uint16_t> halves(std::size_t{4} * surface.width() * (surface.height() / 2));
  ASSERT_EQ(bytes.size(), halves.size() * sizeof(std::uint16_t));
  std::memcpy(halves.data(), bytes.data(), bytes.size());
  double squares = 0;
  for (std::uint32_t y = 0; y < surface.height(); y += 2) {
    for (std::uint32_t x = 0; x < surface.width(); ++x) {
      for (unsigned channel = 0; channel < 4; ++channel) {
        const auto clamp = [](float value) { return std::fmin(std::fmax(static_cast<double>(value), 0.0), 1.0); };
        const double off = clamp(surface.pixel(x, y)[channel]) -
                           clamp(half_value(halves[4 * (std::size_t{y / 2} * surface.width() + x) + channel]));
        squares += off * off;
      }
    }
  }
  const double psnr = -10 * std::log10(squares / static_cast<double>(halves.size()));
  RecordProperty("psnr_db", std::to_string(psnr));
  EXPECT_GE(psnr, 50);
}

}  // namespace
}  // namespace vrpipe
