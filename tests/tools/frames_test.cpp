// `vrpipe frames`: whole frames, in software beside by hardware and by an accelerator.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "documented_keys.h"
#include "image/images.h"
#include "one_event_energies.h"
#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

class Frames : public ToolTest {
 protected:
  json frames(std::vector<std::string> arguments = {}) const {
    arguments.insert(arguments.begin(), {"frames", "--scene", "tiny.spl"});
    return json_of(std::move(arguments));
  }
  static std::map<std::string, json> by_path(const json& result) {
    std::map<std::string, json> paths;
    for (const json& path : result["frames"]) paths[path["path"]] = path;
    return paths;
  }
};

TEST_F(Frames, AreTimedOnEveryPath) {
  const json result = frames({"--fidelity", "lt"});
  EXPECT_EQ(result["schema"], "vrpipe.frames/1");
  ASSERT_EQ(result["frames"].size(), 6U);
  const std::vector<std::string> paths{"software", "hardware", "multi-pass", "in-shader", "vr-pipe", "accelerator"};
  const std::vector<std::string> names{"published", "baseline", "4 passes", "ordered lock", "het+qm", "gscore"};
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const json& path = result["frames"][i];
    EXPECT_EQ(path["path"], paths[i]);
    EXPECT_EQ(path["name"], names[i]);
    const json& milliseconds = path["milliseconds"];
    EXPECT_TRUE(milliseconds["preprocess"].is_null()) << "of a draw list";
    const double sum = milliseconds["sort"].get<double>() + milliseconds["raster"].get<double>();
    if (paths[i] == "accelerator") {
      EXPECT_GT(milliseconds["frame"], std::max(milliseconds["sort"], milliseconds["raster"])) << "and latencies";
    } else {
      EXPECT_DOUBLE_EQ(milliseconds["frame"].get<double>(), sum);
    }
    EXPECT_GT(milliseconds["raster"], 0);
    EXPECT_FALSE(path["bound_by"].get<std::string>().empty());
  }
}

TEST_F(Frames, InFlightTakeTheLongestOfWhatTheyShare) {
  const std::vector<std::string> small{"--size",     "64x48", "--fovy", "10",
                                       "--fidelity", "lt",    "--set",  "preprocess.sh_degree=0"};
  const auto paths = [&](std::vector<std::string> more) {
    more.insert(more.begin(), small.begin(), small.end());
    more.insert(more.begin(), "frames");
    return by_path(json_of(more));
  };
  for (const auto& [name, path] : paths({})) {
    const json& milliseconds = path["milliseconds"];
    EXPECT_GT(milliseconds["interval"], 0) << name;
    EXPECT_LE(milliseconds["interval"], milliseconds["frame"]) << name;
  }
  // Preparation as slow as can be is all of it: the draw's shaders add what they take of the SM array, which is less than the draw.
  const std::vector<std::string> slow{"--set", "preparation.record_cycles=10000", "--set",
                                      "preparation.launch_microseconds=0"};
  const json prepared = paths(slow)["hardware"]["milliseconds"];
  EXPECT_GT(prepared["interval"], prepared["preprocess"]);
  EXPECT_LT(prepared["interval"], prepared["frame"]);
  // And one that is free leaves the draw.
  const json drawn = paths({"--set", "preparation.record_cycles=0", "--set", "preparation.depth_sort_cycles=0", "--set",
                            "preparation.visible_bytes=0", "--set", "preparation.culled_bytes=0", "--set",
                            "preparation.depth_sort_bytes=0"})["hardware"]["milliseconds"];
  EXPECT_EQ(drawn["interval"], drawn["raster"]);
}

TEST_F(Frames, DrawsAreThoseOfCompare) {
  const json result = frames({"--fidelity", "lt", "--platform", "mobile"});
  const json compared = json_of({"compare", "--scene", "tiny.spl", "--fidelity", "lt", "--platform", "mobile"});
  std::map<std::string, json> runs;
  for (const json& run : compared["runs"]) runs[run["variant"]] = run;
  for (const auto& [path, variant] : {std::pair{"hardware", "baseline"}, {"vr-pipe", "het+qm"}}) {
    const json of_path = by_path(result)[path];
    EXPECT_EQ(of_path["milliseconds"]["raster"], runs[variant]["milliseconds"]);
    EXPECT_EQ(of_path["counts"], runs[variant]["counts"]);
  }
}

TEST_F(Frames, AShaderThatBlendsIsThatOfRun) {
  const std::vector<std::string> set{"--fidelity", "lt", "--platform", "gh100-gpc", "--set", "crop.cache_bytes=4096"};
  std::vector<std::string> run{"run", "--scene", "tiny.spl", "--variant", "in-shader"};
  run.insert(run.end(), set.begin(), set.end());
  const json of_run = json_of(run)["runs"][0], path = by_path(frames(set))["in-shader"];
  EXPECT_EQ(path["milliseconds"]["raster"], of_run["milliseconds"]);
  EXPECT_EQ(path["result_hash"], of_run["result_hash"]);
}

TEST_F(Frames, SeveralPassesAreThoseOfRun) {
  const json result = frames({"--fidelity", "lt", "--multi-pass", "3"});
  const json run =
      json_of({"run", "--scene", "tiny.spl", "--fidelity", "lt", "--variant", "baseline", "--multi-pass", "3"});
  const json path = by_path(result)["multi-pass"];
  EXPECT_EQ(path["name"], "3 passes");
  EXPECT_EQ(path["milliseconds"]["raster"], run["runs"][0]["milliseconds"]);
  EXPECT_EQ(path["counts"], run["runs"][0]["counts"]);
  EXPECT_EQ(path["milliseconds"]["sort"], by_path(result)["hardware"]["milliseconds"]["sort"]);
  EXPECT_EQ(by_path(frames({"--fidelity", "functional", "--multi-pass", "1"})).count("multi-pass"), 0U);
}

TEST_F(Frames, AGaussianSceneIsPreprocessed) {
  const json result =
      json_of({"frames", "--size", "64x48", "--fovy", "10", "--fidelity", "bound", "--set", "preprocess.sh_degree=0"});
  const std::uint64_t gaussians = result["scene"]["gaussians_total"];
  for (const json& path : result["frames"]) {
    EXPECT_GT(path["milliseconds"]["preprocess"], 0);
    EXPECT_EQ(path["kernels"][0]["name"], "preprocess");
    EXPECT_EQ(path["kernels"][0]["items"], gaussians);
    double sum = 0;
    for (const char* part : {"preprocess", "sort", "raster"}) sum += path["milliseconds"][part].get<double>();
    if (path["path"] == "accelerator") {
      EXPECT_GT(path["milliseconds"]["frame"], path["milliseconds"]["preprocess"]);
    } else {
      EXPECT_DOUBLE_EQ(path["milliseconds"]["frame"].get<double>(), sum);
    }
  }
}

void expect_range_of(const json& range, double low, double nominal, double high) {
  EXPECT_NEAR(range["low"].get<double>(), low, 1e-9 * high);
  EXPECT_NEAR(range["nominal"].get<double>(), nominal, 1e-9 * high);
  EXPECT_NEAR(range["high"].get<double>(), high, 1e-9 * high);
}

TEST_F(Frames, EnergyIsOfAllPartsByOneTable) {
  const auto paths = by_path(frames({"--fidelity", "lt", "--platform", "gh100-gpc"}));
  const json run = json_of({"run", "--scene", "tiny.spl", "--fidelity", "lt", "--platform", "gh100-gpc", "--variant",
                            "baseline", "--energy"});
  EXPECT_EQ(paths.at("hardware")["millijoules"]["raster"], run["runs"][0]["energy"]["total_millijoules"]);
  for (const auto& [name, path] : paths) {
    if (name == "accelerator") continue;
    SCOPED_TRACE(name);
    const json& energy = path["millijoules"];
    EXPECT_TRUE(energy["preprocess"].is_null());
    const auto sum = [&](const char* end) {
      return energy["sort"][end].get<double>() + energy["raster"][end].get<double>();
    };
    expect_range_of(energy, sum("low"), sum("nominal"), sum("high"));
    EXPECT_GT(energy["sort"]["low"], 0);
  }
  expect_range_of(paths.at("hardware")["millijoules"]["over_hardware"], 1, 1, 1);
  const json& software = paths.at("software")["millijoules"];
  EXPECT_NEAR(software["over_hardware"]["nominal"].get<double>(),
              software["nominal"].get<double>() / paths.at("hardware")["millijoules"]["nominal"].get<double>(), 1e-9);
}

TEST_F(Frames, EnergyOfAnAcceleratorIsItsPowerAndItsMemorys) {
  write("e.toml", one_event_energies("DRAM", R"(["kernel.dram_bytes", "quads_blended"])",
                                     "{ low = 1e6, nominal = 2e6, high = 3e6 }"));
  const json accelerator = by_path(frames({"--fidelity", "lt", "--energies", "e.toml"}))["accelerator"];
  double bytes = 0;
  for (const json& each : accelerator["bytes"]) bytes += each.get<double>();
  const double units = 0.87 * accelerator["milliseconds"]["frame"].get<double>();
  expect_range_of(accelerator["millijoules"], units + 1e-3 * bytes, units + 2e-3 * bytes, units + 3e-3 * bytes);
  EXPECT_TRUE(accelerator["millijoules"]["raster"].is_null()) << "stages overlap";
  const json unknown = by_path(frames({"--fidelity", "lt", "--unit", "accelerator=gcc"}))["accelerator"];
  EXPECT_TRUE(unknown["millijoules"].is_null()) << "its power is not published";
}

TEST_F(Frames, EnergyThatIsNotKnownIsNotGuessed) {
  for (const json& path : frames({"--fidelity", "functional"})["frames"]) EXPECT_TRUE(path["millijoules"].is_null());
  const std::vector<std::string> elsewhere{"--fidelity", "lt", "--platform", "desktop"};
  for (const auto& [name, path] : by_path(frames(elsewhere))) {
    EXPECT_EQ(path["millijoules"].is_null(), name != "accelerator") << name;
    if (name == "accelerator") {
      EXPECT_TRUE(path["millijoules"]["over_hardware"].is_null());
    }
  }
  const std::string said = vrpipe({"frames", "--scene", "tiny.spl", "--fidelity", "lt", "--platform", "desktop"}).out;
  EXPECT_NE(said.find("mJ of the GPU are not known"), std::string::npos) << said;
  refused({"frames", "--scene", "tiny.spl", "--energies", "none.toml"}, {"cannot read energies", "none.toml"});
}

TEST_F(Frames, WithoutTimeThereAreCountsAlone) {
  const json result = frames({"--fidelity", "functional"});
  const json timed = frames({"--fidelity", "lt"});
  for (const json& path : result["frames"]) {
    for (const char* part : {"preprocess", "sort", "raster", "frame", "interval"})
      EXPECT_TRUE(path["milliseconds"][part].is_null());
    EXPECT_TRUE(path["bound_by"].is_null());
    EXPECT_TRUE(path["expected_error_percent"].is_null());
  }
  for (const char* path : {"software", "accelerator"})
    EXPECT_EQ(by_path(result)[path]["counts"], by_path(timed)[path]["counts"]);
}

TEST_F(Frames, CountsAreTheSameAtEveryFidelity) {
  const json cycle = frames(), lt = frames({"--fidelity", "lt"});
  EXPECT_EQ(cycle["fidelity"], "cycle");
  EXPECT_EQ(cycle["frames"][0]["counts"], lt["frames"][0]["counts"]);
  EXPECT_EQ(cycle["frames"][0]["milliseconds"]["sort"], lt["frames"][0]["milliseconds"]["sort"]);
}

TEST_F(Frames, AnAcceleratorIsTimedAtLtWhereCyclesAreAskedFor) {
  json cycle = by_path(frames())["accelerator"], lt = by_path(frames({"--fidelity", "lt"}))["accelerator"];
  EXPECT_EQ(cycle["fidelity"], "lt");
  for (json* path : {&cycle, &lt}) {
    path->erase("host_seconds");
    (*path)["millijoules"].erase("over_hardware");
  }
  EXPECT_EQ(cycle, lt);
}

TEST_F(Frames, AcceleratorsAreChosenAndSet) {
  std::map<std::string, json> paths;
  for (const char* name : {"gscore", "gcc", "flicker"}) {
    paths[name] = by_path(frames({"--fidelity", "lt", "--unit", "accelerator=" + std::string(name)}))["accelerator"];
    EXPECT_EQ(paths[name]["name"], name);
    EXPECT_EQ(paths[name]["implementations"], json({{"accelerator", name}}));
    std::uint64_t moved = 0;
    for (const json& stage : paths[name]["kernels"]) moved += stage["bytes"].get<std::uint64_t>();
    EXPECT_EQ(moved,
              paths[name]["bytes"]["sort"].get<std::uint64_t>() + paths[name]["bytes"]["raster"].get<std::uint64_t>());
  }
  EXPECT_EQ(paths["gscore"]["parameters"]["accelerator.area_mm2"], 3.95);
  EXPECT_EQ(paths["flicker"]["parameters"]["accelerator.volume_units"], 8);
  EXPECT_EQ(paths["gcc"]["parameters"]["accelerator.conversion"], "chunk");
  const json slow = by_path(frames({"--fidelity", "lt", "--set", "accelerator.frequency_mhz=500", "--set",
                                    "accelerator.dram_gigabytes_per_second=25.6"}))["accelerator"];
  EXPECT_DOUBLE_EQ(slow["milliseconds"]["frame"].get<double>(),
                   2 * paths["gscore"]["milliseconds"]["frame"].get<double>());
}

TEST_F(Frames, KernelsAreChosenAndSet) {
  const json result = frames({"--fidelity", "lt", "--unit", "render=endless", "--set", "binning.lists=three_sigma",
                              "--set", "render.warp_pixels=8x4"});
  const json software = by_path(result)["software"];
  EXPECT_EQ(software["name"], "endless");
  EXPECT_EQ(software["implementations"]["render"], "endless");
  EXPECT_EQ(software["parameters"]["binning.lists"], "three_sigma");
  EXPECT_EQ(software["parameters"]["render.warp_pixels"], "8x4");
  EXPECT_EQ(software["parameters"]["render.blocks_per_core"], 8);
  EXPECT_EQ(software["counts"]["lanes_stopping"], 0);
  EXPECT_TRUE(software["expected_error_percent"].is_null()) << "nobody measured it";
  EXPECT_TRUE(by_path(frames({"--fidelity", "lt"}))["software"]["expected_error_percent"].is_null());
  const json measured = frames({"--fidelity", "lt", "--platform", "gh100-gpc"});
  EXPECT_EQ(by_path(measured)["software"]["expected_error_percent"], 4);
  EXPECT_EQ(by_path(measured)["hardware"]["expected_error_percent"], 5);
  EXPECT_TRUE(by_path(measured)["vr-pipe"]["expected_error_percent"].is_null()) << "there is none";
  const json changed = frames({"--fidelity", "lt", "--platform", "gh100-gpc", "--set", "crop.latency_cycles=20"});
  EXPECT_TRUE(by_path(changed)["hardware"]["expected_error_percent"].is_null());
}

TEST_F(Frames, AKernelOfAPluginTakesThePlaceOfTheShippedOne) {
  const json shipped = by_path(frames({"--fidelity", "lt"}))["software"];
  const json own =
      by_path(frames({"--fidelity", "lt", "--plugin", KERNEL_PLUGIN, "--unit", "render=no-barriers"}))["software"];
  EXPECT_EQ(own["name"], "no-barriers");
  EXPECT_EQ(own["counts"]["lanes_blending"], shipped["counts"]["lanes_blending"]);
  EXPECT_EQ(own["counts"]["barriers_gone"], 0) << "a list of 60 splats is one batch";
  EXPECT_EQ(own["milliseconds"]["raster"], shipped["milliseconds"]["raster"]);
}

TEST_F(Frames, AreTheSameWithAnyNumberOfProcesses) {
  json one = frames({"--fidelity", "lt", "--jobs", "1"}), three = frames({"--fidelity", "lt", "--jobs", "3"});
  for (json* result : {&one, &three}) {
    for (json& path : (*result)["frames"]) path.erase("host_seconds");
  }
  EXPECT_EQ(one["frames"], three["frames"]);
}

TEST_F(Frames, ImagesOfEveryPathAreAlike) {
  const json result = frames({"--fidelity", "functional", "--output", "images", "--unit", "render=endless"});
  std::vector<tools::SharedImage> images;
  for (const json& path : result["frames"]) {
    EXPECT_EQ(path["images"]["png"], "images/tiny-" + path["path"].get<std::string>() + ".png");
    images.push_back(tools::read_exr((folder() / path["images"]["exr"].get<std::string>()).string()));
  }
  ASSERT_EQ(images.size(), 6U);
  float most = 0;
  for (std::size_t i = 0; i < std::size_t{4} * images[0].width() * images[0].height(); ++i) {
    for (std::size_t of : {1, 2, 3, 4, 5})
      most = std::max(most, std::fabs(images[0].values()[i] - images[of].values()[i]));
  }
  EXPECT_LT(most, 0.01F) << "halves, and what ends early";
  EXPECT_GT(most, 0.0F) << "single precision in software";
}

TEST_F(Frames, AConfigurationReadsBackToTheSameFrames) {
  const std::vector<std::string> arguments{"frames", "--scene",    "tiny.spl", "--fidelity",
                                           "bound",  "--platform", "gh100-gpc"};
  std::vector<std::string> changed = arguments;
  changed.insert(changed.end(), {"--unit", "render=threshold", "--set", "binning.lists=box", "--unit",
                                 "accelerator=gcc", "--set", "accelerator.chunk_entries=16"});
  for (std::vector<std::string> given : {arguments, changed}) {
    json direct = json_of(given);
    given.push_back("--print-config");
    const Finished printed = vrpipe(given);
    ASSERT_EQ(printed.code, 0) << printed.err;
    write("frames.toml", printed.out);
    json read = json_of({"frames", "--config", "frames.toml"});
    for (json* result : {&direct, &read}) {
      for (json& path : (*result)["frames"]) path.erase("host_seconds");
    }
    EXPECT_EQ(direct["frames"], read["frames"]);
  }
}

TEST_F(Frames, TheTableHasEveryPath) {
  const Finished finished = vrpipe({"frames", "--scene", "tiny.spl", "--fidelity", "lt", "--json", "frames.json"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  for (const char* part :
       {"software (published)", "hardware (baseline)", "in-shader (ordered lock)", "vr-pipe (het+qm)",
        "accelerator (gscore)", "3.95 mm2", "preprocess", "millijoules", "mJ at 8 nm", "hardware is 1", "in flight",
        "warp iterations", "a draw list is preprocessed already", "result: frames.json"}) {
    EXPECT_NE(finished.out.find(part), std::string::npos) << part << " is not in\n" << finished.out;
  }
  EXPECT_EQ(json::parse(read_file(folder() / "frames.json"))["schema"], "vrpipe.frames/1");
}

TEST_F(Frames, APageHasThePapersFiguresOfThisScene) {
  const Finished finished =
      vrpipe({"frames", "--scene", "tiny.spl", "--fidelity", "lt", "--html", "frames.html", "--json", "frames.json"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_NE(finished.out.find("page: frames.html"), std::string::npos) << finished.out;
  const std::string page = read_file(folder() / "frames.html");
  for (const char* part : {"Where a frame's time goes", "over software", "draw alone", "pruned", "fragments blended",
                           "accelerator (gscore)", "vrpipe frames --scene tiny.spl"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
  const auto count = [&](const std::string& what) {
    std::size_t found = 0;
    for (std::size_t at = page.find(what); at != std::string::npos; at = page.find(what, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("<img "), 6U) << "a picture of each path";
  EXPECT_EQ(count("<svg"), 5U);
  EXPECT_EQ(count("http://") + count("https://"), count("http://www.w3.org/2000/svg")) << "it needs no network";

  // What termination saves in software is measured for it, by the kernel that has none.
  const json result = json::parse(read_file(folder() / "frames.json"));
  const json with = by_path(result)["software"], without = result["without_termination"];
  EXPECT_EQ(without["name"], "endless");
  EXPECT_GE(without["counts"]["lanes_blending"], with["counts"]["lanes_blending"]);
  EXPECT_EQ(without["counts"]["lanes_stopping"], 0);
  EXPECT_EQ(result["without_lock"]["name"], "no lock");
  EXPECT_LT(result["without_lock"]["milliseconds"]["raster"], by_path(result)["in-shader"]["milliseconds"]["raster"]);
  EXPECT_NE(page.find("in-shader (no lock)"), std::string::npos);
  const json plain = frames({"--fidelity", "lt"});
  for (const char* key : {"without_termination", "without_lock"}) EXPECT_TRUE(plain[key].is_null()) << key;
  const Finished untimed = vrpipe({"frames", "--scene", "tiny.spl", "--fidelity", "functional", "--html", "f.html"});
  EXPECT_EQ(untimed.code, 0) << untimed.err;
  EXPECT_NE(read_file(folder() / "f.html").find("nothing takes time"), std::string::npos);
}

TEST_F(Frames, OfManyViewsAreThoseOfEach) {
  const std::vector<std::string> small{"--size",       "48x36", "--fovy", "8",
                                       "--fidelity",   "bound", "--set",  "preprocess.sh_degree=0",
                                       "--multi-pass", "1"};
  const auto run = [&](std::vector<std::string> more) {
    more.insert(more.begin(), small.begin(), small.end());
    more.insert(more.begin(), "frames");
    return json_of(more);
  };
  const json all = run({"--views", "3", "--output", "views"});
  EXPECT_EQ(all["schema"], "vrpipe.frame-views/1");
  EXPECT_EQ(all["cameras"], json({{"file", nullptr}, {"count", 3}, {"orbit", true}}));
  ASSERT_EQ(all["views"].size(), 3U);
  json first = all["views"][0]["frames"], alone = run({})["frames"];
  for (json* paths : {&first, &alone}) {
    for (json& path : *paths) {
      path.erase("host_seconds");
      path.erase("images");
    }
  }
  EXPECT_EQ(first, alone) << "the first view round the scene is the scene's own";
  std::vector<double> over;
  for (const json& view : all["views"]) {
    std::map<std::string, json> paths = by_path(view);
    over.push_back(paths["vr-pipe"]["milliseconds"]["frame"].get<double>() /
                   paths["hardware"]["milliseconds"]["frame"].get<double>());
    EXPECT_TRUE(std::filesystem::exists(folder() / paths["software"]["images"]["png"].get<std::string>()));
  }
  const json distribution = all["distribution"]["vr-pipe"]["over_hardware"];
  EXPECT_EQ(distribution["views"], 3);
  EXPECT_DOUBLE_EQ(distribution["minimum"], *std::min_element(over.begin(), over.end()));
  EXPECT_DOUBLE_EQ(distribution["maximum"], *std::max_element(over.begin(), over.end()));
  EXPECT_EQ(over[distribution["maximum_in_view"].get<std::size_t>()], distribution["maximum"]);

  std::vector<std::string> printed{"frames", "--views", "2"};
  printed.insert(printed.end(), small.begin(), small.end());
  const Finished text = vrpipe(printed);
  EXPECT_EQ(text.code, 0) << text.err;
  for (const char* part : {"2 views round the scene", "hardware is 1: least", "accelerator (gscore)"})
    EXPECT_NE(text.out.find(part), std::string::npos) << part << " is not in\n" << text.out;
  refused({"frames", "--scene", "tiny.spl", "--views", "2"}, {"--scene", "a draw list"});
  refused({"frames", "--views", "2", "--html", "page.html"}, {"--html", "one view"});
}

TEST_F(Frames, MistakesAreToldInALine) {
  refused({"frames", "--scene", "none.ply"}, {"none.ply"});
  refused({"frames", "--scene", "tiny.spl", "--set", "render.issue_rat=1"}, {"render.issue_rate"});
  refused({"frames", "--scene", "tiny.spl", "--unit", "render=publishd"}, {"published"});
  refused({"frames", "--scene", "tiny.spl", "--set", "binning.lists=circle"}, {"ellipse"});
  refused({"frames", "--scene", "tiny.spl", "--set", "accelerator.volume_unit=1"}, {"accelerator.volume_units"});
  refused({"frames", "--scene", "tiny.spl", "--unit", "accelerator=gscor"}, {"gscore"});
  refused({"frames", "--scene", "tiny.spl", "--set", "accelerator.subtile_side_pixels=12"},
          {"accelerator.subtile_side_pixels"});
  refused({"frames", "--scene", "builtin:courtyard", "--size", "32x32"}, {"meshes"});
  refused({"frames", "--scene", "tiny.spl", "--json", "tiny.spl"}, {"--json"});
  for (const char* command : {"run", "compare", "accuracy"}) {
    refused({command, "--scene", "tiny.spl", "--set", "render.issue_rate=1"},
            {"--set render.issue_rate", "vrpipe frames"});
    refused({command, "--scene", "tiny.spl", "--unit", "accelerator=gcc"}, {"vrpipe frames"});
    refused({command, "--scene", "tiny.spl", "--unit", "render=endless"}, {"--unit render=endless", "vrpipe frames"});
  }
}

TEST_F(Frames, EveryKeyOfTheResultIsDocumented) {
  const std::string page = read_file(std::string(VRPIPE_DOCS) + "/software.md");
  std::set<std::string> known;
  for (const std::string& key : documented(page, "Keys of a path")) known.insert(key);
  json paths = json::object();
  const json result = frames({"--fidelity", "lt"});
  for (const char* key : {"frames", "without_termination", "without_lock"}) paths[key] = result[key];
  json untimed = paths, elsewhere = paths, preprocessed = paths;
  untimed["frames"] = frames({"--fidelity", "functional"})["frames"];
  elsewhere["frames"] = frames({"--fidelity", "bound", "--platform", "desktop"})["frames"];
  preprocessed["frames"] = json_of({"frames", "--size", "64x48", "--fovy", "10", "--fidelity", "bound"})["frames"];
  expect_documented({paths, untimed, elsewhere, preprocessed}, known);
}

}  // namespace
}  // namespace vrpipe::testing
