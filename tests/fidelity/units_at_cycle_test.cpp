// One unit cycle by cycle among others at lt: nothing is lost on the way, and time is as near as at lt.
#include <algorithm>
#include <string>
#include <vector>

#include <vrpipe/model/border.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/simulation.h>

#include "support/mixed_frames.h"
#include "support/refusals.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

const std::vector<std::string> units_of_a_gpc{"vpo", "tgc", "raster", "tc", "prop", "zrop", "qru", "sm", "crop"};

RunRequest at_cycle(RunRequest request, std::vector<std::string> units) {
  request.fidelity = Fidelity::lt;
  request.units_at_cycle = std::move(units);
  return request;
}

class UnitAtCycle : public ::testing::TestWithParam<std::string> {
 protected:
  static std::vector<std::string> units() {
    if (GetParam() == "all") return units_of_a_gpc;
    if (GetParam() == "rops") return {"crop", "zrop"};
    return {GetParam()};
  }
};
std::vector<std::string> cases() {
  std::vector<std::string> all = units_of_a_gpc;
  all.insert(all.end(), {"draw", "rops", "all"});
  return all;
}
INSTANTIATE_TEST_SUITE_P(Fidelity, UnitAtCycle, ::testing::ValuesIn(cases()),
                         [](const auto& unit) { return unit.param; });

TEST_P(UnitAtCycle, TakesNearlyTheTimeOfCycle) {
  const Draw draw = random_draw(64, 48, 2500, 5);
  for (const char* platform : {"agx-orin", "gh100-gpc"}) {
    for (const Variant& variant : variants()) {
      RunRequest request = request_of(variant.name);
      request.platform = &platform_named(platform);
      const RunResult cycle = run(request, draw);
      const RunResult lt = run(at_cycle(request, {}), draw);
      const RunResult mixed = run(at_cycle(request, units()), draw);
      const double least = std::fabs(percent_above(*lt.cycles, *cycle.cycles));
      // Vertices come out of SMs at cycle later in the order of calls than at lt, and bins of a TC that times them out go
      // meanwhile (docs/accuracy.md).
      const bool times_out = GetParam() == "sm" && platform == std::string("gh100-gpc");
      EXPECT_NEAR(percent_above(*mixed.cycles, *cycle.cycles), 0, std::max(times_out ? 6.5 : 2.5, least + 1))
          << platform << " " << variant.name;
      EXPECT_NEAR(percent_above(mixed.counts.quads_blended, cycle.counts.quads_blended), 0, times_out ? 6.5 : 2)
          << platform << " " << variant.name;
      if (variant.early_termination || variant.quad_merging) continue;
      EXPECT_EQ(mixed.counts.fragments_blended, cycle.counts.fragments_blended) << platform;
      EXPECT_TRUE(same_image(mixed.framebuffer.color, cycle.framebuffer.color)) << platform;
    }
  }
}

TEST_P(UnitAtCycle, DrawsTheSameInStrictTermination) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    for (const char* variant : {"baseline", "het+qm"}) {
      RunRequest request = request_of(variant, Fidelity::cycle, strictly);
      if (seed % 2 == 0) request.platform = &platform_named("agx-orin");
      const Frame frame = seed % 3 == 0 ? mixed_frame(seed, request) : random_frame(seed, request);
      const RunResult cycle = run(request, frame);
      const RunResult mixed = run(at_cycle(request, units()), frame);
      EXPECT_EQ(mixed.counts.named(), cycle.counts.named()) << variant << " " << seed;
      EXPECT_TRUE(same_image(mixed.framebuffer.color, cycle.framebuffer.color)) << variant << " " << seed;
    }
  }
}

TEST_P(UnitAtCycle, IsReproducible) {
  const Draw draw = random_draw(64, 48, 600, 9);
  const RunRequest request = at_cycle(request_of("het+qm"), units());
  EXPECT_EQ(run(request, draw).result_hash, run(request, draw).result_hash);
}

TEST_P(UnitAtCycle, AccountsForEveryCycle) {
  const RunResult mixed = run(at_cycle(request_of("het"), units()), random_draw(64, 48, 600, 9));
  for (const UnitReport& unit : mixed.units) {
    std::uint64_t sum = 0;
    for (const std::uint64_t cycles : unit.cycles) sum += cycles;
    EXPECT_EQ(sum, *mixed.cycles) << unit.name;
  }
}

// What lt cannot know of CROP, a clocked CROP does: how long its queue makes the rest wait behind a slow blender.
TEST(UnitsAtCycle, ASlowUnitHoldsBackTheOthers) {
  const Draw draw = random_draw(64, 48, 1500, 3);
  RunRequest request = request_of("baseline");
  request.settings = {{"crop", "bytes_per_cycle", "16"}};
  const RunResult slow = run(at_cycle(request, {"crop"}), draw);
  EXPECT_GE(*slow.cycles, 2 * slow.counts.quads_blended);
  EXPECT_NEAR(percent_above(*slow.cycles, *run(request, draw).cycles), 0, 0.5);
}

TEST(UnitsAtCycle, AUnitIsNamedByItsPathToo) {
  const Draw draw = random_draw(64, 48, 300, 3);
  const RunRequest request = request_of("het");
  EXPECT_EQ(run(at_cycle(request, {"gpc0.zrop"}), draw).cycles, run(at_cycle(request, {"zrop"}), draw).cycles);
}

TEST(UnitsAtCycle, TheCrossbarIsOne) {
  const Draw draw = random_draw(128, 128, 600, 3);
  RunRequest request = request_of("het");
  request.settings = {{"platform", "gpcs", "2"}};
  const RunResult cycle = run(request, draw);
  for (const char* unit : {"wdx", "crop", "tgc"}) {
    const RunResult mixed = run(at_cycle(request, {unit}), draw);
    const double least = std::fabs(percent_above(*run(at_cycle(request, {}), draw).cycles, *cycle.cycles));
    EXPECT_NEAR(percent_above(*mixed.cycles, *cycle.cycles), 0, least + 1) << unit;
  }
}

TEST(UnitsAtCycle, ATextSaysThem) {
  RunRequest request;
  choose_fidelity(request, "lt,crop=cycle,gpc0.zrop=cycle");
  EXPECT_EQ(request.fidelity, Fidelity::lt);
  EXPECT_EQ(request.units_at_cycle, (std::vector<std::string>{"crop", "gpc0.zrop"}));
  EXPECT_EQ(fidelity_of(request), "lt,crop=cycle,gpc0.zrop=cycle");
  choose_fidelity(request, "cycle");
  EXPECT_EQ(fidelity_of(request), "cycle");
}

TEST(UnitsAtCycle, WhatCannotBeIsRefused) {
  const Draw draw = random_draw(16, 16, 1, 1);
  const auto refusal = [&](const std::string& unit, const std::function<void(RunRequest&)>& change = nullptr) {
    return refusal_of([&] { run(at_cycle(request_of("het", Fidelity::lt, change), {unit}), draw); });
  };
  EXPECT_NE(refusal("corp").find("did you mean crop?"), std::string::npos);
  EXPECT_NE(refusal("l2").find("a memory's is that of the run"), std::string::npos);
  const auto several = [](RunRequest& request) { request.settings = {{"platform", "gpcs", "2"}}; };
  EXPECT_NE(refusal("sm", several).find("2 GPCs"), std::string::npos);
  EXPECT_NE(refusal("vpo", several).find("2 GPCs"), std::string::npos);
  RunRequest request;
  EXPECT_NE(refusal_of([&] { choose_fidelity(request, "cycle,crop=lt"); }).find("lt,crop=cycle"), std::string::npos);
  EXPECT_NE(refusal_of([&] { choose_fidelity(request, "bound,crop=cycle"); }).find("lt,crop=cycle"), std::string::npos);
  EXPECT_NE(refusal_of([&] { choose_fidelity(request, "lt,crop"); }).find("lt,crop=cycle"), std::string::npos);
}

// A local clock that is 100 cycles ahead.
TEST(Lane, AnItemThatPassesLateIsHandedOnAsIfItHadNot) {
  Lane lane;
  lane.set_size(2);
  for (unsigned place = 0; place < 3; ++place) lane.has_room(0, 0);
  lane.enters(0, 10, 110);
  lane.enters(1, 12, 112);
  EXPECT_EQ(lane.leaves(115), 15U);
  EXPECT_EQ(lane.leaves(120), 20U);
}

TEST(Lane, AnItemWaitsForTheOneWhosePlaceItTakes) {
  Lane lane;
  lane.set_size(2);
  for (unsigned place = 0; place < 4; ++place) lane.has_room(0, 0);
  lane.enters(0, 10, 10);
  lane.enters(1, 11, 11);
  EXPECT_EQ(lane.leaves(30), 30U);
  EXPECT_EQ(lane.taken(2, 12), 30U);
  EXPECT_EQ(lane.taken(2, 40), 40U);
  EXPECT_EQ(lane.leaves(35), 35U);
  EXPECT_EQ(lane.taken(3, 12), 35U);
}

TEST(Lane, AnItemLeavesWhenThereIsRoomForThoseWhoReceiveIt) {
  Lane lane;
  lane.set_size(2);
  lane.has_room(50, 150);
  lane.enters(0, 10, 110);
  EXPECT_EQ(lane.leaves(151), 51U);
}

TEST(Lane, MoreThanHasGoneInIsAFault) {
  Lane lane;
  lane.has_room(0, 0);
  EXPECT_THROW(lane.leaves(1), SimulationFault);
}

TEST(Crossing, ABinMovesInBeatsAndComesBackInParts) {
  BinStorage storage;
  storage.in_use = true;
  for (std::uint32_t i = 0; i < 37; ++i) {
    Quad quad{};
    quad.splat = i;
    storage.flush.quads.push_back(quad);
  }
  BinItem item;
  item.storage = &storage;
  item.quads = 37;
  item.beats = 5;
  std::vector<QuadBeat> beats;
  std::vector<Cycle> cycles;
  Crossing<QuadBeat, BinItem>::into_cycle(item, {100, 108}, 5, [&](const QuadBeat& beat, Cycle at) {
    beats.push_back(beat);
    cycles.push_back(at);
  });
  EXPECT_FALSE(storage.in_use);
  EXPECT_EQ(cycles, (std::vector<Cycle>{100, 102, 104, 106, 108}));
  Crossing<QuadBeat, BinItem> back;
  std::vector<std::uint32_t> splats;
  for (const QuadBeat& beat : beats) {
    back.out_of_cycle(beat, 200, [&](const BinItem& part, CycleInterval at, unsigned places) {
      EXPECT_EQ(at.first, 200U);
      EXPECT_EQ(places, 1U);
      EXPECT_EQ(part.last_part, &beat == &beats.back());
      for (std::uint32_t i = 0; i < part.quads; ++i) splats.push_back(part.storage->flush.quads[i].splat);
    });
  }
  ASSERT_EQ(splats.size(), 37U);
  EXPECT_TRUE(std::is_sorted(splats.begin(), splats.end()));
}

TEST(Crossing, AWarpMovesInBeatsAndComesBackWhole) {
  ShadedWarp first, second;
  first.count = 3;
  second.count = 2;
  std::vector<ColorQuad> quads;
  for (const ShadedWarp* warp : {&first, &second}) {
    Crossing<ColorBeat, ShadedWarpItem>::into_cycle({warp}, {10, 11}, 2, [&](const ColorBeat& beat, Cycle) {
      quads.insert(quads.end(), beat.quads.begin(), beat.quads.begin() + beat.count);
    });
  }
  ASSERT_EQ(quads.size(), 5U);
  // Two a cycle: the second beat is of both.
  Crossing<ColorBeat, ShadedWarpItem> back;
  std::vector<const ShadedWarp*> warps;
  unsigned places = 0;
  for (unsigned i = 0; i < 5; i += 2) {
    ColorBeat beat;
    for (unsigned j = i; j < std::min(i + 2, 5U); ++j) beat.quads[beat.count++] = quads[j];
    back.out_of_cycle(beat, 20 + i / 2, [&](const ShadedWarpItem& item, CycleInterval at, unsigned taken) {
      warps.push_back(item.warp);
      places += taken;
      EXPECT_EQ(at.last, 20 + i / 2);
    });
  }
  EXPECT_EQ(warps, (std::vector<const ShadedWarp*>{&first, &second}));
  EXPECT_EQ(places, 3U);
}

}  // namespace
}  // namespace vrpipe
