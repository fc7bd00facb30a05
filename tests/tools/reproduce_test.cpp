#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <set>
#include <thread>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/gaussian_scene.h>

#include "forked.h"
#include "image/base64.h"
#include "jobs/heat_map.h"
#include "jobs/paper_rows.h"
#include "jobs/reproduce_findings.h"
#include "jobs/reproduce_plan.h"
#include "jobs/sensitivity_table.h"
#include "output/reproduce_report.h"
#include "output/reproduce_tables.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;
using tools::Verdict;

// What rows are made of.

TEST(Means, AreArithmeticAndGeometric) {
  const tools::Mean mean = tools::mean_of({1, 4});
  EXPECT_DOUBLE_EQ(mean.arithmetic, 2.5);
  EXPECT_NEAR(mean.geometric, 2, 1e-14);
  EXPECT_TRUE(std::isnan(tools::mean_of({}).arithmetic));
  EXPECT_TRUE(std::isnan(tools::mean_of({1, std::nan("")}).geometric));
}

TEST(Base64, ComesBack) {
  std::string bytes;
  for (int i = 0; i < 260; ++i) {
    EXPECT_EQ(tools::bytes_of_base64(tools::base64(bytes)), bytes);
    bytes += static_cast<char>(i * 37);
  }
  EXPECT_EQ(tools::base64("Man"), "TWFu");
  EXPECT_EQ(tools::base64("Ma"), "TWE=");
}

// The sensitivity.

TEST(Sensitivity, VariesEveryParameterThatThePaperLeavesOpenOrSaysWhyNot) {
  std::set<std::string> varied, not_varied;
  for (const tools::SensitivityParameter& parameter : tools::sensitivity_parameters()) {
    EXPECT_FALSE(parameter.values.empty()) << parameter.name;
    for (const std::string& value : parameter.values) varied.insert(value.substr(0, value.find('=')));
  }
  for (const tools::NotVaried& each : tools::parameters_not_varied()) {
    not_varied.insert(each.name);
    EXPECT_FALSE(each.reason.empty());
  }
  for (const char* platform : {"agx-orin-ideal-memory", "agx-orin"}) {
    for (const ParameterListing& listing : list_parameters(&platform_named(platform))) {
      for (const Parameter* parameter : listing.parameters->parameters()) {
        if (std::string(parameter->source()) != source::open) continue;
        const std::string name = listing.unit + "." + parameter->name();
        EXPECT_TRUE(varied.count(name) > 0 || not_varied.count(name) > 0 ||
                    not_varied.count(std::string("*.") + parameter->name()) > 0 ||
                    not_varied.count(listing.unit + ".*") > 0)
            << name;
      }
    }
  }
}

TEST(Sensitivity, SkipsWithANoteWhatThePlatformDoesNotKnow) {
  RunRequest request;
  request.platform = &platforms().front();
  request.variant = variant_named("het+qm");
  EXPECT_THROW(tools::with_settings(request, "crop.unheard_of=1"), UserError);
  const RunRequest changed = tools::with_settings(request, "platform=agx-orin-lpddr5,tc.bins=16,termination=strict");
  EXPECT_EQ(changed.platform->name, "agx-orin-lpddr5");
  EXPECT_EQ(changed.termination, Termination::strict);
  ASSERT_EQ(changed.settings.size(), 1U);
  EXPECT_EQ(changed.settings[0].unit + changed.settings[0].parameter + changed.settings[0].value, "tcbins16");
}

TEST(ReproducePlan, HasEveryPointOnceAndSceneByScene) {
  for (const bool quick : {false, true}) {
    tools::ReproduceOptions options;
    options.quick = quick;
    options.base.platform = &platforms().front();
    const tools::ReproducePlan plan = tools::plan_reproduction(options);
    ASSERT_EQ(plan.scenes.size(), 8U);
    EXPECT_EQ(plan.scenes_of(tools::PlannedScene::Role::six).size(), 6U);
    EXPECT_EQ(plan.places.size(), plan.points.size());
    for (std::size_t i = 1; i < plan.points.size(); ++i) {
      EXPECT_LE(plan.points[i - 1].key.scene, plan.points[i].key.scene);
    }
    const std::size_t skipped = plan.skipped.size();
    for (const tools::SkippedSetting& each : plan.skipped) EXPECT_FALSE(each.reason.empty()) << skipped;
  }
}

TEST(HeatMaps, ComeBackFromAJournal) {
  tools::HeatMap map;
  map.width = 7;
  map.height = 3;
  map.sum = 1234567890123;
  map.largest = 99;
  map.png = std::string("\x89PNG\0\xff", 6);
  const tools::HeatMap back = tools::heat_map_from_json(json::parse(tools::to_json(map).dump()));
  EXPECT_EQ(back.png, map.png);
  EXPECT_EQ(back.sum, map.sum);
}

// What follows from points.

/// Points as the paper would have them: each scene gains what it says.
class Synthetic : public ::testing::Test {
 protected:
  void SetUp() override {
    tools::ReproduceOptions options;
    options.base.platform = &platforms().front();
    result_.plan = tools::plan_reproduction(options);
    for (const tools::ReproducePoint& point : result_.plan.points) result_.points.push_back(made(point));
    result_.frames.resize(result_.plan.scenes.size());
    for (const std::size_t scene : result_.plan.scenes_of(tools::PlannedScene::Role::six)) {
      result_.frames[scene] = made_frame();
    }
  }

  /// Of a draw that takes 100 ms on the baseline, which `made` gives.
  static tools::WholeFrame made_frame() {
    tools::WholeFrame frame;
    frame.measured = {15, 12, 3};
    frame.papers = {30, 24, 6};
    frame.lists = 25;
    frame.render = 100;
    frame.endless_render = 120;
    frame.lanes = 1000;
    frame.fragments_blended = 200;
    frame.endless_fragments_blended = 300;
    frame.accelerator = 30;
    return frame;
  }

  static tools::PointResult made(const tools::ReproducePoint& point) {
    // Speed-ups of HET and of QM, by scene: kitchen, bonsai, train, truck, lego, palace, building, rubble.
    constexpr double het[] = {1.7, 1.5, 2.1, 2.2, 1.6, 1.65, 2, 2}, qm[] = {1.1, 1.15, 1.4, 1.49, 1.3, 1.35, 1.2, 1.2};
    const Variant& variant = point.request.variant;
    const double gain_het = variant.early_termination ? het[point.key.scene] : 1;
    const double gain_qm = variant.quad_merging ? qm[point.key.scene] : 1;
    tools::PointResult made;
    made.run.request = point.request;
    const double passes = point.key.passes == 1 ? 1 : point.key.scene == 2 || point.key.scene == 3 ? 1.3 : 0.9;
    const double in_shader = variant.name == "in-shader" ? 3 : variant.name == "in-shader-no-lock" ? 0.8 : 1;
    made.run.cycles = static_cast<std::uint64_t>(1e8 / gain_het / gain_qm / passes * in_shader);
    made.run.milliseconds = static_cast<double>(*made.run.cycles) * 1e-6;
    Counts& counts = made.run.counts;
    counts.fragments_rasterized = 4'000'000;
    counts.fragments_pruned = 1'000'000;
    counts.fragments_blended = static_cast<std::uint64_t>(3e6 / (gain_het * 1.3) / gain_qm);
    if (!variant.early_termination) counts.fragments_blended = static_cast<std::uint64_t>(3e6 / gain_qm);
    counts.quads_blended = static_cast<std::uint64_t>(1e6 / gain_het / gain_qm);
    made.run.utilization = {{"raster", 0.2}, {"zrop", 0.1}, {"prop", 0.9}, {"sm", 0.2}, {"crop", 0.9}, {"l2", 0.5}};
    made.run.bottleneck = Bottleneck{"gpc0.crop", 1, {}};
    made.gaussians_total = point.key.scene == 6 ? 9'060'000 : 5'210'000;
    made.gaussians_visible = 900'000;
    made.width = made.height = 100;
    if (point.with_map) made.map = tools::HeatMap();
    return made;
  }

  tools::RowFinding row(const std::string& id) const {
    const tools::Reproduction of = tools::reproduction_of(result_);
    for (const tools::RowFinding& each : of.rows) {
      if (id == each.row->id) return each;
    }
    throw std::logic_error("no row " + id);
  }
  /// Of a scene at the main comparison.
  tools::PointResult& point(std::size_t scene, const std::string& variant) {
    tools::PointKey key;
    key.scene = scene;
    key.fidelity = result_.plan.fidelity;
    key.variant = variant;
    return result_.points[result_.plan.places.at(key.name(result_.plan.scenes))];
  }

  tools::ReproduceResult result_;
};

TEST_F(Synthetic, RowsSayWhatThePointsSay) {
  EXPECT_EQ(row("R3").verdict, Verdict::agrees);
  EXPECT_EQ(row("R3").measured, "1.49x (truck)");
  EXPECT_EQ(row("R4").verdict, Verdict::agrees);
  EXPECT_NEAR(row("R4").number.value(), (1.7 + 1.5 + 2.1 + 2.2 + 1.6 + 1.65) / 6, 1e-6);
  EXPECT_EQ(row("R23").verdict, Verdict::agrees);
  for (const char* id : {"C2", "C4", "C5", "C6", "C7", "C8", "C9", "C11"}) {
    EXPECT_EQ(row(id).verdict, Verdict::agrees) << id << ": " << row(id).reason;
  }
  for (const char* id : {"C13"}) {
    EXPECT_EQ(row(id).verdict, Verdict::not_modelled) << id;
    EXPECT_NE(row(id).reason, "") << id;
  }
}

TEST_F(Synthetic, RowsOfWholeFramesSayWhatComesBeforeADrawAndBesideIt) {
  // The baseline's frame is 12 + 3 + 100 ms, software's 15 + 25 + 100, truck's by HET+QM 15 + 100 / (2.2 x 1.49).
  EXPECT_EQ(row("R9").verdict, Verdict::differs);
  EXPECT_EQ(row("R11").measured.find("87 %"), 0U) << row("R11").measured;
  EXPECT_EQ(row("R11").verdict, Verdict::agrees);
  EXPECT_EQ(row("R21").measured, "9 FPS / 9 FPS / 9 FPS / 9 FPS");
  EXPECT_EQ(row("R21").verdict, Verdict::agrees);
  EXPECT_EQ(row("R22").measured.find("20 % ("), 0U) << row("R22").measured;
  for (const char* id : {"R22", "C1", "C3", "C10"}) EXPECT_EQ(row(id).verdict, Verdict::agrees) << id;
  double frames = 0;
  for (std::size_t scene = 0; scene < 6; ++scene) frames += 115 / (15 + point(scene, "het+qm").run.milliseconds) / 6;
  EXPECT_NEAR(row("R10").number.value(), frames, 1e-9);

  // What takes longer before a draw takes from what the draw gains: 130 over 30 and the draw.
  double papers = 0;
  for (std::size_t scene = 0; scene < 6; ++scene) papers += 130 / (30 + point(scene, "het+qm").run.milliseconds) / 6;
  ASSERT_EQ(row("R10").verdict, Verdict::differs);
  EXPECT_NE(row("R10").reason.find(fmt::format("{:.2f}x", papers)), std::string::npos) << row("R10").reason;

  result_.frames[4]->render = 60;
  EXPECT_EQ(row("C1").exceptions, std::vector<std::string>{"lego"});
  EXPECT_EQ(row("C3").exceptions, std::vector<std::string>{"lego"}) << "2 for 1.5";
  result_.frames[4]->accelerator = 80;
  EXPECT_EQ(row("C10").exceptions, std::vector<std::string>{"lego"});
  result_.frames[4].reset();
  EXPECT_EQ(row("R9").verdict, Verdict::cannot_say);
  EXPECT_EQ(row("R9").reason, "nothing was drawn");
  EXPECT_EQ(row("C1").verdict, Verdict::cannot_say);
  EXPECT_EQ(row("C3").measured, "");
}

TEST(WholeFrames, ComeBackFromAJournal) {
  tools::WholeFrame frame;
  frame.measured = {1.5, 2, 0.1};
  frame.papers = {3, 4, 5};
  frame.lists = 6;
  frame.render = 7;
  frame.endless_render = 8;
  frame.fragments_blended = 9;
  frame.endless_fragments_blended = 10;
  frame.lanes = 11;
  frame.accelerator = 1.0 / 3;
  const auto back = json::parse(json(frame).dump()).get<tools::WholeFrame>();
  EXPECT_EQ(json(back), json(frame));
  EXPECT_EQ(back.accelerator, frame.accelerator);
  EXPECT_EQ(back.papers.sort, 5);
}

TEST_F(Synthetic, TheTextHeadsItsRows) {
  const std::string text = tools::reproduction_text(tools::reproduction_of(result_), {});
  const std::size_t heading = text.find("id  verdict             the paper says          measured here, difference\n");
  ASSERT_NE(heading, std::string::npos) << text;
  EXPECT_LT(heading, text.find("\nR1  differs             up to 2.78x             3.28x (truck), +18 %\n"));
}

TEST_F(Synthetic, ColumnsCanBeToldApart) {
  for (const tools::ReportTable& table : tools::all_tables(tools::reproduction_of(result_))) {
    const std::set<std::string> headings(table.heading.begin(), table.heading.end());
    EXPECT_EQ(headings.size(), table.heading.size()) << table.title;
  }
}

TEST_F(Synthetic, RowsThatCouldNotHaveFailedDoNotCount) {
  for (const char* id : {"R14", "R16", "R25", "R31", "R32"}) EXPECT_EQ(row(id).verdict, Verdict::input) << id;
  for (const char* id : {"R20", "R29", "R30", "C12"}) EXPECT_EQ(row(id).verdict, Verdict::cannot_fail) << id;
  EXPECT_EQ(row("R14").measured, "24.25 KB");
  EXPECT_EQ(row("R32").measured, "9.06 M / 5.21 M");
  const auto summary = [&] { return tools::verdict_summary(tools::reproduction_of(result_)); };
  EXPECT_NE(summary().find(" of 27 rows that could have failed agree; of 2 nothing can be said; 11 are inputs, 4 "
                           "cannot fail, 1 not modelled"),
            std::string::npos)
      << summary();
  // An input that comes out otherwise is shown, and is still one.
  point(6, "baseline").gaussians_total = 1'000'000;
  EXPECT_EQ(row("R32").verdict, Verdict::input);
  EXPECT_NEAR(row("R32").difference_percent.value(), 100 * (1 / 9.06 - 1), 1e-9);
  // What was not drawn leaves the count.
  for (tools::PointResult& each : result_.points) each.run.counts = Counts();
  EXPECT_EQ(summary().find(" of 27 rows"), std::string::npos) << summary();
  EXPECT_NE(summary().find("nothing can be said"), std::string::npos) << summary();
}

TEST_F(Synthetic, NumbersAgreeWithinFivePercentUnlessTheRowSaysOtherwise) {
  const auto rows = [](const std::string& published) {
    return tools::parse_rows(
        "schema = \"vrpipe.paper-rows/1\"\n[[row]]\nid = \"A\"\nsection = \"I\"\nwhat = \"w\"\nsays = \"s\"\n"
        "kind = \"measured\"\nhow = \"h\"\nmeasure = \"truck's speed-up of het\"\npublished = " +
            published,
        "rows");
  };
  result_.plan.rows = rows("2.1");  // it is 2.2
  EXPECT_EQ(row("A").verdict, Verdict::agrees);
  result_.plan.rows = rows("2.09");
  EXPECT_EQ(row("A").verdict, Verdict::differs);
  EXPECT_EQ(row("A").reason, "no reason is known");
  result_.plan.rows = rows("2.09\ntolerance_percent = 6\ntolerance_reason = \"of one scene\"");
  EXPECT_EQ(row("A").verdict, Verdict::agrees);
  std::string heading;
  for (const std::string& line : tools::reproduction_heading(tools::reproduction_of(result_))) heading += line;
  EXPECT_NE(heading.find("within 5 % of the paper's; A within 6 %: of one scene."), std::string::npos) << heading;
}

TEST_F(Synthetic, AReasonIsPrintedOnlyWhereThisRunHasShownIt) {
  const std::string setting = "link.qru.warps.depth=8192";
  const auto with_setting = [&](const auto& change) {
    for (std::size_t i = 0; i < result_.points.size(); ++i) {
      if (result_.plan.points[i].key.settings == setting) change(result_.points[i].run);
    }
  };
  // Of quads: R7 is 6 % low, and the setting does nothing.
  ASSERT_EQ(row("R7").verdict, Verdict::differs);
  EXPECT_EQ(row("R7").reason.find("no reason is known; tried in vain: termination may"), 0U) << row("R7").reason;
  with_setting([](RunResult& run) {
    if (run.request.variant.name == "het") run.counts.quads_blended = run.counts.quads_blended * 179 / 190;
  });
  EXPECT_EQ(row("R7").reason.find(
                "termination may be tested farther ahead of blending (link.qru.warps.depth=8192: /1.90)"),
            0U)
      << row("R7").reason;
  ASSERT_EQ(row("R7").tried.size(), 1U);
  EXPECT_TRUE(row("R7").tried[0].is_shown);

  // By another row: quads that fall too little are no reason for a speed-up that is too great.
  ASSERT_GT(row("R2").difference_percent.value(), 5);
  EXPECT_NE(row("R2").reason.find("tried in vain: quads fall more than in the paper"), std::string::npos);
  for (std::size_t scene = 0; scene < 6; ++scene) point(scene, "het").run.counts.quads_blended /= 2;
  EXPECT_EQ(row("R2").reason.find("quads fall more than in the paper (R7) (/3.58)"), 0U) << row("R2").reason;

  // By another measure of the same run.
  EXPECT_EQ(row("R6").verdict, Verdict::agrees);
  for (std::size_t scene = 0; scene < 6; ++scene) {
    tools::PointResult& both = point(scene, "het+qm");
    const std::uint64_t more = both.run.counts.fragments_blended / 4;
    both.run.counts.fragments_blended += more;
    both.fragments_of_back_quads = more;
  }
  EXPECT_EQ(row("R6").verdict, Verdict::differs);
  EXPECT_EQ(row("R6").reason.find("the paper may count all fragments"), 0U) << row("R6").reason;
  for (std::size_t scene = 0; scene < 6; ++scene) point(scene, "het+qm").fragments_of_back_quads = 0;
  EXPECT_EQ(row("R6").reason.find("no reason is known; tried in vain: the paper may"), 0U) << row("R6").reason;
}

TEST_F(Synthetic, RowsAreJudgedWithEachFrontEnd) {
  const auto found = [&](std::size_t i) { return tools::reproduction_of(result_).front_ends.at(i); };
  ASSERT_EQ(tools::reproduction_of(result_).front_ends.size(), 3U);
  EXPECT_EQ(found(0).name, "agx-orin");
  EXPECT_EQ(found(2).name, "agx-orin-emerald-1");
  std::vector<std::string> ids;
  for (const tools::RowFinding& each : found(0).rows) ids.push_back(each.row->id);
  for (const char* id : {"R1", "R2", "R3", "R4", "R5", "R6", "R7", "R8", "C6", "C7", "C8"}) {
    EXPECT_EQ(std::count(ids.begin(), ids.end(), id), 1) << id;
  }
  EXPECT_EQ(std::count(ids.begin(), ids.end(), "R18"), 0) << "of views, which a front end does not move";
  EXPECT_EQ(std::count(ids.begin(), ids.end(), "C11"), 0) << "of large scenes, on which nothing is tried";
  EXPECT_EQ(found(2).agree(), found(0).agree());
  for (std::size_t i = 0; i < result_.points.size(); ++i) {
    const tools::PointKey& key = result_.plan.points[i].key;
    if (key.settings == "platform=agx-orin-emerald-1" && key.variant == "het") *result_.points[i].run.cycles /= 2;
  }
  EXPECT_EQ(found(1).agree(), found(0).agree());
  EXPECT_EQ(found(2).agree(), found(0).agree() - 1) << "R4 alone";
  EXPECT_NEAR(found(2).means.het.arithmetic, 2 * found(0).means.het.arithmetic, 1e-6);
  const tools::ReportTable table = tools::front_ends_table(tools::reproduction_of(result_));
  ASSERT_EQ(table.heading.size(), 6U);
  EXPECT_EQ(table.rows.size(), ids.size() + 3);
  EXPECT_EQ(table.rows.back().at(4), fmt::format("{} of {}", found(1).agree(), ids.size()));
}

TEST_F(Synthetic, FragmentsThatAreLateAreLeftOutBesideThoseThatAreBlended) {
  const auto main = [&] { return tools::reproduction_of(result_).findings.fragments.front(); };
  EXPECT_DOUBLE_EQ(main().fragments_in_time, main().fragments) << "none is late";
  for (std::size_t scene = 0; scene < 6; ++scene) {
    tools::PointResult& het = point(scene, "het");
    het.fragments_blended_late = het.run.counts.fragments_blended / 5;
  }
  EXPECT_NEAR(main().fragments_in_time, main().fragments / 0.8, 1e-4);
  EXPECT_NEAR(main().fall_percent_in_time, 100 * (1 - main().quads / main().fragments_in_time), 1e-9);
}

TEST_F(Synthetic, EnergyIsJudgedByThePapersMethodTheImitation) {
  EXPECT_EQ(row("R12").verdict, Verdict::cannot_say) << "nothing was counted";
  const tools::EnergyTable& table = tools::shipped_energies();
  // Constant power alone: energies are as times.
  const auto spend = [&](std::size_t scene, const std::string& variant, Fidelity fidelity, double seconds) {
    tools::PointKey key;
    key.scene = scene;
    key.variant = variant;
    key.fidelity = fidelity;
    tools::EnergyAmounts& amounts =
        result_.points[result_.plan.places.at(key.name(result_.plan.scenes))].energy.emplace();
    amounts.events.assign(table.events.size(), 0);
    amounts.powers.assign(table.powers.size(), 1);
    amounts.seconds = seconds;
    amounts.fragments_blended = 1;
  };
  for (std::size_t scene = 0; scene < 6; ++scene) {
    spend(scene, "baseline", Fidelity::lt, 3.3);
    spend(scene, "imitation", Fidelity::lt, scene == 3 ? 1.5 : 2.1);
    spend(scene, "baseline", Fidelity::cycle, 2);
    spend(scene, "het+qm", Fidelity::cycle, 1);
  }
  EXPECT_NEAR(row("R12").number.value(), (5 * 3.3 / 2.1 + 3.3 / 1.5) / 6, 1e-9);
  EXPECT_EQ(row("R12").verdict, Verdict::agrees);
  EXPECT_EQ(row("R13").measured, "2.20x (truck)");
  EXPECT_EQ(row("R13").verdict, Verdict::agrees);
  spend(3, "imitation", Fidelity::lt, 1.8);
  EXPECT_EQ(row("R13").verdict, Verdict::differs);
  EXPECT_NE(row("R13").reason.find("HET+QM itself spends less (2.00x)"), std::string::npos) << row("R13").reason;
}

TEST_F(Synthetic, RowsThatDifferNameTheScenes) {
  point(2, "het").run.cycles = *point(0, "baseline").run.cycles;
  EXPECT_EQ(row("C6").verdict, Verdict::differs);
  EXPECT_NE(row("C6").reason.find("train"), std::string::npos);
  point(4, "het").run.counts.quads_blended = 1;
  EXPECT_EQ(row("C8").verdict, Verdict::differs);
  EXPECT_NE(row("C8").reason.find("lego"), std::string::npos);
  point(7, "baseline").run.bottleneck->unit = "gpc0.raster";
  EXPECT_EQ(row("C11").verdict, Verdict::differs);
  EXPECT_NE(row("C11").reason.find("rubble"), std::string::npos);
}

TEST_F(Synthetic, NothingIsSaidOfScenesWithoutFragments) {
  for (tools::PointResult& each : result_.points) each.run.counts = Counts();
  for (const char* id : {"R1", "R2", "R5", "R18", "R19"}) {
    EXPECT_EQ(row(id).verdict, Verdict::cannot_say) << id;
    EXPECT_FALSE(row(id).number.has_value()) << id;
  }
}

// The command, on a small scene in the place of each of the paper's.

class Reproduce : public ToolTest {
 protected:
  void SetUp() override {
    GaussianSceneBuilder builder(0);
    for (int i = 0; i < 120; ++i) {
      GaussianAttributes gaussian;
      const auto spread = [i](int step) { return 0.04F * static_cast<float>((i * step) % 23 - 11); };
      gaussian.position = {spread(7), spread(5), spread(3)};
      gaussian.log_scale = {-2.0F, -1.7F, -1.9F};
      gaussian.opacity_logit = i % 2 == 0 ? 6.0F : 0.5F;
      gaussian.f_dc = {1, 0.2F, -0.5F};
      builder.add(gaussian);
    }
    write_gaussian_file(folder() / "cloud.ply", builder.build());
  }

  static std::vector<std::string> command(const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"reproduce", "--quick", "--size", "64x48"};
    for (const char* scene : {"kitchen", "bonsai", "train", "truck", "lego", "palace", "building", "rubble"}) {
      words.insert(words.end(), {"--scene", std::string(scene) + "=cloud.ply"});
    }
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
};

TEST_F(Reproduce, SaysSomethingOfEveryRow) {
  const Finished finished = vrpipe(command({"--json", "r.json", "--html", "r.html", "--markdown", "r.md", "--output",
                                            "maps", "--journal", "j.jsonl", "--beside", "mine=cloud.ply"}));
  ASSERT_EQ(finished.code, 0) << finished.err;
  const json result = json::parse(read_file(folder() / "r.json"));
  EXPECT_EQ(result["schema"], "vrpipe.reproduce/1");
  EXPECT_EQ(result["quick"], true);
  const std::string page = read_file(folder() / "r.html"), document = read_file(folder() / "r.md");
  ASSERT_EQ(result["rows"].size(), tools::paper_rows().size());
  for (std::size_t i = 0; i < result["rows"].size(); ++i) {
    const json& row = result["rows"][i];
    const std::string id = tools::paper_rows()[i].id;
    EXPECT_EQ(row["id"], id);
    if (row["verdict"] != "agrees") {
      EXPECT_TRUE(row["reason"].is_string()) << id;
    }
    if (row["verdict"] == "agrees" || row["verdict"] == "differs") {
      EXPECT_TRUE(row["measured"].is_string()) << id;
    }
    EXPECT_NE(page.find("<tr id=\"" + id + "\">"), std::string::npos) << id;
    EXPECT_NE(document.find("| " + id + " |"), std::string::npos) << id;
    EXPECT_NE(finished.out.find("\n" + id + " "), std::string::npos) << id;
  }
  // One beside the paper's is in no row and no mean.
  ASSERT_EQ(result["scenes_beside"].size(), 1U);
  EXPECT_EQ(result["scenes_beside"][0]["name"], "mine");
  EXPECT_GT(result["scenes_beside"][0]["speedup"]["het"], 0);
  EXPECT_NE(document.find("| mine (beside) |"), std::string::npos);
  EXPECT_NE(document.find("| mine beside the six |"), std::string::npos);
  EXPECT_NE(document.find("reproduce --quick --beside mine=cloud.ply --markdown"), std::string::npos);
  // A verdict of a quick look says so.
  EXPECT_EQ(document.find("| agrees |"), std::string::npos);
  EXPECT_NE(document.find("| agrees (quick) |"), std::string::npos);
  ASSERT_EQ(result["scenes"].size(), 6U);
  for (const json& scene : result["scenes"]) {
    EXPECT_EQ(scene["runs"].size(), 4U);
    EXPECT_GT(scene["fragments_per_pixel"]["without"]["fragments"], 0);
    // What was counted pixel by pixel is what was blended: without termination that is the same at every fidelity.
    EXPECT_EQ(scene["fragments_per_pixel"]["without"]["fragments"], scene["runs"][0]["counts"]["fragments_blended"]);
    const std::string name = scene["name"];
    for (const char* variant : {"baseline", "het"}) {
      const std::string png = read_file(folder() / "maps" / ("fragments-" + name + "-" + variant + ".png"));
      EXPECT_EQ(png.substr(1, 3), "PNG") << name;
    }
  }
  for (const char* outside : {"<script", "<link", "src=\"http", "href=\"http", "@import", "url("}) {
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  }
  EXPECT_NE(page.find("data:image/png;base64,"), std::string::npos);
  EXPECT_NE(page.find("<svg"), std::string::npos);

  // A journal that was named stays, and nothing is simulated again.
  const Finished again = vrpipe(command({"--json", "s.json", "--journal", "j.jsonl", "--beside", "mine=cloud.ply"}));
  EXPECT_EQ(again.code, 0);
  EXPECT_NE(again.err.find("simulations were done before"), std::string::npos) << again.err;
  json other = json::parse(read_file(folder() / "s.json"));
  other["command"] = result["command"];
  EXPECT_EQ(other, result);

  // Nor for rows of one's own.
  write("rows.toml", R"(schema = "vrpipe.paper-rows/1"
[[row]]
id = "Q1"
section = "mine"
what = "fall of quads"
says = "some"
kind = "measured"
holds = [{ of = "fall of quads by het", above = 0.1 }]
how = "baseline over HET"
)");
  ASSERT_EQ(vrpipe(command({"--json", "t.json", "--rows", "rows.toml", "--journal", "j.jsonl", "--beside",
                            "mine=cloud.ply"}))
                .code,
            0);
  const json own = json::parse(read_file(folder() / "t.json"));
  ASSERT_EQ(own["rows"].size(), 1U);
  EXPECT_EQ(own["rows"][0]["id"], "Q1");
  EXPECT_EQ(own["rows"][0]["verdict"], "agrees");
}

TEST_F(Reproduce, GoesOnAfterItWasKilledAndEndsWithTheSameBytes) {
  const std::vector<std::string> words =
      command({"--json", "r.json", "--html", "r.html", "--journal", "j.jsonl", "--platform", "agx-orin-ideal-memory"});
  const auto written = [&] { return read_file(folder() / "r.json") + read_file(folder() / "r.html"); };
  const pid_t process = ::fork();
  if (process == 0) {
    const bool ready = ::chdir(folder().c_str()) == 0 && std::freopen("/dev/null", "w", stdout) != nullptr;
    ::_exit(ready ? become_vrpipe(words) : 98);
  }
  std::ptrdiff_t lines = 0;
  for (int waited = 0; lines < 30 && waited < 30000; ++waited) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::string text = read_file(folder() / "j.jsonl");
    lines = std::count(text.begin(), text.end(), '\n');
  }
  ::kill(process, SIGKILL);
  int status = 0;
  ::waitpid(process, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status)) << "it was done before it could be killed";
  EXPECT_FALSE(std::filesystem::exists(folder() / "r.json"));
  const Finished resumed = vrpipe(words);
  ASSERT_EQ(resumed.code, 0) << resumed.err;
  std::size_t done = 0, all = 0;
  EXPECT_EQ(std::sscanf(resumed.err.c_str(), "%zu of %zu simulations were done before", &done, &all), 2) << resumed.err;
  EXPECT_GE(done, 20U);
  EXPECT_LT(done, all);
  const std::string of_two_runs = written();
  std::filesystem::remove(folder() / "j.jsonl");
  ASSERT_EQ(vrpipe(words).code, 0);
  EXPECT_EQ(of_two_runs, written());
}

TEST_F(Reproduce, RefusesWhatItCannotDo) {
  refused({"reproduce", "--scene", "cloud.ply"}, {"(--scene"});
  refused({"reproduce", "--scene", "object=cloud.ply"}, {"(--scene object=cloud.ply)", "the paper does not have"});
  refused({"reproduce", "--scene", "train=none.ply"}, {"(--scene train=none.ply)", "no such file"});
  refused({"reproduce", "--scene", "train=cloud.ply", "--scene", "train=cloud.ply"}, {"train"});
  refused({"reproduce", "--beside", "cloud.ply"}, {"'cloud.ply' (--beside)", "mine=model.ply"});
  refused({"reproduce", "--beside", "mine=none.ply"}, {"(--beside mine=none.ply)", "no such file"});
  refused({"reproduce", "--beside", "train=cloud.ply"}, {"name taken (--beside train=cloud.ply)", "--scene"});
  refused({"reproduce", "--beside", "a b=cloud.ply"}, {"bad name 'a b' (--beside)"});
  refused({"reproduce", "--camera", "cameras.json"}, {"(--camera)", "NAME=FILE"});
  write("cameras.json",
        R"([{"img_name": "a", "width": 64, "height": 48, "position": [0, 0, -4],
             "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fx": 90, "fy": 90}])");
  refused({"reproduce", "--camera", "train=cameras.json"}, {"(--camera train)", "add --scene train=FILE"});
  refused({"reproduce", "--camera", "train=none.json"}, {"none.json"});
  refused({"reproduce", "--fidelity", "functional"}, {"'functional' (--fidelity)"});
  refused({"reproduce", "--views", "0"}, {"(--views)"});
  refused({"reproduce", "--set", "tc.bin=3"}, {"tc.bin"});
  refused(command({"--json", "cloud.ply"}), {"--json cloud.ply", "same file"});
  refused(command({"--json", "a", "--html", "a"}), {"same file"});
  refused(command({"--html", "none/a.html"}), {"--html none/a.html"});
  refused({"reproduce", "--quik"}, {"--quick"});
  refused({"reproduce", "--rows", "none.toml"}, {"cannot read rows", "none.toml"});
  write("rows.toml", "schema = \"vrpipe.paper-rows/1\"\n[[row]]\nid = \"A\"\n");
  refused({"reproduce", "--rows", "rows.toml"}, {"rows.toml line 2", "'A' has no section"});
  refused({"reproduce", "--unit", "qru=same-splat"}, {"'same-splat'", "slot qru"});
  refused({"reproduce", "--plugin", "none.so"}, {"none.so", "no such file"});
}

TEST_F(Reproduce, TakesUnitsOfPlugins) {
  const Finished finished = vrpipe({"reproduce", "--quick", "--plugin", TEST_PLUGIN, "--unit", "qru=same-splat",
                                    "--set", "state.termination_threshold=0.9", "--print-config"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_NE(finished.out.find("same-splat"), std::string::npos) << finished.out;
  EXPECT_NE(finished.out.find(TEST_PLUGIN), std::string::npos) << finished.out;
}

}  // namespace
}  // namespace vrpipe::testing
