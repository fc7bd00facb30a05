// `vrpipe diff`: what differs between two results.
#include "tool_test_support.h"

#include <regex>
#include <sstream>

namespace vrpipe::testing {
namespace {

using nlohmann::json;

class Diff : public ToolTest {
 protected:
  void result(const std::string& file, std::vector<std::string> options) const {
    options.insert(options.end(), {"--scene", "tiny.spl", "--json", file});
    const Finished finished = vrpipe(std::move(options));
    ASSERT_EQ(finished.code, 0) << finished.err;
  }
  json diff(const std::string& a = "a.json", const std::string& b = "b.json") const { return json_of({"diff", a, b}); }
};

json find(const json& diff, const std::string& run, const std::string& key) {
  for (const json& each : diff["differences"]) {
    if (each["key"] == key && (run.empty() ? each["run"].is_null() : each["run"] == run)) return each;
  }
  return json();
}

TEST_F(Diff, OfTheSameRunTwiceIsNothing) {
  result("a.json", {"compare"});
  result("b.json", {"compare", "--jobs", "1"});
  const json same = diff();
  EXPECT_TRUE(same["equal"]);
  EXPECT_EQ(same["differences"], json::array());
  EXPECT_EQ(same["pictures"].size(), 4U);
  for (const json& picture : same["pictures"]) EXPECT_EQ(picture["same_result_hash"], true);
  EXPECT_NE(vrpipe({"diff", "a.json", "b.json"}).out.find("nothing differs"), std::string::npos);
}

TEST_F(Diff, NamesTheSettingAndWhatCameOfIt) {
  result("a.json", {"compare"});
  result("b.json", {"compare", "--set", "tc.bins=2"});
  const json changed = diff();
  EXPECT_FALSE(changed["equal"]);
  EXPECT_EQ(find(changed, "", "platform.parameters.tc.bins"), json({{"group", "settings"},
                                                                    {"run", nullptr},
                                                                    {"key", "platform.parameters.tc.bins"},
                                                                    {"a", 32},
                                                                    {"b", 2},
                                                                    {"change_percent", -93.75}}));
  const json flushes = find(changed, "baseline", "counts.tc_flushes");
  ASSERT_FALSE(flushes.is_null());
  EXPECT_EQ(flushes["group"], "counts");
  EXPECT_GT(flushes["b"], flushes["a"]);
  EXPECT_EQ(find(changed, "baseline", "cycles")["group"], "time");
  EXPECT_FALSE(find(changed, "baseline", "statistics.tc.flushes.value").is_null());
  EXPECT_TRUE(find(changed, "", "host.load_average").is_null());
  EXPECT_TRUE(find(changed, "", "platform.origins.tc.bins").is_null());
}

// A parameter changes hundreds of numbers.
TEST_F(Diff, SaysOnOneScreenWhatWasAskedForAndWhatCameOfIt) {
  result("a.json", {"compare"});
  result("b.json", {"compare", "--set", "tc.bins=2"});
  const std::string text = vrpipe({"diff", "a.json", "b.json"}).out;
  EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 40) << text;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
  const json a = json::parse(read_file(folder() / "a.json")), b = json::parse(read_file(folder() / "b.json"));
  for (std::size_t run = 0; run < 4; ++run) {
    const std::uint64_t from = a["runs"][run]["cycles"], to = b["runs"][run]["cycles"];
    const std::string name = a["runs"][run]["name"];
    std::smatch row;
    ASSERT_TRUE(std::regex_search(text, row,
                                  std::regex("\n  " + std::regex_replace(name, std::regex("\\+"), "\\+") +
                                             " +([0-9,]+) +([0-9,]+) +([0-9.]+) +([0-9.x-]+) +([0-9.x-]+)")))
        << text;
    EXPECT_EQ(std::regex_replace(row[1].str(), std::regex(","), ""), std::to_string(from));
    EXPECT_EQ(std::regex_replace(row[2].str(), std::regex(","), ""), std::to_string(to));
    EXPECT_NEAR(std::stod(row[3]), static_cast<double>(to) / static_cast<double>(from), 0.0005);
    if (name == "baseline") continue;
    EXPECT_NEAR(std::stod(row[4]), a["speedup"][name].get<double>(), 0.005);
    EXPECT_NEAR(std::stod(row[5]), b["speedup"][name].get<double>(), 0.005);
  }
  EXPECT_LT(text.find("platform.parameters.tc.bins"), text.find("speed-up A"));
  EXPECT_LT(text.find("speed-up A"), text.find("statistics that changed most"));
  EXPECT_EQ(text.find("buckets"), std::string::npos);
  EXPECT_EQ(text.find("units.gpc0"), std::string::npos);
  const std::string all = vrpipe({"diff", "a.json", "b.json", "--all"}).out;
  for (const json& each : diff()["differences"])
    EXPECT_NE(all.find(each["key"].get<std::string>()), std::string::npos) << each;
}

TEST_F(Diff, RefusesResultsOfDifferentCommands) {
  result("run.json", {"run", "--variant", "het"});
  result("compare.json", {"compare"});
  ASSERT_EQ(vrpipe({"microbench", "kill-rate", "--json", "bench.json"}).code, 0);
  refused({"diff", "compare.json", "bench.json"},
          {"results of different commands", "(bench.json)", "vrpipe.microbench/1", "compare.json of vrpipe.compare/1"});
  // These hold the same: a run of one is matched with that of the other.
  const json changed = diff("run.json", "compare.json");
  EXPECT_EQ(changed["only_in_b"], json::array({"baseline", "qm", "het+qm"}));
  EXPECT_TRUE(find(changed, "het", "cycles").is_null());
}

TEST_F(Diff, MatchesRunsAndUnitsByName) {
  result("a.json", {"compare", "--variant", "het", "--variant", "baseline"});
  result("b.json", {"compare", "--variant", "baseline", "--variant", "mine=het,tc.bins=2", "--relative-to", "mine"});
  const json changed = diff();
  EXPECT_EQ(changed["only_in_a"], json::array({"het"}));
  EXPECT_EQ(changed["only_in_b"], json::array({"mine"}));
  for (const json& each : changed["differences"]) EXPECT_TRUE(each["run"].is_null()) << each;
  EXPECT_EQ(find(changed, "", "relative_to")["b"], "mine");
}

TEST_F(Diff, ComparesPicturesThatAreThere) {
  result("a.json", {"run", "--output", "one"});
  result("b.json", {"run", "--output", "two"});
  EXPECT_EQ(diff()["pictures"][0]["error"]["max_abs_error"], 0);
  result("b.json", {"run", "--output", "two", "--set", "state.blend_rounding=rtz"});
  const json error = diff()["pictures"][0]["error"];
  EXPECT_GT(error["max_abs_error"], 0);
  EXPECT_LT(error["max_abs_error"], 0.1);
  EXPECT_GT(error["psnr_db"], 40);
  std::filesystem::remove_all(folder() / "one");
  const json missing = diff()["pictures"][0];
  EXPECT_TRUE(missing["error"].is_null());
  EXPECT_NE(missing["reason"].get<std::string>().find("a.json"), std::string::npos);
}

TEST_F(Diff, OfPicturesOfTwoSizesSaysSo) {
  const std::vector<std::string> run{"run", "--scene", "builtin:object", "--fidelity", "functional"};
  for (const std::string side : {"8", "12"}) {
    std::vector<std::string> of = run;
    of.insert(of.end(), {"--size", side + "x8", "--output", side, "--json", side + ".json"});
    ASSERT_EQ(vrpipe(of).code, 0);
  }
  const json other = diff("8.json", "12.json");
  EXPECT_NE(other["pictures"][0]["reason"].get<std::string>().find("8x8 and 12x8"), std::string::npos);
  EXPECT_EQ(find(other, "", "scene.width")["group"], "drawn");
}

TEST_F(Diff, TakesResultsOfOtherCommandsThanCompare) {
  for (const char* file : {"a.json", "b.json"}) {
    const std::string seed = file == std::string("a.json") ? "300" : "400";
    const Finished finished = vrpipe({"microbench", "kill-rate", "--set", "l2.latency_cycles=" + seed, "--json", file});
    ASSERT_EQ(finished.code, 0) << finished.err;
  }
  EXPECT_FALSE(find(diff(), "", "platform.parameters.l2.latency_cycles").is_null());
}

TEST_F(Diff, RefusesWhatIsNoResult) {
  result("a.json", {"run", "--fidelity", "functional"});
  write("list.json", "[1, 2]");
  write("other.json", "{\"schema\": 3}");
  write("broken.json", "{\"schema\": ");
  refused({"diff", "a.json", "nowhere.json"}, {"nowhere.json", "no such file"});
  refused({"diff", "a.json", "list.json"}, {"list.json", "no schema of vrpipe"});
  refused({"diff", "other.json", "a.json"}, {"other.json"});
  refused({"diff", "a.json", "broken.json"}, {"broken.json", "no JSON from byte"});
  refused({"diff", "nowhere.json", "broken.json"}, {"nowhere.json", "no such file"});
  refused({"diff", "a.json", "."}, {"cannot read result"});
  refused({"diff", "a.json"}, {"B.json"});
  refused({"diff", "a.json", "a.json", "--json", "a.json"}, {"--json"});
}

}  // namespace
}  // namespace vrpipe::testing
