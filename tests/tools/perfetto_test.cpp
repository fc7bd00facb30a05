#include <cmath>
#include <limits>
#include <map>
#include <set>

#include <vrpipe/platforms/simulation.h>

#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

constexpr std::uint64_t no_end = std::numeric_limits<std::uint64_t>::max();

/// `vrpipe run --trace`, read back.
class Perfetto : public ToolTest {
 protected:
  using TrackId = std::pair<unsigned, unsigned>;
  struct Timeline {
    json about;
    std::map<TrackId, std::string> tracks;
    std::map<std::string, std::map<std::string, std::uint64_t>> states;  ///< cycles of each unit
    std::map<std::string, unsigned> instants;                            ///< by track
    std::set<std::string> counters;
    std::map<std::string, std::int64_t> sums;  ///< of a counter's values
  };

  /// Reads a trace, and checks what holds of all: slices of a track do not overlap, counters are not negative, and all
  /// is between two cycles.
  Timeline read(const std::string& name, std::uint64_t from, std::uint64_t to) const {
    const json trace = json::parse(read_file(folder() / name));
    Timeline timeline;
    timeline.about = trace["otherData"];
    const auto mhz = timeline.about["frequency_mhz"].get<double>();
    const json& events = trace["traceEvents"];
    for (const json& event : events) {
      if (event["ph"] != "M" || event["name"] != "thread_name") continue;
      const bool is_new = timeline.tracks.emplace(id(event), event["args"]["name"]).second;
      EXPECT_TRUE(is_new) << event;
    }
    std::map<TrackId, double> until;
    std::map<TrackId, std::uint64_t> until_cycle;
    for (const json& event : events) {
      if (event["ph"] == "M") continue;
      const auto cycle = static_cast<std::uint64_t>(std::llround(event["ts"].get<double>() * mhz));
      EXPECT_GE(cycle, from) << event;
      EXPECT_LE(cycle, to) << event;
      if (event["ph"] == "C") {
        EXPECT_EQ(event["args"].size(), 1U);
        const auto value = event["args"].front().get<std::int64_t>();
        EXPECT_GE(value, 0) << event;
        timeline.counters.insert(event["name"]);
        timeline.sums[event["name"]] += value;
        continue;
      }
      EXPECT_EQ(event["args"]["cycle"], cycle) << event;
      EXPECT_EQ(timeline.tracks.count(id(event)), 1U) << event;
      if (event["ph"] == "i") {
        ++timeline.instants[timeline.tracks[id(event)]];
        continue;
      }
      EXPECT_EQ(event["ph"], "X");
      const auto cycles = event["args"]["cycles"].get<std::uint64_t>();
      EXPECT_GT(cycles, 0U);
      EXPECT_LE(cycle + cycles, to);
      EXPECT_GE(cycle, until_cycle[id(event)]) << event;
      EXPECT_GE(event["ts"].get<double>(), until[id(event)] - 1e-9) << event;
      until_cycle[id(event)] = cycle + cycles;
      until[id(event)] = event["ts"].get<double>() + event["dur"].get<double>();
      timeline.states[timeline.tracks[id(event)]][event["name"]] += cycles;
    }
    return timeline;
  }

 private:
  static TrackId id(const json& event) { return {event["pid"].get<unsigned>(), event["tid"].get<unsigned>()}; }
};

TEST_F(Perfetto, StatesSumToThoseOfTheRunAndNothingChanges) {
  for (const char* fidelity : {"lt", "cycle"}) {
    SCOPED_TRACE(fidelity);
    const std::vector<std::string> command{"run", "--scene", "tiny.spl", "--fidelity", fidelity};
    std::vector<std::string> traced = command;
    traced.insert(traced.end(), {"--trace", "t.json", "--interval", "10"});
    const json run = json_of(traced)["runs"][0];
    EXPECT_EQ(run["result_hash"], json_of(command)["runs"][0]["result_hash"]);
    const auto cycles = run["cycles"].get<std::uint64_t>();
    const Timeline timeline = read("t.json", 0, cycles);
    for (const json& unit : run["units"]) {
      const auto& states = timeline.states.at(unit["name"]);
      for (const auto& [state, total] : unit["cycles"].items()) {
        const auto found = states.find(state);
        EXPECT_EQ(found == states.end() ? 0 : found->second, total) << unit["name"] << " " << state;
      }
    }
    EXPECT_EQ(timeline.instants.at("gpc0.tc.bins"), run["counts"]["tc_flushes"]);
    EXPECT_EQ(timeline.instants.at("gpc0.qru.warps"), run["counts"]["warps"]);
    for (const char* counter : {"fragment warps in flight", "gpc0.tc bins in use", "l2.color_bytes_read"}) {
      EXPECT_EQ(timeline.counters.count(counter), 1U) << counter;
    }
    EXPECT_EQ(timeline.counters.count("queue gpc0.tc.bins"), std::string(fidelity) == "lt" ? 0U : 1U);
    // At the others bins come and go at once.
    EXPECT_EQ(timeline.counters.count("gpc0.tgc bins in use"), std::string(fidelity) == "cycle" ? 1U : 0U);
    EXPECT_EQ(timeline.about["platform"], "agx-orin");
    EXPECT_EQ(timeline.about["variant"], "het+qm");
    EXPECT_EQ(timeline.about["fidelity"], fidelity);
    EXPECT_EQ(timeline.about["scene"], "tiny.spl");
  }
}

TEST_F(Perfetto, AWindowHasWhatAllHasThere) {
  const auto states_in = [&](const std::string& window, std::uint64_t from, std::uint64_t to) {
    EXPECT_EQ(vrpipe({"run", "--scene", "tiny.spl", "--trace", "t.json" + window}).code, 0);
    return read("t.json", from, to).states;
  };
  const auto all = states_in("", 0, no_end);
  std::map<std::string, std::map<std::string, std::uint64_t>> parts;
  for (const auto& part :
       {states_in("@:300", 0, 300), states_in("@300:1000", 300, 1000), states_in("@1000:", 1000, no_end)}) {
    for (const auto& [unit, states] : part) {
      for (const auto& [state, cycles] : states) parts[unit][state] += cycles;
    }
  }
  EXPECT_EQ(parts, all);
}

TEST_F(Perfetto, AnAtInTheNameOfAFileIsNoWindow) {
  EXPECT_EQ(vrpipe({"run", "--scene", "tiny.spl", "--trace", "t@home"}).code, 0);
  EXPECT_EQ(files(), (std::vector<std::string>{"t@home", "tiny.spl"}));
}

TEST_F(Perfetto, HasAGroupForEachGpc) {
  EXPECT_EQ(vrpipe({"run", "--scene", "tiny.spl", "--platform", "desktop", "--trace", "t.json"}).code, 0);
  const json trace = json::parse(read_file(folder() / "t.json"));
  std::set<std::string> groups;
  for (const json& event : trace["traceEvents"]) {
    if (event["name"] == "process_name") groups.insert(event["args"]["name"]);
  }
  EXPECT_EQ(groups.size(), 1U + platform_named("desktop").gpcs);
  EXPECT_EQ(groups.count("desktop het+qm, gpc1"), 1U);
}

TEST_F(Perfetto, GoesIntoTheFolderOfTheImages) {
  EXPECT_EQ(vrpipe({"run", "--scene", "tiny.spl", "--output", "images", "--trace", "images/t.json"}).code, 0);
  EXPECT_EQ(files(), (std::vector<std::string>{"images", "images/t.json", "images/tiny-het+qm.exr",
                                               "images/tiny-het+qm.png", "tiny.spl"}));
}

TEST_F(Perfetto, ThatCannotBeWrittenIsAMistake) {
  const Finished full = vrpipe({"run", "--scene", "tiny.spl", "--trace", "/dev/full"});
  EXPECT_EQ(full.code, 2);
  EXPECT_NE(full.err.find("cannot write file (--trace /dev/full)"), std::string::npos) << full.err;
  const std::vector<std::string> run{"run", "--scene", "tiny.spl"};
  const auto refused_here = [&](std::vector<std::string> options, const std::vector<std::string>& parts) {
    options.insert(options.begin(), run.begin(), run.end());
    refused(options, parts);
  };
  for (const char* fidelity : {"functional", "bound"}) {
    refused_here({"--trace", "t.json", "--fidelity", fidelity}, {"--trace", fidelity, "use lt or cycle"});
  }
  refused_here({"--trace", "t.json@20:10"}, {"'@20:10'", "--trace", "it ends before it begins", "@1000:2000"});
  refused_here({"--trace", "t.json@9999999:"}, {"--trace t.json@9999999:", "the run ends after", "begin earlier"});
  refused_here({"--trace", "t.json@1k:2k"}, {"'@1k:2k'", "whole numbers"});
  refused_here({"--trace", "t.json", "--trace", "u.json"}, {"twice"});
  refused({"compare", "--trace", "t.json"}, {"'--trace'", "`vrpipe run`"});
}

}  // namespace
}  // namespace vrpipe::testing
