#include "tool_test_support.h"

#include <map>
#include <regex>
#include <set>

#include <vrpipe/pipeline/effects.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/simulation.h>

#include "cli/command_line.h"
#include "forked.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

/// What `run`, `compare`, `accuracy` and `units` say of effects.
class EffectsCommand : public ToolTest {
 protected:
  /// The entries of a run by name.
  std::map<std::string, json> effects_of(const json& run) const {
    std::map<std::string, json> entries;
    for (const json& entry : run["effects"]) entries[entry["name"]] = entry;
    EXPECT_EQ(entries.size(), run["effects"].size());
    return entries;
  }
  std::map<std::string, json> effects_by(std::vector<std::string> command) const {
    return effects_of(json_of(std::move(command))["runs"][0]);
  }
  static std::set<std::string> declared() {
    std::set<std::string> names;
    for (const Effect& effect : effects()) names.insert(effect.full_name());
    return names;
  }
  /// The command in a process that has something more, as if of a plugin.
  Finished with(const std::function<void()>& add, std::vector<const char*> arguments) const {
    arguments.insert(arguments.begin(), "vrpipe");
    return in_fork(folder(), [&] {
      fresh_simulation();
      add();
      return tools::run_command_line(static_cast<int>(arguments.size()), arguments.data());
    });
  }
  static void expect_in(const std::string& text, const std::vector<std::string>& parts) {
    for (const std::string& part : parts)
      EXPECT_NE(text.find(part), std::string::npos) << part << " is not in:\n" << text;
  }
};

/// An effect of QRU's that every run may omit.
Effect an_effect(const std::string& name) {
  Effect effect;
  effect.component = "qru";
  effect.name = name;
  effect.models = "what a test looks at";
  effect.omitted_when = "always | but for tests";
  effect.elaborates = "nothing";
  effect.tripwire = "nowhere";
  effect.decide = [](const EffectQuestion&) { return EffectDecision::omit("a test says so"); };
  return effect;
}

TEST_F(EffectsCommand, EachRunHasEachEffectWithItsStateProofAndReason) {
  const json result = json_of({"compare", "--scene", "tiny.spl"});
  EXPECT_EQ(result["effects"], "auto");
  for (const json& run : result["runs"]) {
    SCOPED_TRACE(run["variant"]);
    std::set<std::string> names;
    for (const auto& [name, entry] : effects_of(run)) {
      names.insert(name);
      EXPECT_EQ(entry.size(), 4U) << entry;
      EXPECT_FALSE(entry["reason"].get<std::string>().empty()) << entry;
      if (entry["state"] == "active") {
        EXPECT_TRUE(entry["proof"].is_null()) << entry;
      } else {
        EXPECT_EQ(entry["state"], "omitted") << entry;
        EXPECT_TRUE(entry["proof"] == "static" || entry["proof"] == "verified") << entry;
      }
    }
    EXPECT_EQ(names, declared());
    EXPECT_FALSE(run.contains("all_effects"));
  }
  EXPECT_EQ(effects_of(result["runs"][0])["qru.pairing"]["state"], "omitted");
  EXPECT_EQ(effects_of(result["runs"][1])["qru.pairing"]["state"], "active");
}

TEST_F(EffectsCommand, AllTakesInEverythingAndChangesNothing) {
  const json chosen = json_of({"run", "--scene", "tiny.spl"});
  const json all = json_of({"run", "--scene", "tiny.spl", "--effects", "all"});
  EXPECT_EQ(all["effects"], "all");
  for (const auto& [name, entry] : effects_of(all["runs"][0])) EXPECT_EQ(entry["state"], "active") << entry;
  EXPECT_EQ(all["runs"][0]["result_hash"], chosen["runs"][0]["result_hash"]);
  expect_in(vrpipe({"run", "--scene", "tiny.spl", "--effects", "all"}).out, {"paper termination, effects all\n"});
}

TEST_F(EffectsCommand, WhatIsForcedOutHasNoProof) {
  const std::vector<std::string> command{"run",      "--scene",   "tiny.spl",         "--variant",
                                         "baseline", "--effects", "auto,-qru.pairing"};
  const json entry = effects_by(command)["qru.pairing"];
  EXPECT_EQ(entry["state"], "omitted");
  EXPECT_TRUE(entry["proof"].is_null());
  expect_in(vrpipe(command).out, {"termination, effects auto,-qru.pairing\n", "left out by force: qru.pairing\n"});
}

TEST_F(EffectsCommand, RunsCountThemAndComparisonsSayWhereTheyDiffer) {
  const std::string run = vrpipe({"run", "--scene", "tiny.spl", "--variant", "qm"}).out;
  std::smatch counted;
  ASSERT_TRUE(std::regex_search(run, counted, std::regex("\neffects: (\\d+) active, (\\d+) left out \\("))) << run;
  EXPECT_EQ(std::stoul(counted[1]) + std::stoul(counted[2]), declared().size());
  EXPECT_LT(run.find("took "), run.find("\neffects: ")) << "at the end";
  const std::string compared = vrpipe({"compare", "--scene", "tiny.spl"}).out;
  expect_in(compared, {"effects that differ", "  qru.pairing            static  active  static  active\n"});
  EXPECT_TRUE(std::regex_search(compared, std::regex("\neffects: \\d+ active in all, \\d+ left out in all \\(")));
  const std::string explained =
      vrpipe({"run", "--scene", "tiny.spl", "--variant", "qm", "--fidelity", "functional", "--explain-effects"}).out;
  std::vector<std::string> names;
  for (const std::string& name : declared()) names.push_back("  " + name + " ");
  expect_in(explained, names);
  expect_in(explained, {"effects of qm ", "no draw tests depth or stencil\n"});
}

TEST_F(EffectsCommand, ExplainingMeasuresWhatIsOmittedAndAllTogether) {
  for (const char* command : {"run", "compare"}) {
    SCOPED_TRACE(command);
    const json result = json_of({command, "--scene", "tiny.spl", "--fidelity", "functional", "--explain-effects"});
    for (const json& run : result["runs"]) {
      const double without = run["all_effects"]["host_seconds"]["without"];
      EXPECT_GT(without, 0);
      EXPECT_GT(run["all_effects"]["host_seconds"]["with"].get<double>(), 0);
      unsigned measured = 0;
      for (const auto& [name, entry] : effects_of(run)) {
        if (entry["state"] == "active") {
          EXPECT_TRUE(entry["host_seconds"].is_null()) << entry;
          continue;
        }
        ++measured;
        EXPECT_GT(entry["host_seconds"]["with"].get<double>(), 0) << entry;
        EXPECT_EQ(entry["host_seconds"]["without"], without) << entry;
      }
      EXPECT_GT(measured, 10U);
    }
  }
  const Finished text = vrpipe({"run", "--scene", "tiny.spl", "--fidelity", "functional", "--explain-effects"});
  EXPECT_EQ(text.code, 0);
  EXPECT_EQ(text.err, "") << "it is short";
  expect_in(text.out, {"host s without", "together\n  all effects "});
}

TEST_F(EffectsCommand, ExplainingANamedListTakesInWhatWasForcedOut) {
  const auto entries = effects_by({"run", "--scene", "tiny.spl", "--variant", "baseline", "--fidelity", "functional",
                                   "--effects", "all,-zrop.termination", "--explain-effects"});
  for (const auto& [name, entry] : entries) {
    EXPECT_EQ(entry["host_seconds"].is_object(), name == "zrop.termination") << entry;
  }
}

/// A QRU that pairs only if an effect is elaborated, which is omitted as if that changed nothing.
TEST_F(EffectsCommand, AnEffectThatWasWronglyOmittedIsAFault) {
  const auto add = [] {
    Implementation unit = Registry::instance().find("qru", "pairing");
    unit.name = "dishonest";
    unit.trust = Trust::checked;
    unit.make_behaviour = [pairing = unit.make_behaviour](const ParameterSet& parameters,
                                                          const RenderContext& context) {
      if (EffectGate(context, "qru.dishonesty").is_active()) return pairing(parameters, context);
      const Implementation& other = Registry::instance().find("qru", "pass-through");
      return other.make_behaviour(*other.make_parameters(), context);
    };
    Registry::instance().add(unit);
    add_effect(an_effect("dishonesty"));
  };
  const std::vector<const char*> run{"run", "--scene", "tiny.spl", "--variant", "qm", "--unit", "qru=dishonest"};
  EXPECT_EQ(with(add, run).code, 0) << "nobody can know";
  std::vector<const char*> explained = run;
  explained.push_back("--explain-effects");
  const Finished finished = with(add, explained);
  EXPECT_EQ(finished.code, 1);
  EXPECT_EQ(finished.out, "");
  EXPECT_EQ(finished.err,
            "vrpipe: fault: variant qm: what is left out changes the result: --effects auto gives another than "
            "auto,qru.dishonesty\n");
}

TEST_F(EffectsCommand, UnitsListsEveryEffectBesideItsComponent) {
  const std::string text = vrpipe({"units"}).out;
  const std::string alone = vrpipe({"units", "--effects"}).out;
  const std::string markdown = vrpipe({"units", "--markdown"}).out;
  const std::string table = vrpipe({"units", "--effects", "--markdown"}).out;
  const json listing = json_of({"units"});
  ASSERT_EQ(listing["effects"].size(), effects().size());
  std::map<std::string, json> entries;
  for (const json& entry : listing["effects"]) entries[entry["name"]] = entry;
  for (const Effect& effect : effects()) {
    const std::string name = effect.full_name();
    const json& entry = entries[name];
    EXPECT_EQ(entry["component"], effect.component);
    EXPECT_EQ(entry["kind"], name_of(effect.kind));
    EXPECT_EQ(entry["models"], effect.models);
    EXPECT_EQ(entry["tripwire"], effect.tripwire);
    EXPECT_EQ(entry["elaborates"], effect.elaborates);
    for (const std::string& all : {text, alone}) {
      expect_in(all, {"effect " + name, effect.models, effect.omitted_when, effect.elaborates});
    }
    for (const std::string& all : {markdown, table}) expect_in(all, {"| `" + name + "`"});
    expect_in(vrpipe({"units", "--slot", effect.component}).out, {"effect " + name});
  }
  // Before the units of the next slot, and after those of its own.
  EXPECT_LT(text.find("tc.bins ="), text.find("effect tc.eviction"));
  EXPECT_LT(text.find("effect tc.eviction"), text.find("prop=pre-rop"));
  EXPECT_EQ(alone.find("tc.bins ="), std::string::npos);
  EXPECT_LT(table.find("`draw.several_draws`"), table.find("`crop.blend_hazard`")) << "as a frame flows";
  const json some = json_of({"units", "--slot", "clock", "--effects"});
  EXPECT_EQ(some["units"], json::array());
  ASSERT_EQ(some["effects"].size(), 1U);
  EXPECT_EQ(some["effects"][0]["name"], "clock.kernel_time");
}

TEST_F(EffectsCommand, APluginsEffectIsOneLikeTheOthers) {
  expect_in(vrpipe({"units", "--plugin", TEST_PLUGIN, "--effects"}).out,
            {"effect qru.same_splat_pairs of same-splat, functional: quads of the two triangles"});
  const std::vector<std::string> run{"run", "--scene", "tiny.spl", "--variant", "qm", "--plugin", TEST_PLUGIN};
  std::vector<std::string> with_unit = run;
  with_unit.insert(with_unit.end(), {"--unit", "qru=same-splat"});
  const auto entry = [](const char* state, const json& proof, const char* reason) {
    return json{{"name", "qru.same_splat_pairs"}, {"state", state}, {"proof", proof}, {"reason", reason}};
  };
  EXPECT_EQ(effects_by(run)["qru.same_splat_pairs"], entry("omitted", "static", "qru has pairing"));
  const auto entries = effects_by(with_unit);
  EXPECT_EQ(entries.at("qru.same_splat_pairs"), entry("active", nullptr, "draws of splats: 1"));
  // What is merged in the SM array is the same, whoever pairs.
  EXPECT_EQ(entries.at("qru.pairing")["state"], "active");
  EXPECT_EQ(entries.at("qru.pairing")["reason"], "qru has same-splat, which may do the same");
}

TEST_F(EffectsCommand, OneThatNothingDecidesIsActiveAndTheListSaysWhy) {
  const auto add = [] {
    Effect effect = an_effect("undecided");
    effect.omitted_when = "no predicate is known";
    effect.decide = nullptr;
    add_effect(effect);
  };
  expect_in(with(add, {"units", "--slot", "qru"}).out,
            {"effect qru.undecided, functional: what a test looks at\n      always active: no predicate is known\n"});
  expect_in(with(add, {"units", "--effects", "--markdown"}).out,
            {"\n## Not decided, and why\n\n| effect | kind | models | why it stays active |\n|---|---|---|---|\n",
             "\n| `qru.undecided` | functional | what a test looks at | no predicate is known |\n"});
  const json listed = json::parse(with(add, {"units", "--slot", "qru", "--effects", "--json", "-"}).out);
  EXPECT_EQ(listed["effects"][1]["always_active_because"], "no predicate is known");
  EXPECT_EQ(listed["effects"][1]["decided"], false);
  const json run = json::parse(with(add, {"run", "--scene", "tiny.spl", "--json", "-"}).out)["runs"][0];
  EXPECT_EQ(effects_of(run)["qru.undecided"]["state"], "active");
  EXPECT_EQ(effects_of(run)["qru.undecided"]["reason"], "no predicate is known");
}

TEST_F(EffectsCommand, AListLeavesOutNothingThatIsAlwaysActive) {
  const auto entries = effects_by({"run", "--scene", "tiny.spl", "--variant", "baseline", "--fidelity", "functional",
                                   "--effects", "cache.details,crop.rounding_loss"});
  for (const Effect& effect : effects()) {
    const std::string name = effect.full_name();
    if (name == "cache.details" || name == "crop.rounding_loss") continue;
    // agx-orin-ideal-memory has neither a DRAM nor an L2 that misses, and the list leaves all out that ZROP is there for.
    const bool is_there = effect.component != "dram" && effect.component != "l2" && effect.component != "zrop";
    EXPECT_EQ(entries.at(name)["state"], effect.decide == nullptr && is_there ? "active" : "omitted") << name;
  }
}

TEST_F(EffectsCommand, MarkdownKeepsATextInItsCell) {
  const Finished finished = with([] { add_effect(an_effect("odd")); }, {"units", "--effects", "--markdown"});
  expect_in(finished.out,
            {"| `qru.odd` | functional | what a test looks at | always \\| but for tests | nothing | nowhere |\n"});
}

TEST_F(EffectsCommand, AccuracyHasATableOnItsPageAndTheChoiceInItsJson) {
  const Finished finished = vrpipe({"accuracy", "--scene", "tiny.spl", "--quick", "--effects", "all,-raster.hi_z",
                                    "--html", "page.html", "--json", "result.json"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(json::parse(read_file(folder() / "result.json"))["effects"], "all,-raster.hi_z");
  expect_in(finished.out, {", effects all,-raster.hi_z"});
  const std::string page = read_file(folder() / "page.html");
  expect_in(page, {"<h2>Effects: what is simulated</h2>", "<code>--effects all,-raster.hi_z</code>",
                   "<th>effect</th><th>baseline</th><th>het+qm</th><th>reason</th>",
                   "<tr><td>raster.hi_z</td><td>forced</td><td>forced</td>"});
  for (const std::string& name : declared()) expect_in(page, {"<tr><td>" + name + "</td>"});
}

}  // namespace
}  // namespace vrpipe::testing
