#include <gtest/gtest.h>

#include <sys/time.h>

#include <csignal>
#include <stdexcept>

#include <vrpipe/component/error.h>

#include "host/command_failure.h"
#include "jobs/processes.h"
#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using tools::CommandFailure;

/// Platforms whose wiring fails in every way in which a simulation can.
Platform failing(void (*wire)(Netlist&)) {
  Platform platform = platforms().front();
  platform.name = "failing";
  platform.wire = wire;
  return platform;
}

std::vector<RunRequest> all_variants(const Platform& platform) {
  std::vector<RunRequest> requests;
  for (const Variant& variant : variants()) {
    requests.emplace_back();
    requests.back().platform = &platform;
    requests.back().variant = variant;
  }
  return requests;
}

/// The same geometry for every request.
tools::FrameSource frames_of(const Draw& draw) {
  return [&draw](const RunRequest& request) { return Frame::of(draw, draw_state_of(request)); };
}

CommandFailure failure_of(void (*wire)(Netlist&)) {
  fresh_simulation();  // other tests may have left one in this process
  const Platform platform = failing(wire);
  const Draw draw = tiny_draw();
  tools::ProgressLine progress;
  try {
    tools::simulate_in_processes(all_variants(platform), frames_of(draw), false, 2, progress);
  } catch (const CommandFailure& failure) {
    return failure;
  }
  ADD_FAILURE() << "nothing failed";
  return {0, ""};
}

TEST(Processes, AMistakeOfTheUserComesBackAsOne) {
  const CommandFailure failure =
      failure_of([](Netlist&) { throw UserError("bad wiring", "here", "it is wrong", "mend it"); });
  EXPECT_EQ(failure.exit_code, 2);
  EXPECT_STREQ(failure.what(), "bad wiring (here): it is wrong; mend it");
}

TEST(Processes, AFaultNamesTheVariant) {
  const CommandFailure failure = failure_of([](Netlist&) { throw SimulationFault("gpc0.tc", 17, "a bin is lost"); });
  EXPECT_EQ(failure.exit_code, 1);
  const std::string text = failure.what();
  EXPECT_EQ(text.rfind("variant ", 0), 0U) << text;
  EXPECT_NE(text.find("gpc0.tc at cycle 17: a bin is lost"), std::string::npos) << text;
}

TEST(Processes, AKilledSimulationNamesTheSignal) {
  const CommandFailure failure = failure_of([](Netlist&) { ::raise(SIGKILL); });
  EXPECT_EQ(failure.exit_code, 1);
  const std::string text = failure.what();
  EXPECT_NE(text.find("variant "), std::string::npos) << text;
  EXPECT_NE(text.find("signal 9"), std::string::npos) << text;
  EXPECT_NE(text.find("--jobs 1"), std::string::npos) << text;
}

TEST(Processes, AnEarlyExitIsAFault) {
  const CommandFailure failure = failure_of([](Netlist&) { ::_exit(0); });
  EXPECT_EQ(failure.exit_code, 1);
  EXPECT_NE(std::string(failure.what()).find("before it was done"), std::string::npos) << failure.what();
}

// A machine that is busy with other things stretches wall time; here a handler does, which sleeps at every tick of
// the simulation's own time.
TEST(Processes, CpuSecondsDoNotCountWaiting) {
  fresh_simulation();
  Draw draw = tiny_draw();
  const std::vector<Splat> splats = draw.splats;
  for (int i = 0; i < 100; ++i) draw.splats.insert(draw.splats.end(), splats.begin(), splats.end());
  struct sigaction sleep {};
  sleep.sa_handler = [](int) { ::usleep(30000); };
  sleep.sa_flags = SA_RESTART;
  struct sigaction before {};
  ::sigaction(SIGVTALRM, &sleep, &before);
  const itimerval ticks{{0, 4000}, {0, 4000}};
  const itimerval off{};
  ::setitimer(ITIMER_VIRTUAL, &ticks, nullptr);
  tools::ProgressLine progress;
  const RunRequest request = all_variants(platforms().front()).front();
  const RunResult result = tools::simulate_here(request, *frames_of(draw)(request), false, progress).result;
  ::setitimer(ITIMER_VIRTUAL, &off, nullptr);
  ::sigaction(SIGVTALRM, &before, nullptr);
  EXPECT_GT(result.cpu_seconds, 0.004) << "the draw is too small to say anything";
  EXPECT_GT(result.host_seconds, 2 * result.cpu_seconds);
}

TEST(Processes, ResultsComeBackWhole) {
  fresh_simulation();
  const Draw draw = tiny_draw();
  const std::vector<RunRequest> requests = all_variants(platforms().front());
  tools::ProgressLine progress;
  const std::vector<tools::Simulated> apart =
      tools::simulate_in_processes(requests, frames_of(draw), true, 3, progress);
  ASSERT_EQ(apart.size(), 4U);
  for (std::size_t i = 0; i < requests.size(); ++i) {
    fresh_simulation();
    const tools::Simulated here = tools::simulate_here(requests[i], *frames_of(draw)(requests[i]), true, progress);
    const RunResult& a = apart[i].result;
    const RunResult& b = here.result;
    EXPECT_EQ(a.request.variant.name, b.request.variant.name);
    EXPECT_EQ(a.result_hash, b.result_hash);
    EXPECT_EQ(a.cycles, b.cycles);
    EXPECT_EQ(a.milliseconds, b.milliseconds);
    EXPECT_GT(a.host_seconds, 0);
    EXPECT_GT(a.cpu_seconds, 0);
    EXPECT_EQ(a.implementations, b.implementations);
    EXPECT_EQ(a.counts.named(), b.counts.named());
    EXPECT_EQ(a.utilization, b.utilization);
    EXPECT_EQ(a.parameters, b.parameters);
    EXPECT_EQ(a.kernel_events, b.kernel_events);
    ASSERT_EQ(a.units.size(), b.units.size());
    for (std::size_t unit = 0; unit < a.units.size(); ++unit) {
      EXPECT_EQ(a.units[unit].name, b.units[unit].name);
      EXPECT_EQ(a.units[unit].cycles, b.units[unit].cycles);
    }
    ASSERT_EQ(a.statistics.size(), b.statistics.size());
    for (std::size_t statistic = 0; statistic < a.statistics.size(); ++statistic) {
      EXPECT_EQ(a.statistics[statistic].name, b.statistics[statistic].name);
      EXPECT_EQ(a.statistics[statistic].value, b.statistics[statistic].value);
      EXPECT_EQ(a.statistics[statistic].meaning, b.statistics[statistic].meaning);
    }
    const std::size_t values = std::size_t{4} * draw.width * draw.height;
    EXPECT_TRUE(std::equal(apart[i].image->values(), apart[i].image->values() + values, here.image->values()));
  }
}

}  // namespace
}  // namespace vrpipe::testing
