#include <vrpipe/platforms/accelerator.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/accelerator.h>

#include "support/refusals.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

RunRequest accelerator_request(Fidelity fidelity, std::vector<Setting> settings = {}, const char* unit = "gscore") {
  RunRequest request;
  request.platform = &platform_named("agx-orin");
  request.variant = variant_named("baseline");
  request.fidelity = fidelity;
  request.settings = std::move(settings);
  request.units = {{"accelerator", unit}};
  return request;
}

AcceleratorResult drawn(const RunRequest& request, const Draw& draw, std::optional<std::uint64_t> gaussians = {}) {
  return simulate_accelerator(request, *Frame::of(draw), gaussians);
}

std::uint64_t count_in(const std::vector<StatisticReport>& statistics, const std::string& name) {
  for (const StatisticReport& report : statistics) {
    if (report.name == name) return report.value;
  }
  ADD_FAILURE() << "no statistic " << name;
  return 0;
}

std::string refusal(const RunRequest& request, const Frame& frame = *Frame::of(testing::draw_of(16, 16))) {
  return testing::refusal_of([&] { simulate_accelerator(request, frame, {}); });
}

TEST(AcceleratorFrame, HasTheSameCountsAndImageAtEveryFidelity) {
  const Draw draw = testing::random_draw(100, 60, 300, 2);
  for (const char* unit : {"gscore", "gcc", "flicker"}) {
    const AcceleratorResult functional = drawn(accelerator_request(Fidelity::functional, {}, unit), draw, 500);
    EXPECT_FALSE(functional.cycles.has_value());
    EXPECT_FALSE(functional.sort.cycles.has_value());
    EXPECT_TRUE(functional.bound_by.empty());
    const AcceleratorResult bound = drawn(accelerator_request(Fidelity::bound, {}, unit), draw, 500);
    const AcceleratorResult lt = drawn(accelerator_request(Fidelity::lt, {}, unit), draw, 500);
    EXPECT_GE(*lt.cycles, *bound.cycles);
    EXPECT_EQ(lt.name, unit);
    for (const AcceleratorResult* timed : {&bound, &lt}) {
      EXPECT_TRUE(testing::same_image(functional.framebuffer.color, timed->framebuffer.color));
      ASSERT_EQ(timed->statistics.size(), functional.statistics.size());
      for (std::size_t i = 0; i < timed->statistics.size(); ++i)
        EXPECT_EQ(timed->statistics[i].value, functional.statistics[i].value) << timed->statistics[i].name;
      EXPECT_EQ(timed->raster.bytes, functional.raster.bytes);
      EXPECT_GE(*timed->cycles, std::max({*timed->preprocess->cycles, *timed->sort.cycles, *timed->raster.cycles}));
    }
  }
}

TEST(AcceleratorFrame, IsTheImageOfThePublishedRendererBitByBit) {
  const Draw draw = testing::random_draw(150, 90, 500, 6);
  RunRequest request = accelerator_request(Fidelity::functional);
  const AcceleratorResult accelerator = drawn(request, draw);
  const SoftwareResult software = simulate_software(request, *Frame::of(draw), {});
  EXPECT_TRUE(testing::same_image(accelerator.framebuffer.color, software.framebuffer.color));
  EXPECT_EQ(count_in(accelerator.statistics, "accelerator.pairs"), count_in(software.statistics, "binning.pairs"));
  EXPECT_EQ(count_in(accelerator.statistics, "accelerator.fragments_blended"),
            count_in(software.statistics, "render.lanes_blending"));
}

TEST(AcceleratorFrame, MemoryBindsWhereItIsSlow) {
  const Draw draw = testing::random_draw(200, 120, 900, 4);
  const AcceleratorResult fast =
      drawn(accelerator_request(Fidelity::lt, {{"accelerator", "dram_gigabytes_per_second", "10000"}}), draw, 2000);
  const AcceleratorResult slow =
      drawn(accelerator_request(Fidelity::lt, {{"accelerator", "dram_gigabytes_per_second", "1"}}), draw, 2000);
  EXPECT_NE(fast.bound_by.find("units"), std::string::npos) << fast.bound_by;
  EXPECT_EQ(slow.bound_by, "memory");
  EXPECT_GE(*slow.cycles, slow.preprocess->bytes + slow.sort.bytes + slow.raster.bytes);
  EXPECT_GT(*slow.cycles, 10 * *fast.cycles);
}

TEST(AcceleratorFrame, OfADrawListNothingIsPreprocessed) {
  EXPECT_FALSE(drawn(accelerator_request(Fidelity::lt), testing::draw_of(16, 16)).preprocess.has_value());
}

/// Of one's own: two steps of the same cycles in each stage.
class TwoSteps : public AcceleratorBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer bandwidth{*this, "bandwidth", 1000, 0, 1000000, "MB/s", "this test", "of memory"};
    Integer cycles{*this, "cycles", 100, 0, 4000000000, "cycles", "this test", "of a step in a stage, up to a square"};
  };
  TwoSteps(const Parameters& parameters, const RenderContext&)
      : bandwidth_(parameters.bandwidth), cycles_(parameters.cycles) {}
  std::vector<AcceleratorStep> draw(std::optional<std::uint64_t>) override {
    AcceleratorStep step;
    for (AcceleratorStep::Part& part : step.parts) part.cycles = cycles_ > 1000000 ? cycles_ * cycles_ : cycles_;
    return {step, step};
  }
  TimingParameters timing() const override { return {500, bandwidth_, {}, 2, {"a", "b", "c"}}; }

 private:
  std::uint32_t bandwidth_;
  std::uint64_t cycles_;
};
const Registrar<TwoSteps, AcceleratorBehaviour> two_steps("accelerator", "two-steps", "two steps");

TEST(AcceleratorFrame, AUnitOfOnesOwnTakesThePlaceOfTheShippedOne) {
  const AcceleratorResult result = drawn(accelerator_request(Fidelity::lt, {}, "two-steps"), testing::draw_of(16, 16));
  EXPECT_EQ(*result.cycles, 400U);
  EXPECT_EQ(result.frequency_mhz, 500U);
  EXPECT_EQ(result.bound_by, "raster: c");
}

TEST(AcceleratorFrame, AUnitThatBreaksARuleIsNamed) {
  try {
    drawn(accelerator_request(Fidelity::lt, {{"accelerator", "bandwidth", "0"}}, "two-steps"),
          testing::draw_of(16, 16));
    FAIL() << "nothing thrown";
  } catch (const SimulationFault& fault) {
    EXPECT_NE(std::string(fault.what()).find("accelerator=two-steps"), std::string::npos) << fault.what();
  }
}

TEST(AcceleratorFrame, RefusesWhatItDoesNotKnow) {
  EXPECT_NE(refusal(accelerator_request(Fidelity::cycle)).find("bound or lt"), std::string::npos);
  EXPECT_NE(refusal(accelerator_request(Fidelity::lt, {}, "gscor")).find("gscore"), std::string::npos);
  EXPECT_NE(refusal(accelerator_request(Fidelity::lt, {{"accelerator", "volume_unit", "1"}})).find("volume_units"),
            std::string::npos);
  EXPECT_NE(refusal(accelerator_request(Fidelity::lt, {{"accelerator", "masks", "circle"}})).find("ellipse"),
            std::string::npos);
  RunRequest endless = accelerator_request(Fidelity::lt, {{"accelerator", "cycles", "4000000000"}}, "two-steps");
  EXPECT_NE(refusal(endless).find("accelerator=two-steps"), std::string::npos);
  Frame two(16, 16);
  for (int i = 0; i < 2; ++i) two.draw(testing::geometry_of(16, 16), {});
  EXPECT_NE(refusal(accelerator_request(Fidelity::lt), two).find("one draw"), std::string::npos);
}

TEST(AcceleratorFrame, IsNoneOfThePipelinesUnits) {
  const RunRequest request = accelerator_request(Fidelity::functional, {{"accelerator", "volume_units", "8"}});
  EXPECT_THROW(check_configuration(request), UserError);
  EXPECT_NO_THROW(check_configuration(of_pipeline_alone(request)));
  EXPECT_NO_THROW(check_software(request));
}

}  // namespace
}  // namespace vrpipe
