#include "support/builders.h"
#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using Anomalies = ToolTest;

std::string line_with(const std::string& text, const std::string& start) {
  const std::size_t at = text.find("\n" + start);
  return at == std::string::npos ? "" : text.substr(at + 1, text.find('\n', at + 1) - at - 1);
}

std::uint64_t value_of(const nlohmann::json& run, const std::string& name) {
  for (const auto& statistic : run["statistics"]) {
    if (statistic["name"] == name) return statistic["value"];
  }
  ADD_FAILURE() << "no statistic " << name;
  return 0;
}

TEST_F(Anomalies, IsOneLineOfTheReportAndInTheStatistics) {
  Draw draw = draw_of(16, 16, std::vector<Splat>(1500, flat_box(0, 0, 16, 16, 1.0F / 255.0F)));
  draw.splats.push_back(flat_box(-40, -40, 60, 60, 0.5F, 70000.0F));
  draw.splats.push_back(splat_at(8, 8, 900, 900, 0.5F, 0.9F));
  write_draw_list(folder() / "hard.spl", draw);
  const std::vector<std::string> command{"run", "--scene", "hard.spl", "--fidelity", "functional", "--variant", "het"};
  const std::string line = line_with(vrpipe(command).out, "numbers to watch: ");
  EXPECT_NE(line.find("256 pixels stuck"), std::string::npos) << line;
  EXPECT_NE(line.find("times a colour was clamped"), std::string::npos) << line;
  EXPECT_NE(line.find("edge functions of"), std::string::npos) << line;
  const nlohmann::json run = json_of(command)["runs"][0];
  EXPECT_EQ(value_of(run, "crop.pixels_stuck"), 256U);
  EXPECT_GT(value_of(run, "raster.widest_edge"), 32U);
  EXPECT_GT(value_of(run, "vpo.smallest_determinant"), 0U);
  EXPECT_EQ(value_of(run, "vpo.dropped_not_finite"), 0U);
}

TEST_F(Anomalies, IsNotMentionedWhereThereIsNone) {
  const Finished run = vrpipe({"run", "--scene", "tiny.spl", "--fidelity", "functional", "--format", "rgba32f"});
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(line_with(run.out, "numbers to watch: "), "");
}

}  // namespace
}  // namespace vrpipe::testing
