#include "tool_test_support.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <regex>
#include <set>

#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/gaussian_scene.h>

#include "documented_keys.h"
#include "jobs/settings.h"

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
                                           "quads_unshaded",
                                           "fragments_unshaded",
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
                                           "quads_unblended",
                                           "fragments_unblended",
                                           "quads_blended",
                                           "fragments_blended",
                                           "warps",
                                           "tgc_flushes",
                                           "tc_flushes",
                                           "termination_updates"};

void check_statistic(const json& statistic) {
  SCOPED_TRACE(statistic["name"].dump());
  EXPECT_TRUE(statistic["name"].is_string() && statistic["unit"].is_string() && statistic["meaning"].is_string());
  const json& value = statistic["value"];
  const std::string kind = statistic["kind"];
  const bool is_quotient = kind == "ratio" || kind == "histogram";
  EXPECT_TRUE(is_quotient ? value.is_number_float() || value.is_null() : value.is_number_unsigned()) << value;
  EXPECT_EQ(statistic["formula"].is_string(), kind == "ratio");
  EXPECT_EQ(statistic["histogram"].is_object(), kind == "histogram");
  EXPECT_TRUE(statistic["instances"].is_null()) << "one GPC";
  if (kind != "histogram") return;
  const json& histogram = statistic["histogram"];
  std::uint64_t count = 0;
  for (const json& bucket : histogram["buckets"]) {
    count += bucket["count"].get<std::uint64_t>();
    EXPECT_TRUE(bucket["to"].is_null() || bucket["to"] >= bucket["from"]);
  }
  EXPECT_EQ(count, histogram["count"]);
  if (count == 0) return;
  EXPECT_DOUBLE_EQ(value.get<double>(), histogram["sum"].get<double>() / static_cast<double>(count));
  EXPECT_LE(histogram["smallest"], value);
  EXPECT_GE(histogram["largest"], value);
}

void check_run(const json& run, bool timed) {
  SCOPED_TRACE(run["variant"].dump());
  EXPECT_EQ(run["cycles"].is_number_unsigned(), timed);
  EXPECT_EQ(run["cycles"].is_null(), !timed);
  EXPECT_EQ(run["milliseconds"].is_number_float(), timed);
  EXPECT_TRUE(run["host_seconds"].is_number_float());
  EXPECT_GT(run["cpu_seconds"].get<double>(), 0);
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
  EXPECT_FALSE(run["effects"].empty());
  EXPECT_EQ(run["result_hash"].get<std::string>().size(), 16U);
  EXPECT_TRUE(run["images"].contains("png") && run["images"].contains("exr"));
  for (const json& unit : run["units"]) {
    std::uint64_t sum = 0;
    for (const auto& state : unit["cycles"].items()) sum += state.value().get<std::uint64_t>();
    EXPECT_EQ(sum, run["cycles"].get<std::uint64_t>()) << unit["name"];
  }
  for (const json& statistic : run["statistics"]) check_statistic(statistic);
  const auto count = [&](const std::string& name) { return run["counts"][name].get<std::uint64_t>(); };
  for (const std::string what : {"quads_", "fragments_"}) {
    EXPECT_EQ(count(what + "rasterized"),
              count(what + "depth_stencil_failed") + count(what + "terminated") + count(what + "shaded"));
    EXPECT_EQ(count(what + "shaded"), count(what + "pruned") + count(what + "merged") + count(what + "dropped_late") +
                                          count(what + "late_failed") + count(what + "blended"));
  }
  EXPECT_GT(count("fragments_blended"), 0U);
}

void check_head(const json& result, const std::string& schema = "vrpipe.compare/1") {
  EXPECT_EQ(result["schema"], schema);
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
  EXPECT_EQ(result["effects"], "auto");
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
  check_head(result, "vrpipe.run/1");
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
    for (json* one : {&alone, &together}) {
      one->erase("host_seconds");
      one->erase("cpu_seconds");
    }
    EXPECT_EQ(alone, together);
  }
}

TEST_F(Result, DoesNotDependOnTheNumberOfProcesses) {
  json results[3];
  const char* const jobs[] = {"1", "2", "4"};
  for (std::size_t i = 0; i < 3; ++i) {
    results[i] = json_of({"compare", "--scene", "tiny.spl", "--jobs", jobs[i]});
    for (json& run : results[i]["runs"]) {
      run.erase("host_seconds");
      run.erase("cpu_seconds");
    }
    // What was asked for, and what else the host did.
    results[i].erase("command");
    results[i].erase("host");
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
  for (const char* command : {"scenes", "platforms", "units", "energies"}) {
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

TEST_F(Result, NothingVisibleIsSaidAndHasNoSpeedup) {
  Draw empty;
  empty.width = 8;
  empty.height = 8;
  write_draw_list(folder() / "empty.spl", empty);
  const std::vector<std::vector<std::string>> cases{{"compare", "--scene", "builtin:object", "--size", "8x8", "--eye",
                                                     "0,0,-30", "--look-at", "0,0,-60"},
                                                    {"compare", "--scene", "empty.spl"}};
  for (const std::vector<std::string>& arguments : cases) {
    const Finished finished = vrpipe(arguments);
    SCOPED_TRACE(finished.out);
    EXPECT_EQ(finished.code, 0);
    EXPECT_NE(finished.out.find("nothing is visible"), std::string::npos);
    EXPECT_NE(finished.out.find("camera"), std::string::npos) << "what to do";
    EXPECT_TRUE(std::regex_search(finished.out, std::regex("speed-up over baseline( +-){4}\n")));
    const json result = json_of(arguments);
    for (const char* variant : {"qm", "het", "het+qm"}) EXPECT_TRUE(result["speedup"][variant].is_null()) << variant;
  }
  EXPECT_EQ(vrpipe({"compare", "--scene", "tiny.spl"}).out.find("nothing is visible"), std::string::npos);
}

// What made a result.

TEST_F(Result, NamesTheCommandThePluginsAndTheUnits) {
  const std::vector<std::string> words{"compare",  "--scene",   "tiny.spl", "--fidelity",    "functional",
                                       "--plugin", TEST_PLUGIN, "--unit",   "qru=same-splat"};
  const json result = json_of(words);
  ASSERT_EQ(result["command"].size(), words.size() + 3) << "the program, and --json -";
  for (std::size_t i = 0; i < words.size(); ++i) EXPECT_EQ(result["command"][i + 1], words[i]);
  ASSERT_EQ(result["plugins"].size(), 1U);
  EXPECT_EQ(result["plugins"][0]["path"], TEST_PLUGIN);
  std::FILE* const pipe = ::popen("sha256sum < '" TEST_PLUGIN "'", "r");
  char digits[65] = "";
  EXPECT_EQ(std::fread(digits, 1, 64, pipe), 64U);
  ::pclose(pipe);
  EXPECT_EQ(result["plugins"][0]["sha256"], digits);
  const std::map<std::string, std::string> qru{{"baseline", "pass-through"},
                                               {"qm", "same-splat"},
                                               {"het", "pass-through"},
                                               {"het+qm", "same-splat"}};
  for (const json& run : result["runs"]) {
    const json& implementations = run["implementations"];
    EXPECT_EQ(implementations["qru"], qru.at(run["variant"])) << run["variant"];
    EXPECT_EQ(implementations["crop"], "color-rop");
    const std::vector<Slot>& slots = Registry::instance().slots();
    const auto kernels =
        std::count_if(slots.begin(), slots.end(), [](const Slot& slot) { return slot.is_outside_pipeline; });
    EXPECT_EQ(implementations.size(), slots.size() - 2 - static_cast<std::size_t>(kernels))
        << "agx-orin has no L1 in a slot of its own, one GPC needs no crossbar, and a draw by hardware no kernels";
  }
  EXPECT_GE(result["host"]["load_average"].get<double>(), 0);
  EXPECT_EQ(json_of({"compare", "--scene", "tiny.spl", "--jobs", "3"})["host"]["processes"], 3);
  EXPECT_TRUE(json_of({"run", "--scene", "tiny.spl"})["plugins"].empty());
}

TEST_F(Result, EveryParameterHasAnOrigin) {
  const Platform& platform = platform_named("mobile");
  ASSERT_FALSE(platform.settings.empty());
  const Setting& both = platform.settings.front();
  const std::string overridden = both.unit + "." + both.parameter;
  const json result = json_of({"run", "--scene", "builtin:object", "--size", "16x16", "--fidelity", "functional",
                               "--platform", "mobile", "--set", "state.exponential=exact", "--set",
                               "preprocess.sh_degree=1", "--set", overridden + "=" + both.value});
  std::map<std::string, std::string> expected;
  for (const auto& parameter : result["platform"]["parameters"].items()) expected[parameter.key()] = "default";
  for (const Setting& setting : platform.settings) expected.at(setting.unit + "." + setting.parameter) = "platform";
  for (const std::string& given : {std::string("state.exponential"), std::string("preprocess.sh_degree"), overridden}) {
    expected.at(given) = "command line";
  }
  EXPECT_EQ(result["platform"]["origins"], json(expected));
}

TEST_F(Result, CameraHasItsFinalNumbers) {
  const std::vector<std::string> draw{"run",   "--scene",    "builtin:object", "--size",
                                      "32x24", "--fidelity", "functional"};
  std::vector<std::string> given = draw;
  given.insert(given.end(), {"--eye", "0,0,-3", "--look-at", "0,0,1", "--up", "0,-1,0", "--fovy", "90"});
  const json camera = json_of(given)["camera"];
  EXPECT_EQ(camera["eye"], (json{0, 0, -3}));
  EXPECT_EQ(camera["look_at"], (json{0, 0, 1}));
  EXPECT_EQ(camera["up"], (json{0, -1, 0}));
  EXPECT_NEAR(camera["fovy_degrees"].get<double>(), 90, 1e-9);
  EXPECT_NEAR(camera["focal_pixels"][1].get<double>(), 12, 1e-9);
  EXPECT_EQ(camera["projection"], "perspective");
  EXPECT_EQ(camera["principal_point"], (json{16, 12}));
  EXPECT_TRUE(camera["orthographic_height"].is_null());
  EXPECT_NEAR(camera["right"][0].get<double>(), 1, 1e-12);
  EXPECT_NEAR(camera["down"][1].get<double>(), 1, 1e-12);
  EXPECT_NEAR(camera["forward"][2].get<double>(), 1, 1e-12);
  EXPECT_TRUE(camera["file"].is_null() && camera["index"].is_null());

  const json entry = {{"width", 32},
                      {"height", 24},
                      {"position", {1, 2, -3}},
                      {"rotation", {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
                      {"fx", 20},
                      {"fy", 24},
                      {"cx", 10},
                      {"cy", 14.5}};
  write("cameras.json", json{entry, entry}.dump());
  std::vector<std::string> from_file{"run", "--scene", "builtin:object", "--fidelity", "functional"};
  from_file.insert(from_file.end(), {"--camera", "cameras.json#1"});
  const json read = json_of(from_file)["camera"];
  EXPECT_EQ(read["file"], "cameras.json");
  EXPECT_EQ(read["index"], 1);
  EXPECT_EQ(read["eye"], (json{1, 2, -3}));
  EXPECT_EQ(read["focal_pixels"], (json{20, 24}));
  EXPECT_EQ(read["principal_point"], (json{10, 14.5}));
  EXPECT_TRUE(read["look_at"].is_null() && read["up"].is_null());

  std::vector<std::string> parallel = draw;
  parallel.insert(parallel.end(), {"--orthographic", "3"});
  const json orthographic = json_of(parallel)["camera"];
  EXPECT_EQ(orthographic["projection"], "orthographic");
  EXPECT_EQ(orthographic["orthographic_height"], 3);
  EXPECT_EQ(orthographic["focal_pixels"], (json{8, 8}));
  EXPECT_TRUE(orthographic["fovy_degrees"].is_null());

  EXPECT_FALSE(json_of(draw)["camera"]["look_at"].is_null()) << "the scene's own";
  EXPECT_TRUE(json_of({"run", "--scene", "tiny.spl"})["camera"].is_null());
}

GaussianScene one_gaussian() {
  GaussianSceneBuilder builder(0);
  GaussianAttributes gaussian;
  gaussian.log_scale = {-4, -4, -4};
  gaussian.opacity_logit = 2;
  builder.add(gaussian);
  return builder.build();
}

TEST_F(Result, WhatTheFileSaysOfItsModelIsAParameterThatTheUserMayOverride) {
  GaussianFile file;
  file.gaussians = one_gaussian();
  write_gaussian_file(folder() / "classic.ply", file);
  file.gaussians.set_compensates_opacity(true);
  write_gaussian_file(folder() / "mip.ply", file);
  const auto drawn = [&](const char* scene, const std::vector<std::string>& settings) {
    std::vector<std::string> command{"run", "--scene", scene, "--size", "16x16", "--fidelity", "functional"};
    for (const std::string& setting : settings) command.insert(command.end(), {"--set", "preprocess." + setting});
    return json_of(command);
  };
  const std::string name = "preprocess.opacity_compensation";
  const auto expect = [&](const json& result, const char* value, const char* origin, unsigned compensated) {
    EXPECT_EQ(result["platform"]["parameters"][name], value);
    EXPECT_EQ(result["platform"]["origins"][name], origin);
    EXPECT_EQ(result["scene"]["gaussians_compensated"], compensated);
  };
  const json classic = drawn("classic.ply", {}), mip = drawn("mip.ply", {});
  expect(classic, "off", "default", 0);
  expect(mip, "on", "scene", 1);
  expect(drawn("mip.ply", {"opacity_compensation=off"}), "off", "command line", 0);
  expect(drawn("classic.ply", {"opacity_compensation=on"}), "on", "command line", 1);
  const auto hash = [](const json& result) { return result["runs"][0]["result_hash"]; };
  EXPECT_NE(hash(mip), hash(classic));
  EXPECT_EQ(hash(mip), hash(drawn("classic.ply", {"opacity_compensation=on"})));
  EXPECT_EQ(hash(classic), hash(drawn("mip.ply", {"opacity_compensation=off"})));
  EXPECT_NE(hash(classic), hash(drawn("classic.ply", {"dilation=0.1"})));
  ASSERT_EQ(mip["scene"]["notes"].size(), 1U);
  EXPECT_NE(mip["scene"]["notes"][0].get<std::string>().find("SplatRenderMode: mip"), std::string::npos);
}

// The documentation.

TEST_F(Result, EveryKeyIsDocumentedAndEveryDocumentedKeyExists) {
  write_gaussian_file(folder() / "scene.ply", one_gaussian());
  write("frame.json", R"({"commands": [{"draw": "tiny.spl"}, {"draw": "tiny.spl"}]})");
  const std::string page = read_file(RESULTS_PAGE);
  const auto of_scene = [&](std::vector<std::string> command) {
    command.insert(command.end(), {"--scene", "scene.ply", "--size", "16x16", "--plugin", TEST_PLUGIN});
    return json_of(command);
  };
  const auto check = [&](const std::string& heading, const std::vector<json>& results) {
    SCOPED_TRACE(heading);
    std::set<std::string> known = documented(page, "Of every result");
    known.merge(documented(page, heading));
    expect_documented(results, known);
  };
  check("Of `run` and `compare`",
        {of_scene({"run"}), of_scene({"compare"}), json_of({"run", "--scene", "tiny.spl", "--fidelity", "functional"}),
         json_of({"run", "--scene", "tiny.spl", "--platform", "desktop"}),
         json_of({"compare", "--scene", "tiny.spl", "--variant", "mine=qm,qru=pass-through,tc.bins=2"}),
         json_of({"run", "--frame", "frame.json"}),
         json_of({"run", "--scene", "tiny.spl", "--fidelity", "lt", "--variant", "software"}),
         json_of({"run", "--scene", "tiny.spl", "--fidelity", "functional", "--explain-effects"}),
         json_of({"compare", "--scene", "tiny.spl", "--platform", "desktop", "--energy"}),
         json_of({"run", "--scene", "tiny.spl", "--interval", "100"}),
         json_of({"run", "--scene", "tiny.spl", "--fidelity", "sampled"}),
         json_of({"run", "--scene", "tiny.spl", "--error", "3%"}),
         json_of({"run", "--scene", "tiny.spl", "--fidelity", "functional", "--energy"})});
  check("Of `accuracy`",
        {of_scene({"accuracy", "--quick"}), json_of({"accuracy", "--scene", "tiny.spl", "--set", "crop.ways=64"})});
}

}  // namespace
}  // namespace vrpipe::testing
