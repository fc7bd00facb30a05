// Variants that draw in software or by an accelerator, in the commands that compare, sweep and measure.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

class DrawnBy : public ToolTest {
 protected:
  json command(const std::string& name, std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {name, "--scene", "tiny.spl"});
    return json_of(std::move(arguments));
  }
  json compared(std::vector<std::string> arguments, const std::string& fidelity = "lt") const {
    arguments.insert(arguments.end(), {"--fidelity", fidelity});
    return command("compare", std::move(arguments));
  }
  static std::map<std::string, json> by_variant(const json& result) {
    std::map<std::string, json> runs;
    for (const json& run : result["runs"]) runs[run["variant"]] = run;
    return runs;
  }
  json frame(const std::string& path, std::vector<std::string> arguments = {}) const {
    arguments.insert(arguments.end(), {"--fidelity", "lt"});
    const json result = command("frames", std::move(arguments));
    for (const json& each : result["frames"]) {
      if (each["path"] == path) return each;
    }
    return {};
  }
};

const std::vector<std::string> all_that_draw{"--variant", "baseline",    "--variant", "software",
                                             "--variant", "accelerator", "--variant", "het+qm"};

std::uint64_t sum_of(const json& counts, const std::vector<std::string>& names) {
  std::uint64_t sum = 0;
  for (const std::string& name : names) sum += counts["fragments_" + name].get<std::uint64_t>();
  return sum;
}

TEST_F(DrawnBy, SoftwareTakesTheListsAndTheRenderingOfItsFrame) {
  const json run = by_variant(compared(all_that_draw)).at("software");
  const json path = frame("software");
  std::uint64_t cycles = 0;
  for (const json& kernel : path["kernels"]) cycles += kernel["cycles"].get<std::uint64_t>();
  EXPECT_EQ(run["cycles"], cycles);
  EXPECT_NEAR(run["milliseconds"].get<double>(),
              path["milliseconds"]["sort"].get<double>() + path["milliseconds"]["raster"].get<double>(), 1e-12);
  ASSERT_EQ(run["kernels"].size(), path["kernels"].size());
  for (std::size_t i = 0; i < run["kernels"].size(); ++i) {
    for (const char* key : {"name", "items", "bytes", "cycles", "bound_by"})
      EXPECT_EQ(run["kernels"][i][key], path["kernels"][i][key]);
  }
  EXPECT_EQ(run["counts"]["fragments_blended"], path["counts"]["lanes_blending"]);
  EXPECT_EQ(run["implementations"]["render"], "published");
  EXPECT_FALSE(run["implementations"].contains("preparation")) << "no part of a draw";
  EXPECT_EQ(run["result_hash"], path["result_hash"]);
}

TEST_F(DrawnBy, HeatMapsOfSoftwareSumToItsCounts) {
  for (const char* pixels : {"16x2", "8x4"}) {
    SCOPED_TRACE(pixels);
    std::vector<std::string> command{"run",        "--scene", "tiny.spl",
                                     "--fidelity", "lt",      "--variant",
                                     "software",   "--set",   std::string("render.warp_pixels=") + pixels,
                                     "--output",   "o"};
    const json unseen = json_of(command)["runs"][0];
    command.emplace_back("--heat-maps");
    const json run = json_of(command)["runs"][0];
    EXPECT_EQ(run["result_hash"], unseen["result_hash"]);
    const json maps = json::parse(read_file(folder() / "o/tiny-software-heat-maps.json"))["pixels"];
    const json& counts = run["counts"];
    EXPECT_EQ(maps["rasterized"]["sum"], counts["fragments_rasterized"]);
    EXPECT_EQ(maps["blended"]["sum"], counts["fragments_blended"]);
    EXPECT_EQ(maps["terminated"]["sum"], sum_of(counts, {"terminated", "dropped_late"}));
    EXPECT_FALSE(maps.contains("merged")) << "kernels do not merge";
    EXPECT_GT(sum_of(counts, {"terminated"}), 0U);
  }
}

TEST_F(DrawnBy, AGaussianSceneIsProjectedBefore) {
  const std::vector<std::string> small{"--size", "64x48", "--fovy", "10", "--set", "preprocess.sh_degree=0"};
  std::vector<std::string> arguments = small;
  arguments.insert(arguments.begin(), "frames");
  arguments.insert(arguments.end(), {"--fidelity", "lt"});
  const json path = json_of(arguments)["frames"][0];
  arguments[0] = "run";
  arguments.insert(arguments.end(), {"--variant", "software"});
  const json run = json_of(arguments)["runs"][0];
  EXPECT_GT(path["milliseconds"]["preprocess"], 0);
  EXPECT_NEAR(run["milliseconds"].get<double>(),
              path["milliseconds"]["sort"].get<double>() + path["milliseconds"]["raster"].get<double>(), 1e-12);
}

TEST_F(DrawnBy, AnAcceleratorIsInCyclesOfThePlatform) {
  for (const char* platform : {"agx-orin", "gh100-gpc"}) {
    const json result = compared({"--variant", "baseline", "--variant", "accelerator", "--platform", platform});
    const json run = by_variant(result).at("accelerator");
    const json path = frame("accelerator", {"--platform", platform});
    const double exact = path["milliseconds"]["frame"].get<double>() * 1e3 * run["frequency_mhz"].get<double>();
    EXPECT_NEAR(run["cycles"].get<double>(), std::ceil(exact - 1e-6), 0) << platform;
    const json baseline = by_variant(result).at("baseline");
    EXPECT_DOUBLE_EQ(result["speedup"]["accelerator"].get<double>(),
                     baseline["cycles"].get<double>() / run["cycles"].get<double>());
  }
}

TEST_F(DrawnBy, FragmentsAreConserved) {
  std::vector<std::string> arguments = all_that_draw;
  for (const char* kernel : {"endless", "threshold"})
    arguments.insert(arguments.end(), {"--variant", std::string(kernel) + "-k=software,render=" + kernel});
  for (const auto& [name, run] : by_variant(compared(arguments, "functional"))) {
    SCOPED_TRACE(name);
    const json& counts = run["counts"];
    EXPECT_GT(counts["fragments_blended"], 0);
    EXPECT_EQ(counts["fragments_rasterized"], sum_of(counts, {"terminated", "shaded"}));
    EXPECT_EQ(counts["fragments_shaded"], sum_of(counts, {"pruned", "merged", "dropped_late", "blended"}));
    EXPECT_TRUE(run["cycles"].is_null());
    if (name == "software" || name == "accelerator") {
      EXPECT_EQ(counts["quads_rasterized"], 0);
    }
    if (name == "endless-k") {
      EXPECT_EQ(counts["fragments_terminated"], 0) << "nor are lanes beside the frame fragments";
    }
  }
}

TEST_F(DrawnBy, ResultsOfThePipelineStayWhatTheyAre) {
  const json alone = compared({"--variant", "baseline", "--variant", "het+qm"}), beside = compared(all_that_draw);
  for (const json& run : alone["runs"]) {
    const json other = by_variant(beside).at(run["variant"]);
    for (const char* key : {"cycles", "counts", "result_hash", "utilization", "bottleneck"})
      EXPECT_EQ(run[key], other[key]);
    EXPECT_FALSE(other.contains("kernels"));
  }
  EXPECT_EQ(alone["speedup"]["het+qm"], beside["speedup"]["het+qm"]);
  EXPECT_EQ(alone["fidelity"], beside["fidelity"]);
  EXPECT_TRUE(compared({"--variant", "software", "--variant", "het"})["early_termination_ratio"].is_null());
}

TEST_F(DrawnBy, AnAcceleratorIsAtLtBesideTheClock) {
  const json result = compared(all_that_draw, "cycle");
  EXPECT_EQ(result["fidelity"], "cycle");
  const auto runs = by_variant(result);
  EXPECT_EQ(runs.at("software")["fidelity"], "cycle");
  EXPECT_EQ(runs.at("accelerator")["fidelity"], "lt");
  EXPECT_FALSE(runs.at("baseline").contains("fidelity"));
  EXPECT_NE(vrpipe({"run", "--scene", "tiny.spl", "--variant", "accelerator"}).out.find("lt fidelity"),
            std::string::npos);
}

TEST_F(DrawnBy, KernelsAndAcceleratorsAreSetForThoseThatHaveThem) {
  const auto runs = by_variant(
      compared({"--variant", "baseline", "--variant", "software", "--variant", "accelerator", "--variant",
                "mine=software,render=endless,render.issue_rate=0.5", "--set", "render.least_transmittance=0.01",
                "--set", "binning.lists=ellipse", "--unit", "accelerator=gcc"}));
  EXPECT_EQ(runs.at("accelerator")["implementations"]["accelerator"], "gcc");
  EXPECT_EQ(runs.at("mine")["implementations"]["render"], "endless");
  EXPECT_EQ(runs.at("mine")["changes"]["base"], "software");
  EXPECT_EQ(runs.at("mine")["parameters"]["render.issue_rate"], 0.5);
  EXPECT_EQ(runs.at("baseline")["cycles"], by_variant(compared({"--variant", "baseline"})).at("baseline")["cycles"]);
  EXPECT_LT(runs.at("software")["counts"]["fragments_blended"],
            by_variant(compared({"--variant", "software"})).at("software")["counts"]["fragments_blended"]);
}

TEST_F(DrawnBy, AKernelOfAPluginTakesPart) {
  const auto runs = by_variant(
      compared({"--plugin", KERNEL_PLUGIN, "--variant", "software", "--variant", "mine=software,render=no-barriers"}));
  const json& own = runs.at("mine");
  EXPECT_EQ(own["implementations"]["render"], "no-barriers");
  EXPECT_EQ(own["counts"], runs.at("software")["counts"]) << "it derives from the shipped one";
  EXPECT_EQ(own["cycles"], runs.at("software")["cycles"]) << "a list of 60 splats is one batch";
  const json whole = json_of({"run", "--scene", "tiny.spl", "--variant", "software", "--fidelity", "lt", "--plugin",
                              KERNEL_PLUGIN, "--unit", "render=no-barriers"});
  EXPECT_EQ(whole["runs"][0]["cycles"], own["cycles"]);
}

TEST_F(DrawnBy, WhatTheyAreWithoutIsRefused) {
  const auto bad = [&](std::vector<std::string> arguments, const std::vector<std::string>& parts) {
    arguments.insert(arguments.begin() + 1, {"--scene", "tiny.spl"});
    refused(arguments, parts);
  };
  bad({"run", "--set", "render.issue_rate=0.9"}, {"render.issue_rate", "no unit of a draw by hardware"});
  bad({"run", "--variant", "software", "--unit", "accelerator=gcc"},
      {"accelerator=gcc", "no variant here draws with it"});
  bad({"run", "--variant", "software", "--set", "preparation.record_cycles=8"}, {"preparation", "no variant here"});
  for (const char* unit : {"crop=in-shader", "gpc0.crop=in-shader"}) {
    for (const char* variant : {"software", "accelerator"})
      bad({"run", "--variant", variant, "--unit", unit}, {unit, "no variant here draws with it"});
  }
  for (const char* parameter : {"crop.ways", "gpc0.crop.ways", "link.draw.vertices.depth"}) {
    const std::string setting = std::string(parameter) + "=4";
    for (const char* variant : {"software", "accelerator"}) {
      bad({"run", "--variant", variant, "--set", setting},
          {std::string("--set ") + parameter, "no variant here draws with it"});
    }
    bad({"run", "--variant", "m=software," + setting}, {"variant m", parameter, "does not draw with"});
  }
  bad({"run", "--variant", "accelerator", "--set", "sm.cores=4"}, {"sm.cores", "no variant here"});
  bad({"run", "--variant", "m=software,crop=in-shader"}, {"variant m", "does not draw with crop"});
  bad({"compare", "--variant", "baseline", "--variant", "m=software,accelerator=gcc"}, {"variant m", "accelerator"});
  bad({"compare", "--variant", "m=het,render=endless"}, {"'render'", "has none"});
  bad({"run", "--variant", "software", "--trace", "t.json"}, {"--trace", "variant software"});
  bad({"run", "--variant", "software", "--log", "crop"}, {"--log", "variant software"});
  bad({"compare", "--variant", "baseline", "--variant", "software", "--interval", "100", "--json", "i.json"},
      {"--interval", "variant software"});
  bad({"run", "--variant", "software", "--until", "100"}, {"--until", "variant software"});
  bad({"compare", "--variant", "software", "--variant", "het", "--multi-pass", "2"}, {"--multi-pass", "one pass"});
  bad({"run", "--variant", "accelerator", "--effects", "all"}, {"--effects", "has no effects"});
  bad({"run", "--variant", "software", "--explain-effects"}, {"--explain-effects", "has no effects"});
  bad({"run", "--variant", "accelerator", "--output", "o", "--heat-maps"}, {"--heat-maps", "does not tell"});
  write("frame.json", R"({"commands": [{"draw": "tiny.spl"}]})");
  refused({"run", "--frame", "frame.json", "--variant", "software"}, {"--frame", "variant software"});
}

TEST_F(DrawnBy, WhatOneOfThemHasCanBeSet) {
  const auto run = [&](const std::string& variant, const std::vector<std::string>& settings) {
    std::vector<std::string> arguments{"--variant", "software", "--variant", variant};
    for (const std::string& setting : settings) arguments.insert(arguments.end(), {"--set", setting});
    return by_variant(compared(arguments));
  };
  EXPECT_NE(run("het", {"crop.bytes_per_cycle=16"}).at("het")["cycles"], run("het", {}).at("het")["cycles"]);
  EXPECT_NE(run("accelerator", {"sm.cores=4"}).at("software")["cycles"],
            run("accelerator", {"platform.gpcs=1", "state.exponential=exact"}).at("software")["cycles"]);
  // A printed configuration sets everything.
  write("c.toml", "[set]\ncrop.ways = 4\nlink.draw.vertices.depth = 4\n");
  command("run", {"--variant", "software", "--config", "c.toml"});
  refused({"run", "--scene", "tiny.spl", "--variant", "software", "--config", "c.toml", "--set", "crop.ways=8"},
          {"--set crop.ways", "no variant here draws with it"});
}

TEST_F(DrawnBy, ReportsAndPagesHaveRunsWithoutQuads) {
  std::vector<std::string> arguments{"compare", "--scene",   "tiny.spl", "--fidelity", "lt",
                                     "--html",  "page.html", "--output", "o",          "--energy"};
  arguments.insert(arguments.end(), all_that_draw.begin(), all_that_draw.end());
  const Finished finished = vrpipe(arguments);
  ASSERT_EQ(finished.code, 0) << finished.err;
  for (const char* part : {"RENDER", "speed-up over baseline", "quads", "energy, mJ",
                           "software: its cycles have the sorting of splats among them"})
    EXPECT_NE(finished.out.find(part), std::string::npos) << part;
  EXPECT_EQ(finished.out.find("nan"), std::string::npos);
  const std::string page = read_file(folder() / "page.html");
  EXPECT_NE(page.find(">Over time<"), std::string::npos) << "of the pipelines";
  EXPECT_NE(page.find("<dt>termination</dt><dd>paper (not of software, accelerator)</dd>"), std::string::npos);
  EXPECT_NE(page.find("Not known of software, accelerator."), std::string::npos) << "merged, when terminated";
  const Finished alone = vrpipe({"run", "--scene", "tiny.spl", "--variant", "software", "--html", "alone.html"});
  ASSERT_EQ(alone.code, 0) << alone.err;
  const std::string own_page = read_file(folder() / "alone.html");
  for (const char* absent : {"<dt>colour</dt>", "<dt>termination</dt>", "<dt>effects</dt>", "Fragments merged",
                             "Cycle in which each pixel terminated"})
    EXPECT_EQ(own_page.find(absent), std::string::npos) << absent;
  EXPECT_NE(own_page.find("Fragments blended"), std::string::npos);
  EXPECT_EQ(alone.out.find("\nquads"), std::string::npos);
  EXPECT_NE(alone.out.find("unit cycles"), std::string::npos);
  EXPECT_NE(alone.out.find("colour and termination of its own"), std::string::npos) << "--format says nothing of it";
  const Finished views = vrpipe({"compare", "--views", "2", "--size", "32x24", "--fovy", "10", "--fidelity", "lt",
                                 "--variant", "baseline", "--variant", "software", "--set", "preprocess.sh_degree=0"});
  ASSERT_EQ(views.code, 0) << views.err;
  EXPECT_NE(views.out.find("software"), std::string::npos);
}

TEST_F(DrawnBy, EnergyOfSoftwareIsThatOfItsFrame) {
  const std::string platform = "gh100-gpc";
  const json run =
      by_variant(compared({"--variant", "software", "--variant", "accelerator", "--platform", platform, "--energy"}))
          .at("software");
  const json path = frame("software", {"--platform", platform});
  EXPECT_NEAR(run["energy"]["total_millijoules"]["nominal"].get<double>(), path["millijoules"]["nominal"].get<double>(),
              1e-9);
  const auto accelerators = by_variant(compared({"--variant", "baseline", "--variant", "accelerator", "--variant",
                                                 "mine=accelerator,accelerator=gcc", "--energy"}));
  const json own = accelerators.at("accelerator")["energy"], beside = frame("accelerator")["millijoules"];
  EXPECT_NEAR(own["total_millijoules"]["nominal"].get<double>(), beside["nominal"].get<double>(),
              0.87 * 1e3 / (accelerators.at("baseline")["frequency_mhz"].get<double>() * 1e3))
      << "of a whole cycle of the platform";
  EXPECT_GT(own["ratio_over_baseline"]["nominal"], 0);
  const json unknown = accelerators.at("mine")["energy"];
  EXPECT_TRUE(unknown["total_millijoules"].is_null());
  EXPECT_TRUE(unknown["ratio_over_baseline"].is_null());
  EXPECT_FALSE(unknown["missing"].empty());
}

TEST_F(DrawnBy, AStudyGoesOverListsAndKernels) {
  write("study.toml",
        "scene = \"tiny.spl\"\nfidelity = \"lt\"\ncolumns = [\"binning.pairs\", \"render.warp_iterations\"]\n"
        "[variants.endless]\nbase = \"software\"\nunit.render = \"endless\"\n"
        "[axes]\nvariant = [\"baseline\", \"software\", \"endless\"]\nbinning.lists = [\"obb\", \"ellipse\"]\n");
  const json points = json_of({"sweep", "study.toml"})["points"];
  ASSERT_EQ(points.size(), 5U) << "baseline has no lists";
  EXPECT_TRUE(points[0]["binning.lists"].is_null());
  for (std::size_t i = 1; i < points.size(); ++i) {
    SCOPED_TRACE(points[i].dump());
    EXPECT_EQ(points[i]["binning.lists"], i % 2 == 1 ? "obb" : "ellipse");
    EXPECT_EQ(points[i]["variant"], i < 3 ? "software" : "endless");
    EXPECT_GT(points[i]["binning.pairs"], 0);
    EXPECT_GT(points[i]["cycles"], 0);
    EXPECT_GT(points[i]["speedup"], 0);
  }
  EXPECT_GE(points[1]["binning.pairs"], points[2]["binning.pairs"]);
  EXPECT_LE(points[1]["render.warp_iterations"], points[3]["render.warp_iterations"]);
  const json run = command("run", {"--variant", "software", "--fidelity", "lt", "--set", "binning.lists=ellipse"});
  EXPECT_EQ(points[2]["cycles"], run["runs"][0]["cycles"]);
}

TEST_F(DrawnBy, AStudyRefusesWhatNothingDrawsWith) {
  const std::string head = "scene = \"tiny.spl\"\n[axes]\n";
  write("study.toml", head + "variant = [\"baseline\", \"accelerator\"]\nrender.issue_rate = [0.8, 0.9]\n");
  refused({"sweep", "study.toml"}, {"render.issue_rate", "changes nothing"});
  write("study.toml", head + "variant = [\"accelerator\"]\nfidelity = [\"lt\", \"cycle\"]\n");
  refused({"sweep", "study.toml"}, {"fidelity cycle", "of the point"});
  write("study.toml", head + "variant = [\"accelerator\"]\naccelerator.volume_units = [8, 16]\n");
  const json points = json_of({"sweep", "study.toml"})["points"];
  ASSERT_EQ(points.size(), 2U);
  EXPECT_GE(points[0]["cycles"], points[1]["cycles"]);
}

TEST_F(DrawnBy, AccuracyClimbsTheLadderThatThereIs) {
  const json result = json_of({"accuracy", "--scene", "tiny.spl", "--variant", "software", "--variant", "accelerator"});
  std::vector<std::string> rungs;
  for (const json& level : result["fidelity"]) {
    rungs.push_back(level["variant"].get<std::string>() + " " + level["fidelity"].get<std::string>());
    EXPECT_TRUE(level["image_equal"]);
    if (level["fidelity"] == "functional") {
      EXPECT_TRUE(level["cycles_error_percent"].is_null());
    } else if (level["fidelity"] == "bound") {
      EXPECT_LE(level["cycles_error_percent"], 0);
    }
  }
  EXPECT_EQ(rungs, (std::vector<std::string>{"software functional", "software bound", "software lt", "software cycle",
                                             "accelerator functional", "accelerator bound", "accelerator lt"}));
  EXPECT_EQ(result["fidelity"][3]["cycles_error_percent"], 0);
  EXPECT_EQ(result["fidelity"][6]["cycles_error_percent"], 0);
  const double lt = result["fidelity"][2]["cycles"], cycle = result["fidelity"][3]["cycles"];
  EXPECT_NEAR(result["fidelity"][2]["cycles_error_percent"].get<double>(), 100 * (lt / cycle - 1), 1e-9);
  EXPECT_TRUE(result["stress"].empty());
  const Finished finished =
      vrpipe({"accuracy", "--scene", "tiny.spl", "--variant", "software", "--quick", "--html", "a.html"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  EXPECT_NE(finished.out.find("left out, since they are of the graphics pipeline"), std::string::npos);
  EXPECT_EQ(finished.out.find("inf"), std::string::npos);
}

TEST_F(DrawnBy, AConfigurationReadsBack) {
  const std::vector<std::string> arguments{"compare",
                                           "--scene",
                                           "tiny.spl",
                                           "--fidelity",
                                           "lt",
                                           "--variant",
                                           "software",
                                           "--variant",
                                           "mine=software,render=endless",
                                           "--set",
                                           "render.warp_pixels=8x4",
                                           "--unit",
                                           "binning=pairs"};
  std::vector<std::string> printing = arguments;
  printing.emplace_back("--print-config");
  const Finished printed = vrpipe(printing);
  ASSERT_EQ(printed.code, 0) << printed.err;
  write("c.toml", printed.out);
  const json again = json_of({"compare", "--config", "c.toml"}), first = json_of(arguments);
  ASSERT_EQ(again["runs"].size(), first["runs"].size());
  for (std::size_t i = 0; i < first["runs"].size(); ++i)
    EXPECT_EQ(again["runs"][i]["result_hash"], first["runs"][i]["result_hash"]);
}

}  // namespace
}  // namespace vrpipe::testing
