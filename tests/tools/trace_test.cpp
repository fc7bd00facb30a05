#include <map>
#include <sstream>

#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

/// `vrpipe run --trace`: statistics in the course of a run.
class Trace : public ToolTest {
 protected:
  /// The lines of a file, each split at its commas.
  std::vector<std::vector<std::string>> rows_of(const std::string& name) const {
    std::vector<std::vector<std::string>> rows;
    std::istringstream file(read_file(folder() / name));
    for (std::string line; std::getline(file, line);) {
      std::vector<std::string>& row = rows.emplace_back(1);
      for (const char letter : line) {
        if (letter == ',') {
          row.emplace_back();
        } else {
          row.back() += letter;
        }
      }
    }
    return rows;
  }
  static const nlohmann::json& statistic(const nlohmann::json& run, const std::string& name) {
    for (const nlohmann::json& each : run["statistics"]) {
      if (each["name"] == name) return each;
    }
    throw std::out_of_range(name);
  }
};

TEST_F(Trace, ARowEverySoManyCyclesAndTheResultInTheLast) {
  for (const char* fidelity : {"lt", "at", "cycle"}) {
    const std::vector<std::string> command{"run", "--scene", "tiny.spl", "--fidelity", fidelity};
    std::vector<std::string> traced = command;
    traced.insert(traced.end(), {"--trace", "t.csv", "--trace-every", "100", "--trace-statistics",
                                 "crop.quads_blended,gpc0.sm.fragment_warps,l2.color_bytes_read"});
    const nlohmann::json run = json_of(traced)["runs"][0];
    EXPECT_EQ(run["result_hash"], json_of(command)["runs"][0]["result_hash"]);

    const auto rows = rows_of("t.csv");
    EXPECT_EQ(rows[0], (std::vector<std::string>{"cycle", "crop.quads_blended", "gpc0.sm.fragment_warps",
                                                 "l2.color_bytes_read"}));
    const auto cycles = run["cycles"].get<std::uint64_t>();
    ASSERT_EQ(rows.size(), 1 + (cycles + 99) / 100);
    for (std::size_t i = 1; i + 1 < rows.size(); ++i) EXPECT_EQ(rows[i][0], std::to_string(100 * i));
    EXPECT_EQ(rows.back(), (std::vector<std::string>{std::to_string(cycles), run["counts"]["quads_blended"].dump(),
                                                     run["counts"]["warps"].dump(),
                                                     statistic(run, "l2.color_bytes_read")["value"].dump()}));
  }
}

TEST_F(Trace, TellsWhereQuadsGoEvery1000CyclesUnlessToldOtherwise) {
  EXPECT_EQ(vrpipe({"run", "--scene", "tiny.spl", "--trace", "t.csv"}).code, 0);
  const auto rows = rows_of("t.csv");
  EXPECT_EQ(rows[0], (std::vector<std::string>{"cycle", "raster.quads_rasterized", "zrop.quads_terminated",
                                               "sm.quads_shaded", "sm.quads_pruned", "sm.quads_merged",
                                               "crop.quads_blended", "l2.color_bytes_read", "l2.color_bytes_written"}));
  EXPECT_EQ(rows[1][0], "1000");
}

TEST_F(Trace, AHistogramIsTwoColumnsAndWhatHasNoValueYetIsEmpty) {
  const nlohmann::json run =
      json_of({"run", "--scene", "tiny.spl", "--trace", "t.csv", "--trace-every", "1", "--trace-statistics",
               "tc.quads_per_flush,raster.widest_edge,crop.cache.line_hit_rate"})["runs"][0];
  const auto rows = rows_of("t.csv");
  EXPECT_EQ(rows[0], (std::vector<std::string>{"cycle", "tc.quads_per_flush.count", "tc.quads_per_flush.sum",
                                               "raster.widest_edge", "crop.cache.line_hit_rate"}));
  EXPECT_EQ(rows[1], (std::vector<std::string>{"1", "0", "0", "", ""}));
  const nlohmann::json& flushes = statistic(run, "tc.quads_per_flush");
  EXPECT_EQ(rows.back()[1], flushes["histogram"]["count"].dump());
  EXPECT_EQ(rows.back()[2], flushes["histogram"]["sum"].dump());
  EXPECT_EQ(rows.back()[3], statistic(run, "raster.widest_edge")["value"].dump());
  EXPECT_NEAR(std::stod(rows.back()[4]), statistic(run, "crop.cache.line_hit_rate")["value"].get<double>(), 1e-5);
}

TEST_F(Trace, GoesIntoTheFolderOfTheImages) {
  EXPECT_EQ(vrpipe({"run", "--scene", "tiny.spl", "--output", "images", "--trace", "images/t.csv"}).code, 0);
  EXPECT_EQ(files(), (std::vector<std::string>{"images", "images/t.csv", "images/tiny-het+qm.exr",
                                               "images/tiny-het+qm.png", "tiny.spl"}));
}

TEST_F(Trace, ThatCannotBeWrittenIsAMistake) {
  const Finished full = vrpipe({"run", "--scene", "tiny.spl", "--trace", "/dev/full"});
  EXPECT_EQ(full.code, 2);
  EXPECT_NE(full.err.find("cannot write file (--trace /dev/full)"), std::string::npos) << full.err;
}

}  // namespace
}  // namespace vrpipe::testing
