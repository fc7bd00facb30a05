#include <map>
#include <numeric>

#include "csv_rows.h"
#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

/// `--interval`: a run in intervals.
class Interval : public ToolTest {
 protected:
  static const json& statistic(const json& run, const std::string& name) {
    for (const json& each : run["statistics"]) {
      if (each["name"] == name) return each;
    }
    throw std::out_of_range(name);
  }
  static std::uint64_t sum(const json& values) {
    std::uint64_t total = 0;
    for (const json& value : values) total += value.get<std::uint64_t>();
    return total;
  }
  /// States of each interval sum to its length, and all intervals to the run's.
  static void check_states(const json& run) {
    const json& intervals = run["intervals"];
    const auto cycles = run["cycles"].get<std::uint64_t>();
    const std::size_t count = intervals["from"].size();
    ASSERT_EQ(intervals["states"].size(), run["units"].size());
    for (const json& unit : run["units"]) {
      const json& states = intervals["states"][unit["name"].get<std::string>()];
      ASSERT_EQ(states.size(), unit["cycles"].size());
      for (const auto& [state, total] : unit["cycles"].items()) {
        ASSERT_EQ(states[state].size(), count);
        EXPECT_EQ(sum(states[state]), total) << unit["name"] << " " << state;
      }
      for (std::size_t i = 0; i < count; ++i) {
        const std::uint64_t until = i + 1 < count ? intervals["from"][i + 1].get<std::uint64_t>() : cycles;
        std::uint64_t all = 0;
        for (const json& of_state : states) all += of_state[i].get<std::uint64_t>();
        EXPECT_EQ(all, until - intervals["from"][i].get<std::uint64_t>()) << unit["name"] << " in interval " << i;
      }
    }
  }
};

const std::vector<std::string> timed_fidelities{"lt", "cycle"};

TEST_F(Interval, SumToTheRunAndChangeNothing) {
  for (const std::string& fidelity : timed_fidelities) {
    SCOPED_TRACE(fidelity);
    const std::vector<std::string> command{"run", "--scene", "tiny.spl", "--fidelity", fidelity};
    const json plain = json_of(command)["runs"][0];
    for (const char* cycles : {"1", "100", "999999"}) {
      SCOPED_TRACE(cycles);
      std::vector<std::string> with_intervals = command;
      with_intervals.insert(with_intervals.end(), {"--interval", cycles});
      const json run = json_of(with_intervals)["runs"][0];
      EXPECT_EQ(run["result_hash"], plain["result_hash"]);
      const json& intervals = run["intervals"];
      EXPECT_EQ(intervals["cycles"], std::stoull(cycles));
      const std::uint64_t every = std::stoull(cycles), all = run["cycles"].get<std::uint64_t>();
      ASSERT_EQ(intervals["from"].size(), (all + every - 1) / every);
      for (std::size_t i = 0; i < intervals["from"].size(); ++i) EXPECT_EQ(intervals["from"][i], i * every);
      check_states(run);
      EXPECT_EQ(intervals["statistics"].size(), 8U) << "where quads go, and what CROP moves";
      for (const auto& [name, values] : intervals["statistics"].items()) {
        EXPECT_EQ(values.size(), intervals["from"].size());
        EXPECT_EQ(sum(values), statistic(run, name)["value"]) << name;
      }
    }
    EXPECT_FALSE(plain.contains("intervals"));
  }
}

TEST_F(Interval, ARunThatStopsIsTheBeginningOfTheWhole) {
  for (const char* variant : {"baseline", "het+qm"}) {
    const std::vector<std::string> command{"run", "--scene", "tiny.spl", "--variant", variant};
    const auto with = [&](std::vector<std::string> options) {
      options.insert(options.begin(), command.begin(), command.end());
      return json_of(options)["runs"][0];
    };
    const json whole = with({"--interval", "1000"});
    const json part = with({"--until", "1000"});
    EXPECT_TRUE(part["stopped"].get<bool>());
    EXPECT_FALSE(whole["stopped"].get<bool>());
    EXPECT_GE(part["cycles"], 1000U);
    EXPECT_LT(part["cycles"], 1040U) << "but for what is under way";
    std::size_t compared = 0;
    for (const json& each : part["statistics"]) {
      const json& in_intervals = whole["intervals"]["statistics"];
      const auto found = in_intervals.find(each["name"].get<std::string>());
      if (found == in_intervals.end()) continue;
      EXPECT_EQ(each["value"], found->at(0)) << each["name"];
      ++compared;
    }
    EXPECT_GT(compared, 4U);
    EXPECT_LT(part["counts"]["quads_blended"], whole["counts"]["quads_blended"]);
    EXPECT_GT(part["counts"]["quads_blended"], 0U);
    const json beyond = with({"--until", "1000000"});
    EXPECT_FALSE(beyond["stopped"].get<bool>());
    EXPECT_EQ(beyond["result_hash"], whole["result_hash"]);
  }
  EXPECT_NE(
      vrpipe({"run", "--scene", "tiny.spl", "--until", "400"}).out.find("stopped at cycle 400: the frame goes on"),
      std::string::npos);
  refused({"run", "--scene", "tiny.spl", "--until", "400", "--fidelity", "lt"},
          {"cannot stop at a cycle", "lt", "use cycle"});
  refused({"run", "--scene", "tiny.spl", "--until", "0"}, {"--until", "'0'"});
}

// That the last interval is what the others leave of the total does not hide what is charged to a wrong one.
TEST_F(Interval, OfHalfTheLengthAreThePartsOfThoseOfTheWhole) {
  for (const std::string& fidelity : timed_fidelities) {
    const auto of = [&](const char* cycles) {
      return json_of({"run", "--scene", "tiny.spl", "--fidelity", fidelity, "--interval",
                      cycles})["runs"][0]["intervals"]["states"];
    };
    const json whole = of("64"), half = of("32");
    for (const auto& [unit, states] : whole.items()) {
      for (const auto& [state, cycles] : states.items()) {
        const json& halves = half[unit][state];
        for (std::size_t i = 0; i < cycles.size(); ++i) {
          const auto second = 2 * i + 1 < halves.size() ? halves[2 * i + 1].get<std::uint64_t>() : 0;
          EXPECT_EQ(cycles[i], halves[2 * i].get<std::uint64_t>() + second) << fidelity << unit << state << i;
        }
      }
    }
  }
}

TEST_F(Interval, RatiosAndMeansAreOfTheInterval) {
  const json run = json_of({"run", "--scene", "tiny.spl", "--interval", "200", "--interval-statistics",
                            "crop.cache.line_hit_rate,crop.cache.line_hits,crop.cache.line_misses,"
                            "tc.quads_per_flush,tc.flushes,raster.widest_edge"})["runs"][0];
  const json& statistics = run["intervals"]["statistics"];
  const std::size_t count = run["intervals"]["from"].size();
  bool any_null = false;
  for (std::size_t i = 0; i < count; ++i) {
    const auto hits = statistics["crop.cache.line_hits"][i].get<double>();
    const double lines = hits + statistics["crop.cache.line_misses"][i].get<double>();
    const json& rate = statistics["crop.cache.line_hit_rate"][i];
    EXPECT_EQ(rate.is_null(), lines == 0);
    if (lines > 0) {
      EXPECT_NEAR(rate.get<double>(), hits / lines, 1e-12);
    }
    EXPECT_EQ(statistics["tc.quads_per_flush"][i].is_null(), statistics["tc.flushes"][i] == 0);
    any_null = any_null || rate.is_null();
  }
  EXPECT_TRUE(any_null) << "before the first blend";
  EXPECT_TRUE(statistics["raster.widest_edge"][0].is_number() || statistics["raster.widest_edge"][0].is_null());
  EXPECT_EQ(statistics["raster.widest_edge"][count - 1], statistic(run, "raster.widest_edge")["value"]);
}

TEST_F(Interval, ComeBackFromTheProcessesOfCompare) {
  const json result = json_of({"compare", "--scene", "tiny.spl", "--interval", "250", "--jobs", "2"});
  ASSERT_EQ(result["runs"].size(), 4U);
  for (const json& run : result["runs"]) {
    check_states(run);
    const json alone = json_of(
        {"run", "--scene", "tiny.spl", "--variant", run["variant"].get<std::string>(), "--interval", "250"})["runs"][0];
    EXPECT_EQ(run["intervals"], alone["intervals"]) << run["variant"];
    EXPECT_EQ(run["result_hash"], alone["result_hash"]);
  }
}

TEST_F(Interval, ATableHasTheSame) {
  const json result = json_of(
      {"compare", "--scene", "tiny.spl", "--interval", "300", "--interval-csv", "i.csv", "--platform", "desktop"});
  const auto rows = csv_rows(read_file(folder() / "i.csv"));
  std::size_t row = 1;
  for (const json& run : result["runs"]) {
    const json& intervals = run["intervals"];
    for (std::size_t i = 0; i < intervals["from"].size(); ++i, ++row) {
      ASSERT_LT(row, rows.size());
      ASSERT_EQ(rows[row].size(), rows[0].size());
      std::map<std::string, std::string> cells;
      for (std::size_t column = 0; column < rows[0].size(); ++column) cells[rows[0][column]] = rows[row][column];
      EXPECT_EQ(cells["run"], run["variant"]);
      EXPECT_EQ(cells["from"], intervals["from"][i].dump());
      EXPECT_EQ(cells["crop.quads_blended"], intervals["statistics"]["crop.quads_blended"][i].dump());
      EXPECT_EQ(cells["gpc1.crop.busy"], intervals["states"]["gpc1.crop"]["busy"][i].dump());
    }
    EXPECT_EQ(rows[row - 1][2], run["cycles"].dump()) << "where the last ends";
  }
  EXPECT_EQ(row, rows.size());
  EXPECT_EQ(vrpipe({"run", "--scene", "tiny.spl", "--interval", "300", "--interval-csv", "one.csv"}).code, 0);
  EXPECT_EQ(csv_rows(read_file(folder() / "one.csv"))[0][0], "from") << "of one run";
}

TEST_F(Interval, AreRefusedWithoutTimeOrWithoutAPlace) {
  for (const char* command : {"run", "compare"}) {
    const auto refused_here = [&](std::vector<std::string> options, const std::vector<std::string>& parts) {
      options.insert(options.begin(), {command, "--scene", "tiny.spl", "--json", "r.json"});
      refused(options, parts);
    };
    refused_here({"--interval", "0"}, {"'0'", "--interval", "from 1"});
    refused_here({"--interval", "1k"}, {"'1k'", "--interval"});
    for (const char* fidelity : {"functional", "bound"}) {
      refused_here({"--interval", "100", "--fidelity", fidelity}, {"--interval", fidelity, "use lt or cycle"});
    }
    refused_here({"--interval-csv", "i.csv"}, {"--interval-csv", "add --interval CYCLES"});
    refused_here({"--interval-statistics", "tc.flushes"}, {"--interval-statistics", "add --interval CYCLES"});
    refused_here({"--interval", "9", "--interval-statistics", "crop.quads_blendet"},
                 {"'crop.quads_blendet'", "did you mean crop.quads_blended?"});
    refused_here({"--interval", "9", "--interval-statistics", "tc.flushes,"}, {"--interval-statistics", "missing"});
    refused_here({"--interval", "9", "--explain-effects"}, {"--explain-effects", "--interval"});
    refused_here({"--interval", "9", "--interval-csv", "r.json"}, {"is the same file"});
    refused_here({"--interval", "9", "--interval-csv", "no/i.csv"}, {"--interval-csv no/i.csv", "no folder no"});
    refused({command, "--scene", "tiny.spl", "--interval", "9"},
            {"--interval", "add --json FILE, --interval-csv FILE.csv or --html"});
  }
  refused({"compare", "--views", "2", "--interval", "9", "--json", "r.json"}, {"--interval", "or --views"});
  refused({"accuracy", "--interval", "9"}, {"'--interval'", "`vrpipe run`"});
}

}  // namespace
}  // namespace vrpipe::testing
