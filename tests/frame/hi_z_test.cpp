// Hi-Z in whole frames: what it culls nobody misses.
#include <memory>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/platforms/wiring.h>

#include "support/mixed_frames.h"
#include "support/mixed_reference.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::mixed_frame;
using testing::random_frame;
using testing::request_of;
using testing::run;
using testing::statistic;

RunRequest with(RunRequest request, const std::string& name, const std::string& value) {
  request.settings.push_back({"raster", name, value});
  return request;
}

bool same_depth_stencil(const DepthStencilSurface& a, const DepthStencilSurface& b) {
  for (std::size_t place = 0; place < a.grid().quads(); ++place) {
    if (a.quad(place).depth != b.quad(place).depth || a.quad(place).stencil != b.quad(place).stencil) return false;
  }
  return true;
}

class HiZFrame : public ::testing::TestWithParam<std::tuple<Fidelity, std::string, Termination>> {
 protected:
  RunRequest request() const {
    RunRequest request = request_of(std::get<1>(GetParam()), std::get<0>(GetParam()));
    request.termination = std::get<2>(GetParam());
    // The fragment shader's, so that no fragment's fate depends on it.
    request.settings = {{"state", "exponential", "exact"}};
    return request;
  }
};
INSTANTIATE_TEST_SUITE_P(Frame, HiZFrame,
                         ::testing::Combine(::testing::ValuesIn(fidelities()),
                                            ::testing::Values("baseline", "qm", "het", "het+qm"),
                                            ::testing::Values(Termination::paper, Termination::strict)),
                         [](const auto& each) {
                           const std::string& variant = std::get<1>(each.param);
                           return std::string(name_of(std::get<0>(each.param))) + "_" +
                                  (variant == "het+qm" ? std::string("both") : variant) + "_" +
                                  name_of(std::get<2>(each.param));
                         });

// Without merging or termination each pixel is blended as before, to the bit. Which quads share a bin, and so what is merged
// and when a bit is known, depends on what is culled: there the reference has a bound.
TEST_P(HiZFrame, LeavesImageDepthAndStencilAsTheyAre) {
  std::uint64_t culled = 0;
  const bool terminates = request().variant.early_termination;
  static testing::MixedReferences of_mixed, of_random;
  unsigned frames = 0;
  for (std::uint64_t seed = 200; frames < 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    // The order of termination among other state changes is not the reference's.
    const bool is_mixed = terminates || seed % 2 == 0;
    const Frame frame = is_mixed ? mixed_frame(seed, request()) : random_frame(seed, request());
    const testing::MixedReference& reference = (is_mixed ? of_mixed : of_random).of(seed, testing::context_of(frame));
    if (reference.near_prune_edge > 0) continue;
    ++frames;
    const RunResult off = run(with(request(), "hi_z", "off"), frame);
    const RunResult on = run(request(), frame);
    EXPECT_TRUE(same_depth_stencil(off.framebuffer.depth_stencil, on.framebuffer.depth_stencil));
    if (std::get<1>(GetParam()) == "baseline") {
      EXPECT_TRUE(testing::same_image(off.framebuffer.color, on.framebuffer.color));
      EXPECT_EQ(off.counts.fragments_blended, on.counts.fragments_blended);
      EXPECT_EQ(off.counts.quads_blended + off.counts.quads_unshaded,
                on.counts.quads_blended + on.counts.quads_unshaded);
    }
    testing::expect_image(on, reference, terminates ? 1 - 0.996 : 0);
    EXPECT_LE(on.counts.quads_rasterized, off.counts.quads_rasterized);
    EXPECT_EQ(statistic(off, "raster.hi_z_tests"), 0U);
    culled += statistic(on, "raster.hi_z_culled");
  }
  EXPECT_GT(culled, 0U);
}

class HiZPrecision : public HiZFrame {};
INSTANTIATE_TEST_SUITE_P(Frame, HiZPrecision,
                         ::testing::Combine(::testing::ValuesIn(fidelities()), ::testing::Values("baseline"),
                                            ::testing::Values(Termination::paper, Termination::strict)),
                         [](const auto& each) {
                           return std::string(name_of(std::get<0>(each.param))) + "_" +
                                  name_of(std::get<2>(each.param));
                         });

TEST_P(HiZPrecision, LeavesImageDepthAndStencilAsTheyAre) {
  std::uint64_t least = ~0ULL;
  for (const std::uint64_t seed : {200U, 202U, 204U}) {  // a depth format each
    const Frame frame = mixed_frame(seed, request());
    const RunResult off = run(with(request(), "hi_z", "off"), frame);
    std::uint64_t coarser = 0;
    for (unsigned bits = 1; bits <= 24; ++bits) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(bits) + " bits");
      const RunResult on = run(with(request(), "hi_z_bits", std::to_string(bits)), frame);
      EXPECT_TRUE(testing::same_image(off.framebuffer.color, on.framebuffer.color));
      EXPECT_TRUE(same_depth_stencil(off.framebuffer.depth_stencil, on.framebuffer.depth_stencil));
      const std::uint64_t culled = statistic(on, "raster.hi_z_culled");
      // What is known in time does not depend on time.
      if (request().termination == Termination::strict) {
        EXPECT_GE(culled, coarser) << "finer steps lie within coarser ones";
      }
      coarser = culled;
    }
    least = std::min(least, coarser);
  }
  EXPECT_GT(least, 0U);
}

class HiZStrict : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Frame, HiZStrict, ::testing::Values("baseline", "qm", "het", "het+qm"),
                         [](const auto& variant) {
                           return variant.param == "het+qm" ? std::string("both") : variant.param;
                         });

TEST_P(HiZStrict, CountsAreTheSameAtAllFidelitiesAndUnderStalls) {
  std::uint64_t culled = 0;
  for (std::uint64_t seed = 300; seed < 316; ++seed) {
    const Fidelity any = Fidelity::functional;
    const RunRequest first = request_of(GetParam(), any, testing::strictly);
    const Frame frame = seed % 2 == 0 ? mixed_frame(seed, first) : random_frame(seed, first);
    const RunResult expected = run(first, frame);
    culled += statistic(expected, "raster.hi_z_culled");
    for (const Fidelity fidelity : fidelities()) {
      for (const unsigned stalls : {0U, 90U}) {
        RunRequest request = request_of(GetParam(), fidelity, testing::strictly);
        request.stall_seed = seed;
        request.stall_per_256 = fidelity == Fidelity::functional || fidelity == Fidelity::bound ? 0 : stalls;
        const RunResult result = run(request, frame);
        SCOPED_TRACE("seed " + std::to_string(seed) + " at " + name_of(fidelity));
        EXPECT_EQ(result.counts.named(), expected.counts.named());
        for (const char* name : {"raster.hi_z_tests", "raster.hi_z_culled"}) {
          EXPECT_EQ(statistic(result, name), statistic(expected, name)) << name;
        }
        EXPECT_TRUE(testing::same_image(result.framebuffer.color, expected.framebuffer.color));
      }
    }
  }
  EXPECT_GT(culled, 0U);
}

// An opaque wall in front of all splats.
class HiZWall : public HiZFrame {
 protected:
  static constexpr std::uint32_t side = 64;
  static std::shared_ptr<Draw> wall(float depth) {
    auto draw = std::make_shared<Draw>(testing::draw_of(side, side));
    const auto corner = [&](float x, float y) { return MeshVertex{x, y, depth, 1, 0.5F, 0.5F, 0.5F, 0, 0, 1}; };
    draw->mesh.push_back({{corner(-9, -9), corner(-9, 200), corner(200, -9)}});
    return draw;
  }
  static DrawState stored(Compare compare) {
    DrawState state;
    state.shader = FragmentShader::none;
    state.depth = {true, compare, true};
    return state;
  }
  DrawState tested() const {
    DrawState state = draw_state_of(request());
    state.depth = {true, Compare::less, false};
    return state;
  }
  static std::shared_ptr<Draw> splats(float depth) {
    auto draw = std::make_shared<Draw>(testing::random_draw(side, side, 30, 5));
    for (Splat& splat : draw->splats) splat.depth = depth;
    return draw;
  }
  static std::uint64_t rasterized(const RunResult& result, std::size_t draw) {
    for (const auto& [name, count] : result.draws.at(draw).counts) {
      if (name == "quads_rasterized") return count;
    }
    ADD_FAILURE();
    return 0;
  }
};
INSTANTIATE_TEST_SUITE_P(Frame, HiZWall,
                         ::testing::Combine(::testing::ValuesIn(fidelities()), ::testing::Values("baseline", "het+qm"),
                                            ::testing::Values(Termination::strict)),
                         [](const auto& each) {
                           return std::string(name_of(std::get<0>(each.param))) +
                                  (std::get<1>(each.param) == "baseline" ? "_baseline" : "_both");
                         });

TEST_P(HiZWall, SplatsBehindItMakeNoQuads) {
  Frame frame(side, side);
  frame.draw(wall(0.5F), stored(Compare::less));
  frame.draw(splats(0.75F), tested());
  frame.draw(splats(0.25F), tested());
  const RunResult result = run(request(), frame);
  EXPECT_EQ(rasterized(result, 0), side * side / 4);
  EXPECT_EQ(rasterized(result, 1), 0U);
  EXPECT_GT(rasterized(result, 2), 0U);
  EXPECT_EQ(result.counts.quads_depth_stencil_failed, 0U);
  EXPECT_EQ(statistic(result, "raster.hi_z_updates"), side * side / 64);
}

TEST_P(HiZWall, AfterADrawThatMayRaiseDepthNothingIsCulledUntilDepthIsCleared) {
  for (const Compare compare : {Compare::greater, Compare::greater_equal, Compare::not_equal, Compare::always}) {
    Frame frame(side, side);
    frame.draw(wall(0.5F), stored(Compare::less));
    frame.draw(wall(0.9F), stored(compare));
    frame.draw(splats(0.75F), tested());
    Clear clear;
    clear.depth = true;
    frame.clear(clear);
    frame.draw(splats(0.75F), tested());
    frame.draw(wall(0.5F), stored(Compare::less_equal));
    frame.draw(splats(0.75F), tested());
    const RunResult result = run(request(), frame);
    const RunResult off = run(with(request(), "hi_z", "off"), frame);
    const std::uint64_t all = rasterized(off, 2);
    EXPECT_GT(all, 0U);
    EXPECT_EQ(rasterized(result, 2), all);
    EXPECT_EQ(rasterized(result, 3), all);
    EXPECT_EQ(rasterized(result, 5), 0U);
    if (std::get<1>(GetParam()) == "baseline") {
      EXPECT_TRUE(testing::same_image(off.framebuffer.color, result.framebuffer.color));
    }
  }
}

TEST_P(HiZWall, AClearOfDepthCullsWithoutAnyUpdate) {
  Frame frame(side, side);
  Clear clear;
  clear.depth = true;
  clear.depth_value = 0.5F;
  frame.clear(clear);
  frame.draw(splats(0.75F), tested());
  frame.draw(splats(0.25F), tested());
  const RunResult result = run(request(), frame);
  EXPECT_EQ(rasterized(result, 0), 0U);
  EXPECT_GT(rasterized(result, 1), 0U);
  EXPECT_EQ(statistic(result, "raster.hi_z_updates"), 0U);
}

TEST_P(HiZWall, IsSeenByAStencilThatCountsWhatFails) {
  Frame frame(side, side);
  frame.draw(wall(0.5F), stored(Compare::less));
  DrawState state = tested();
  state.stencil.test = true;
  frame.draw(splats(0.75F), state, "leaves no trace");
  state.stencil.front.depth_fail = StencilOperation::increment;
  frame.draw(splats(0.75F), state, "counted");
  const RunResult result = run(request(), frame);
  EXPECT_EQ(rasterized(result, 1), 0U);
  EXPECT_GT(rasterized(result, 2), 0U);
  unsigned counted = 0;
  const DepthStencilSurface& surface = result.framebuffer.depth_stencil;
  for (std::size_t place = 0; place < surface.grid().quads(); ++place) counted += surface.quad(place).stencil[0];
  EXPECT_GT(counted, 0U);
}

// The link is optional: RASTER then knows what depth was cleared to, and waits for nobody.
TEST_P(HiZWall, WithoutTheLinkNothingIsCulledByWhatIsStored) {
  Platform unlinked = platform_named("agx-orin-ideal-memory");
  unlinked.wire = [wire = unlinked.wire](Netlist& netlist) {
    wire(netlist);
    netlist.disconnect("gpc0.zrop.out_hi_z");
  };
  RunRequest request = this->request();
  request.platform = &unlinked;
  Frame frame(side, side);
  frame.draw(wall(0.5F), stored(Compare::less));
  frame.draw(splats(0.75F), tested());
  const RunResult result = run(request, frame);
  EXPECT_GT(rasterized(result, 1), 0U);
  EXPECT_EQ(statistic(result, "raster.hi_z_culled"), 0U);
}

TEST(HiZ, CullsNothingThatIsRasterisedBeforeItsUpdatesCome) {
  for (const unsigned latency : {1U, 100000U}) {
    RunRequest request = request_of("baseline", Fidelity::cycle);
    request.settings.push_back({"link.zrop.hi_z", "latency_cycles", std::to_string(latency)});
    const Frame frame = mixed_frame(202, request);
    const RunResult result = run(request, frame);
    if (latency == 1) {
      EXPECT_GT(statistic(result, "raster.hi_z_culled"), 0U);
    } else {
      EXPECT_EQ(statistic(result, "raster.hi_z_culled"), 0U);
    }
  }
}

}  // namespace
}  // namespace vrpipe
