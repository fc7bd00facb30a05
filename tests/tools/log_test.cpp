#include <map>
#include <regex>
#include <sstream>

#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

/// `vrpipe run --log`.
class Log : public ToolTest {
 protected:
  struct Line {
    std::uint64_t cycle;
    std::string unit, what;
  };
  static std::vector<Line> lines_of(const std::string& text) {
    std::vector<Line> lines;
    std::istringstream all(text);
    const std::regex form(" *([0-9]+) ([a-z0-9.]+) (.+)");
    for (std::string line; std::getline(all, line);) {
      std::smatch parts;
      EXPECT_TRUE(std::regex_match(line, parts, form)) << line;
      if (!parts.empty()) lines.push_back({std::stoull(parts[1]), parts[2], parts[3]});
    }
    return lines;
  }
  static unsigned count(const std::vector<Line>& lines, const std::string& beginning) {
    return static_cast<unsigned>(std::count_if(lines.begin(), lines.end(),
                                               [&](const Line& line) { return line.what.rfind(beginning, 0) == 0; }));
  }
};

TEST_F(Log, HasWhatPassesLinksAndStatesAndChangesNothing) {
  for (const char* fidelity : {"lt", "cycle"}) {
    SCOPED_TRACE(fidelity);
    const std::vector<std::string> command{"run", "--scene", "tiny.spl", "--fidelity", fidelity};
    std::vector<std::string> logged = command;
    logged.insert(logged.end(), {"--log", "qru", "--log-file", "log.txt"});
    const nlohmann::json run = json_of(logged)["runs"][0];
    EXPECT_EQ(run["result_hash"], json_of(command)["runs"][0]["result_hash"]);
    const std::vector<Line> lines = lines_of(read_file(folder() / "log.txt"));
    EXPECT_EQ(count(lines, "out gpc0.qru.warps: warp "), run["counts"]["warps"]);
    EXPECT_GT(count(lines, "in gpc0.prop.survivors: "), 0U);
    EXPECT_GT(count(lines, "state busy"), 0U);
    for (const Line& line : lines) EXPECT_EQ(line.unit, "gpc0.qru");
  }
}

TEST_F(Log, SaysWhyABinIsFlushedAndWhatIsTerminated) {
  const nlohmann::json run = json_of({"run", "--scene", "tiny.spl", "--fidelity", "lt", "--log", "gpc0.tc", "--log",
                                      "crop", "--log-file", "log.txt"})["runs"][0];
  const std::string text = read_file(folder() / "log.txt");
  EXPECT_EQ(count(lines_of(text), "out gpc0.tc.bins: bin of tile "), run["counts"]["tc_flushes"]);
  EXPECT_TRUE(std::regex_search(text, std::regex("quads?, flushed: (full|evicted|timed out|end of the draw)")));
  EXPECT_TRUE(std::regex_search(text, std::regex("out gpc0.crop.terminations: pixels [01]{4} of quad [0-9]+ of tile")));
}

TEST_F(Log, GoesToStderrForAWindow) {
  const Finished finished = vrpipe({"run", "--scene", "tiny.spl", "--platform", "agx-orin-ideal-memory", "--log",
                                    "raster@100:200", "--log", "raster@150:300"});
  EXPECT_EQ(finished.code, 0);
  const std::vector<Line> lines = lines_of(finished.err);
  EXPECT_FALSE(lines.empty());
  for (const Line& line : lines) {
    EXPECT_GE(line.cycle, 100U);
    EXPECT_LT(line.cycle, 300U);
  }
  EXPECT_EQ(vrpipe({"run", "--scene", "tiny.spl", "--log", "raster@0:1"}).err.size(), 0U);
}

TEST_F(Log, RefusesWhatItCannotLog) {
  const auto refused_here = [&](std::vector<std::string> options, const std::vector<std::string>& parts) {
    options.insert(options.begin(), {"run", "--scene", "tiny.spl"});
    refused(options, parts);
  };
  refused_here({"--log", "crp"}, {"'crp'", "--log", "did you mean crop?"});
  refused_here({"--log", "gpc1.crop"}, {"'gpc1.crop'", "did you mean gpc0.crop?"});
  refused_here({"--log", "l2"}, {"'l2'", "a memory has no states"});
  refused_here({"--log", "crop@7:7"}, {"'@7:7'", "it ends before it begins"});
  refused_here({"--log", "crop@9999999:"}, {"--log crop@9999999:", "the run ends after", "begin earlier"});
  refused_here({"--log", "crop@9999999:", "--log-file", "log.txt"}, {"--log crop@9999999:", "the run ends after"});
  refused_here({"--log", "crop", "--fidelity", "functional"}, {"--log", "functional", "use lt or cycle"});
  refused_here({"--log-file", "log.txt"}, {"--log-file", "add --log UNIT"});
  refused_here({"--log", "crop", "--log-file", "no/log.txt"}, {"--log-file no/log.txt", "no folder no"});
  refused_here({"--log", "crop", "--log-file", "tiny.spl"}, {"is the same file"});
  refused_here({"--log", "crop", "--explain-effects"}, {"--explain-effects", "--log"});
  refused({"compare", "--log", "crop"}, {"'--log'", "`vrpipe run`"});
}

}  // namespace
}  // namespace vrpipe::testing
