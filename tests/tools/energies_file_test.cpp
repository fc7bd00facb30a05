// Tests of tables of energies as files, and of the options that take them.

#include "tool_test_support.h"

#include <utility>

#include "jobs/energy_table.h"
#include "one_event_energies.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

class EnergiesFile : public ToolTest {
 protected:
  /// The shipped table with one text replaced.
  void write_with(const std::string& from, const std::string& to) const {
    std::string text = tools::shipped_energies_text();
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write("e.toml", text.replace(at, from.size(), to));
  }
  /// `parts`: what the message has to name.
  void refused_with(const std::string& from, const std::string& to, const std::vector<std::string>& parts) const {
    SCOPED_TRACE(to);
    write_with(from, to);
    refused({"run", "--scene", "tiny.spl", "--energies", "e.toml"}, parts);
  }
  std::string line_of(const std::string& text) const {
    const std::string all = tools::shipped_energies_text();
    const auto end = all.begin() + static_cast<std::ptrdiff_t>(all.find(text));
    return "e.toml line " + std::to_string(1 + std::count(all.begin(), end, '\n'));
  }
};

TEST_F(EnergiesFile, MistakesNameTheLineAndWhatToDo) {
  refused_with("node = \"12 nm\"\npj", "nodes = \"12 nm\"\npj",
               {line_of("node = \"12 nm\"\npj"), "unknown key 'nodes'", "did you mean node?"});
  refused_with("unit = \"SM lanes\"\n", "", {"'instruction of a lane' has no unit", "add unit = "});
  refused_with("low = 3.9", "low = -3.9", {line_of("low = 3.9"), "low of pj is negative"});
  refused_with("low = 3.9", "low = 39", {line_of("low = 3.9"), "pj is 39, 7.1, 10.2", "low may not exceed nominal"});
  refused_with("low = 3.9", "low = \"3.9\"", {line_of("low = 3.9"), "low of pj is not a number"});
  refused_with("low = 3.9", "low = nan", {"low of pj is not a number"});
  refused_with("low = 3.9, ", "", {line_of("low = 3.9"), "has no low"});
  refused_with("pj = { low = 3.9, nominal = 7.1, high = 10.2 }", "pj = 7.1", {"pj is not a range"});
  refused_with("node = \"12 nm\"\npj", "node = \"13 nm\"\npj", {"there is no node '13 nm'", "did you mean 12 nm?"});
  refused_with("tgc.entries", "tgc.entires", {line_of("tgc.entries"), "nothing counts 'tgc.entires'", "tgc.entries"});
  refused_with("tgc.entries", "tgc.primitives_per_flush", {"neither a counter nor a number"});
  refused_with("l2.color_bytes_read / 32", "l2.color_bytes_read / tc.bins", {"divides by a name"});
  refused_with("l2.color_bytes_read / 32", "l2.color_bytes_read / 0", {"'0' in a count is no number above 0"});
  refused_with("l2.color_bytes_read / 32", "l2.color_bytes_read /", {"lacks a factor"});
  refused_with("name = \"operands of a merge\"", "name = \"operands of a lane\"", {"there are two"});
  refused_with("vrpipe.energies/1", "vrpipe.energies/9", {"schema is not vrpipe.energies/1"});
  refused_with("[[event]]", "[event", {"e.toml line", "--toml"});
  refused_with("cycles = [\"sm.fragments.core_cycles\"", "count = \"1\"\ncycles = [\"sm.fragments.core_cycles\"",
               {"'active SM' has a count and cycles"});
  refused_with("cycles = [\"sm.fragments.core_cycles\"", "cycles = [\"sm.fragments.core_cycle\"",
               {"nothing counts 'sm.fragments.core_cycle'", "did you mean sm.fragments.core_cycles?"});
  refused_with("[[other_process.node]]\nname = \"22 nm\"", "[[other_process.node]]\nname = \"23 nm\"",
               {line_of("[[other_process]]"), "'4N' has no node '22 nm'", "[[other_process.node]]"});
  refused_with("platforms = [\"gh100-gpc\"]\nleaves_out", "platforms = []\nleaves_out", {"'4N' has no platform"});
}

TEST_F(EnergiesFile, IsReadBeforeAnythingElseIsDone) {
  refused({"run", "--scene", "tiny.spl", "--energies", "missing.toml"}, {"cannot read energies", "missing.toml"});
  refused({"run", "--scene", "tiny.spl", "--energies", "a", "--energies", "b"}, {"--energies"});
  write("e.toml", tools::shipped_energies_text());
  refused({"run", "--scene", "tiny.spl", "--energies", "e.toml", "--json", "e.toml"}, {"is the same file"});
  refused({"compare", "--views", "2", "--energy", "--scene", "builtin:object"}, {"--energy", "--views"});
}

TEST_F(EnergiesFile, TheShippedTableIsPrintedAsAFileThatGivesTheSame) {
  const Finished printed = vrpipe({"energies", "--toml"});
  EXPECT_EQ(printed.code, 0) << printed.err;
  EXPECT_EQ(printed.out, tools::shipped_energies_text());
  write("e.toml", printed.out);
  const std::vector<std::string> run{"run", "--scene", "tiny.spl", "--fidelity", "lt"};
  const auto energy = [&](std::vector<std::string> options) {
    options.insert(options.begin(), run.begin(), run.end());
    return json_of(options)["runs"][0].value("energy", json());
  };
  EXPECT_EQ(energy({"--energy"}), energy({"--energies", "e.toml"}));
  EXPECT_TRUE(energy({}).is_null()) << "only where it is asked for";
  EXPECT_EQ(json_of({"energies"}), json_of({"energies", "e.toml"}));
  const std::string listed = vrpipe({"energies", "e.toml"}).out;
  EXPECT_NE(listed.find("DRAM: row activated"), std::string::npos);
  EXPECT_LT(std::count(listed.begin(), listed.end(), '\n'),
            3 * static_cast<long>(json_of({"energies"})["events"].size()));
}

TEST_F(EnergiesFile, ATableOfOnesOwnCountsWhatItNames) {
  write("e.toml", one_event_energies("mine", R"(["2 * quads_blended", "fragments_pruned / 4"])",
                                     "{ low = 1, nominal = 2, high = 3 }"));
  const json result = json_of({"compare", "--scene", "tiny.spl", "--fidelity", "lt", "--energies", "e.toml"});
  for (const json& run : result["runs"]) {
    const double count =
        2 * run["counts"]["quads_blended"].get<double>() + run["counts"]["fragments_pruned"].get<double>() / 4;
    EXPECT_EQ(run["energy"]["events"][0]["count"], count);
    EXPECT_DOUBLE_EQ(run["energy"]["total_millijoules"]["nominal"].get<double>(), count * 2e-9);
    EXPECT_DOUBLE_EQ(run["energy"]["constant_millijoules"]["high"].get<double>(), 0);
    const double ratio = result["runs"][0]["energy"]["events"][0]["count"].get<double>() / count;
    for (const char* end : {"low", "nominal", "high"}) {
      EXPECT_DOUBLE_EQ(run["energy"]["ratio_over_baseline"][end].get<double>(), ratio);
    }
  }
}

TEST_F(EnergiesFile, TheReportSaysWhatIsKnownAndWhatThePaperMeasured) {
  const std::string compared = vrpipe({"compare", "--scene", "tiny.spl", "--energy"}).out;
  for (const char* text :
       {"\nenergy, mJ", "SM lanes", "all that moves", "constant power x time", "efficiency over baseline",
        "1.00 to 1.00x", "TGC and QRU, % of the total", "1.65x", "2.15x", "another method"}) {
    EXPECT_NE(compared.find(text), std::string::npos) << text;
  }
  const std::string untimed = vrpipe({"run", "--scene", "tiny.spl", "--energy", "--fidelity", "functional"}).out;
  EXPECT_NE(untimed.find("constant power is unknown, since there is no time"), std::string::npos) << untimed;
  EXPECT_EQ(untimed.find("efficiency"), std::string::npos);
  const std::string elsewhere = vrpipe({"run", "--scene", "tiny.spl", "--energy", "--platform", "mobile"}).out;
  EXPECT_NE(elsewhere.find("was not found for mobile"), std::string::npos) << elsewhere;
  EXPECT_EQ(vrpipe({"compare", "--scene", "tiny.spl"}).out.find("energy"), std::string::npos);
}

}  // namespace
}  // namespace vrpipe::testing
