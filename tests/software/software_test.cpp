#include <vrpipe/platforms/software.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/binning.h>
#include <vrpipe/pipeline/slots/preparation.h>
#include <vrpipe/pipeline/slots/render.h>
#include <vrpipe/platforms/accelerator.h>
#include <vrpipe/platforms/observers.h>

#include "preparation/preparation.h"
#include "software/software_statistic.h"
#include "support/refusals.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::software_statistic;

RunRequest request_at(Fidelity fidelity, std::vector<Setting> settings = {}, std::vector<UnitChoice> units = {}) {
  RunRequest request;
  request.platform = &platform_named("gh100-gpc");
  request.variant = variant_named("baseline");
  request.fidelity = fidelity;
  request.settings = std::move(settings);
  request.units = std::move(units);
  return request;
}

SoftwareResult render(const RunRequest& request, const Draw& draw, std::optional<std::uint64_t> gaussians = {}) {
  return simulate_software(request, *Frame::of(draw), gaussians);
}

std::string refused(const RunRequest& request, const Frame& frame) {
  return testing::refusal_of([&] { simulate_software(request, frame, {}); });
}
std::string refused(const RunRequest& request) { return refused(request, *Frame::of(testing::draw_of(16, 16))); }

TEST(Software, GivesTheSameCountsAndImageAtEveryFidelity) {
  const Draw draw = testing::random_draw(100, 60, 300, 2);
  const SoftwareResult functional = render(request_at(Fidelity::functional), draw);
  EXPECT_FALSE(functional.cycles.has_value());
  for (const Fidelity fidelity : {Fidelity::bound, Fidelity::lt, Fidelity::cycle}) {
    const SoftwareResult timed = render(request_at(fidelity), draw);
    EXPECT_TRUE(testing::same_image(functional.framebuffer.color, timed.framebuffer.color));
    ASSERT_EQ(timed.statistics.size(), functional.statistics.size());
    for (std::size_t i = 0; i < timed.statistics.size(); ++i) {
      EXPECT_EQ(timed.statistics[i].value, functional.statistics[i].value) << timed.statistics[i].name;
    }
  }
}

TEST(Software, IsNeverUnderItsBound) {
  const Draw draw = testing::random_draw(200, 120, 900, 4);
  const SoftwareResult bound = render(request_at(Fidelity::bound), draw, 2000);
  const SoftwareResult lt = render(request_at(Fidelity::lt), draw, 2000);
  EXPECT_GE(*lt.cycles, *bound.cycles);
  EXPECT_GT(*lt.render.cycles, *bound.render.cycles);
  for (std::size_t i = 0; i < lt.binning.size(); ++i) EXPECT_EQ(*lt.binning[i].cycles, *bound.binning[i].cycles);
}

TEST(Software, TheFluidIsNearTheClock) {
  const Draw draw = testing::random_draw(400, 300, 2000, 4);
  const double cycle = static_cast<double>(*render(request_at(Fidelity::cycle), draw).render.cycles);
  EXPECT_NEAR(static_cast<double>(*render(request_at(Fidelity::lt), draw).render.cycles), cycle, 0.03 * cycle);
}

TEST(Software, CyclesAreThoseOfItsKernelsOneAfterTheOther) {
  const SoftwareResult result = render(request_at(Fidelity::lt), testing::random_draw(100, 60, 300, 2), 500);
  ASSERT_TRUE(result.preprocess.has_value());
  std::uint64_t sum = *result.preprocess->cycles + *result.render.cycles;
  for (const KernelReport& kernel : result.binning) sum += *kernel.cycles;
  EXPECT_EQ(*result.cycles, sum);
}

TEST(Software, OfADrawListNothingIsPreprocessed) {
  EXPECT_FALSE(render(request_at(Fidelity::lt), testing::draw_of(16, 16)).preprocess.has_value());
  EXPECT_FALSE(prepare_for_hardware(request_at(Fidelity::lt), *Frame::of(testing::draw_of(16, 16)), {}).preprocess);
}

TEST(Software, KernelsShareTheArrayAndLaunchWhateverItIs) {
  const Frame frame(16, 16);
  const std::uint64_t gaussians = 1'000'000;
  const std::vector<Setting> price{{"preparation", "record_cycles", "12"}, {"preparation", "launch_microseconds", "3"}};
  const auto on = [&](const char* cores) {
    std::vector<Setting> settings = price;
    settings.push_back({"sm", "cores", cores});
    return *prepare_for_hardware(request_at(Fidelity::lt, settings), frame, gaussians).preprocess->cycles;
  };
  EXPECT_EQ(on("4"), 12 * gaussians / 4 + 3 * 1980);
  EXPECT_EQ(on("8"), 12 * gaussians / 8 + 3 * 1980);
}

TEST(Software, CoresAreActiveButForLaunching) {
  const RunRequest request = request_at(Fidelity::lt, {{"preparation", "launch_microseconds", "1"},
                                                       {"preparation", "record_cycles", "12"},
                                                       {"preparation", "visible_instructions", "640"},
                                                       {"preparation", "culled_instructions", "64"}});
  const KernelReport kernel = *prepare_for_hardware(request, Frame(16, 16), 1000).preprocess;
  EXPECT_EQ(kernel.core_cycles, 12 * 1000);
  EXPECT_EQ(*kernel.cycles, 12 * 1000 / 4 + 1980U);
  EXPECT_EQ(kernel.warp_instructions, 64 * 1000 / 32) << "none is visible";
  EXPECT_EQ(kernel.lane_instructions, 64 * 1000);
}

TEST(Software, ACoreOfHalfTheLanesIsHalfAnSm) {
  RunRequest request = request_at(Fidelity::lt, {{"preparation", "launch_microseconds", "0"},
                                                 {"preparation", "record_cycles", "12"},
                                                 {"preparation", "visible_bytes", "0"},
                                                 {"preparation", "culled_bytes", "0"}});
  request.platform = &platform_named("agx-orin");
  // 16 cores of 64 lanes.
  EXPECT_EQ(*prepare_for_hardware(request, Frame(16, 16), 800'000).preprocess->cycles, 12U * 800'000 / 8);
}

TEST(Software, MemoryBindsWhatMovesMoreThanItsBandwidth) {
  RunRequest request = request_at(Fidelity::bound, {{"preparation", "launch_microseconds", "0"},
                                                    {"preparation", "culled_bytes", "65536"}});
  request.platform = &platform_named("agx-orin");
  const KernelReport kernel = *prepare_for_hardware(request, Frame(16, 16), 10'000).preprocess;
  EXPECT_EQ(kernel.bound_by, "memory");
  // 16 channels of 32 bits at 1600 million transfers a second, less what refreshing them takes; 612 million cycles.
  const double without_refresh = 65536e4 / (16 * 4 * 1600e6 / 612e6);
  EXPECT_GT(static_cast<double>(*kernel.cycles), without_refresh);
  EXPECT_LT(static_cast<double>(*kernel.cycles), 1.05 * without_refresh);
}

/// A kernel of one's own, after the shipped ones: it draws whatever comes first, a warp instruction a tile.
class FrontMost : public RenderBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer instructions{*this, "instructions", 1, 1, 1000, "instructions", "this test", "of each warp"};
  };
  FrontMost(const Parameters& parameters, const RenderContext& context)
      : context_(context), instructions_(parameters.instructions) {}
  void use_surfaces(Framebuffer& framebuffer) override { color_ = &framebuffer.color; }
  void render(std::size_t tile, const std::uint32_t* splats, std::uint32_t length, BlockWork& out) override {
    out.warps = 1;
    out.instructions.clear();
    if (length == 0) return;
    out.instructions.push_back(std::uint64_t{1000} * instructions_);
    const Splat& splat = context_.draw(0).splat(splats[0]);
    for (unsigned position = 0; position < positions_per_tile; ++position) {
      color_->quad(color_->grid().tile(tile), position) = testing::color_of(splat.red, splat.green, splat.blue, 1);
    }
    ++warp_iterations;
    lanes_blending += 32;
  }
  TimingParameters timing() const override { return {1, 1000, 1, 0}; }
  std::uint64_t bytes() const override { return 0; }

 private:
  const RenderContext& context_;
  const std::uint64_t instructions_;
  ColorSurface* color_ = nullptr;
};

/// Breaks a rule: its lists name a splat that is not there.
class WrongLists : public BinningBehaviour {
 public:
  struct Parameters : ParameterSet {};
  WrongLists(const Parameters&, const RenderContext& context)
      : tiles_(ScreenTiling(context.frame->width(), context.frame->height()).tiles()) {}
  TileLists make_lists() override {
    TileLists lists;
    lists.begin.assign(tiles_ + 1, 1);
    lists.begin.front() = 0;
    lists.splats = {77};
    return lists;
  }
  std::vector<KernelWork> kernels() const override { return {}; }

 private:
  std::size_t tiles_;
};

/// And one whose time is no number.
class Timeless : public PreparationBehaviour {
 public:
  struct Parameters : ParameterSet {};
  Timeless(const Parameters&, const RenderContext&) {}
  KernelWork project(Path, std::uint64_t gaussians, std::uint64_t) const override {
    return {"preprocess", gaussians, std::numeric_limits<double>::quiet_NaN(), 0, 0};
  }
  KernelWork sort_by_depth(std::uint64_t splats) const override { return {"depth sort", splats}; }
};

const Registrar<Timeless, PreparationBehaviour> timeless("preparation", "timeless", "takes a time that is no number");
const Registrar<FrontMost, RenderBehaviour> front_most("render", "front-most", "draws the first splat of each tile");
const Registrar<WrongLists, BinningBehaviour> wrong_lists("binning", "wrong-lists", "names splats that are not there");

TEST(Software, AKernelOfOnesOwnTakesThePlaceOfTheShippedOne) {
  const Draw draw =
      testing::draw_of(32, 16,
                       {testing::round_splat(8, 8, 2, 0.9F, 1, 0, 0), testing::round_splat(16, 8, 6, 0.9F, 0, 1, 0)});
  const RunRequest request =
      request_at(Fidelity::lt, {{"render", "instructions", "500"}, {"sm", "cores", "1"}}, {{"render", "front-most"}});
  const SoftwareResult result = render(request, draw);
  EXPECT_EQ(*result.render.cycles, 1000U) << "one block at a time, an instruction a cycle";
  EXPECT_EQ(result.framebuffer.color.pixel(0, 0)[0], 1.0F);
  EXPECT_EQ(result.framebuffer.color.pixel(20, 0)[1], 1.0F);
  EXPECT_EQ(software_statistic(result, "render.lanes_blending"), 64U);
  EXPECT_NE(std::find(result.implementations.begin(), result.implementations.end(),
                      std::pair<std::string, std::string>{"render", "front-most"}),
            result.implementations.end());
}

TEST(Software, AUnitThatBreaksARuleIsNamed) {
  try {
    render(request_at(Fidelity::functional, {}, {{"binning", "wrong-lists"}}), testing::draw_of(16, 16));
    FAIL() << "nothing thrown";
  } catch (const SimulationFault& fault) {
    EXPECT_NE(std::string(fault.what()).find("binning=wrong-lists"), std::string::npos) << fault.what();
    EXPECT_NE(std::string(fault.what()).find("splat 77 of 0"), std::string::npos) << fault.what();
  }
}

TEST(Software, AKernelOfATimeThatCannotBeIsAFault) {
  EXPECT_THROW(render(request_at(Fidelity::lt, {}, {{"preparation", "timeless"}}), testing::draw_of(16, 16), 5),
               SimulationFault);
}

TEST(Software, RefusesWhatItDoesNotKnow) {
  EXPECT_NE(refused(request_at(Fidelity::lt, {{"render", "issue_rat", "1"}})).find("issue_rate"), std::string::npos);
  EXPECT_NE(refused(request_at(Fidelity::lt, {}, {{"render", "publishd"}})).find("published"), std::string::npos);
  EXPECT_NE(refused(request_at(Fidelity::lt, {{"binning", "lists", "circle"}})).find("ellipse"), std::string::npos);
  Frame two(16, 16);
  for (int i = 0; i < 2; ++i) two.draw(testing::geometry_of(16, 16), {});
  EXPECT_NE(refused(request_at(Fidelity::lt), two).find("one draw"), std::string::npos);
}

TEST(Software, IsNoneOfThePipelinesUnits) {
  RunRequest request = request_at(Fidelity::functional, {{"render", "issue_rate", "1"}});
  EXPECT_THROW(check_configuration(request), UserError);
  EXPECT_NO_THROW(check_configuration(of_pipeline_alone(request)));
  EXPECT_NO_THROW(check_software(request));
}

RunRequest variant_at(const char* variant, Fidelity fidelity, std::vector<UnitChoice> units = {}) {
  RunRequest request = request_at(fidelity, {}, std::move(units));
  request.variant = variant_named(variant);
  return request;
}

TEST(SoftwareVariant, IsWhatStandsInThePlaceOfTheDraw) {
  const Draw draw = testing::random_draw(100, 60, 300, 2);
  const RunResult run = simulate(variant_at("software", Fidelity::lt), draw);
  const SoftwareResult result = render(request_at(Fidelity::lt), draw);
  EXPECT_EQ(run.cycles, result.cycles);
  EXPECT_EQ(run.result_hash, result.result_hash);
  EXPECT_DOUBLE_EQ(run.milliseconds, static_cast<double>(*run.cycles) / (1980 * 1e3));
  EXPECT_EQ(run.kernels.size(), result.binning.size() + 1);
  EXPECT_TRUE(run.effects.empty());
  std::uint64_t busy = 0;
  for (const UnitReport& unit : run.units) {
    std::uint64_t sum = 0;
    for (const std::uint64_t cycles : unit.cycles) sum += cycles;
    EXPECT_EQ(sum, *run.cycles) << unit.name;
    busy += unit.cycles[static_cast<unsigned>(UnitState::busy)];
  }
  EXPECT_EQ(busy, *run.cycles) << "one after the other";
  ASSERT_TRUE(run.bottleneck.has_value());
  EXPECT_GT(testing::utilization(run, "sm"), 0);
  EXPECT_LE(testing::utilization(run, "sm"), 1);
}

TEST(SoftwareVariant, CountsFragmentsOfTheFrameAlone) {
  const Draw draw = testing::random_draw(100, 60, 300, 2);  // beside it are lanes of tiles, and none of its pixels
  const Counts counts = simulate(variant_at("software", Fidelity::functional, {{"render", "endless"}}), draw).counts;
  const SoftwareResult lanes = render(request_at(Fidelity::functional, {}, {{"render", "endless"}}), draw);
  EXPECT_GT(software_statistic(lanes, "render.lanes_dead"), 0U);
  EXPECT_EQ(counts.fragments_terminated, 0U);
  EXPECT_EQ(counts.fragments_shaded, counts.fragments_rasterized);
  EXPECT_EQ(counts.fragments_blended, software_statistic(lanes, "render.lanes_blending"));
  EXPECT_EQ(counts.quads_rasterized, 0U);
}

TEST(SoftwareVariant, AKernelThatSaysNothingOfFragmentsHasNone) {
  const RunResult run =
      simulate(variant_at("software", Fidelity::lt, {{"render", "front-most"}}), testing::random_draw(50, 40, 30, 2));
  EXPECT_EQ(run.counts.fragments_rasterized, 0U);
  EXPECT_GT(*run.cycles, 0U);
}

TEST(SoftwareVariant, RefusesWhatIsOfThePipelineAlone) {
  const Draw draw = testing::draw_of(16, 16);
  const auto refusal = [&](const RunRequest& request) { return testing::refusal_of([&] { simulate(request, draw); }); };
  RunRequest stopped = variant_at("software", Fidelity::cycle);
  stopped.stop_at = 10;
  EXPECT_NE(refusal(stopped).find("stop"), std::string::npos);
  RunRequest stalled = variant_at("software", Fidelity::cycle);
  stalled.stall_seed = 1;
  EXPECT_NE(refusal(stalled).find("ports"), std::string::npos);
  RunRequest observed = variant_at("software", Fidelity::cycle);
  observed.observers = std::make_shared<Observers>();
  observed.observers->on_states([](const std::string&, UnitState, Cycle) {});
  EXPECT_NE(refusal(observed).find("observed"), std::string::npos);
  EXPECT_THROW(check_configuration(observed), UserError);
  EXPECT_NE(refusal(variant_at("accelerator", Fidelity::cycle)).find("take lt"), std::string::npos);
  Frame tested(16, 16);
  DrawState state;
  state.depth.test = true;
  tested.draw(testing::geometry_of(16, 16), state);
  EXPECT_THROW(simulate(variant_at("software", Fidelity::lt), tested), UserError);
}

TEST(AcceleratorVariant, IsInWholeCyclesOfThePlatform) {
  const Draw draw = testing::random_draw(100, 60, 300, 2);
  const RunRequest request = variant_at("accelerator", Fidelity::lt);
  const AcceleratorResult own = simulate_accelerator(request, *Frame::of(draw), {});
  const RunResult run = simulate(request, draw);
  const std::uint64_t scaled = *own.cycles * 1980;
  EXPECT_EQ(*run.cycles, (scaled + own.frequency_mhz - 1) / own.frequency_mhz);
  EXPECT_EQ(finest_fidelity(request.variant), Fidelity::lt);
  EXPECT_EQ(run.counts.fragments_blended, own.counts.fragments_blended);
}

// The paper: HET+QM draws 2.07 times as fast, and frames are 1.60 times as fast; under 25 frames a second in OpenGL.
TEST(PapersPreparation, TakesWhatTheDrawLeavesOfThePapersFrames) {
  const double draw_share = (1 - 1 / 1.60) / (1 - 1 / 2.07);
  constexpr double sms = 8, cycles_per_ms = 612e3, frame_ms = 40, gaussians = 1.665e6, in_view = 0.9e6;
  RenderContext context;
  context.frame = std::make_shared<Frame>(1, 1);
  const PapersPreparation preparation(PapersPreparation::Parameters(), context);
  const KernelWork projected =
      preparation.project(PreparationBehaviour::Path::hardware, static_cast<std::uint64_t>(gaussians),
                          static_cast<std::uint64_t>(in_view));
  const KernelWork sorted = preparation.sort_by_depth(static_cast<std::uint64_t>(in_view));
  const double ms = (projected.sm_cycles + sorted.sm_cycles) / (sms * cycles_per_ms) +
                    (projected.launch_microseconds + sorted.launch_microseconds) / 1000;
  EXPECT_NEAR(ms / frame_ms, 1 - draw_share, 0.002);
}

}  // namespace
}  // namespace vrpipe
