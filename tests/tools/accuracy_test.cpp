#include "tool_test_support.h"

#include <cmath>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/gaussian_scene.h>

#include "image/picture.h"
#include "jobs/precision_knobs.h"
#include "jobs/settings.h"
#include "jobs/trade_off.h"
#include "output/accuracy_report.h"
#include "output/svg_plot.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

class Accuracy : public ToolTest {
 protected:
  /// Without L2 and DRAM, whose elaboration is most of the time of a draw as small.
  json accuracy(std::vector<std::string> options) const {
    options.insert(options.begin(), {"accuracy", "--scene", "tiny.spl", "--platform", "agx-orin-ideal-memory"});
    return json_of(options);
  }
};

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

// What does not depend on the scene.

TEST(TradeOffs, TheFrontIsWhatNothingBeatsInBoth) {
  using tools::dominated;
  EXPECT_EQ(dominated({{1, 9}, {2, 5}, {3, 6}, {4, 0}}, {}), (std::vector<bool>{false, false, true, false}));
  // Worse in one and equal in the other is beaten; equals are not.
  EXPECT_EQ(dominated({{1, 1}, {1, 2}, {2, 1}, {1, 1}}, {}), (std::vector<bool>{false, true, true, false}));
  EXPECT_EQ(dominated({{1, -INFINITY}, {0, 3}, {2, -INFINITY}}, {}), (std::vector<bool>{false, false, true}));
  EXPECT_TRUE(dominated({}, {}).empty());
}

TEST(TradeOffs, DifferencesWithinTheToleranceSayNothing) {
  using tools::dominated;
  using tools::pareto_front;
  const tools::Tolerance tolerance{0.1, 0.5};
  // 5 % cheaper and 0.4 closer beats nobody, alone or together; 20 % cheaper and 0.4 worse does.
  EXPECT_EQ(dominated({{100, 3}, {95, 3}, {100, 2.6}, {95, 2.6}}, tolerance), std::vector<bool>(4, false));
  EXPECT_EQ(dominated({{100, 3}, {80, 3.4}}, tolerance), (std::vector<bool>{true, false}));
  // 19 cycles less for a PSNR 1 dB worse is no bargain.
  EXPECT_EQ(pareto_front({{1290000, -57.4}, {1289981, -56.4}}, {0.001, 0.1}), (std::vector<bool>{true, false}));
  // Of those that are alike, the first.
  EXPECT_EQ(pareto_front({{100, 3}, {95, 3}, {50, 9}, {100, 2.6}}, tolerance),
            (std::vector<bool>{true, false, true, false}));
  EXPECT_EQ(pareto_front({{0, 0}, {0, 0}}, tolerance), (std::vector<bool>{true, false}));
}

TEST(AccuracyText, BoundsAreRoundedUpAndZeroIsZeroAlone) {
  EXPECT_EQ(tools::within(0), "0 %");
  EXPECT_EQ(tools::within(4.26), "4.3 %");
  EXPECT_EQ(tools::within(4.21), "4.3 %");
  EXPECT_EQ(tools::within(0.3), "0.3 %");
  EXPECT_EQ(tools::within(0.04), "0.04 %");
  EXPECT_EQ(tools::within(0.00123), "0.002 %");
}

/// Numbers as wide as they get.
tools::AccuracyResult large_result() {
  tools::AccuracyResult result;
  result.base.platform = &platforms().front();
  result.base.variant = variant_named("het+qm");
  for (const Variant& variant : variants()) {
    for (const Fidelity fidelity : fidelities()) {
      tools::FidelityLevel level;
      level.run.request.variant = variant;
      level.run.request.fidelity = fidelity;
      level.run.cycles = 1234567890;
      level.run.kernel_events = 123456789;
      level.host_seconds = level.cpu_seconds = 999.99;
      level.times_as_fast = level.times_as_fast_elapsed = 12.34;
      level.quads_per_second = 123.4e6;
      level.cycles_error_percent = level.speedup_error_percent = -12.345;
      level.fragments_blended_error_percent = 0.00012;
      level.run.expected_error_percent = 2.2;
      level.speedup = 12.345;
      level.image.psnr_db = 101.23;
      level.dominated = true;
      result.fidelity.push_back(level);
    }
  }
  tools::PrecisionRun run;
  run.run.cycles = 1234567890;
  run.cycles_change_percent = -12.345;
  run.error = {101.23, 0.99999, 0.0123, 1234567, 0.9999};
  run.proved_max_error = 0.01234;
  run.pixels_stuck = 1234567;
  run.l2_bytes = 12'345'678'901;
  run.dram_bytes = 12'345'678'901;
  run.millijoules = tools::Range{1, 1234.5, 2000};
  run.by_fragments = {{1024, 2047, 1234567, 0.0001234, 0.0123, 0.1234}};
  run.on_front = true;
  result.runs.push_back(run);
  for (const tools::PrecisionKnob& knob : tools::precision_knobs()) {
    for (const std::string& value : knob.values) {
      const bool is_default = value == knob.values.front();
      result.precision.push_back({&knob, value, is_default ? 0 : result.runs.size()});
      if (is_default) continue;
      result.runs.push_back(run);
      result.runs.back().name = knob.name + "=" + value;
    }
  }
  for (const Fidelity fidelity : {Fidelity::bound, Fidelity::lt}) {
    result.stress.resize(1, {"termination queue of depth 1", "het+qm", 1234567890123, {}});
    result.stress.back().error_percent.emplace_back(fidelity, -12345.678);
  }
  return result;
}

TEST(AccuracyText, TablesFitATerminalOf80Columns) {
  std::istringstream lines(tools::accuracy_text(large_result(), {}));
  std::vector<std::string> all;
  for (std::string line; std::getline(lines, line);) all.push_back(line);
  std::size_t tables = 0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    if (all[i].empty() || all[i].find_first_not_of('-') != std::string::npos) continue;
    ++tables;
    for (std::size_t row = i - 1; row < all.size() && !all[row].empty(); ++row) {
      EXPECT_LE(all[row].size(), 80U) << all[row];
    }
  }
  EXPECT_EQ(tables, 6U);
}

TEST(AccuracyText, SaysWhatBoundsTheDrawWherePricesCollapse) {
  tools::AccuracyResult result = large_result();
  RunResult& run = result.runs.front().run;
  run.request = result.base;
  run.bottleneck = Bottleneck{"gpc0.raster", 0.97, {{"fine tiles", 0.97}}};
  EXPECT_EQ(
      tools::precision_summary(result).front(),
      "het+qm is bound by RASTER, occupied 97.0 % (fine tiles 97.0 %): what spares other units saves no time here");
  run.bottleneck->occupancy = 0.5;
  EXPECT_EQ(tools::precision_summary(result).front(),
            "no one unit bounds het+qm: RASTER is occupied 50.0 % (fine tiles 97.0 %)");
}

TEST(AccuracyText, SaysWhatAccuracyCosts) {
  tools::AccuracyResult result = large_result();
  for (tools::FidelityLevel& level : result.fidelity) {
    const bool is_baseline = level.run.request.variant.name == "baseline";
    if (level.run.request.fidelity == Fidelity::functional) level.run.cycles.reset();
    if (level.run.request.fidelity != Fidelity::lt) continue;
    level.times_as_fast = is_baseline ? 1.7 : 2.31;
    level.cycles_error_percent = is_baseline ? -0.1 : 0.04;
  }
  EXPECT_EQ(tools::fidelity_verdict(result),
            "lt: 1.7 to 2.3 times as fast as cycle, cycles within 0.1 %; "
            "bound: 12.3 times, cycles within 12.4 %; functional: 12.3 times, without cycles");
  for (tools::PrecisionRun& run : result.runs) run.on_front = false;
  result.runs[0].error.psnr_db = 57.4;
  result.runs[1].on_front = result.runs[2].on_front = true;
  result.runs[1].run.cycles = 1000;
  result.runs[1].error.psnr_db = 42;
  EXPECT_EQ(tools::precision_verdict(result), "the default: 57.40 dB; cheapest, " + result.runs[1].name +
                                                  ": -12.35 % of the cycles for 42.00 dB; most exact, " +
                                                  result.runs[2].name + ": -12.35 % of the cycles for 101.23 dB");
}

TEST(AccuracyText, SaysWhatASecondCoreSpares) {
  tools::AccuracyResult result = large_result();
  for (tools::FidelityLevel& level : result.fidelity) {
    if (level.run.request.fidelity != Fidelity::lt) continue;
    level.host_seconds = 0.6 * level.cpu_seconds;
    level.times_as_fast_elapsed = level.run.request.variant.name == "baseline" ? 20 : 21.5;
  }
  const std::string summary = fmt::format("{}", fmt::join(tools::fidelity_summary(result), "\n"));
  EXPECT_NE(summary.find(
                "lt: 12.3 times as fast in CPU seconds, 20.0 to 21.5 times with another core beside it, cycles"),
            std::string::npos)
      << summary;
  EXPECT_NE(summary.find("bound: 12.3 times as fast, cycles"), std::string::npos) << summary;
}

TEST(PrecisionKnobs, AreAllThatTheHardwareChooses) {
  std::vector<std::string> names;
  for (const auto& knob : tools::precision_knobs()) names.push_back(knob.name);
  EXPECT_EQ(names,
            (std::vector<std::string>{"format", "blend_rounding", "termination_threshold", "termination_compare",
                                      "termination", "pruning_threshold", "subpixel_bits", "exponential", "shading",
                                      "merging", "attributes", "export_format", "alpha_max", "depth_key_bits",
                                      "sh_degree", "dilation", "splat_extent", "quad_merging", "early_termination"}));
  // A choice that is added to a parameter belongs here too.
  for (const ParameterListing& unit : tools::all_parameters(nullptr)) {
    for (const Parameter* parameter : unit.parameters->parameters()) {
      if ((unit.unit != "state" && unit.unit != "preprocess") || dynamic_cast<const Choice*>(parameter) == nullptr) {
        continue;
      }
      // What accuracy measures has splats alone, whose depth nobody tests.
      if (std::string(parameter->name()) == "depth_format") continue;
      // How a model was trained, not how exactly it is drawn.
      if (std::string(parameter->name()) == "opacity_compensation") continue;
      const auto& knobs = tools::precision_knobs();
      const auto knob =
          std::find_if(knobs.begin(), knobs.end(), [&](const auto& one) { return one.name == parameter->name(); });
      ASSERT_NE(knob, knobs.end()) << parameter->name();
      std::string values;
      for (const std::string& value : knob->values) values += (values.empty() ? "one of " : ", ") + value;
      // Which is the axis-aligned box once more, as one primitive.
      if (knob->name == "splat_extent") values += ", fill_rectangle";
      EXPECT_EQ(values, parameter->range()) << parameter->name();
    }
  }
}

TEST(PrecisionKnobs, EachTakesItsValuesAndTellsThem) {
  tools::PrecisionSettings untouched;
  untouched.request.platform = &platforms().front();
  untouched.request.variant = variant_named("het+qm");
  for (const auto& knob : tools::precision_knobs()) {
    SCOPED_TRACE(knob.name);
    const auto has = [&](const std::string& value) {
      return std::find(knob.values.begin(), knob.values.end(), value) != knob.values.end();
    };
    EXPECT_TRUE(has(knob.value(untouched))) << "the default " << knob.value(untouched) << " is not on the ladder";
    EXPECT_TRUE(knob.quick_value.empty() || has(knob.quick_value));
    EXPECT_NE(knob.quick_value, knob.value(untouched));
    for (const std::string& value : knob.values) {
      tools::PrecisionSettings settings = untouched;
      knob.set(settings, value);
      EXPECT_EQ(knob.value(settings), value);
      EXPECT_NO_THROW(check_configuration(settings.request)) << value;
      for (const auto& other : tools::precision_knobs()) {
        if (other.name != knob.name) {
          EXPECT_EQ(other.value(settings), other.value(untouched)) << other.name;
        }
      }
    }
  }
}

TEST(Pictures, AreAveragedAndTheirErrorMapsKeepTheLargest) {
  tools::ShownImage image{5, 3, std::vector<double>(45, 0.0)};
  image.rgb[0] = 1;  // red of the first pixel
  const tools::Picture picture = tools::picture_of(image, 3);
  EXPECT_EQ(picture.width, 3U);
  EXPECT_EQ(picture.height, 2U);
  EXPECT_EQ(picture.rgb[0], 64);
  EXPECT_EQ(picture.rgb[1], 0);
  const tools::ShownImage black{5, 3, std::vector<double>(45, 0.0)};
  const tools::Picture map = tools::error_map(image, black, 3);
  const auto worst = tools::error_color(1);
  const auto none = tools::error_color(0);
  EXPECT_TRUE(std::equal(worst.begin(), worst.end(), map.rgb.begin()));
  EXPECT_TRUE(std::equal(none.begin(), none.end(), map.rgb.begin() + 3));
  EXPECT_NE(worst, none);
  EXPECT_EQ(tools::picture_of(image, 5).width, 5U);
}

TEST(Plots, LabelsNeverOverlap) {
  tools::Plot plot;
  for (int i = 0; i < 40; ++i) {
    plot.points.push_back(
        {1 + 0.002 * i, 0.05 * (i % 7), "#000", tools::Marker::circle, false, "label number " + std::to_string(i), ""});
  }
  plot.points.push_back({2, 1, "#000", tools::Marker::circle, false, "far", ""});
  const std::string drawn = tools::svg(plot);
  EXPECT_NE(drawn.find(">far<"), std::string::npos);
  struct Label {
    double x, y;
    std::string anchor;
    double width;
  };
  std::vector<Label> labels;
  const std::regex pattern(
      R"re(<text x="([-0-9.]+)" y="([-0-9.]+)" text-anchor="(\w+)" class="label">([^<]*)</text>)re");
  for (std::sregex_iterator i(drawn.begin(), drawn.end(), pattern), end; i != end; ++i) {
    labels.push_back({std::stod((*i)[1]), std::stod((*i)[2]), (*i)[3], 7.3 * static_cast<double>((*i)[4].length())});
  }
  ASSERT_GT(labels.size(), 5U);
  const auto left = [](const Label& label) {
    return label.anchor == "start" ? label.x
           : label.anchor == "end" ? label.x - label.width
                                   : label.x - label.width / 2;
  };
  for (std::size_t i = 0; i < labels.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const bool apart = std::fabs(labels[i].y - labels[k].y) >= 14 ||
                         left(labels[i]) >= left(labels[k]) + labels[k].width ||
                         left(labels[k]) >= left(labels[i]) + labels[i].width;
      EXPECT_TRUE(apart) << i << " and " << k;
    }
  }
}

/// Where the circles of a drawing are.
std::vector<std::pair<double, double>> circles(const std::string& drawn) {
  std::vector<std::pair<double, double>> all;
  const std::regex pattern(R"re(<circle cx="([-0-9.]+)" cy="([-0-9.]+)")re");
  for (std::sregex_iterator i(drawn.begin(), drawn.end(), pattern), end; i != end; ++i) {
    all.emplace_back(std::stod((*i)[1]), std::stod((*i)[2]));
  }
  return all;
}

TEST(Plots, ZeroHasAPlaceOfItsOwnOnALogarithmicAxis) {
  tools::Plot plot;
  plot.y.logarithmic = true;
  for (const double y : {0.0, 0.001, 0.01, 10.0}) {
    plot.points.push_back({1, y, "#000", tools::Marker::circle, false, "", ""});
  }
  const std::string drawn = tools::svg(plot);
  std::vector<std::pair<double, double>> at = circles(drawn);  // the last is drawn first
  ASSERT_EQ(at.size(), 4U);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_GT(at[i].second - at[i - 1].second, 30) << "down by " << i;
  EXPECT_NE(drawn.find(">0</text>"), std::string::npos);
  for (tools::PlotPoint& point : plot.points) point.y = 0;
  EXPECT_EQ(tools::svg(plot).find("nan"), std::string::npos);
}

TEST(Plots, LabelsKeepOffLines) {
  tools::Plot plot;
  plot.points.push_back({1, 1, "#000", tools::Marker::circle, false, "label", ""});
  plot.points.push_back({3, 1, "#000", tools::Marker::circle, false, "", ""});
  plot.lines.push_back({{{1, 1}, {3, 1}}, "#000", true});
  const std::string drawn = tools::svg(plot);
  std::smatch label;
  ASSERT_TRUE(std::regex_search(drawn, label, std::regex(R"re(<text x="([-0-9.]+)" y="([-0-9.]+)"[^>]*>label<)re")));
  const auto [x, y] = circles(drawn).back();
  EXPECT_TRUE(std::stod(label[1]) < x || std::fabs(std::stod(label[2]) - 4 - y) > 6) << label[0];
}

TEST(Plots, EscapeWhatTheyAreGiven) {
  tools::Plot plot;
  plot.points.push_back({1, 1, "#000", tools::Marker::star, false, "<b>&\"", "<i>"});
  const std::string drawn = tools::svg(plot);
  EXPECT_NE(drawn.find("&lt;b&gt;&amp;&quot;"), std::string::npos);
  EXPECT_EQ(drawn.find("<i>"), std::string::npos);
  EXPECT_EQ(drawn.find("nan"), std::string::npos);
}

// The command.

TEST_F(Accuracy, FidelityHasEveryVariantAtEveryRung) {
  const json result = accuracy({});
  EXPECT_EQ(result["schema"], "vrpipe.accuracy/1");
  EXPECT_EQ(result["scene"]["name"], "tiny.spl");
  EXPECT_EQ(result["scene"]["width"], 48);
  EXPECT_EQ(result["platform"]["name"], "agx-orin-ideal-memory");
  EXPECT_EQ(result["platform"]["parameters"]["state.exponential"], "ex2");
  const json& ladder = result["fidelity"];
  const std::vector<std::string> levels{"functional", "bound", "lt", "lt,zrop=cycle,crop=cycle", "cycle"};
  ASSERT_EQ(ladder.size(), variants().size() * levels.size());
  std::map<std::string, double> baseline;
  std::map<std::string, double> exact;
  for (const json& level : ladder) {
    if (level["variant"] == "baseline" && level["cycles"].is_number()) baseline[level["fidelity"]] = level["cycles"];
    if (level["fidelity"] == "cycle") exact[level["variant"]] = level["cycles"];
  }
  std::size_t i = 0;
  for (const Variant& variant : variants()) {
    std::vector<tools::TradeOff> timed;
    std::vector<bool> said;
    for (const std::string& name : levels) {
      const Fidelity fidelity = fidelity_named(name.substr(0, name.find(',')));
      const json& level = ladder[i++];
      SCOPED_TRACE(level.dump());
      EXPECT_EQ(level["variant"], variant.name);
      EXPECT_EQ(level["fidelity"], name);
      EXPECT_GT(level["host_seconds"].get<double>(), 0);
      EXPECT_GT(level["quads_per_second"].get<double>(), 0);
      EXPECT_TRUE(level["kernel_events"].is_number_unsigned());
      EXPECT_TRUE(level["dominated"].is_boolean());
      if (fidelity == Fidelity::functional) {
        for (const char* key : {"cycles", "cycles_error_percent", "speedup", "speedup_error_percent"}) {
          EXPECT_TRUE(level[key].is_null()) << key;
        }
        EXPECT_FALSE(level["dominated"].get<bool>());
        continue;
      }
      const double cycles = level["cycles"];
      const double error = level["cycles_error_percent"];
      EXPECT_EQ(level["expected_error_percent"].is_number(), fidelity == Fidelity::lt || fidelity == Fidelity::cycle);
      EXPECT_NEAR(error, 100 * (cycles / exact[variant.name] - 1), 1e-9);
      EXPECT_NEAR(level["speedup"].get<double>(), baseline[name] / cycles, 1e-9);
      EXPECT_NEAR(level["speedup_error_percent"].get<double>(),
                  100 * (level["speedup"].get<double>() / (baseline["cycle"] / exact[variant.name]) - 1), 1e-9);
      timed.push_back({level["cpu_seconds"], std::fabs(error)});
      said.push_back(level["dominated"]);
    }
    std::vector<bool> expected = tools::dominated(timed, tools::fidelity_tolerance);
    expected.back() = false;  // what the others are measured against
    EXPECT_EQ(said, expected) << variant.name;
    const json& most_exact = ladder[i - 1];
    for (std::size_t k = i - levels.size(); k < i; ++k) {
      EXPECT_NEAR(ladder[k]["times_as_fast"].get<double>(),
                  most_exact["cpu_seconds"].get<double>() / ladder[k]["cpu_seconds"].get<double>(), 1e-9);
      EXPECT_NEAR(ladder[k]["quads_per_second"].get<double>() * ladder[k]["cpu_seconds"].get<double>(),
                  most_exact["quads_per_second"].get<double>() * most_exact["cpu_seconds"].get<double>(), 1e-3)
          << "all rasterise the same quads";
    }
  }
}

TEST_F(Accuracy, InStrictTerminationEveryRungHasTheSameImage) {
  const json result = accuracy({"--termination", "strict", "--quick"});
  ASSERT_FALSE(result["fidelity"].empty());
  for (const json& level : result["fidelity"]) {
    EXPECT_TRUE(level["image_equal"].get<bool>()) << level;
    EXPECT_EQ(level["image_max_abs_difference"], 0);
    EXPECT_EQ(level["fragments_blended_error_percent"], 0);
  }
}

TEST_F(Accuracy, PrecisionHasEveryValueOfEveryKnob) {
  const json result = accuracy({});
  const json& ladder = result["precision"];
  std::size_t i = 0;
  json by_default;
  for (const auto& knob : tools::precision_knobs()) {
    if (knob.is_preprocessing) continue;  // of no meaning for a draw list
    std::size_t defaults = 0;
    for (const std::string& value : knob.values) {
      ASSERT_LT(i, ladder.size());
      const json& row = ladder[i++];
      SCOPED_TRACE(row.dump());
      EXPECT_EQ(row["knob"], knob.name);
      EXPECT_EQ(row["value"], value);
      EXPECT_TRUE(row["psnr_db"].is_number() && row["ssim"].is_number() && row["max_abs_error"].is_number());
      EXPECT_TRUE(row["cycles"].is_number_unsigned() && row["pixels_stuck"].is_number_unsigned());
      EXPECT_GT(row["host_seconds"].get<double>(), 0);
      EXPECT_LE(row["pixels_differing_8bit"].get<unsigned>(), 48U * 40U);
      EXPECT_EQ(row["costs_no_time"].get<bool>(), row["cycles_change_percent"] == 0);
      if (!row["default"].get<bool>()) continue;
      ++defaults;
      if (by_default.is_null()) by_default = row;
      EXPECT_EQ(row["result_hash"], by_default["result_hash"]);
      EXPECT_EQ(row["cycles_change_percent"], 0);
    }
    EXPECT_EQ(defaults, 1U) << knob.name;
  }
  EXPECT_EQ(i, ladder.size());
  EXPECT_EQ(result["knobs_left_out"], (json{"depth_key_bits", "sh_degree", "dilation"}));
  // The default's numbers are those of `run`.
  const json alone = json_of({"run", "--scene", "tiny.spl", "--platform", "agx-orin-ideal-memory"})["runs"][0];
  EXPECT_EQ(by_default["result_hash"], alone["result_hash"]);
  EXPECT_EQ(by_default["cycles"], alone["cycles"]);
}

TEST_F(Accuracy, FewerBitsAreFartherFromTheExactImage) {
  std::map<std::string, json> rows;
  const json result = accuracy({"--set", "state.exponential=exact"});
  for (const json& row : result["precision"]) {
    rows[row["knob"].get<std::string>() + "=" + row["value"].get<std::string>()] = row;
  }
  const auto psnr = [&](const std::string& name) { return rows.at(name)["psnr_db"].get<double>(); };
  EXPECT_TRUE(rows.at("exponential=exact")["default"].get<bool>());
  EXPECT_GT(psnr("format=rgba16f"), psnr("format=rgba8") + 5);
  EXPECT_GT(psnr("exponential=exact"), psnr("exponential=table16") + 1);
  EXPECT_GT(psnr("termination_threshold=0.999"), psnr("termination_threshold=0.98"));
  // Two images of which one is more than another 8-bit level off, and the other nearly exact.
  EXPECT_GT(rows.at("format=rgba8")["max_abs_error"].get<double>(), 1 / 255.0);
  EXPECT_GT(rows.at("format=rgba8")["share_differing_8bit"].get<double>(),
            rows.at("early_termination=off")["share_differing_8bit"].get<double>());
}

TEST_F(Accuracy, NoErrorIsBeyondWhatIsProved) {
  const json result = accuracy({});
  for (const json& row : result["precision"]) {
    const std::string name = row["knob"].get<std::string>() + "=" + row["value"].get<std::string>();
    ASSERT_FALSE(row["proved_max_abs_error"].is_null()) << name;
    EXPECT_LE(row["max_abs_error"], row["proved_max_abs_error"]) << name;
    std::uint64_t pixels = 0;
    double largest = 0;
    for (const json& range : row["by_fragments"]) {
      EXPECT_LE(range["max_abs_error"], range["proved_max_abs_error"]) << name << " from " << range["from"];
      EXPECT_LE(range["mean_abs_error"], range["max_abs_error"]);
      pixels += range["pixels"].get<std::uint64_t>();
      largest = std::max(largest, range["max_abs_error"].get<double>());
    }
    EXPECT_EQ(pixels, 48U * 40);
    EXPECT_EQ(largest, row["max_abs_error"].get<double>());
  }
}

TEST_F(Accuracy, OfEachChoiceItSaysWhatIsMovedAndSpent) {
  std::map<std::string, json> rows;
  const json result = json_of({"accuracy", "--scene", "tiny.spl"});
  for (const json& row : result["precision"])
    rows[row["knob"].get<std::string>() + "=" + row["value"].get<std::string>()] = row;
  const auto bytes = [&](const std::string& name) { return rows.at(name)["l2_bytes"].get<double>(); };
  EXPECT_LT(bytes("format=rgba8"), bytes("format=rgba16f"));
  EXPECT_EQ(bytes("format=srgb8"), bytes("format=rgba8"));
  EXPECT_LT(bytes("format=rgba16f"), bytes("format=rgba32f"));
  const json run = json_of({"run", "--scene", "tiny.spl", "--energy"})["runs"][0];
  EXPECT_EQ(rows.at("format=rgba16f")["millijoules"], run["energy"]["total_millijoules"]);
}

TEST_F(Accuracy, ValuesThatNobodyHasMeasuredAreLeftOut) {
  const json result = accuracy({"--quick", "--set", "state.blend_rounding=measured"});
  EXPECT_EQ(result["values_never_measured"], json::array()) << "rgba8 has been measured";
  const Finished refused =
      vrpipe({"run", "--scene", "tiny.spl", "--format", "rgba16", "--set", "state.blend_rounding=measured"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.err.find("rgba16"), std::string::npos) << refused.err;
  const json of_rgba16 = accuracy({"--format", "rgba16"});
  EXPECT_EQ(of_rgba16["values_never_measured"], json{"blend_rounding=measured"});
}

TEST(ErrorByFragments, RangesDouble) {
  tools::ShownImage image{5, 1, {}}, reference{5, 1, {}};
  for (int i = 0; i < 15; ++i) {
    image.rgb.push_back(0.5 + 0.01 * i);
    reference.rgb.push_back(0.5);
  }
  const std::vector<tools::ErrorOfRange> ranges =
      tools::error_by_fragments(image, reference, {0, 1, 2, 3, 900}, {0.1, 0.2, 0.3, 0.25, 0.9});
  ASSERT_EQ(ranges.size(), 4U);
  EXPECT_EQ(ranges[2].from, 2U);
  EXPECT_EQ(ranges[2].to, 3U);
  EXPECT_EQ(ranges[2].pixels, 2U);
  EXPECT_NEAR(ranges[2].mean_abs_error, 0.085, 1e-12);
  EXPECT_NEAR(ranges[2].max_abs_error, 0.11, 1e-12);
  EXPECT_EQ(ranges[2].proved_max_error, 0.3);
  EXPECT_EQ(ranges[3].from, 512U);
  EXPECT_EQ(ranges[3].to, 1023U);
  EXPECT_FALSE(tools::error_by_fragments(image, reference, {0, 1, 2, 3, 900}, {})[0].proved_max_error);
}

/// Gaussians at many depths close together, whose colours depend on the direction.
void write_scene(const std::filesystem::path& path) {
  GaussianSceneBuilder builder(3);
  for (unsigned i = 0; i < 300; ++i) {
    GaussianAttributes gaussian;
    gaussian.position = {0.02F * static_cast<float>(i % 17) - 0.16F, 0.02F * static_cast<float>(i % 13) - 0.12F,
                         2 + 0.001F * static_cast<float>(i * 7 % 300)};
    gaussian.log_scale = {-3, -2.5F, -3};
    gaussian.opacity_logit = i % 2 == 0 ? 2.0F : -1.0F;
    gaussian.f_dc = {i % 3 == 0 ? 1.0F : 0.0F, i % 3 == 1 ? 1.0F : 0.0F, i % 3 == 2 ? 1.0F : 0.0F};
    for (auto& channel : gaussian.f_rest) channel.fill(0.3F);
    builder.add(gaussian);
  }
  // Far away, so that few bits of a depth are left for the others.
  GaussianAttributes far;
  far.position = {0, 0, 1e6F};
  far.log_scale = {9, 9, 9};
  far.opacity_logit = 1;
  builder.add(far);
  write_gaussian_file(path, builder.build());
}

TEST_F(Accuracy, KnobsOfPreprocessingPreprocessAgain) {
  write_scene(folder() / "scene.ply");
  const auto with_view = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--scene", "scene.ply", "--size", "48x48", "--eye", "0,0,0", "--look-at",
                                       "0,0,1", "--fidelity", "functional"});
    return arguments;
  };
  const json result = json_of(with_view({"accuracy", "--quick"}));
  std::map<std::string, json> rows;
  for (const json& row : result["precision"]) {
    rows[row["knob"].get<std::string>() + "=" + row["value"].get<std::string>()] = row;
    EXPECT_TRUE(row["cycles"].is_null() && row["costs_no_time"].is_null()) << row;
  }
  EXPECT_EQ(result["precision_fidelity"], "functional");
  EXPECT_EQ(result["platform"]["parameters"]["preprocess.sh_degree"], 3);
  EXPECT_EQ(result["platform"]["parameters"]["preprocess.depth_key_bits"], "32");
  for (const char* changed : {"sh_degree=0", "depth_key_bits=12"}) {
    const json& row = rows.at(changed);
    EXPECT_NE(row["result_hash"], rows.at("sh_degree=3")["result_hash"]) << changed;
    EXPECT_LT(row["psnr_db"].get<double>(), rows.at("sh_degree=3")["psnr_db"].get<double>()) << changed;
    EXPECT_LE(row["max_abs_error"], row["proved_max_abs_error"]) << changed;
    EXPECT_LE(row["proved_max_abs_error"].get<double>(),
              row["max_abs_error"].get<double>() + rows.at("sh_degree=3")["proved_max_abs_error"].get<double>() + 0.1)
        << changed << ": by what the exact images differ, and little more";
    const json run = json_of(with_view({"run", "--set", std::string("preprocess.") + changed}));
    EXPECT_EQ(row["result_hash"], run["runs"][0]["result_hash"]) << changed;
  }
}

TEST_F(Accuracy, StressIsOfWhatWasAskedForAndSaysSo) {
  const std::vector<std::string> asked{"--scene", "tiny.spl", "--platform",      "gh100-gpc",     "--format",
                                       "rgba8",   "--set",    "prop.order=draw", "--termination", "strict"};
  std::vector<std::string> arguments{"accuracy", "--quick", "--html", "page.html", "--json", "result.json"};
  arguments.insert(arguments.end(), asked.begin(), asked.end());
  const Finished finished = vrpipe(arguments);
  EXPECT_EQ(finished.code, 0) << finished.err;
  const std::string says =
      "Away from gh100-gpc, rgba8 colour, strict termination, prop.order=draw: errors of the cycles";
  EXPECT_NE(finished.out.find(says + "\n"), std::string::npos) << finished.out;
  EXPECT_NE(read_file(folder() / "page.html").find(says), std::string::npos);
  const json result = json::parse(read_file(folder() / "result.json"));
  EXPECT_TRUE(result["stress_left_out"].empty());
  std::size_t rows = 0;
  for (const json& row : result["stress"]) {
    EXPECT_EQ(row["platform"], "gh100-gpc");
    EXPECT_EQ(row["format"], "rgba8");
    EXPECT_EQ(row["termination"], "strict");
    const auto change = row["configuration"].get<std::string>();
    if (change.find('=') == std::string::npos) continue;
    std::vector<std::string> alone{"run", "--variant", row["variant"].get<std::string>()};
    alone.insert(alone.end(), asked.begin(), asked.end());
    alone.insert(alone.end(), {"--set", change});
    EXPECT_EQ(row["cycles"], json_of(alone)["runs"][0]["cycles"]) << change;
    ++rows;
  }
  EXPECT_EQ(rows, 10U);
}

TEST_F(Accuracy, WhatCannotBeChangedInWhatWasAskedForIsLeftOutAndSaysSo) {
  const Finished finished = vrpipe({"accuracy", "--scene", "tiny.spl", "--set", "crop.ways=64"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_NE(finished.out.find(
                "\nleft out: crop.cache_bytes=1024: unusable CROP cache (crop.ways, crop.cache_bytes): 64 ways"),
            std::string::npos)
      << finished.out;
  EXPECT_EQ(finished.out.find("\ncrop.cache_bytes=1024\n"), std::string::npos);
  EXPECT_NE(finished.out.find("\ncrop.cache_bytes=262144\n"), std::string::npos);
}

TEST_F(Accuracy, HasARungForEachSetOfUnitsAtCycle) {
  const json result = accuracy({"--quick", "--at-cycle", "crop", "--at-cycle", "tc,qru"});
  std::vector<std::string> names;
  for (const json& level : result["fidelity"]) {
    if (level["variant"] == "baseline") names.push_back(level["fidelity"]);
  }
  EXPECT_EQ(names,
            (std::vector<std::string>{"functional", "bound", "lt", "lt,tc=cycle,qru=cycle", "lt,crop=cycle", "cycle"}));
  const Finished finished = vrpipe({"accuracy", "--quick", "--scene", "tiny.spl", "--at-cycle", "corp"});
  EXPECT_EQ(finished.code, 2);
  EXPECT_NE(finished.err.find("did you mean crop?"), std::string::npos) << finished.err;
}

TEST_F(Accuracy, QuickIsSmallerAndSaysSo) {
  const Finished finished = vrpipe({"accuracy", "--quick", "--scene", "tiny.spl"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_NE(finished.out.find("a quick look"), std::string::npos);
  const json quick = accuracy({"--quick"});
  EXPECT_TRUE(quick["quick"].get<bool>());
  EXPECT_EQ(quick["fidelity"].size(), 2 * (fidelities().size() + 1));
  EXPECT_LT(quick["precision"].size(), accuracy({})["precision"].size());
}

TEST_F(Accuracy, ReportSaysWhatCostsNothing) {
  const Finished finished = vrpipe({"accuracy", "--scene", "tiny.spl", "--platform", "agx-orin-ideal-memory"});
  EXPECT_EQ(finished.code, 0);
  EXPECT_EQ(finished.err, "");
  // No half equals the threshold, so >= and > are the same.
  EXPECT_TRUE(std::regex_search(finished.out, std::regex("termination_compare[^\n]* costs? no simulated time")))
      << finished.out;
  for (const char* part :
       {"Fidelity", "Precision", "speed-up", "PSNR", "max error", "stuck", "dominated: another fidelity",
        "front: nothing is better", "as fast, cycles within", "exponential, default ex2", "1/255", "left out"}) {
    EXPECT_NE(finished.out.find(part), std::string::npos) << part << " is not in:\n" << finished.out;
  }
  for (const char c : finished.out) ASSERT_TRUE(c == '\n' || (c >= ' ' && c <= '~')) << finished.out;
}

TEST_F(Accuracy, MarkdownHoldsBothTables) {
  const Finished finished = vrpipe({"accuracy", "--scene", "tiny.spl", "--quick", "--markdown"});
  EXPECT_EQ(finished.code, 0);
  EXPECT_NE(finished.out.find("| variant | fidelity | cycles |"), std::string::npos) << finished.out;
  EXPECT_NE(finished.out.find("| knob | value | PSNR, dB |"), std::string::npos);
}

TEST_F(Accuracy, ResultsDoNotDependOnTheNumberOfProcesses) {
  json results[2];
  const char* const jobs[] = {"1", "3"};
  for (std::size_t i = 0; i < 2; ++i) {
    results[i] = accuracy({"--jobs", jobs[i]});
    for (const char* ladder : {"fidelity", "precision"}) {
      for (json& row : results[i][ladder]) {
        for (const char* key : {"host_seconds", "cpu_seconds", "times_as_fast", "times_as_fast_elapsed",
                                "quads_per_second", "dominated"}) {
          row.erase(key);
        }
      }
    }
    for (const char* key : {"precision_processes", "command", "host"}) results[i].erase(key);
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST_F(Accuracy, PageStandsAlone) {
  write("<b>.spl", read_file(folder() / "tiny.spl"));
  const Finished finished = vrpipe({"accuracy", "--scene", "<b>.spl", "--quick", "--html", "page.html"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  const std::string page = read_file(folder() / "page.html");
  EXPECT_EQ(page.rfind("<!DOCTYPE html>", 0), 0U);
  EXPECT_EQ(occurrences(page, "</html>"), 1U);
  EXPECT_EQ(occurrences(page, "<svg"), 3U);
  EXPECT_EQ(occurrences(page, ">plot as SVG<"), 3U);
  EXPECT_EQ(occurrences(page, ">data as CSV<"), 3U);
  // Nothing is loaded: the only address is the name of SVG.
  EXPECT_EQ(occurrences(page, "http"), occurrences(page, "xmlns=\"http://www.w3.org/2000/svg\""));
  EXPECT_EQ(occurrences(page, "src="), occurrences(page, "src=\"data:image/png;base64,"));
  EXPECT_EQ(occurrences(page, "href="), occurrences(page, "href=\"data:"));
  for (const char* loading : {"<script", "<link", "<iframe", "@import", "url("}) {
    EXPECT_EQ(page.find(loading), std::string::npos) << loading;
  }
  // The reference, and for each run an image and an error map.
  std::set<std::string> runs;
  const json quick = accuracy({"--quick"});
  for (const json& row : quick["precision"]) {
    if (!row["default"].get<bool>()) runs.insert(row["knob"].get<std::string>() + row["value"].get<std::string>());
  }
  EXPECT_EQ(occurrences(page, "<img"), 1 + 2 * (1 + runs.size()));
  for (const char* part : {"class=\"verdict\">lt,zrop=cycle,crop=cycle: ", "times as fast as cycle",
                           "class=\"verdict\">the default: ", "<b>dominated</b>: another", "<b>front</b>: nothing",
                           "accuracy --scene '&lt;b&gt;.spl' --quick --html page.html</code>"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
  EXPECT_NE(page.find("&lt;b&gt;.spl"), std::string::npos);
  EXPECT_EQ(page.find("<b>.spl"), std::string::npos);
  for (const char* broken : {">nan", " nan", "inf dB", "{}"}) EXPECT_EQ(page.find(broken), std::string::npos) << broken;
}

TEST_F(Accuracy, KnobsOfThePlotCanBeToldApart) {
  EXPECT_EQ(
      vrpipe({"accuracy", "--scene", "tiny.spl", "--platform", "agx-orin-ideal-memory", "--html", "page.html"}).code,
      0);
  const std::string page = read_file(folder() / "page.html");
  struct Look {
    std::string shape;
    int red, green, blue;
  };
  std::map<std::string, Look> looks;
  const std::regex pattern(R"re(<(circle|polygon) ([^>]*)fill="(#\w+)" stroke="(#\w+)"[^>]*><title>(\w+)=)re");
  for (std::sregex_iterator i(page.begin(), page.end(), pattern), end; i != end; ++i) {
    const std::string color = (*i)[3] == "#fff" ? (*i)[4] : (*i)[3];
    const unsigned long rgb = std::stoul(color.substr(1), nullptr, 16);
    const std::string corners = (*i)[2];  // a comma each
    looks[(*i)[5]] = {(*i)[1].str() + std::to_string(std::count(corners.begin(), corners.end(), ',')),
                      static_cast<int>(rgb >> 16), static_cast<int>(rgb >> 8 & 255), static_cast<int>(rgb & 255)};
  }
  EXPECT_EQ(looks.size(), tools::precision_knobs().size() - 3) << "a draw list leaves out three";
  for (const auto& [name, a] : looks) {
    for (const auto& [other, b] : looks) {
      if (name == other || a.shape != b.shape) continue;
      EXPECT_GT(std::hypot(a.red - b.red, a.green - b.green, a.blue - b.blue), 70) << name << " and " << other;
    }
  }
}

TEST_F(Accuracy, WritesTheImageOfEveryChoice) {
  const Finished finished = vrpipe({"accuracy", "--scene", "tiny.spl", "--quick", "--output", "new", "--html",
                                    "new/page.html", "--json", "new/result.json", "--save-draw", "new/draw.spl"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  const std::vector<std::string> there = files();
  for (const char* file :
       {"new/tiny-reference.png", "new/tiny-reference.exr", "new/tiny-default.png", "new/tiny-format-rgba8.png",
        "new/tiny-exponential-table16.exr", "new/page.html", "new/result.json", "new/draw.spl"}) {
    EXPECT_TRUE(std::binary_search(there.begin(), there.end(), file)) << file;
  }
  for (const std::string& file : there) EXPECT_EQ(file.find("tmp"), std::string::npos) << file;
}

TEST_F(Accuracy, WritesTheImagesOfCrossedChoicesByAllTheirValues) {
  const Finished finished = vrpipe({"accuracy", "--scene", "tiny.spl", "--platform", "agx-orin-ideal-memory",
                                    "--fidelity", "functional", "--output", "new", "--json", "new/result.json"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  const std::vector<std::string> there = files();
  for (const char* file : {"new/tiny-format-rgba8,blend_rounding-rtz,quad_merging-on,merging-fp16.png",
                           "new/tiny-format-rgba16f,blend_rounding-rtz,quad_merging-off,merging-fp32.exr"})
    EXPECT_TRUE(std::binary_search(there.begin(), there.end(), file)) << file;
}

TEST_F(Accuracy, RefusesBadInputAndWritesNothing) {
  const std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>> cases{
      {{"--format", "rgb10a2"}, {"rgb10a2", "2-bit alpha", "rgba16f"}},
      {{"--format", "r11g11b10f"}, {"r11g11b10f", "no alpha"}},
      {{"--variant", "qn"}, {"'qn'", "did you mean qm"}},
      {{"--repeat", "0"}, {"--repeat", "1 to 100"}},
      {{"--html", "nowhere/page.html"}, {"--html nowhere/page.html", "no folder"}},
      {{"--html", ""}, {"--html", "missing value"}},
      {{"--fidelity", "exact"}, {"'exact'", "cycle"}},
      {{"--set", "preprocess.sh_degree=1"}, {"preprocess.sh_degree", ".spl", "preprocessed already"}},
      {{"--set", "preprocess.depth_key_bits=16"}, {"preprocess.depth_key_bits", ".spl"}},
      {{"--set", "preprocess.dilation=0.1"}, {"preprocess.dilation", ".spl"}},
      {{"--set", "preprocess.opacity_compensation=on"}, {"preprocess.opacity_compensation", ".spl"}},
      {{"--set", "preprocess.sh_degree=4"}, {"preprocess.sh_degree", "0 to 3"}},
      {{"--set", "preprocess.depth_key_bits=20"}, {"'20'", "32, 24, 16, 12"}},
      {{"--set", "preprocess.sh=1"}, {"there are sh_degree, "}},
      {{"--set", "preproces.sh_degree=1"}, {"did you mean preprocess?"}}};
  const std::vector<std::string> before = files();
  for (const auto& [options, parts] : cases) {
    std::vector<std::string> arguments{"accuracy", "--scene", "tiny.spl"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Finished finished = vrpipe(arguments);
    SCOPED_TRACE(finished.err);
    EXPECT_EQ(finished.code, 2);
    EXPECT_EQ(finished.out, "");
    EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1);
    EXPECT_EQ(finished.err.rfind("vrpipe: error: ", 0), 0U);
    for (const std::string& part : parts) EXPECT_NE(finished.err.find(part), std::string::npos) << part;
    EXPECT_EQ(files(), before);
  }
}

TEST_F(Accuracy, AnEmptyDrawIsFine) {
  Draw empty;
  empty.width = 8;
  empty.height = 8;
  write_draw_list(folder() / "empty.spl", empty);
  const Finished finished =
      vrpipe({"accuracy", "--scene", "empty.spl", "--platform", "agx-orin-ideal-memory", "--html", "page.html"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  const std::string page = read_file(folder() / "page.html");
  for (const std::string& text : {finished.out, page}) {
    EXPECT_NE(text.find("nothing is visible"), std::string::npos);
    for (const char* broken : {">nan", " nan", "\"nan", "inf dB"})
      EXPECT_EQ(text.find(broken), std::string::npos) << broken;
  }
}

}  // namespace
}  // namespace vrpipe::testing
