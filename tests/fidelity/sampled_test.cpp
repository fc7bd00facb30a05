// Windows of a frame at cycle: the interval that they give holds, and all but time is as without it.
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/pipeline/frame.h>
#include <vrpipe/platforms/simulation.h>

#include "fidelity/sampled_draws.h"
#include "support/refusals.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

RunRequest on(const char* platform, RunRequest request) {
  request.platform = &platform_named(platform);
  return request;
}

const Draw& long_draw() {
  static const Draw draw = changing_draw(17000, 2);
  return draw;
}

TEST(Sampled, ItsIntervalHolds) {
  struct Case {
    const char* platform;
    const char* variant;
    ColorFormat format;
    std::uint32_t splats;
    std::uint64_t draw;
    Termination termination = Termination::paper;
  };
  const std::vector<Case> cases{
      {"agx-orin-ideal-memory", "baseline", ColorFormat::rgba16f, 17000, 1},
      {"agx-orin-ideal-memory", "het", ColorFormat::rgba16f, 46000, 2},
      {"agx-orin-ideal-memory", "het+qm", ColorFormat::rgba8, 46000, 3, Termination::strict},
      {"mobile", "qm", ColorFormat::rgba8, 17000, 4},
      {"gh100-gpc", "baseline", ColorFormat::rgba32f, 17000, 5},
      {"agx-orin", "baseline", ColorFormat::rgba16f, 17000, 6},
  };
  unsigned inside = 0, runs = 0;
  std::string outside;
  for (const Case& c : cases) {
    const Draw draw = changing_draw(c.splats, c.draw);
    RunRequest request = on(c.platform, request_of(c.variant));
    request.termination = c.termination;
    request.format = c.format;
    const auto cycles = static_cast<double>(*run(request, draw).cycles);
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const RunResult result = run(sampled(request, seed), draw);
      ASSERT_EQ(result.sampling->windows, 18) << c.platform << " " << c.variant;
      const double off = 100 * (static_cast<double>(*result.cycles) / cycles - 1);
      const bool is_inside = std::fabs(off) <= result.sampling->half_interval_percent;
      ++runs;
      inside += is_inside ? 1 : 0;
      if (!is_inside) outside += fmt::format(" {} {} {}: {:+.2f} %", c.platform, c.variant, seed, off);
    }
  }
  EXPECT_GE(100 * inside, 95 * runs) << inside << " of " << runs << outside;
}

TEST(Sampled, DrawsAndCountsAsFunctional) {
  for (const char* const platform : {"agx-orin-ideal-memory", "agx-orin"}) {
    const RunRequest request = on(platform, request_of("baseline"));
    RunRequest functional = request;
    functional.fidelity = Fidelity::functional;
    const RunResult drawn = run(functional, long_draw());
    const RunResult result = run(sampled(request), long_draw());
    EXPECT_EQ(result.counts.named(), drawn.counts.named()) << platform;
    EXPECT_TRUE(same_image(result.framebuffer.color, drawn.framebuffer.color)) << platform;
    EXPECT_TRUE(result.units.empty());
    EXPECT_TRUE(result.utilization.empty());
    EXPECT_FALSE(result.bottleneck);
    EXPECT_EQ(result.expected_error_percent, result.sampling->half_interval_percent);
    EXPECT_GT(result.sampling->measured_share, 0);
    EXPECT_LT(result.sampling->measured_share + result.sampling->warm_up_share, 0.6);
    EXPECT_EQ(fidelity_of(result.request), "sampled");
  }
}

TEST(Sampled, IsReproducibleBySeed) {
  const RunRequest request = request_of("baseline");
  const RunResult one = run(sampled(request, 7), long_draw());
  const RunResult again = run(sampled(request, 7), long_draw());
  const RunResult other = run(sampled(request, 8), long_draw());
  EXPECT_EQ(one.cycles, again.cycles);
  EXPECT_EQ(one.sampling->half_interval_percent, again.sampling->half_interval_percent);
  EXPECT_EQ(one.result_hash, again.result_hash);
  EXPECT_EQ(one.sampling->seed, 7);
  EXPECT_NE(one.cycles, other.cycles);
}

TEST(Sampled, SimulatesAllOfWhatItsWindowsWouldCover) {
  const Draw draw = random_draw(64, 48, 600, 9);
  for (const char* const variant : {"baseline", "het+qm"}) {
    const RunResult cycle = run(request_of(variant), draw);
    const RunResult result = run(sampled(request_of(variant)), draw);
    EXPECT_EQ(result.sampling->windows, 0);
    EXPECT_EQ(result.sampling->half_interval_percent, 0);
    EXPECT_EQ(result.result_hash, cycle.result_hash);
    EXPECT_EQ(result.units.size(), cycle.units.size());
    EXPECT_FALSE(takes_windows(sampled(request_of(variant)), *Frame::of(draw, draw_state_of(request_of(variant)))));
  }
  const Frame empty(64, 48);
  EXPECT_EQ(run(sampled(request_of("baseline")), empty).sampling->windows, 0);
}

RunRequest with_deep_queue() {
  RunRequest request = on("agx-orin-ideal-memory", request_of("baseline"));
  request.settings.push_back({"link.prop.color", "depth", "2000"});
  return request;
}

TEST(Sampled, WarmsUpForLongerWhereQueuesGoOnToFillInWindows) {
  const Draw draw = changing_draw(40000, 2);
  const auto cycles = static_cast<double>(*run(with_deep_queue(), draw).cycles);
  const RunResult result = run(sampled(with_deep_queue()), draw);
  ASSERT_EQ(result.sampling->windows, 18);
  const RunResult usual = run(sampled(on("agx-orin-ideal-memory", request_of("baseline"))), draw);
  EXPECT_GT(result.sampling->warm_up_share, 3 * usual.sampling->warm_up_share);
  EXPECT_NEAR(static_cast<double>(*result.cycles) / cycles, 1, result.sampling->half_interval_percent / 100);
}

TEST(Sampled, SimulatesAllWhereQueuesGoOnToFillAndLongerWindowsWouldBeHalfOfTheFrame) {
  const RunResult cycle = run(with_deep_queue(), long_draw());
  const RunResult result = run(sampled(with_deep_queue()), long_draw());
  EXPECT_EQ(result.sampling->windows, 0);
  EXPECT_NE(result.sampling->whole_because.find("queues went on to fill"), std::string::npos)
      << result.sampling->whole_because;
  EXPECT_EQ(result.result_hash, cycle.result_hash);
}

TEST(Sampled, SimulatesAllWhereTheFrontEndRunsOnAhead) {
  RunRequest request = on("agx-orin-ideal-memory", request_of("baseline"));
  request.settings.push_back({"link.tgc.jobs", "depth", "65536"});
  const RunResult result = run(sampled(request), changing_draw(40000, 2));
  EXPECT_EQ(result.sampling->windows, 0) << result.sampling->delay_growth_percent << " "
                                         << result.sampling->lead_growth_percent;
}

TEST(Sampled, RefusesWhatItCannotHaveWindowsOf) {
  const Draw draw = random_draw(64, 48, 600, 9);
  const auto refusal = [&](const RunRequest& request) { return refusal_of([&] { run(request, draw); }); };
  EXPECT_NE(refusal(sampled(request_of("software"))).find("through the pipeline"), std::string::npos);
  RunRequest request = sampled(request_of("baseline"));
  request.sampling->windows = 3;
  EXPECT_NE(refusal(request).find("take 16 at least"), std::string::npos);
  request = sampled(request_of("baseline"));
  request.stop_at = 100;
  EXPECT_NE(refusal(request).find("--until"), std::string::npos);
  request = sampled(request_of("baseline", Fidelity::lt));
  EXPECT_NE(refusal(request).find("simulated at cycle"), std::string::npos);
  EXPECT_NE(refusal_of([&] { choose_fidelity(request, "sampled,crop=cycle"); }).find("write sampled alone"),
            std::string::npos);
}

TEST(WithinAnError, TakesLtWhereThatSaysSo) {
  const Draw draw = random_draw(64, 48, 600, 9);
  RunRequest request = request_of("het+qm");
  request.error_percent = 3;
  const RunResult result = run(request, draw);
  EXPECT_EQ(result.way->fidelity, "lt");
  EXPECT_EQ(fidelity_of(result.request), "lt");
  EXPECT_EQ(result.result_hash, run(request_of("het+qm", Fidelity::lt), draw).result_hash);
}

TEST(WithinAnError, TakesWindowsWhereLtDoesNotKnow) {
  RunRequest request = request_of("baseline");
  request.settings.push_back({"sm", "cores", "2"});
  request.error_percent = 4;
  request.sampling = Sampling{0, 5};
  const RunResult result = run(request, long_draw());
  EXPECT_EQ(result.way->fidelity, "sampled");
  EXPECT_NE(result.way->why.find("lt does not know"), std::string::npos);
  EXPECT_EQ(fidelity_of(result.request), "sampled");
  EXPECT_EQ(result.sampling->seed, 5);
  EXPECT_LE(result.sampling->half_interval_percent, 4);
}

TEST(WithinAnError, TakesWindowsAtOnceWhereTheyAreCheaperThanLt) {
  RunRequest request = request_of("baseline");
  request.error_percent = 4;
  const RunResult result = run(request, changing_draw(40000, 2));
  EXPECT_EQ(result.way->fidelity, "sampled");
  EXPECT_EQ(result.way->why.find("lt"), std::string::npos) << result.way->why;
}

TEST(WithinAnError, TakesCycleWhereNothingElseIsAsNear) {
  const Draw draw = random_draw(64, 48, 600, 9);
  for (const double percent : {0.05, 0.5}) {
    RunRequest request = request_of("het+qm");
    request.error_percent = percent;
    const RunResult result = run(request, draw);
    EXPECT_EQ(result.way->fidelity, "cycle") << percent;
    EXPECT_EQ(fidelity_of(result.request), "cycle") << percent;
    EXPECT_EQ(result.result_hash, run(request_of("het+qm"), draw).result_hash) << percent;
    EXPECT_FALSE(result.sampling);
  }
}

TEST(WithinAnError, RefusesWhatIsNone) {
  const Draw draw = random_draw(64, 48, 600, 9);
  for (const double percent : {-1.0, 101.0}) {
    RunRequest request = request_of("baseline");
    request.error_percent = percent;
    EXPECT_NE(refusal_of([&] { run(request, draw); }).find("ask for 1%"), std::string::npos) << percent;
  }
  RunRequest request = request_of("software");
  request.error_percent = 1;
  EXPECT_NE(refusal_of([&] { run(request, draw); }).find("outside the pipeline"), std::string::npos);
}

}  // namespace
}  // namespace vrpipe
