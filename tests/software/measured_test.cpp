// The draw that was rendered on a real GPU by kernels after the published ones, on 4, 8 and 16 of its SMs: counts of
// instrumented kernels, and milliseconds.

#include <vrpipe/platforms/software.h>

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "software/software_statistic.h"
#include "support/measured_scenes.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::software_statistic;

class MeasuredSoftware : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { draw = std::make_unique<Draw>(testing::measured_draw()); }
  static void TearDownTestSuite() { draw.reset(); }

  static SoftwareResult render(const char* lists, const char* kernel, const char* sms = "4",
                               const char* warp_pixels = "16x2") {
    RunRequest request;
    request.platform = &platform_named("gh100-gpc");
    request.variant = variant_named("baseline");
    request.fidelity = Fidelity::lt;
    request.settings = {{"binning", "lists", lists}, {"sm", "cores", sms}, {"render", "warp_pixels", warp_pixels}};
    request.units = {{"render", kernel}};
    return simulate_software(request, *Frame::of(*draw), {});
  }
  static double milliseconds(std::uint64_t cycles) { return static_cast<double>(cycles) / 1980e3; }

  static std::unique_ptr<Draw> draw;
};
std::unique_ptr<Draw> MeasuredSoftware::draw;

void expect_within(double got, double measured, double percent) {
  EXPECT_NEAR(got, measured, percent / 100 * measured) << 100 * (got / measured - 1) << " %";
}

double percent_of_slots(const SoftwareResult& result, const std::string& lanes) {
  return 100 * static_cast<double>(software_statistic(result, "render." + lanes)) /
         (32 * static_cast<double>(software_statistic(result, "render.warp_iterations")));
}

TEST_F(MeasuredSoftware, HasThePairsOfEveryShapeOfLists) {
  expect_within(static_cast<double>(software_statistic(render("three_sigma", "threshold"), "binning.pairs")), 1'470'645,
                0.01);
  expect_within(static_cast<double>(software_statistic(render("box", "threshold"), "binning.pairs")), 858'614, 0.01);
  expect_within(static_cast<double>(software_statistic(render("obb", "threshold"), "binning.pairs")), 820'554, 0.01);
  expect_within(static_cast<double>(software_statistic(render("ellipse", "threshold"), "binning.pairs")), 714'231,
                0.01);
}

struct Lockstep {
  const char* kernel;
  double fragments, iterations, blending, pruned, dead, without_blending;  ///< millions and percent
  double milliseconds;
};
class MeasuredKernels : public MeasuredSoftware, public ::testing::WithParamInterface<Lockstep> {};

TEST_P(MeasuredKernels, WarpsAndLanesDoWhatTheyDoOnTheGpu) {
  const Lockstep& measured = GetParam();
  const SoftwareResult result = render("obb", measured.kernel);
  // Measured numbers have three digits.
  EXPECT_NEAR(static_cast<double>(software_statistic(result, "render.lanes_blending")) / 1e6, measured.fragments,
              0.0501);
  EXPECT_NEAR(static_cast<double>(software_statistic(result, "render.warp_iterations")) / 1e6, measured.iterations,
              0.001 * measured.iterations + 0.016);
  EXPECT_NEAR(percent_of_slots(result, "lanes_blending"), measured.blending, 0.1);
  // Those that stop look at a splat and do not blend: on the GPU they were counted so.
  EXPECT_NEAR(percent_of_slots(result, "lanes_pruned") + percent_of_slots(result, "lanes_stopping"), measured.pruned,
              0.1);
  EXPECT_NEAR(percent_of_slots(result, "lanes_dead"), measured.dead, 0.1);
  EXPECT_NEAR(32 * percent_of_slots(result, "iterations_without_blending"), measured.without_blending, 0.1);
  expect_within(milliseconds(*result.render.cycles), measured.milliseconds, 3);
}
INSTANTIATE_TEST_SUITE_P(Of, MeasuredKernels,
                         ::testing::Values(Lockstep{"endless", 43.3, 210.0 / 32, 20.6, 79.4, 0, 57.2, 9.28},
                                           Lockstep{"published", 25.9, 5.059, 16.0, 68.1, 15.9, 61.6, 8.30},
                                           Lockstep{"threshold", 18.4, 130.0 / 32, 14.2, 65.4, 20.4, 63.0, 6.56}),
                         [](const auto& tested) { return std::string(tested.param.kernel); });

TEST_F(MeasuredSoftware, IssuesTheInstructionsOfTheGpu) {
  const SoftwareResult result = render("obb", "published");
  double all = *result.render.warp_instructions;
  for (const KernelReport& kernel : result.binning) all += *kernel.warp_instructions;
  expect_within(all / 1e6, 269, 1);
}

TEST_F(MeasuredSoftware, TakesTheTimeOfTheGpuOnAsManySms) {
  const SoftwareResult four = render("obb", "published", "4");
  expect_within(milliseconds(*four.cycles), 9.83, 4);
  const SoftwareResult eight = render("obb", "published", "8");
  expect_within(milliseconds(*eight.render.cycles), 4.17, 3);
  expect_within(milliseconds(*eight.cycles), 4.98, 4);
  const SoftwareResult sixteen = render("obb", "published", "16");
  expect_within(milliseconds(*sixteen.render.cycles), 2.12, 3);
  expect_within(milliseconds(*sixteen.cycles), 2.59, 4);
}

TEST_F(MeasuredSoftware, TakesTheTimeOfTheGpuWithOtherLists) {
  expect_within(milliseconds(*render("ellipse", "published").render.cycles), 7.45, 3);
  const SoftwareResult square = render("three_sigma", "published");
  expect_within(milliseconds(*square.render.cycles), 13.49, 3);
  expect_within(milliseconds(*square.cycles), 15.77, 4);
  expect_within(milliseconds(*render("three_sigma", "threshold").render.cycles), 10.66, 3);
  EXPECT_NEAR(percent_of_slots(square, "lanes_blending"), 8.9, 0.1);
}

TEST_F(MeasuredSoftware, TakesTheTimeOfTheGpuWithoutTermination) {
  expect_within(milliseconds(*render("three_sigma", "endless").render.cycles), 15.31, 3);
}

TEST_F(MeasuredSoftware, TakesTheTimeOfTheGpuOnAllItsSms) {
  const SoftwareResult result = render("obb", "published", "132");
  expect_within(milliseconds(*result.render.cycles), 0.46, 4);
  expect_within(milliseconds(*result.cycles), 0.63, 4);
}

TEST_F(MeasuredSoftware, BinningTakesTheTimeOfTheGpu) {
  const std::vector<double> measured{0.170, 0.016, 0.261, 1.022, 0.059};
  const SoftwareResult result = render("obb", "threshold");
  ASSERT_EQ(result.binning.size(), measured.size());
  for (std::size_t i = 0; i < measured.size(); ++i) {
    EXPECT_NEAR(milliseconds(*result.binning[i].cycles), measured[i], 0.001) << result.binning[i].name;
  }
  const HardwarePreparation hardware = prepare_for_hardware(result.request, *Frame::of(*draw), 500'000);
  EXPECT_NEAR(milliseconds(*hardware.sort.cycles), 0.225, 0.001);
  EXPECT_NEAR(milliseconds(*hardware.preprocess->cycles), 0.893, 0.002);
}

}  // namespace
}  // namespace vrpipe
