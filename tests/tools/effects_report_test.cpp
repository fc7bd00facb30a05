#include <gtest/gtest.h>

#include <sstream>

#include "output/effects_page.h"
#include "output/effects_report.h"

namespace vrpipe::testing {
namespace {

using tools::EffectCosts;
using tools::effects_text;

const std::string long_reason =
    "a reason of more words than there is room for on a line of a hundred characters, beside a name and a proof";

/// A run of a variant with an active effect and one omitted for each proof.
RunResult run_of(const std::string& variant) {
  RunResult run;
  run.request.variant = variant_named(variant);
  run.effects = {{"crop.blend_hazard", true, EffectProof::verified, "watched"},
                 {"dram.refresh", true, EffectProof::bounded, "at most 3 %"},
                 {"qru.pairing", false, EffectProof::by_facts, "QRU pairs"},
                 {"raster.hi_z", true, EffectProof::by_facts, long_reason}};
  return run;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST(EffectsReport, OfOneRunCountsThemAndNamesWhatChangesResults) {
  const std::string where = "each with its reason: --json, --html; with what it would cost: --explain-effects\n";
  EXPECT_EQ(
      effects_text({run_of("qm")}, {}, {}),
      "\neffects: 1 active, 3 left out (1 bounded, 1 static, 1 verified)\napproximated: dram.refresh (at most 3 %)\n" +
          where);
  RunResult forced = run_of("qm");
  forced.request.effects = EffectChoice::parse("auto,-raster.hi_z,-dram.refresh");
  EXPECT_EQ(effects_text({forced}, {}, {}),
            "\neffects: 1 active, 3 left out (2 forced, 1 verified)\nleft out by force: dram.refresh, raster.hi_z\n" +
                where);
}

TEST(EffectsReport, ThatTheUserForcedOutHasNoProof) {
  RunResult run = run_of("qm");
  run.request.effects = EffectChoice::parse("auto,-raster.hi_z");
  EXPECT_EQ(tools::state_of(run, run.effects[3]), "forced");
  EXPECT_FALSE(tools::proof_of(run, run.effects[3]).has_value());
  EXPECT_EQ(tools::state_of(run, run.effects[2]), "active");
  EXPECT_FALSE(tools::proof_of(run, run.effects[2]).has_value());
  EXPECT_EQ(tools::proof_of(run, run.effects[0]), EffectProof::verified);
}

TEST(EffectsReport, OfSeveralRunsHasARowWhereTheyDiffer) {
  std::vector<RunResult> runs{run_of("baseline"), run_of("qm")};
  runs[0].effects[2] = {"qru.pairing", true, EffectProof::by_facts, "qru has pass-through"};
  EXPECT_EQ(effects_text(runs, {}, {}),
            "\n"
            "effects that differ  baseline      qm\n"
            "-------------------------------------\n"
            "  qru.pairing          static  active\n"
            "effects: 0 active in all, 3 left out in all (1 bounded, 1 static, 1 verified)\n"
            "approximated: dram.refresh\n"
            "each with its reason: --json, --html; with what it would cost: --explain-effects\n");
  runs[0].effects[2] = runs[1].effects[2];
  const std::string alike = effects_text(runs, {}, {});
  EXPECT_EQ(alike.find("differ"), std::string::npos) << alike;
  EXPECT_NE(alike.find("effects: 1 active in all, 3 left out"), std::string::npos) << alike;
}

TEST(EffectsReport, CostsAreColumnsOfWhatIsOmittedAndARowOfAll) {
  const EffectCosts costs{1.0, {{"crop.blend_hazard", 1.25}, {"dram.refresh", 1.0}, {"raster.hi_z", 12.5}}, 13.75};
  const std::vector<std::string> lines = lines_of(effects_text({run_of("qm")}, {costs}, {}));
  const auto line_with = [&](const std::string& part) {
    for (const std::string& line : lines) {
      if (line.find(part) != std::string::npos) return line;
    }
    return std::string();
  };
  EXPECT_EQ(line_with("effects of"), "effects of qm        proof     host s without   with   ratio  reason");
  EXPECT_EQ(line_with("qru.pairing"), "  qru.pairing                                                 QRU pairs");
  EXPECT_EQ(line_with("crop.blend_hazard"), "  crop.blend_hazard  verified            1.00   1.25   1.25x  watched");
  EXPECT_EQ(line_with("raster.hi_z").substr(0, 62), "  raster.hi_z        static              1.00  12.50  12.50x  ");
  EXPECT_NE(effects_text({run_of("qm")}, {costs}, {}).find("a reason of more words"), std::string::npos);
  EXPECT_EQ(line_with("all effects"), "  all effects                            1.00  13.75  13.75x  --effects all");
}

TEST(EffectsReport, FitsInAHundredColumns) {
  RunResult run = run_of("het+qm");
  for (EffectReport& effect : run.effects) effect.reason = long_reason + ", " + long_reason;
  const EffectCosts costs{1234.5, {{"raster.hi_z", 12345.6}, {"dram.refresh", 1}, {"crop.blend_hazard", 99999.9}}, 1e5};
  for (const std::string& text :
       {effects_text({run}, {}, {}), effects_text({run, run, run, run}, {}, {}), effects_text({run}, {costs}, {})}) {
    for (const std::string& line : lines_of(text)) EXPECT_LE(line.size(), 100U) << line;
  }
}

TEST(EffectsReport, WithoutEffectsIsNothing) { EXPECT_EQ(effects_text({RunResult()}, {}, {}), ""); }

TEST(EffectsReport, LongExplanationsAreAnnounced) {
  EXPECT_EQ(tools::announcement(90, 29), "");
  EXPECT_EQ(tools::announcement(90, 45.2), "--explain-effects: 90 simulations more, one at a time, about 45 s");
  EXPECT_EQ(tools::announcement(90, 600), "--explain-effects: 90 simulations more, one at a time, about 10 min");
}

TEST(EffectsPage, HasAColumnForEachRunAndNamesThoseOfAReason) {
  std::vector<RunResult> runs{run_of("baseline"), run_of("qm"), run_of("het+qm")};
  runs[0].effects[2] = {"qru.pairing", true, EffectProof::by_facts, "qru has <pass-through>"};
  const std::string page = tools::effects_html({&runs[0], &runs[1], &runs[2]});
  for (const char* part :
       {"<th>effect</th><th>baseline</th><th>qm</th><th>het+qm</th><th>reason</th>",
        "<tr><td>qru.pairing</td><td>static</td><td class=\"active\">active</td><td class=\"active\">active</td>"
        "<td>baseline: qru has &lt;pass-through&gt;<br>qm, het+qm: QRU pairs</td></tr>",
        "<tr><td>dram.refresh</td><td>bounded</td><td>bounded</td><td>bounded</td><td>at most 3 %</td></tr>"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part << " is not in\n" << page;
  }
}

}  // namespace
}  // namespace vrpipe::testing
