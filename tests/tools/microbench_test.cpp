#include "jobs/microbench_job.h"

#include <cmath>
#include <map>
#include <regex>
#include <set>
#include <tuple>

#include "documented_keys.h"
#include "jobs/measured_table.h"
#include "jobs/published_figures.h"
#include "output/microbench_report.h"
#include "output/text_plot.h"
#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

// What is published.

TEST(PublishedFigures, EachIsNamedOnceAndHasASource) {
  std::set<std::pair<std::string, std::string>> names;
  const std::vector<std::string> known = microbench_names();
  for (const tools::PublishedFigure& figure : tools::published_figures()) {
    EXPECT_TRUE(names.emplace(figure.microbench, figure.name).second) << figure.name;
    EXPECT_NE(std::find(known.begin(), known.end(), figure.microbench), known.end()) << figure.microbench;
    EXPECT_NE(std::string(figure.source), "") << figure.name;
    if (!figure.paper && !figure.gpu) {
      EXPECT_LT(figure.tolerance_percent, 0) << figure.name << " has nothing to agree with";
    }
  }
  EXPECT_THROW(tools::published_figure("tile-binning", "nothing"), std::logic_error);
}

// Findings.

MicrobenchFigure figure_of(double measured, std::optional<double> reference, double tolerance) {
  MicrobenchFigure figure;
  figure.name = "rate";
  figure.unit = "quads/clk";
  figure.measured = measured;
  figure.reference = reference;
  figure.reference_is = "paper";
  figure.tolerance_percent = tolerance;
  return figure;
}

TEST(MicrobenchFindings, SayWhatAgreesAndByHowMuchAndWhyWhatDoesNot) {
  EXPECT_EQ(tools::finding(figure_of(2, 2.0, 0)), "rate: 2 quads/clk, agrees with the paper's 2");
  EXPECT_EQ(tools::finding(figure_of(2.02, 2.0, 2)), "rate: 2.020 quads/clk, agrees with the paper's 2: 1.0 % more");
  MicrobenchFigure differs = figure_of(1, 2.0, 5);
  EXPECT_EQ(tools::finding(differs), "rate: 1 quads/clk, differs from the paper's 2: 50 % less");
  differs.note = "half the units";
  EXPECT_EQ(tools::finding(differs), "rate: 1 quads/clk, differs from the paper's 2: 50 % less; half the units");
  EXPECT_EQ(tools::finding(figure_of(1, 2.0, -1)), "rate: 1 quads/clk, beside the paper's 2");
  MicrobenchFigure of_a_part = figure_of(4, std::nullopt, 5);
  EXPECT_EQ(tools::finding(of_a_part), "rate: 4 quads/clk");
  of_a_part.gpu = 2;
  of_a_part.gpu_is_of = one_partition;
  EXPECT_EQ(tools::finding(of_a_part), "rate: 4 quads/clk; the real GPU has 2 (one ROP partition)");
  EXPECT_FALSE(of_a_part.agrees());
  EXPECT_TRUE(figure_of(0, 0.0, 0).agrees());
  EXPECT_FALSE(figure_of(3, 0.0, 0).agrees());
  EXPECT_EQ(tools::finding(figure_of(3, 0.0, 0)), "rate: 3 quads/clk, differs from the paper's 0");
}

TEST(MicrobenchFindings, SayHowFarAGroupIsOff) {
  MicrobenchResult result;
  for (const auto& [group, label, measured] :
       {std::tuple{"a", "one", 2.1}, {"a", "two", 1.8}, {"b", "three", 2.0}, {"", "", 9.0}}) {
    MicrobenchFigure figure = figure_of(measured, 2.0, 5);
    figure.group = group;
    figure.name = figure.group.empty() ? "alone" : figure.group + ": " + label;
    result.figures.push_back(figure);
  }
  EXPECT_EQ(result.figures[1].label(), "two");
  EXPECT_EQ(result.figures[3].label(), "alone");
  const std::vector<MicrobenchGroup> groups = result.groups();
  ASSERT_EQ(groups.size(), 3U);
  EXPECT_NEAR(groups[0].mean_percent, 7.5, 1e-9);
  EXPECT_NEAR(groups[0].worst_percent, -10, 1e-9);
  EXPECT_EQ(groups[0].worst, "a: two");
  EXPECT_NEAR(groups[2].mean_percent, 5, 1e-9);
  EXPECT_EQ(tools::finding(groups[0]), "a: 2 figures, off by 7.5 % in the mean, by -10.0 % at most (two)");
  EXPECT_EQ(tools::finding(groups[1]), "b: 1 figure, off by 0.0 % in the mean, by +0.0 % at most (three)");
  EXPECT_EQ(tools::finding(groups[2]), "all: 3 figures, off by 5.0 % in the mean, by -10.0 % at most (a: two)");
  EXPECT_EQ(tools::findings(result).size(), 4U);
  result.figures.resize(2);
  EXPECT_EQ(result.groups().size(), 1U) << "one group is all";
  for (MicrobenchFigure& figure : result.figures) figure.reference.reset();
  EXPECT_TRUE(result.groups().empty()) << "of another GPU";
}

TEST(MeasuredTables, AreAllThere) {
  const std::pair<const char*, std::size_t> tables[] = {{"strips", 41},      {"equal_splats", 24},
                                                        {"same_place", 92},  {"tiles_in_turn", 140},
                                                        {"hot_squares", 42}, {"scattered_rectangles", 36}};
  for (const auto& [name, rows] : tables) EXPECT_EQ(tools::measured_table(name).size(), rows) << name;
  const tools::MeasuredRow& row = tools::measured_table("strips").front();
  EXPECT_EQ(row.text("format"), "RGBA8");
  EXPECT_EQ(row.count("width"), 2U);
  EXPECT_EQ(row.number("clk"), 4.183);
  EXPECT_THROW(row.text("nothing"), std::logic_error);
  EXPECT_THROW(tools::measured_table("nothing"), std::logic_error);
}

TEST(TextPlot, PutsPointsWhereTheyBelong) {
  EXPECT_EQ(tools::text_plot({{'*', {{1, 0}, {3, 4}}}, {'o', {{2, 2}, {3, 4}}}}, 5, 3),
            "4 |    *\n"
            "  |  o\n"
            "0 |*\n"
            "  +-----\n"
            "   1   3\n");
  EXPECT_EQ(tools::text_plot({{'*', {{1, INFINITY}}}}, 5, 3), "");
}

// The command.

class Microbench : public ToolTest {
 protected:
  static std::map<std::string, double> measured(const json& result, const std::string& name) {
    std::map<std::string, double> values;
    for (const json& each : result["microbenchmarks"]) {
      if (each["name"] != name) continue;
      for (const json& figure : each["figures"]) values[figure["name"]] = figure["measured"].get<double>();
    }
    return values;
  }
};

TEST_F(Microbench, OnThePapersGpuAllThatIsPublishedOfItAgrees) {
  const Finished finished = vrpipe({"microbench", "all", "--json", "all.json", "--html", "all.html"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(finished.err, "");
  const json result = json::parse(read_file(folder() / "all.json"));
  EXPECT_EQ(result["schema"], "vrpipe.microbench/1");
  EXPECT_EQ(result["platform"]["name"], "agx-orin");
  EXPECT_EQ(result["fidelity"], "cycle");
  std::set<std::string> names;
  std::size_t figures = 0;
  std::size_t curves = 0;
  unsigned agreeing = 0;
  for (const json& each : result["microbenchmarks"]) {
    names.insert(each["name"]);
    figures += each["figures"].size();
    curves += each["curves"].size();
    for (const json& figure : each["figures"]) {
      if (figure["agrees"].is_null()) continue;
      EXPECT_TRUE(figure["agrees"].get<bool>()) << figure["finding"];
      ++agreeing;
      EXPECT_NE(finished.out.find(figure["name"].get<std::string>()), std::string::npos);
    }
    for (const json& curve : each["curves"]) EXPECT_GT(curve["measured"].size(), 1U) << curve["name"];
  }
  const std::vector<std::string> expected = microbench_names();
  EXPECT_EQ(names, std::set<std::string>(expected.begin(), expected.end()));
  EXPECT_EQ(figures, tools::published_figures().size());
  EXPECT_GE(agreeing, 20U);

  const auto binning = measured(result, "tile-binning");
  EXPECT_EQ(binning.at("warps, 320 quads over 32 tiles"), 64);
  EXPECT_EQ(binning.at("warps, 330 quads over 33 tiles"), 330);
  EXPECT_NEAR(binning.at("gap that parts a pair"), 150, 20) << "tc.idle_timeout_cycles, and when quads come";
  EXPECT_EQ(measured(result, "crop-cache").at("largest working set without reads"), 16);
  const auto rop =
      measured(json_of({"microbench", "rop-throughput", "--platform", "agx-orin-ideal-memory"}), "rop-throughput");
  EXPECT_NEAR(rop.at("RGBA16F, blending, 1024x1024"), 6.4, 0.05) << "a fill and a write-back a quad, of 16 a cycle";
  EXPECT_NEAR(rop.at("RGBA16F, no blending, 1024x1024"), 7.11, 0.05) << "a write-back alone";

  const std::string page = read_file(folder() / "all.html");
  const auto times = [&](const std::string& text) {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = page.find(text, at)) != std::string::npos; ++at) ++count;
    return count;
  };
  EXPECT_EQ(times("<svg"), curves);
  EXPECT_EQ(times(">plot as SVG<"), curves);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
  EXPECT_EQ(page.find("href=\"http"), std::string::npos);
  EXPECT_NE(page.find("</html>"), std::string::npos);
}

TEST_F(Microbench, FollowsThePlatformsSettings) {
  const json halved = json_of({"microbench", "rop-throughput", "--set", "crop.bytes_per_cycle=32", "--set",
                               "crop.cache_bytes=8K", "--fidelity", "lt", "--platform", "agx-orin-ideal-memory"});
  EXPECT_NEAR(measured(halved, "rop-throughput").at("RGBA16F, blending, 32x32"), 4, 0.05);
  EXPECT_EQ(halved["platform"]["parameters"]["crop.bytes_per_cycle"], 32);
  for (const json& figure : halved["microbenchmarks"][0]["figures"]) {
    if (figure["name"] != "RGBA16F, blending, 32x32") continue;
    EXPECT_FALSE(figure["agrees"].get<bool>());
    EXPECT_EQ(figure["gpu_is_of"], "one ROP partition");
    EXPECT_NE(figure["finding"].get<std::string>().find("differs from the paper's 8: 50 % less"), std::string::npos);
  }
  const json small = json_of({"microbench", "crop-cache", "--set", "crop.cache_bytes=8K", "--fidelity", "lt",
                              "--platform", "agx-orin-ideal-memory"});
  EXPECT_EQ(measured(small, "crop-cache").at("largest working set without reads"), 8);
  const json bins = json_of({"microbench", "tile-binning", "--set", "tc.bins=16", "--fidelity", "functional"});
  EXPECT_EQ(measured(bins, "tile-binning").at("bins"), 16);
  EXPECT_EQ(measured(bins, "tile-binning").count("gap that parts a pair"), 0U) << "there is no time";
}

/// Ratios to what was measured, by name.
std::map<std::string, double> ratios(const json& result) {
  std::map<std::string, double> values;
  for (const json& each : result["microbenchmarks"]) {
    for (const json& figure : each["figures"]) {
      const double gpu = figure["gpu"].get<double>();
      EXPECT_TRUE(values.emplace(figure["name"], figure["measured"].get<double>() / gpu).second) << figure["name"];
    }
  }
  return values;
}

TEST_F(Microbench, LawsOfStripsHoldAndThoseThatDoNotAreKnown) {
  const json result = json_of({"microbench", "strips"});
  EXPECT_EQ(result["platform"]["name"], "gh100-gpc") << "by default";
  // A column of quads takes a flit more a line there than its sectors; 4x4 pixels of RGBA8 something that 2x2 pixels do not take,
  // nor 4x4 at one place.
  const std::map<std::string, double> known{{"RGBA8, no blending: 4x4", 0.085},
                                            {"RGBA8, blending: 4x4", 0.085},
                                            {"RGBA16F, no blending: 2x64", 0.17}};
  for (const auto& [name, ratio] : ratios(result)) {
    EXPECT_NEAR(ratio, 1, known.count(name) > 0 ? known.at(name) : 0.025) << name;
  }
  EXPECT_EQ(result["microbenchmarks"][0]["groups"].back()["name"], "all");
  EXPECT_LT(result["microbenchmarks"][0]["groups"].back()["mean_percent"].get<double>(), 1.5);
}

TEST_F(Microbench, QuadsWaitForTheSamePlaceAsMeasured) {
  const Finished finished = vrpipe({"microbench", "same-place", "--json", "same.json", "--html", "same.html"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  const json result = json::parse(read_file(folder() / "same.json"));
  for (const auto& [name, ratio] : ratios(result)) {
    // What the front end bounds is 4.17 clk a filled rectangle there, 4.55 here.
    if (name.find("no blending") != std::string::npos || name.find("4x1") != std::string::npos) {
      EXPECT_NEAR(ratio, 1, 0.12) << name;
    } else if (name == "RGBA16F, blending: 16x1, 16x1 at (0, 1) in turn") {
      EXPECT_NEAR(ratio, 13.0 / 8.93, 0.05) << "two halves of a row of 8 quads do not wait for each other on the GPU";
    } else {
      EXPECT_NEAR(ratio, 1, name.find("16x12") != std::string::npos ? 0.045 : 0.027) << name;
    }
  }
  EXPECT_NE(finished.out.find("RGBA32F, blending: 20 figures, off by 0.2 % in the mean"), std::string::npos)
      << finished.out;
  EXPECT_NE(finished.out.find("ratio"), std::string::npos);
  EXPECT_NE(read_file(folder() / "same.html").find("RGBA32F, blending: 20 figures, off by"), std::string::npos);
}

TEST_F(Microbench, LawsOfAnotherPlatformHaveNoRatio) {
  const Finished finished =
      vrpipe({"microbench", "strips", "--platform", "agx-orin-ideal-memory", "--fidelity", "bound"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  EXPECT_NE(finished.out.find("(one GPC of 2 TPCs)"), std::string::npos);
  EXPECT_EQ(finished.out.find("off by"), std::string::npos);
}

TEST_F(Microbench, WhatALawsConfigurationSaysIsItsOwnDefault) {
  const Finished printed = vrpipe({"microbench", "strips", "--print-config"});
  EXPECT_NE(printed.out.find("platform = \"gh100-gpc\""), std::string::npos) << printed.out;
  EXPECT_NE(vrpipe({"microbench", "kill-rate", "--print-config"}).out.find("platform = \"agx-orin\""),
            std::string::npos);
}

TEST_F(Microbench, ResultsDoNotDependOnTheNumberOfProcesses) {
  const auto figures_of = [&](const char* jobs) {
    json result = json_of({"microbench", "front-end", "--fidelity", "lt", "--jobs", jobs});
    return result["microbenchmarks"][0]["figures"];
  };
  EXPECT_EQ(figures_of("1"), figures_of("3"));
}

TEST_F(Microbench, BlendsInOrderAtEveryFidelity) {
  for (const char* fidelity : {"functional", "bound", "lt"}) {
    const json result =
        json_of({"microbench", "blend-order", "--fidelity", fidelity, "--set", "state.blend_rounding=rtz"});
    for (const auto& [name, pixels] : measured(result, "blend-order")) EXPECT_EQ(pixels, 0) << fidelity << ", " << name;
  }
}

TEST_F(Microbench, Refusals) {
  refused({"microbench"}, {"NAME is required"});
  refused({"microbench", "tile-bining"},
          {"unknown microbenchmark 'tile-bining'", "did you mean tile-binning?", "and all", "and laws"});
  refused({"microbench", "stripes"}, {"did you mean strips?"});
  refused({"microbench", "laws", "--fidelity", "functional"}, {"cannot measure strips", "it measures time"});
  refused({"microbench", "all", "--fidelity", "functional"}, {"cannot measure rop-throughput", "it measures time"});
  refused({"microbench", "kill-rate", "--platform", "agx-orion"}, {"agx-orion", "agx-orin"});
  refused({"microbench", "kill-rate", "--set", "crop.cache_byte=1"}, {"crop.cache_bytes"});
  refused({"microbench", "kill-rate", "--set", "preprocess.sh_degree=1"}, {"no scene is preprocessed"});
  refused({"microbench", "kill-rate", "--set", "tc.bins=1", "--set", "tc.bins=2"}, {"given twice"});
  refused({"microbench", "kill-rate", "--html", "none/x.html"}, {"--html", "there is no folder"});
  refused({"microbench", "kill-rate", "--json", "x", "--html", "x"}, {"--json", "--html"});
  refused({"microbench", "kill-rate", "--scene", "builtin:object"}, {"--scene"});
}

TEST_F(Microbench, EveryKeyIsDocumentedAndEveryDocumentedKeyExists) {
  const std::string page = read_file(std::filesystem::path(RESULTS_PAGE).parent_path() / "microbenchmarks.md");
  expect_documented({json_of({"microbench", "tile-binning", "--fidelity", "functional"}),
                     json_of({"microbench", "front-end", "--fidelity", "bound", "--plugin", TEST_PLUGIN, "--unit",
                              "qru=same-splat"}),
                     json_of({"microbench", "strips", "--fidelity", "bound"})},
                    documented(page, "Keys"));
}

}  // namespace
}  // namespace vrpipe::testing
