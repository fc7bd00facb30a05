// How far lt may be off away from the defaults.
#include <optional>
#include <utility>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/stress.h>
#include <vrpipe/platforms/validated_range.h>
#include <vrpipe/workloads/scene.h>

#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

class Stress : public ::testing::TestWithParam<std::size_t> {};

TEST_P(Stress, BoundIsBelowAndLtWithinFourPercent) {
  const StressConfiguration& configuration = stress_configurations()[GetParam()];
  const Draw draw = random_draw(160, 120, 2000, 6);
  for (const Variant& variant : variants()) {
    const auto result_at = [&](Fidelity fidelity) {
      return run(stressed(request_of(variant.name, fidelity), configuration), draw);
    };
    const auto cycles = static_cast<double>(*result_at(Fidelity::cycle).cycles);
    EXPECT_LE(static_cast<double>(*result_at(Fidelity::bound).cycles), cycles) << variant.name;
    const RunResult result = result_at(Fidelity::lt);
    if (!result.outside_validated_range.empty()) continue;
    EXPECT_NEAR(static_cast<double>(*result.cycles) / cycles, 1, 0.04) << variant.name;
  }
}

std::string name_of_case(const ::testing::TestParamInfo<std::size_t>& info) {
  std::string name;
  for (const char c : stress_configurations()[info.param].name) name += std::isalnum(c) != 0 ? c : '_';
  return name;
}
INSTANTIATE_TEST_SUITE_P(Configurations, Stress, ::testing::Range(std::size_t{0}, stress_configurations().size()),
                         name_of_case);

TEST(StressedRequest, HasTheChangeBehindItsOwnSettingsOnAnyPlatform) {
  for (const Platform& platform : platforms()) {
    RunRequest request = request_of("het+qm");
    request.platform = &platform;
    request.settings = {{"crop", "mshrs", "100"}};
    for (const StressConfiguration& configuration : stress_configurations()) {
      const RunRequest changed = stressed(request, configuration);
      EXPECT_EQ(changed.platform, &platform);
      EXPECT_EQ(changed.settings.front().value, "100");
      EXPECT_EQ(changed.settings.size() > 1, &configuration != &stress_configurations().front()) << configuration.name;
    }
  }
}

TEST(StressedRequest, LinksAreAsShortAsSaidOrShorter) {
  RunRequest request = request_of("het+qm");
  request.settings = {{"link.crop.terminations", "depth", "1"}};
  std::size_t changes = 0;
  for (const Setting& setting : stressed(request, {"", {}, 2}).settings) {
    const bool is_short = setting.unit.find("crop.terminations") != std::string::npos;
    EXPECT_EQ(setting.value, is_short ? "1" : "2") << setting.unit;
    ++changes;
  }
  EXPECT_GT(changes, 10U);
}

TEST(StressedRequest, WhatCannotBeIsRefused) {
  RunRequest request = request_of("baseline");
  EXPECT_THROW(stressed(request, {"", {{"crop", "mshr", "1"}}, {}}), UserError);
  EXPECT_THROW(stressed(request, {"", {{"dram", "channels", "1"}}, {}}), UserError) << "there is none";
  request.settings = {{"crop", "ways", "64"}};
  EXPECT_THROW(stressed(request, {"", {{"crop", "cache_bytes", "1024"}}, {}}), UserError) << "fewer lines than ways";
}

TEST(ValidatedRange, NamesTheParameterThatLiesOutside) {
  EXPECT_EQ(outside_validated_range({{"sm.cores", "4"}, {"l2.header_bytes", "64"}}), std::vector<std::string>{});
  EXPECT_EQ(outside_validated_range({{"sm.cores", "1"}, {"l2.header_bytes", "65"}}),
            (std::vector<std::string>{"sm.cores=1 is below 4, the least that was validated",
                                      "l2.header_bytes=65 is above 64, the most that was validated"}));
}

TEST(ValidatedRange, IsAskedWhereTimeIsApproximate) {
  const Draw draw = random_draw(32, 32, 20, 1);
  for (const Fidelity fidelity : fidelities()) {
    RunRequest request = request_of("het+qm", fidelity);
    EXPECT_TRUE(run(request, draw).outside_validated_range.empty()) << name_of(fidelity);
    request.settings = {{"sm", "cores", "1"}};
    EXPECT_EQ(run(request, draw).outside_validated_range.empty(), fidelity != Fidelity::lt) << name_of(fidelity);
  }
}

TEST(ExpectedError, IsNoneWhereCyclesAreExactAndUnknownWhereNothingIsKnown) {
  const Draw draw = random_draw(32, 32, 20, 1);
  const auto expected = [&](Fidelity fidelity, std::vector<Setting> settings = {}) {
    return run(request_of("het+qm", fidelity, [&](RunRequest& r) { r.settings = std::move(settings); }), draw)
        .expected_error_percent;
  };
  EXPECT_EQ(expected(Fidelity::cycle), 0);
  EXPECT_EQ(expected(Fidelity::functional), std::nullopt);
  EXPECT_EQ(expected(Fidelity::bound), std::nullopt);
  EXPECT_EQ(expected(Fidelity::lt, {{"sm", "cores", "1"}}), std::nullopt) << "outside of what was validated";
}

RunResult at_lt_on(const char* platform, std::vector<Setting> settings) {
  return run(on(platform,
                request_of("baseline", Fidelity::lt, [&](RunRequest& r) { r.settings = std::move(settings); })),
             random_draw(160, 120, 2000, 6));
}

/// What the busiest resource does takes as long at any fidelity.
TEST(ExpectedError, IsSmallWhereTheBottleneckNeverRests) {
  const auto with_latency = [](const char* cycles) {
    return at_lt_on("agx-orin-ideal-memory",
                    {{"sm", "fragment_latency_cycles", cycles}, {"sm", "warps_per_core", "8"}});
  };
  const RunResult busy = with_latency("1");
  const RunResult waiting = with_latency("1000");
  ASSERT_GT(busy.bottleneck->occupancy, 0.95);
  ASSERT_LT(waiting.bottleneck->occupancy, 0.5);
  EXPECT_LT(*busy.expected_error_percent, 1);
  EXPECT_GT(*waiting.expected_error_percent, 1.5);
}

/// lt answers a read of memory before it knows of those that are asked for later and come first.
TEST(ExpectedError, IsLargeWhereRequestsWaitForOneAnotherInMemory) {
  EXPECT_LT(*at_lt_on("agx-orin", {}).expected_error_percent, 3);
  EXPECT_EQ(at_lt_on("agx-orin", {{"dram", "channels", "1"}, {"dram", "tccd_l_ps", "100000"}}).expected_error_percent,
            10)
      << "for long";
  const RunResult slow = at_lt_on("agx-orin", {{"l2", "frequency_mhz", "1"}});
  EXPECT_EQ(slow.bottleneck->unit, "l2");
  EXPECT_EQ(slow.expected_error_percent, 10);
}

/// At a port of 128 bytes a cycle.
TEST(ExpectedError, IsLargeWhereNoUnitHidesThatRequestsWait) {
  std::vector<Setting> settings{{"sm", "cores", "4"},
                                {"draw", "warps_per_1024_cycles", "1000"},
                                {"sm", "vertex_warps", "100"}};
  const RunResult hidden = at_lt_on("agx-orin", settings);
  EXPECT_GT(hidden.bottleneck->occupancy, 0.95);
  EXPECT_LT(*hidden.expected_error_percent, 3);
  settings.push_back({"sm", "warps_per_core", "16"});
  const RunResult seen = at_lt_on("agx-orin", settings);
  EXPECT_LT(seen.bottleneck->occupancy, 0.92);
  EXPECT_GT(*seen.expected_error_percent, 3);
}

TEST(ExpectedError, IsSmallWhereMemoryHasNoBanks) {
  const RunResult slow = at_lt_on("agx-orin-ideal-memory", {{"l2", "frequency_mhz", "1"}});
  EXPECT_EQ(slow.bottleneck->unit, "l2");
  EXPECT_LT(*slow.expected_error_percent, 3);
}

void expect_lt_is_near(RunRequest request, const Draw& draw, double tolerance) {
  const auto cycles = static_cast<double>(*run(request, draw).cycles);
  request.fidelity = Fidelity::lt;
  EXPECT_NEAR(static_cast<double>(*run(request, draw).cycles) / cycles, 1, tolerance);
}

/// A unit's slots are full, and the next core has none either: all warps of a tile to one core.
TEST(Stress, FewTilesOnOneCoreWaitForTheSlotsOfThatCore) {
  const Draw draw = random_draw(17, 33, 200, 3);
  for (const char* variant : {"baseline", "qm"}) {
    SCOPED_TRACE(variant);
    expect_lt_is_near(request_of(variant, Fidelity::cycle,
                                 [](RunRequest& r) {
                                   r.platform = &platform_named("desktop");
                                   r.settings = {{"sm", "warps_to_one_core", "256"}};
                                 }),
                      draw, 0.05);
  }
}

/// There are schedulers for warps that come in every cycle, but not for warps that merge as well.
TEST(Stress, WarpsThatMergeForLongWaitForTheirSchedulers) {
  expect_lt_is_near(request_of("qm", Fidelity::cycle,
                               [](RunRequest& r) {
                                 r.format = ColorFormat::rgba8;
                                 r.settings = {{"sm", "merge_instructions", "39"}};
                               }),
                    random_draw(64, 64, 4000, 6), 0.01);
}

/// Few places under way and a long way to memory.
TEST(Stress, AFarMemoryAndBinsOfOneQuadDoNotDelayFills) {
  expect_lt_is_near(request_of("het+qm", Fidelity::cycle,
                               [](RunRequest& r) {
                                 r.settings = {{"l2", "latency_cycles", "20000"},
                                               {"tc", "bin_quads", "1"},
                                               {"state", "termination_threshold", "1e-9"}};
                               }),
                    random_draw(48, 32, 300, 4), 0.05);
}

/// Fewer than CROP blends in a cycle would otherwise signal alone, each after as long a way.
TEST(Stress, SignalsOfACycleGoTogetherOnALongWay) {
  for (const char* platform : {"gh100-gpc", "agx-orin"}) {
    SCOPED_TRACE(platform);
    expect_lt_is_near(on(platform, request_of("het", Fidelity::cycle,
                                              [](RunRequest& r) {
                                                r.format = ColorFormat::rgba8;
                                                r.termination = Termination::strict;
                                                r.settings = {{"link.crop.terminations", "latency_cycles", "2000"}};
                                              })),
                      random_draw(96, 96, 1500, 8), 0.02);
  }
}

TEST(Stress, BeatsThatAreWiderThanPropPassAtItsRate) {
  expect_lt_is_near(request_of("qm", Fidelity::cycle,
                               [](RunRequest& r) {
                                 r.settings = {{"prop", "quads_per_cycle", "6"}, {"tc", "bin_quads", "13"}};
                               }),
                    random_draw(160, 120, 2000, 6), 0.02);
}

TEST(Stress, AFarCropHasPlacesForAllBeatsOfACycle) {
  expect_lt_is_near(
      request_of(
          "baseline", Fidelity::cycle,
          [](RunRequest& r) {
            r.format = ColorFormat::rgba8;
            r.settings = {{"prop", "color_bytes_per_cycle", "128"}, {"link.prop.color", "latency_cycles", "900"}};
          }),
      random_draw(96, 96, 1500, 8), 0.03);
}

/// Half of the addresses are near to L2; second looks ask without registers.
TEST(Stress, FewFillsAtATimeComeBackInAnyOrder) {
  for (const ColorFormat format : {ColorFormat::rgba16f, ColorFormat::rgba32f}) {
    expect_lt_is_near(on("gh100-gpc", request_of("baseline", Fidelity::cycle,
                                                 [&](RunRequest& r) {
                                                   r.format = format;
                                                   r.settings = {{"crop", "mshrs", "48"}};
                                                 })),
                      random_draw(160, 120, 1500, 8), 0.015);
  }
}

TEST(Stress, LooksWaitForThePortOfAColourCacheThatWritesLongLines) {
  SceneRequest scene;
  scene.scene = "builtin:train";
  scene.size = ImageSize{64, 64};
  scene.fovy_degrees = 4;
  expect_lt_is_near(on("agx-orin-ideal-memory", request_of("het", Fidelity::cycle,
                                                           [](RunRequest& r) {
                                                             r.format = ColorFormat::rgba32f;
                                                             r.termination = Termination::strict;
                                                             r.settings = {{"crop", "port_flits_per_cycle", "1"}};
                                                           })),
                    load_scene(scene).draw, 0.015);
}

TEST(Stress, LongVertexShadersWaitForFragmentsAndFragmentsForThem) {
  expect_lt_is_near(on("desktop", request_of("baseline", Fidelity::cycle,
                                             [](RunRequest& r) {
                                               r.settings = {{"sm", "vertex_instructions", "1000"}};
                                             })),
                    random_draw(160, 120, 2000, 6), 0.05);
}

/// Each quad's beside those that are blended when it is looked up, a queue before it.
TEST(Stress, SectorsMoveBesideQuadsOfSeveralCycles) {
  for (const char* columns : {"1", "2"}) {
    SCOPED_TRACE(columns);
    expect_lt_is_near(request_of("baseline", Fidelity::cycle,
                                 [&](RunRequest& r) {
                                   r.format = ColorFormat::rgba32f;
                                   r.settings = {{"crop", "rgba32f_column_cycles", columns}};
                                 }),
                      random_draw(160, 120, 2000, 6), 0.002);
  }
}

/// Of the sectors of a line it reads as many.
TEST(Stress, AnAccessTakesTheRegistersThatAreFree) {
  for (const char* mshrs : {"2", "3", "16"}) {
    SCOPED_TRACE(mshrs);
    expect_lt_is_near(on("gh100-gpc", request_of("het", Fidelity::cycle,
                                                 [&](RunRequest& r) {
                                                   r.format = ColorFormat::rgba8;
                                                   r.settings = {{"zrop", "mshrs", mshrs}};
                                                 })),
                      random_draw(96, 96, 1500, 8), 0.02);
  }
}

}  // namespace
}  // namespace vrpipe
