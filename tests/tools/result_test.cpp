#include "tool_test_support.h"

#include <map>
#include <set>

#include <vrpipe/platforms/simulation.h>

#include "settings.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

class Result : public ToolTest {};

const std::vector<std::string> count_names{"primitives",
                                           "quads_rasterized",
                                           "fragments_rasterized",
                                           "quads_depth_stencil_failed",
                                           "fragments_depth_stencil_failed",
                                           "quads_terminated",
                                           "fragments_terminated",
                                           "quads_shaded",
                                           "fragments_shaded",
                                           "quads_pruned",
                                           "fragments_pruned",
                                           "quads_merged",
                                           "fragments_merged",
                                           "quads_dropped_late",
                                           "fragments_dropped_late",
                                           "quads_late_failed",
                                           "fragments_late_failed",
                                           "quads_blended",
                                           "fragments_blended",
                                           "warps",
                                           "tgc_flushes",
                                           "tc_flushes",
                                           "termination_updates"};

void check_run(const json& run, bool timed) {
  SCOPED_TRACE(run["variant"].dump());
  EXPECT_EQ(run["cycles"].is_number_unsigned(), timed);
  EXPECT_EQ(run["cycles"].is_null(), !timed);
  EXPECT_EQ(run["milliseconds"].is_number_float(), timed);
  EXPECT_TRUE(run["host_seconds"].is_number_float());
  for (const std::string& name : count_names) EXPECT_TRUE(run["counts"][name].is_number_unsigned()) << name;
  EXPECT_EQ(run["counts"].size(), count_names.size());
  for (const char* unit : {"raster", "zrop", "prop", "sm", "crop", "l2", "dram"}) {
    ASSERT_TRUE(run["utilization"].contains(unit)) << unit;
    const json& share = run["utilization"][unit];
    EXPECT_EQ(share.is_number(), timed) << unit;
    if (timed) {
      EXPECT_TRUE(share.get<double>() >= 0 && share.get<double>() <= 1) << unit << share;
    }
  }
  EXPECT_TRUE(run["effects"].is_array());
  EXPECT_EQ(run["result_hash"].get<std::string>().size(), 16U);
  EXPECT_TRUE(run["images"].contains("png") && run["images"].contains("exr"));
  for (const json& unit : run["units"]) {
    std::uint64_t sum = 0;
    for (const auto& state : unit["cycles"].items()) sum += state.value().get<std::uint64_t>();
    EXPECT_EQ(sum, run["cycles"].get<std::uint64_t>()) << unit["name"];
  }
  for (const json& statistic : run["statistics"]) {
    EXPECT_TRUE(statistic["name"].is_string() && statistic["value"].is_number_unsigned() &&
                statistic["unit"].is_string() && statistic["meaning"].is_string());
  }
  const auto count = [&](const std::string& name) { return run["counts"][name].get<std::uint64_t>(); };
  for (const std::string what : {"quads_", "fragments_"}) {
    EXPECT_EQ(count(what + "rasterized"),
              count(what + "depth_stencil_failed") + count(what + "terminated") + count(what + "shaded"));
    EXPECT_EQ(count(what + "shaded"), count(what + "pruned") + count(what + "merged") + count(what + "dropped_late") +
                                          count(what + "late_failed") + count(what + "blended"));
  }
  EXPECT_GT(count("fragments_blended"), 0U);
}

void check_head(const json& result) {
  EXPECT_EQ(result["schema"], "vrpipe.compare/1");
  EXPECT_TRUE(result["version"].is_string());
  EXPECT_TRUE(result["seed"].is_number_unsigned());
  EXPECT_EQ(result["scene"]["name"], "tiny.spl");
  EXPECT_EQ(result["scene"]["gaussians_total"], 60);
  EXPECT_EQ(result["scene"]["gaussians_visible"], 60);
  EXPECT_EQ(result["scene"]["gaussians_rejected"], 0);
  EXPECT_EQ(result["scene"]["width"], 48);
  EXPECT_EQ(result["scene"]["height"], 40);
  EXPECT_EQ(result["platform"]["name"], platforms().front().name);
  EXPECT_EQ(result["platform"]["frequency_mhz"], platforms().front().frequency_mhz);
}

TEST_F(Result, CompareFollowsTheSchema) {
  const json result = json_of({"compare", "--scene", "tiny.spl"});
  check_head(result);
  EXPECT_EQ(result["fidelity"], "cycle");
  EXPECT_EQ(result["format"], "rgba16f");
  EXPECT_EQ(result["termination"], "paper");
  ASSERT_EQ(result["runs"].size(), 4U);
  std::map<std::string, double> cycles;
  const std::vector<std::string> order{"baseline", "qm", "het", "het+qm"};
  for (std::size_t i = 0; i < order.size(); ++i) {
    check_run(result["runs"][i], true);
    EXPECT_EQ(result["runs"][i]["variant"], order[i]);
    EXPECT_TRUE(result["runs"][i]["images"]["png"].is_null());
    EXPECT_FALSE(result["runs"][i]["units"].empty());
    EXPECT_FALSE(result["runs"][i]["statistics"].empty());
    EXPECT_GT(result["runs"][i]["kernel_events"].get<std::uint64_t>(), 0U);
    cycles[order[i]] = result["runs"][i]["cycles"].get<double>();
  }
  for (const char* variant : {"qm", "het", "het+qm"}) {
    EXPECT_DOUBLE_EQ(result["speedup"][variant].get<double>(), cycles["baseline"] / cycles[variant]);
  }
  EXPECT_EQ(result["speedup"].size(), 3U);
  // The paper's section on the hardware's cost: 24.25 KB and 688 B.
  EXPECT_EQ(result["quad_merging_storage_bytes"]["tgc"], 24832);
  EXPECT_EQ(result["quad_merging_storage_bytes"]["qru"], 688);
}

TEST_F(Result, ParametersHaveTypes) {
  const json result =
      json_of({"compare", "--scene", "tiny.spl", "--set", "tc.bins=64", "--set", "state.termination_threshold=0.5"});
  const json& parameters = result["platform"]["parameters"];
  EXPECT_EQ(parameters["tc.bins"], 64);
  EXPECT_TRUE(parameters["tc.bins"].is_number_unsigned());
  EXPECT_TRUE(parameters["state.termination_threshold"].is_number_float());
  EXPECT_EQ(parameters["state.termination_threshold"], 0.5);
  EXPECT_EQ(parameters["state.exponential"], "ex2");
  std::set<std::string> declared;
  for (const ParameterListing& unit : tools::all_parameters(&platforms().front())) {
    for (const Parameter* parameter : unit.parameters->parameters()) {
      const std::string name = unit.unit + "." + parameter->name();
      declared.insert(name);
      if (!parameters.contains(name)) continue;
      EXPECT_EQ(parameters[name].is_boolean(), dynamic_cast<const Switch*>(parameter) != nullptr) << name;
      EXPECT_EQ(parameters[name].is_string(), dynamic_cast<const Choice*>(parameter) != nullptr) << name;
      EXPECT_EQ(parameters[name].is_number_float(), dynamic_cast<const Real*>(parameter) != nullptr) << name;
    }
  }
  for (const auto& parameter : parameters.items()) EXPECT_EQ(declared.count(parameter.key()), 1U) << parameter.key();
}

TEST_F(Result, RunHasOneEntry) {
  const json result = json_of({"run", "--scene", "tiny.spl", "--format", "rgba8", "--termination", "strict"});
  check_head(result);
  EXPECT_EQ(result["format"], "rgba8");
  EXPECT_EQ(result["termination"], "strict");
  ASSERT_EQ(result["runs"].size(), 1U);
  check_run(result["runs"][0], true);
  EXPECT_EQ(result["runs"][0]["variant"], "het+qm");
  EXPECT_FALSE(result.contains("speedup"));
}

TEST_F(Result, FunctionalHasNoTime) {
  const json result = json_of({"compare", "--scene", "tiny.spl", "--fidelity", "functional"});
  check_head(result);
  EXPECT_EQ(result["fidelity"], "functional");
  ASSERT_EQ(result["runs"].size(), 4U);
  for (const json& run : result["runs"]) check_run(run, false);
  EXPECT_TRUE(result["speedup"]["het+qm"].is_null());
}

TEST_F(Result, CompareEqualsRun) {
  const json result = json_of({"compare", "--scene", "tiny.spl"});
  ASSERT_EQ(result["runs"].size(), 4U);
  for (const json& run : result["runs"]) {
    json alone = json_of({"run", "--scene", "tiny.spl", "--variant", run["variant"].get<std::string>()})["runs"][0];
    json together = run;
    for (json* one : {&alone, &together}) one->erase("host_seconds");
    EXPECT_EQ(alone, together);
  }
}

TEST_F(Result, DoesNotDependOnTheNumberOfProcesses) {
  json results[3];
  const char* const jobs[] = {"1", "2", "4"};
  for (std::size_t i = 0; i < 3; ++i) {
    results[i] = json_of({"compare", "--scene", "tiny.spl", "--jobs", jobs[i]});
    for (json& run : results[i]["runs"]) run.erase("host_seconds");
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

TEST_F(Result, JsonOnStdoutIsAlone) {
  for (const char* command : {"run", "compare"}) {
    const Finished finished =
        vrpipe({command, "--scene", "tiny.spl", "--json", "-", "--output", "images", "--save-draw", "draw.spl"});
    EXPECT_EQ(finished.code, 0);
    EXPECT_TRUE(json::accept(finished.out)) << finished.out;
    EXPECT_EQ(finished.err, "");
  }
  for (const char* command : {"scenes", "platforms", "units"}) {
    const Finished finished = vrpipe({command, "--json", "-"});
    EXPECT_EQ(finished.code, 0);
    EXPECT_TRUE(json::accept(finished.out)) << finished.out;
  }
}

TEST_F(Result, JsonInAFileIsTheSameBesideTheReport) {
  write("result.json", "something older");
  const Finished finished = vrpipe({"compare", "--scene", "tiny.spl", "--json", "result.json"});
  EXPECT_EQ(finished.code, 0);
  const json result = json::parse(read_file(folder() / "result.json"));
  check_head(result);
  EXPECT_NE(finished.out.find("speed-up over baseline"), std::string::npos) << finished.out;
  EXPECT_EQ(files(), (std::vector<std::string>{"result.json", "tiny.spl"}));
}

TEST_F(Result, SavedDrawIsTakenInAgain) {
  const std::vector<std::string> view{"run",   "--scene",    "builtin:object", "--size",
                                      "24x24", "--fidelity", "functional"};
  std::vector<std::string> saving = view;
  saving.insert(saving.end(), {"--save-draw", "draw.spl"});
  const json first = json_of(saving);
  const json second = json_of({"run", "--scene", "draw.spl", "--fidelity", "functional"});
  EXPECT_EQ(first["runs"][0]["result_hash"], second["runs"][0]["result_hash"]);
  EXPECT_EQ(second["scene"]["width"], 24);
  EXPECT_EQ(first["scene"]["gaussians_visible"], second["scene"]["gaussians_visible"]);
  const json again = json_of({"run", "--scene", "tiny.spl", "--save-draw", "copy.spl"});
  EXPECT_EQ(read_file(folder() / "copy.spl"), read_file(folder() / "tiny.spl"));
}

TEST_F(Result, FilesMayLieInTheOutputFolderToBe) {
  const Finished finished = vrpipe({"run", "--scene", "tiny.spl", "--variant", "qm", "--output", "new/folder", "--json",
                                    "new/folder/result.json", "--save-draw", "new/folder/draw.spl"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(files(), (std::vector<std::string>{"new", "new/folder", "new/folder/draw.spl", "new/folder/result.json",
                                               "new/folder/tiny-qm.exr", "new/folder/tiny-qm.png", "tiny.spl"}));
}

TEST_F(Result, AnEmptyDrawIsFine) {
  Draw empty;
  empty.width = 8;
  empty.height = 8;
  write_draw_list(folder() / "empty.spl", empty);
  const Finished finished = vrpipe({"compare", "--scene", "empty.spl", "--output", "."});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(finished.out.find("nan"), std::string::npos) << finished.out;
  EXPECT_EQ(finished.out.find("inf"), std::string::npos) << finished.out;
}

}  // namespace
}  // namespace vrpipe::testing
