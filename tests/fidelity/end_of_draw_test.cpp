// When a draw ends, and what is charged and counted up to there.
#include <vrpipe/platforms/simulation.h>

#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

constexpr Fidelity timed[] = {Fidelity::bound, Fidelity::lt, Fidelity::cycle};

/// Every state by itself, every share, and the sums.
void expect_accounts_within_the_draw(const RunResult& result, const std::string& what) {
  const Cycle cycles = result.cycles.value();
  for (const UnitReport& unit : result.units) {
    std::uint64_t sum = 0;
    for (const std::uint64_t state : unit.cycles) {
      EXPECT_LE(state, cycles) << what << " " << unit.name;
      sum += state;
    }
    EXPECT_EQ(sum, cycles) << what << " " << unit.name;
    EXPECT_GE(unit.occupancy, 0.0) << what << " " << unit.name;
    EXPECT_LE(unit.occupancy, 1.0 + 1e-9) << what << " " << unit.name;
    for (const auto& [part, share] : unit.parts) {
      EXPECT_GE(share, 0.0) << what << " " << unit.name << " " << part;
      EXPECT_LE(share, 1.0 + 1e-9) << what << " " << unit.name << " " << part;
    }
  }
  for (const auto& [unit, share] : result.utilization) {
    EXPECT_GE(share, 0.0) << what << " " << unit;
    EXPECT_LE(share, 1.0 + 1e-9) << what << " " << unit;
  }
}

std::string name(const RunRequest& request) {
  return request.variant.name + " " + name_of(request.fidelity) + " " + request.platform->name;
}

/// Opaque layers in front, and far more behind them, which die in the tests.
Draw wall(unsigned behind) {
  Draw draw = draw_of(96, 64);
  for (unsigned i = 0; i < 40; ++i) draw.splats.push_back(flat_box(-10, -10, 106, 74, 0.9F));
  for (unsigned i = 0; i < behind; ++i) draw.splats.push_back(flat_box(0, 0, 96, 64, 0.5F));
  return draw;
}

// The front end still works long after the last blend.
TEST(EndOfDraw, IsNotBeforeTheLastQuadIsTested) {
  const Draw draw = wall(400);
  for (const Fidelity fidelity : timed) {
    const RunResult result = run(request_of("het", fidelity), draw);
    EXPECT_GT(result.counts.quads_terminated, result.counts.quads_rasterized * 8 / 10);
    // ZROP tests 16 quads a cycle at most.
    EXPECT_GE(*result.cycles, result.counts.quads_rasterized / 16) << name_of(fidelity);
    expect_accounts_within_the_draw(result, name(result.request));
  }
}

TEST(EndOfDraw, IsTheSameWhetherTheLastQuadIsBlendedOrPruned) {
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    Draw draw = draw_of(64, 64, {flat_box(0, 0, 64, 64, 0.5F)});
    const Cycle alone = *run(request_of("baseline", fidelity), draw).cycles;
    // One of pruned fragments behind it: a shaded quad's alpha of 0 is below any threshold.
    for (unsigned i = 0; i < 200; ++i) draw.splats.push_back(flat_box(0, 0, 64, 64, 0.003F));
    const RunResult pruned = run(request_of("baseline", fidelity), draw);
    EXPECT_EQ(pruned.counts.quads_pruned, 200 * pruned.counts.quads_rasterized / 201) << name_of(fidelity);
    EXPECT_GT(*pruned.cycles, alone + 1000) << name_of(fidelity);
    expect_accounts_within_the_draw(pruned, name(pruned.request));
  }
}

// Quads alone keep a draw going: the vertices and triangles behind the last of them do not.
TEST(EndOfDraw, IsNotPutOffByWhatCoversNothing) {
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    for (const char* variant : {"baseline", "het"}) {  // TGC would keep primitives until the end of the frame
      Draw draw = draw_of(64, 64, {flat_box(4, 4, 60, 60, 0.5F)});
      const RunResult alone = run(request_of(variant, fidelity), draw);
      for (unsigned i = 0; i < 5000; ++i) draw.splats.push_back(flat_box(-90, -90, -80, -80, 0.5F));
      const RunResult followed = run(request_of(variant, fidelity), draw);
      EXPECT_EQ(followed.counts.quads_blended, alone.counts.quads_blended);
      // TC's bins wait for more quads until they time out.
      EXPECT_LT(*followed.cycles, *alone.cycles + 1000) << name(followed.request);
      expect_accounts_within_the_draw(followed, name(followed.request));
    }
  }
}

TEST(EndOfDraw, OfADrawWithoutQuadsIsThatOfItsMark) {
  for (const Fidelity fidelity : timed) {
    const RunResult result = run(request_of("het+qm", fidelity), draw_of(64, 64));
    EXPECT_LT(*result.cycles, 100U) << name_of(fidelity);
    expect_accounts_within_the_draw(result, name(result.request));
    EXPECT_EQ(result.bottleneck.has_value() && result.bottleneck->occupancy > 1, false);
  }
}

// The wall that reported a speed-up of 273 has one of about 6.
TEST(EndOfDraw, SpeedUpsAreThoseOfFinishedDraws) {
  const Draw draw = wall(1500);
  const double baseline = static_cast<double>(*run(request_of("baseline"), draw).cycles);
  const double het = static_cast<double>(*run(request_of("het"), draw).cycles);
  // Raster, ZROP and all before them do 16 quads a cycle, CROP 2.
  EXPECT_LT(baseline / het, 8.0);
  EXPECT_GT(baseline / het, 4.0);
}

TEST(EndOfDraw, AccountsStayWithinItForRandomScenesOfManyShapes) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Draw draw = random_draw(96, 80, 200, seed);
    // Opaque in front, out of sight behind: both ends of what outlasts the last blend.
    if (seed % 3 == 0) {
      const Draw front = wall(0);
      draw.splats.insert(draw.splats.begin(), front.splats.begin(), front.splats.end());
    }
    if (seed % 3 == 1) draw.splats.insert(draw.splats.end(), 600, flat_box(-50, -50, -40, -40, 0.5F));
    for (const Variant& variant : variants()) {
      for (const Fidelity fidelity : timed) {
        RunRequest request = request_of(variant.name, fidelity);
        request.platform = &platforms()[mix(seed) % platforms().size()];
        expect_accounts_within_the_draw(run(request, draw), name(request) + " seed " + std::to_string(seed));
      }
    }
  }
}

}  // namespace
}  // namespace vrpipe
