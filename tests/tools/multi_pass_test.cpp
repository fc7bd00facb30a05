// --multi-pass on the command line.
#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

class MultiPassOption : public ToolTest {};

TEST_F(MultiPassOption, OnePassIsTheOrdinaryRun) {
  const json plain = json_of({"run", "--scene", "tiny.spl"});
  const json one = json_of({"run", "--scene", "tiny.spl", "--multi-pass", "1"});
  EXPECT_EQ(one["runs"][0]["result_hash"], plain["runs"][0]["result_hash"]);
  EXPECT_EQ(one["runs"][0]["statistics"], plain["runs"][0]["statistics"]);
  EXPECT_EQ(plain["passes"], 1);
  EXPECT_EQ(one["passes"], 1);
}

TEST_F(MultiPassOption, NPassesAre2NMinus1DrawsInEveryVariant) {
  const json result = json_of({"compare", "--scene", "tiny.spl", "--multi-pass", "4"});
  EXPECT_EQ(result["passes"], 4);
  ASSERT_EQ(result["runs"].size(), 4U);
  for (const json& run : result["runs"]) {
    ASSERT_EQ(run["draws"].size(), 7U) << run["variant"];
    EXPECT_EQ(run["draws"][0]["name"], "tiny.spl, pass 1");
    EXPECT_EQ(run["draws"][1]["name"], "tiny.spl, end of pass 1");
    EXPECT_EQ(run["draws"][1]["counts"]["fragments_shaded"], 48 * 40);
  }
  const json plain = json_of({"run", "--scene", "tiny.spl", "--variant", "baseline"});
  EXPECT_LT(result["runs"][0]["counts"]["fragments_blended"], plain["runs"][0]["counts"]["fragments_blended"]);
  EXPECT_GT(result["runs"][0]["counts"]["fragments_depth_stencil_failed"], 0);
}

TEST_F(MultiPassOption, TheReportSaysHowManyPassesThereAre) {
  EXPECT_NE(vrpipe({"run", "--scene", "tiny.spl", "--multi-pass", "3"}).out.find(", 3 passes"), std::string::npos);
  EXPECT_EQ(vrpipe({"run", "--scene", "tiny.spl"}).out.find("passes"), std::string::npos);
}

TEST_F(MultiPassOption, WhatIsNoNumberOfPassesIsRefused) {
  for (const char* passes : {"0", "-1", "1.5", "x", "", "16385", "4294967298"}) {
    refused({"run", "--scene", "tiny.spl", "--output", "images", "--multi-pass", passes}, {"--multi-pass"});
  }
  refused({"run", "--scene", "tiny.spl", "--multi-pass", "2", "--multi-pass", "3"}, {"--multi-pass", "twice"});
}

TEST_F(MultiPassOption, MorePassesThanSplatsAreRefused) {
  for (const char* command : {"run", "compare"}) {
    refused({command, "--scene", "tiny.spl", "--output", "images", "--multi-pass", "61"},
            {"--multi-pass", "60 splats", "as many as there are splats, 16384 at most"});
  }
}

TEST_F(MultiPassOption, AFrameFileSaysItselfWhatIsDrawn) {
  write("frame.json", R"({"commands": [{"draw": "tiny.spl"}]})");
  refused({"run", "--frame", "frame.json", "--multi-pass", "2"}, {"--multi-pass", "--frame"});
}

}  // namespace
}  // namespace vrpipe::testing
