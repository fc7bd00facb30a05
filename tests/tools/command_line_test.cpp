#include "tool_test_support.h"

#include <pty.h>

#include <regex>
#include <set>
#include <thread>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/builtin_scenes.h>

#include "jobs/settings.h"

namespace vrpipe::testing {
namespace {

class CommandLine : public ToolTest {};

void expect_in(const std::string& text, const std::vector<std::string>& parts) {
  for (const std::string& part : parts)
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in:\n" << text;
}

TEST_F(CommandLine, VersionAndHelp) {
  const Finished version = vrpipe({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_EQ(version.out.rfind("vrpipe ", 0), 0U) << version.out;
  const Finished help = vrpipe({"--help"});
  EXPECT_EQ(help.code, 0);
  EXPECT_EQ(help.err, "");
  expect_in(help.out, {"run", "compare", "accuracy", "convert", "scenes", "platforms", "units", "energies", "--version",
                       "Exit code"});
}

TEST_F(CommandLine, HelpMentionsEveryOptionAndShowsExamples) {
  const std::vector<std::string> shared{
      "--scene",        "--size",           "--camera",       "--eye",          "--look-at",
      "--up",           "--fovy",           "--platform",     "--set",          "--unit",
      "--plugin",       "--fidelity",       "--format",       "--effects",      "--termination",
      "--background",   "--output",         "--json",         "--save-draw",    "default: agx-orin",
      "default: cycle", "default: rgba16f", "default: paper", "default: 0,0,0", "pixels",
      "DEGREES",        "Examples:",        "--undistorted",  "--orthographic", "HEIGHT"};
  for (const char* command : {"run", "compare", "accuracy"}) {
    const Finished help = vrpipe({command, "--help"});
    EXPECT_EQ(help.code, 0);
    expect_in(help.out, shared);
    expect_in(help.out, {std::string(command) == "run" ? "--variant" : "--jobs"});
    EXPECT_EQ(help.out.find("--frame") != std::string::npos, std::string(command) != "accuracy");
    EXPECT_EQ(help.out.find("--explain-effects") != std::string::npos, std::string(command) != "accuracy");
  }
  expect_in(vrpipe({"compare", "--help"}).out, {"--views N|all", "--journal FILE"});
  for (const char* command : {"run", "compare"}) {
    expect_in(vrpipe({command, "--help"}).out,
              {"--interval CYCLES", "--interval-csv FILE.csv", "--interval-statistics NAME,...", "--heat-maps"});
  }
  expect_in(vrpipe({"run", "--help"}).out, {"--trace FILE[@FROM:TO]", "--log UNIT[@FROM:TO]", "--log-file FILE"});
  expect_in(vrpipe({"accuracy", "--help"}).out, {"--quick", "--repeat", "--html", "--markdown"});
  expect_in(vrpipe({"units", "--help"}).out, {"--slot", "--platform", "--plugin", "--effects", "--json", "--markdown"});
  expect_in(vrpipe({"platforms", "--help"}).out, {"--plugin", "--json"});
  expect_in(vrpipe({"scenes", "--help"}).out, {"[FILE]", "--preview", "--json", "--measure", "--scene NAME|NAME=FILE"});
  expect_in(vrpipe({"energies", "--help"}).out, {"[FILE.toml]", "--toml", "--markdown", "--json", "--platform"});
  for (const char* command : {"run", "compare"}) {
    expect_in(vrpipe({command, "--help"}).out, {"--energy", "--energies FILE.toml"});
  }
  expect_in(vrpipe({"convert", "--help"}).out, {"IN", "OUT", ".splat"});
}

// Without a plugin, as one who reads it would.
TEST_F(CommandLine, TheVariantThatHelpGivesAsAnExampleCanBeDrawn) {
  for (const char* command : {"run", "compare", "sweep"}) {
    SCOPED_TRACE(command);
    const std::string help = vrpipe({command, "--help"}).out;
    const std::size_t start = help.find("mine=het+qm,");
    ASSERT_NE(start, std::string::npos);
    expect_in(help, {"het+qm", "in-shader", "in-shader-no-lock", "software", "accelerator"});
    const std::string example = help.substr(start, help.find_first_of(" ;\n", start) - start);
    const Finished finished = vrpipe({"run", "--scene", "tiny.spl", "--fidelity", "functional", "--variant", example});
    EXPECT_EQ(finished.code, 0) << finished.err;
    // Of a value that is no definition, which names the same example.
    const std::string error = vrpipe({"run", "--variant", "mine="}).err;
    EXPECT_NE(error.find("--variant " + example), std::string::npos) << error;
  }
}

TEST_F(CommandLine, ScenesAreMeasuredByTheirCounts) {
  const nlohmann::json measured = json_of({"scenes", "--measure", "--scene", "courtyard", "--scene", "lego=tiny.spl"});
  EXPECT_EQ(measured["schema"], "vrpipe.scene_measurements/1");
  ASSERT_EQ(measured["scenes"].size(), 2u);
  const nlohmann::json& list = measured["scenes"][1];
  EXPECT_EQ(list["name"], "lego=tiny.spl");
  const nlohmann::json run =
      json_of({"run", "--scene", "tiny.spl", "--variant", "baseline", "--fidelity", "functional"});
  EXPECT_EQ(list["fragments_rasterized"], run["runs"][0]["counts"]["fragments_rasterized"]);
  EXPECT_EQ(list["quads_rasterized"], run["runs"][0]["counts"]["quads_rasterized"]);
  EXPECT_EQ(list["fragments_blended"], run["runs"][0]["counts"]["fragments_blended"]);
  EXPECT_GT(measured["scenes"][0]["early_termination_ratio"], 1.0);
  EXPECT_LT(measured["scenes"][0]["splat_side_median_pixels"], measured["scenes"][0]["splat_side_90_percent_pixels"]);
  expect_in(vrpipe({"scenes", "--scene", "lego"}).err, {"--scene", "add --measure"});
  expect_in(vrpipe({"scenes", "--measure", "--scene", "leggo"}).err, {"builtin:lego?"});
  expect_in(vrpipe({"scenes", "--measure", "--scene", "lego", "--scene", "lego=tiny.spl"}).err, {"option given twice"});
}

TEST_F(CommandLine, NegativeNumbersAreValues) {
  const Finished finished = vrpipe({"run", "--size", "8x8", "--fidelity", "functional", "--eye", "-3,-1,-3",
                                    "--look-at=-0,-0.5,0", "--up", "-0.1,-1,0", "--fovy", "+40.5"});
  EXPECT_EQ(finished.code, 0) << finished.err;
}

TEST_F(CommandLine, ScenesPlatformsAndUnitsListEverything) {
  const std::string scenes = vrpipe({"scenes"}).out;
  const nlohmann::json scenes_json = json_of({"scenes"});
  for (const BuiltinSceneInfo& scene : builtin_scenes()) {
    expect_in(scenes, {"builtin:" + scene.name, scene.description});
    EXPECT_NE(scenes_json.dump().find("builtin:" + scene.name), std::string::npos);
  }
  expect_in(scenes, {"stands in for the paper's Train (Tanks&Temples, outdoor), 1,030,000 Gaussians"});
  EXPECT_EQ(scenes_json["scenes"][6]["stands_for"]["gaussians"], 1030000);
  EXPECT_TRUE(scenes_json["scenes"][0]["stands_for"].is_null());
  EXPECT_EQ(scenes_json["schema"], "vrpipe.scenes/1");

  const std::string text = vrpipe({"platforms"}).out;
  const nlohmann::json platforms_json = json_of({"platforms"});
  ASSERT_EQ(platforms_json["platforms"].size(), platforms().size());
  for (std::size_t i = 0; i < platforms().size(); ++i) {
    expect_in(text, {platforms()[i].name, platforms()[i].description});
    EXPECT_EQ(platforms_json["platforms"][i]["name"], platforms()[i].name);
    EXPECT_EQ(platforms_json["platforms"][i]["gpcs"], platforms()[i].gpcs);
  }
  expect_in(text, {"memory: l2 (sectored-cache) for crop, sm, zrop; dram (lpddr3-1600) for l2",
                   "memory: l2 (fixed-latency) for crop\n"});
  EXPECT_EQ(platforms_json["platforms"][0]["memories"][1],
            (nlohmann::json{{"path", "dram"}, {"implementation", "lpddr3-1600"}, {"serves", {"l2"}}}));

  const std::string units = vrpipe({"units"}).out;
  const std::string markdown = vrpipe({"units", "--markdown"}).out;
  const nlohmann::json units_json = json_of({"units"});
  std::size_t index = 0;
  for (const ParameterListing& unit : tools::all_parameters(&platforms().front())) {
    expect_in(units,
              {unit.implementation.empty() ? unit.unit : unit.unit + "=" + unit.implementation, unit.description});
    const nlohmann::json& entry = units_json["units"][index++];
    EXPECT_EQ(entry["slot"], unit.unit);
    EXPECT_EQ(entry["implementation"], unit.implementation);
    EXPECT_EQ(entry["parameters"].size(), unit.parameters->parameters().size());
    for (const Parameter* parameter : unit.parameters->parameters()) {
      expect_in(units, {unit.unit + "." + parameter->name() + " = ", parameter->meaning(), parameter->source(),
                        parameter->range()});
      expect_in(markdown, {"| `" + unit.unit + "." + parameter->name() + "` | " + parameter->default_value()});
    }
  }
  EXPECT_EQ(units_json["units"].size(), index);

  expect_in(units, {"l2=fixed-latency (default on other platforms)", "l2=sectored-cache (on agx-orin)",
                    "dram=lpddr3-1600 (default)"});
  expect_in(vrpipe({"units", "--platform", "agx-orin-lpddr5"}).out,
            {"l2=fixed-latency (default on other platforms)", "l2=sectored-cache (on agx-orin-lpddr5)",
             "dram=lpddr5-6400 (on agx-orin-lpddr5)", "tc=tile-coalescing (default)"});
  for (const nlohmann::json& entry : json_of({"units", "--platform", "agx-orin", "--slot", "l2"})["units"]) {
    EXPECT_EQ(entry["used"], entry["implementation"] == "sectored-cache");
    EXPECT_EQ(entry["default"], entry["implementation"] == "fixed-latency");
  }

  const std::string only = vrpipe({"units", "--slot", "crop"}).out;
  expect_in(only, {"crop.cache_bytes"});
  EXPECT_EQ(only.find("tc.bins"), std::string::npos);
}

TEST_F(CommandLine, CompareReportsWhatAResearcherWants) {
  const Finished finished = vrpipe({"compare", "--scene", "tiny.spl"});
  EXPECT_EQ(finished.code, 0);
  EXPECT_EQ(finished.err, "");
  expect_in(finished.out, {"tiny.spl, 48x40",
                           "agx-orin (",
                           "baseline",
                           "het+qm",
                           "cycles",
                           "simulated ms",
                           "speed-up over baseline",
                           "1.00x",
                           "fragments",
                           "quads",
                           "terminated",
                           "merged away",
                           "blended, reduction",
                           "warps",
                           "utilization",
                           "raster",
                           "zrop",
                           "prop",
                           "sm",
                           "crop",
                           "l2",
                           "host seconds",
                           "early-termination ratio",
                           "24.92 KB",
                           "24.25 KB",
                           "688 B"});
  // No terminal: no colours, nothing but ASCII.
  for (const char c : finished.out) ASSERT_TRUE(c == '\n' || (c >= ' ' && c <= '~')) << finished.out;
  EXPECT_EQ(finished.out.find("rejected"), std::string::npos);
}

TEST_F(CommandLine, RunReportsWhatUnitsSpentTheirCyclesOn) {
  const Finished finished = vrpipe({"run", "--scene", "tiny.spl", "--variant", "qm"});
  EXPECT_EQ(finished.code, 0);
  expect_in(finished.out, {"busy", "starved", "blocked", "memory", "latency", "gpc0.crop", "gpc0.qru"});
}

/// What a command draws on a terminal of its own.
class OnATerminal : public ToolTest {
 protected:
  std::string drawn_by(const std::vector<std::string>& arguments) {
    int master = -1;
    int slave = -1;
    EXPECT_EQ(::openpty(&master, &slave, nullptr, nullptr, nullptr), 0);
    ::setenv("TERM", "xterm", 1);
    std::string drawn;
    std::thread reader([&] {
      char buffer[4096];
      for (ssize_t count; (count = ::read(master, buffer, sizeof buffer)) > 0;) {
        drawn.append(buffer, static_cast<std::size_t>(count));
      }
    });
    finished_ = vrpipe(arguments, slave);
    ::close(slave);
    reader.join();
    ::close(master);
    EXPECT_EQ(finished_.code, 0);
    return drawn;
  }
  Finished finished_;
};

TEST_F(OnATerminal, ProgressIsDrawnAndErased) {
  const std::string drawn = drawn_by({"compare", "--scene", "tiny.spl", "--jobs", "1"});
  expect_in(drawn, {"baseline", "het+qm waiting", "%"});
  const std::string erase = "\r\x1b[J";
  ASSERT_GE(drawn.size(), erase.size());
  EXPECT_EQ(drawn.substr(drawn.size() - erase.size()), erase);
  EXPECT_EQ(drawn.find('\n'), std::string::npos);
  // stdout is a file here: no colours in it.
  EXPECT_EQ(finished_.out.find('\x1b'), std::string::npos);
}

TEST_F(OnATerminal, AccuracyCountsBothLaddersAsOne) {
  const std::string drawn = drawn_by({"accuracy", "--quick", "--scene", "tiny.spl"});
  std::vector<int> done;
  std::set<int> totals;
  std::set<std::string> ladders;
  const std::regex pattern("(fidelity|precision) (\\d+)/(\\d+)");
  for (std::sregex_iterator i(drawn.begin(), drawn.end(), pattern), end; i != end; ++i) {
    ladders.insert((*i)[1]);
    done.push_back(std::stoi((*i)[2]));
    totals.insert(std::stoi((*i)[3]));
  }
  EXPECT_EQ(ladders.size(), 2U);
  EXPECT_EQ(totals.size(), 1U);
  EXPECT_TRUE(std::is_sorted(done.begin(), done.end()));
  ASSERT_FALSE(done.empty());
  EXPECT_EQ(done.back(), *totals.begin());
}

}  // namespace
}  // namespace vrpipe::testing
