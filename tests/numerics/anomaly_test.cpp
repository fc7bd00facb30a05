// The statistics that show a user that numbers went wrong.
#include "numerics_test_support.h"

namespace vrpipe {
namespace {

using namespace testing;

Draw stack(unsigned count, float alpha, float color = 1) {
  // One pixel, and a triangle in place of the box, so that alpha is the same everywhere.
  return draw_of(1, 1, std::vector<Splat>(count, flat_box(-4, -4, 4, 4, alpha, color, color, color)));
}

TEST(Anomalies, APixelIsStuckOnceWhatRoundingLostWouldHavePassedTheThreshold) {
  // alpha 1/255 in binary16 freezes at 0x3B81 = 0.938 after 676; 0.996 then takes (1 - 1/255)^k <= 0.004 / 0.062.
  const auto until = static_cast<unsigned>(std::ceil(std::log(0.004 / (1 - 0.937988)) / std::log(1 - 1.0 / 255)));
  const RunResult before = simulate(untimed(), stack(676 + until - 2, one_255th));
  EXPECT_EQ(statistic(before, "crop.pixels_stuck"), 0U);
  EXPECT_NEAR(static_cast<double>(statistic(before, "crop.fragments_lost_to_rounding")), until - 2, 1);
  const RunResult after = simulate(untimed(), stack(676 + until + 2, one_255th));
  EXPECT_EQ(statistic(after, "crop.pixels_stuck"), 1U);
  const RunResult long_after = simulate(untimed(), stack(5000, one_255th));
  EXPECT_EQ(statistic(long_after, "crop.pixels_stuck"), 1U);
  EXPECT_EQ(long_after.counts.termination_updates, 0U);
}

TEST(Anomalies, NothingIsStuckInSinglePrecision) {
  const RunResult result = simulate(untimed("het", ColorFormat::rgba32f), stack(2000, one_255th));
  EXPECT_EQ(statistic(result, "crop.pixels_stuck"), 0U);
  EXPECT_EQ(statistic(result, "crop.fragments_lost_to_rounding"), 0U);
  EXPECT_EQ(result.counts.termination_updates, 1U);
}

TEST(Anomalies, ADifferentColourFormatLosesFromItsOwnLimitOn) {
  EXPECT_EQ(statistic(simulate(untimed("het", ColorFormat::rgba8), stack(300, 0.25F)), "crop.pixels_stuck"), 0U);
  EXPECT_EQ(statistic(simulate(untimed("het", ColorFormat::rgba8), stack(300, 0.24F)), "crop.pixels_stuck"), 1U);
  // F2: merging pairs halves the limit.
  EXPECT_EQ(statistic(simulate(untimed("het+qm", ColorFormat::rgba8), stack(300, 0.24F)), "crop.pixels_stuck"), 0U);
}

TEST(Anomalies, WhatIsNotFiniteIsDroppedWholeWhicheverFieldItIs) {
  const Splat good = round_splat(8, 8, 3, 0.5F);
  const RunResult plain = simulate(untimed(), draw_of(16, 16, {good}));
  for (unsigned field = 0; field < 12; ++field) {
    if (field == 7) continue;  // reserved
    for (const float value : {not_a_number, infinity, -infinity}) {
      Splat bad = good;
      std::memcpy(reinterpret_cast<char*>(&bad) + 4 * field, &value, sizeof value);
      const RunResult result = simulate(untimed(), draw_of(16, 16, {bad, good}));
      EXPECT_EQ(statistic(result, "vpo.dropped_not_finite"), 1U) << field;
      EXPECT_TRUE(same_bits(plain.framebuffer.color, result.framebuffer.color)) << field;
    }
  }
}

TEST(Anomalies, TheWidestEdgeFunctionIsReportedInBits) {
  const auto widest = [](float half_extent, const char* bits) {
    return statistic(simulate(untimed("baseline", ColorFormat::rgba16f, {{"state", "subpixel_bits", bits}}),
                              draw_of(64, 64,
                                      {flat_box(32 - half_extent, 32 - half_extent, 32 + half_extent, 32 + half_extent,
                                                0.5F)})),
                     "raster.widest_edge");
  };
  EXPECT_LE(widest(4, "8"), 32U);
  EXPECT_GT(widest(128, "8"), 32U);
  EXPECT_GT(widest(30000, "8"), widest(1000, "8"));
  EXPECT_LE(widest(1e6F, "12"), 63U);
}

TEST(Anomalies, TheSmallestDeterminantIsThatOfTheThinnestSplat) {
  const RunResult result =
      simulate(untimed(), draw_of(64, 64, {round_splat(8, 8, 3, 0.5F), splat_at(30, 30, 10, 0.02F, 0.4F, 0.9F)}));
  EXPECT_NEAR(static_cast<double>(statistic(result, "vpo.smallest_determinant")), 0.2e6, 2);
  Splat line = round_splat(30, 30, 3, 0.5F);
  line.bx = line.by = 0;
  EXPECT_EQ(statistic(simulate(untimed(), draw_of(64, 64, {line})), "vpo.smallest_determinant"), 0U);
  // Without splats there is no smallest one.
  for (const StatisticReport& report : simulate(untimed(), draw_of(16, 16)).statistics) {
    EXPECT_NE(report.name, "vpo.smallest_determinant");
  }
}

TEST(Anomalies, ExtremesOfSeveralGpcsAreTheLargestOfThem) {
  RunRequest request = untimed();
  const RunResult one = simulate(request, random_draw(128, 128, 50, 3));
  request.platform = &platform_named("desktop");
  const RunResult several = simulate(request, random_draw(128, 128, 50, 3));
  EXPECT_EQ(statistic(one, "raster.widest_edge"), statistic(several, "raster.widest_edge"));
  EXPECT_EQ(statistic(one, "vpo.smallest_determinant"), statistic(several, "vpo.smallest_determinant"));
}

}  // namespace
}  // namespace vrpipe
