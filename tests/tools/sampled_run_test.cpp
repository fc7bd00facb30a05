// --fidelity sampled, --seed and --error on the command line.
#include <vrpipe/workloads/draw_list.h>

#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

class SampledRun : public ToolTest {
 protected:
  void write_long_draw() const {
    Draw draw = random_draw(256, 192, 17000, 2);
    for (Splat& splat : draw.splats) {
      for (float* const extent : {&splat.ax, &splat.ay, &splat.bx, &splat.by}) *extent *= 2;
    }
    write_draw_list(folder() / "long.spl", draw);
  }
  static bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }
};

TEST_F(SampledRun, SaysWhatItsWindowsAre) {
  write_long_draw();
  const json result =
      json_of({"run", "--scene", "long.spl", "--variant", "baseline", "--fidelity", "sampled", "--seed", "7"});
  const json& run = result["runs"][0];
  EXPECT_EQ(run["sampling"]["windows"], 26);
  EXPECT_EQ(run["sampling"]["seed"], 7);
  EXPECT_EQ(run["sampling"]["confidence_percent"], 95);
  EXPECT_GT(run["sampling"]["half_interval_percent"], 0);
  EXPECT_GT(run["kernel_events"], 0);
  EXPECT_EQ(run["expected_error_percent"], run["sampling"]["half_interval_percent"]);
  for (const char* const key : {"units", "utilization", "bottleneck", "stopped"})
    EXPECT_FALSE(run.contains(key)) << key;
  const std::string text = vrpipe({"run", "--scene", "long.spl", "--variant", "baseline", "--fidelity", "sampled"}).out;
  for (const char* const part : {"sampled fidelity", " cycles, 95 of 100 within +-", "26 windows with ", "seed 1\n"})
    EXPECT_TRUE(has(text, part)) << part << "\n" << text;
}

TEST_F(SampledRun, TakesFramesOfSeveralDrawsAndSeveralGpcs) {
  write_long_draw();
  std::vector<std::string> arguments{"run", "--scene", "long.spl", "--variant", "baseline", "--multi-pass", "2"};
  const double cycles = json_of(arguments)["runs"][0]["cycles"];
  arguments.insert(arguments.end(), {"--fidelity", "sampled"});
  const json run = json_of(arguments)["runs"][0];
  EXPECT_GT(run["sampling"]["windows"], 26);
  EXPECT_NEAR(run["cycles"].get<double>() / cycles, 1, 0.05);
  const Finished finished = vrpipe({"run", "--scene", "tiny.spl", "--fidelity", "sampled", "--platform", "desktop"});
  EXPECT_TRUE(has(finished.out, "sampled: all of the frame at cycle: half of the frame would be in windows\n"));
}

TEST_F(SampledRun, SaysThatAllOfAShortFrameIsSimulated) {
  const Finished finished = vrpipe({"run", "--scene", "tiny.spl", "--fidelity", "sampled"});
  EXPECT_TRUE(has(finished.out, "sampled: all of the frame at cycle: half of the frame would be in windows\n"));
  const json run = json_of({"run", "--scene", "tiny.spl", "--fidelity", "sampled"})["runs"][0];
  EXPECT_EQ(run["cycles"], json_of({"run", "--scene", "tiny.spl"})["runs"][0]["cycles"]);
  EXPECT_EQ(run["sampling"]["windows"], 0);
  EXPECT_TRUE(run.contains("units"));
}

TEST_F(SampledRun, AnErrorSaysWhichWayItTookAndWhy) {
  const Finished finished = vrpipe({"compare", "--scene", "tiny.spl", "--error", "3%"});
  EXPECT_TRUE(has(finished.out, "het+qm: --error 3% took lt: lt says ")) << finished.out;
  const json run = json_of({"run", "--scene", "tiny.spl", "--error", "0.01"})["runs"][0];
  EXPECT_EQ(run["fidelity"], "cycle");
  EXPECT_EQ(run["error"]["way"], "cycle");
  EXPECT_EQ(run["error"]["asked_percent"], 0.01);
  EXPECT_TRUE(has(run["error"]["why"], "lt never says less than"));
}

TEST_F(SampledRun, WhatMakesNoSenseIsRefused) {
  for (const char* const value : {"0", "-1%", "101", "%", "1 %", "nan"})
    refused({"run", "--scene", "tiny.spl", "--error", value}, {"(--error)", "e.g. --error 1%"});
  refused({"run", "--scene", "tiny.spl", "--error", "1%", "--fidelity", "lt"}, {"--fidelity says which way"});
  refused({"run", "--scene", "tiny.spl", "--error", "1%", "--interval", "100", "--json", "x.json"}, {"--interval"});
  refused({"run", "--scene", "tiny.spl", "--error", "1%", "--html", "x.html"}, {"--html"});
  refused({"run", "--scene", "tiny.spl", "--seed", "3"}, {"nothing is drawn at random"});
  refused({"run", "--scene", "tiny.spl", "--fidelity", "sampled", "--seed", "0"}, {"(--seed)"});
  const std::vector<std::string> sampled{"run", "--scene", "tiny.spl", "--fidelity", "sampled"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), sampled.begin(), sampled.end());
    return more;
  };
  refused(with({"--trace", "x.json"}), {"--trace", "use lt or cycle"});
  refused(with({"--variant", "software"}), {"software"});
  refused(with({"--until", "10"}), {"--until"});
  refused({"microbench", "tile-binning", "--fidelity", "sampled"}, {"a microbenchmark is short"});
}

}  // namespace
}  // namespace vrpipe::testing
