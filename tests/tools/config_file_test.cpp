// Configuration files: what they say, what the command line says instead, and what --print-config writes.
#include "tool_test_support.h"

#include <array>
#include <regex>
#include <sstream>

#include "jobs/toml_text.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

class ConfigFile : public ToolTest {
 protected:
  json with(const std::string& config, const std::string& command, std::vector<std::string> options = {}) const {
    write("config.toml", config);
    options.insert(options.begin(), {command, "--config", "config.toml"});
    return json_of(std::move(options));
  }
  std::string printed(std::vector<std::string> options) const {
    options.emplace_back("--print-config");
    const Finished finished = vrpipe(std::move(options));
    EXPECT_EQ(finished.code, 0) << finished.err;
    return finished.out;
  }
  void bad(const std::string& config, const std::vector<std::string>& parts) const {
    SCOPED_TRACE(config);
    write("config.toml", config);
    refused({"compare", "--config", "config.toml", "--output", "images"}, parts);
  }
};

/// What does not depend on how it was asked for, nor on the host.
json comparable(json result) {
  for (const char* key : {"command", "config", "host"}) result.erase(key);
  result["platform"].erase("origins");
  for (json& run : result["runs"]) {
    for (const char* key : {"host_seconds", "cpu_seconds"}) run.erase(key);
  }
  return result;
}

TEST_F(ConfigFile, SaysWhatTheCommandLineCan) {
  const json by_file = with(R"(
scene = "tiny.spl"
platform = "mobile"
fidelity = "lt"
format = "rgba8"
termination = "strict"
effects = "all"
variant = ["baseline", "mine"]
relative-to = "mine"
background = [0.5, 1, 0]
jobs = 1

[variants.mine]
base = "het+qm"
unit.qru = "pass-through"
set.tgc.bins = 9

[set]
tc.bins = 5
crop.cache_bytes = "8K"
crop.forwarding = false

[unit]
l2 = "fixed-latency"
)",
                            "compare");
  const json by_words = json_of({"compare",
                                 "--scene",
                                 "tiny.spl",
                                 "--platform",
                                 "mobile",
                                 "--fidelity",
                                 "lt",
                                 "--format",
                                 "rgba8",
                                 "--termination",
                                 "strict",
                                 "--effects",
                                 "all",
                                 "--variant",
                                 "baseline",
                                 "--variant",
                                 "mine=het+qm,qru=pass-through,tgc.bins=9",
                                 "--relative-to",
                                 "mine",
                                 "--jobs",
                                 "1",
                                 "--set",
                                 "tc.bins=5",
                                 "--set",
                                 "crop.cache_bytes=8K",
                                 "--set",
                                 "crop.forwarding=off",
                                 "--unit",
                                 "l2=fixed-latency"});
  EXPECT_EQ(comparable(by_file), comparable(by_words));
  EXPECT_EQ(by_file["config"], "config.toml");
  EXPECT_EQ(by_file["platform"]["origins"]["tc.bins"], "file");
}

TEST_F(ConfigFile, GivesWayToTheCommandLineKeyByKey) {
  const json result = with("scene = \"nowhere.ply\"\nfidelity = \"lt\"\n[set]\ntc.bins = 5\ntc.bin_quads = 16\n", "run",
                           {"--scene", "tiny.spl", "--set", "tc.bins=6"});
  EXPECT_EQ(result["fidelity"], "lt");
  EXPECT_EQ(result["platform"]["parameters"]["tc.bins"], 6);
  EXPECT_EQ(result["platform"]["parameters"]["tc.bin_quads"], 16);
  EXPECT_EQ(result["platform"]["origins"]["tc.bins"], "command line");
  EXPECT_EQ(result["platform"]["origins"]["tc.bin_quads"], "file");
}

TEST_F(ConfigFile, IsCheckedWhereTheCommandLineSaysOtherwise) {
  for (const auto& [line, option, value] :
       std::vector<std::array<const char*, 3>>{{"fidelity = \"bogus\"", "--fidelity", "lt"},
                                               {"platform = \"bogus\"", "--platform", "mobile"},
                                               {"size = 3", "--size", "32x32"},
                                               {"fovy = nan", "--fovy", "40"},
                                               {"fovy = 500", "--fovy", "40"},
                                               {"orthographic = 0", "--orthographic", "3"},
                                               {"error = 0", "--error", "2%"},
                                               {"seed = 0", "--seed", "3"},
                                               {"variants.a = { base = \"het\", set.tc.bins = 0 }", "--variant",
                                                "a=het"},
                                               {"variant = \"a=het,qru=bogus\"", "--variant", "het"},
                                               {"eye = [0, 1]", "--eye", "0,0,-4"},
                                               {"variant = \"hat\"", "--variant", "het"},
                                               {"format = \"rgb\"", "--format", "rgba8"},
                                               {"termination = \"late\"", "--termination", "strict"},
                                               {"effects = \"alll\"", "--effects", "auto"},
                                               {"background = \"2,0,0\"", "--background", "0,0,0"},
                                               {"multi-pass = 0", "--multi-pass", "2"},
                                               {"views = \"some\"", "--views", "2"},
                                               {"jobs = 0", "--jobs", "1"},
                                               {"interval = 0", "--interval", "100"},
                                               {"set.tc.bins = 0", "--set", "tc.bins=3"},
                                               {"set.tc.binz = 1", "--set", "tc.binz=3"},
                                               {"unit.qru = \"bogus\"", "--unit", "qru=pairing"}}) {
    SCOPED_TRACE(line);
    write("config.toml", "\n" + std::string(line) + "\n");
    refused({"compare", "--config", "config.toml", option, value}, {"config.toml:2, "});
  }
  // A mistake of the command line is not the file's.
  write("config.toml", "size = \"32x32\"\n");
  EXPECT_EQ(vrpipe({"run", "--config", "config.toml", "--size", "3"}).err.find("config.toml"), std::string::npos);
}

TEST_F(ConfigFile, DefinesVariantsThatStandBesideTheFourInItsOrder) {
  const json result =
      with("scene = \"tiny.spl\"\n[variants.z]\nbase = \"qm\"\n[variants.a]\nbase = \"z\"\n", "compare");
  std::vector<std::string> names;
  for (const json& run : result["runs"]) names.push_back(run["variant"]);
  EXPECT_EQ(names, (std::vector<std::string>{"baseline", "qm", "het", "het+qm", "z", "a"}));
  EXPECT_EQ(result["runs"][5]["result_hash"], result["runs"][1]["result_hash"]);
}

TEST_F(ConfigFile, DefinesVariantsThatNameUnitsOfGpcsOfTheirOwn) {
  const json result = with(
      "scene = \"tiny.spl\"\nvariant = \"two\"\n[set]\ntc.bins = 7\n"
      "[variants.two]\nbase = \"qm\"\nset.platform.gpcs = 2\nunit.\"gpc1.qru\" = \"pass-through\"\n",
      "run");
  EXPECT_EQ(result["platform"]["parameters"]["platform.gpcs"], 2);
}

TEST_F(ConfigFile, DefinesVariantsInAnyOrder) {
  const json result = with(
      "scene = \"tiny.spl\"\nvariant = [\"a\", \"b\"]\n[variants.a]\nbase = \"b\"\nset.tgc.bins = 4\n"
      "[variants.b]\nbase = \"c\"\nset.tc.bins = 3\n",
      "compare", {"--variant", "a", "--variant", "b", "--variant", "c=qm"});
  EXPECT_EQ(result["runs"][0]["changes"]["base"], "b");
  EXPECT_EQ(result["runs"][0]["changes"]["set"], json({{"tc.bins", "3"}, {"tgc.bins", "4"}}));
}

TEST_F(ConfigFile, MayBeOverruledInWhatItDefines) {
  const json result = with("scene = \"tiny.spl\"\n[variants.a]\nbase = \"qm\"\nset.tc.bins = 3\n", "compare",
                           {"--variant", "a=het,tc.bins=4"});
  EXPECT_EQ(result["runs"][0]["changes"]["base"], "het");
}

TEST_F(ConfigFile, NamesFilesFromWhereItStands) {
  std::filesystem::create_directory(folder() / "study");
  std::filesystem::rename(folder() / "tiny.spl", folder() / "study" / "tiny.spl");
  write("study/config.toml", "scene = \"tiny.spl\"\noutput = \"images\"\nfidelity = \"functional\"\n");
  const Finished finished = vrpipe({"run", "--config", "study/config.toml"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_TRUE(std::filesystem::exists(folder() / "study" / "images" / "tiny-het+qm.png"));
}

TEST_F(ConfigFile, PrintedReadsBackToTheSameRunAndTheSameFile) {
  write("some.toml",
        "scene = \"tiny.spl\"\n[variants.own]\nbase = \"het\"\n[variants.own.set]\ntc.bins = 3\n"
        "crop.forwarding = false\n[set]\nzrop.cache_bytes = \"4K\"\n");
  write("frame.json", R"({"commands": [{"draw": "tiny.spl"}]})");
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"run", "--scene", "tiny.spl", "--set", "state.termination_threshold=0.75", "--set",
            "crop.latency_cycles=9"},
           {"compare", "--config", "some.toml", "--set", "tc.bins=11", "--termination", "strict"},
           {"compare", "--scene", "tiny.spl", "--platform", "mobile", "--variant", "baseline", "--variant",
            "x=het+qm,qru=pass-through,state.pruning_threshold=1e-5"},
           {"compare", "--scene", "tiny.spl", "--platform", "mobile", "--platform", "desktop", "--set", "tc.bins=4"},
           {"run", "--scene", "tiny.spl", "--variant", "mine=het,tc.bins=7", "--set", "tc.bins=1"},
           {"compare", "--scene", "tiny.spl", "--variant", "mine=het,tc.bins=7", "--variant", "baseline", "--set",
            "tc.bins=1"},
           {"run", "--scene", "tiny.spl", "--set", "gpc0.tc.bins=9", "--set", "tc.bins=5"},
           // Units of variants have parameters of their own, and other defaults.
           {"run", "--scene", "tiny.spl", "--variant", "in-shader", "--set", "crop.lock_clock_mhz=1980", "--set",
            "gpc0.crop.warps=16", "--set", "crop.latency_cycles=9"},
           {"compare", "--scene", "tiny.spl", "--platform", "mobile", "--platform", "desktop", "--variant",
            "mine=in-shader,crop.hand_over_cycles=900", "--variant", "in-shader-no-lock", "--set",
            "gpc0.crop.blend_cycles=70", "--set", "link.gpc0.tc.bins.depth=3"},
           {"compare", "--scene", "tiny.spl", "--variant", "baseline", "--variant", "lpddr5=het+qm,dram=lpddr5-6400",
            "--set", "dram.channels=4"},
           {"run", "--frame", "frame.json", "--fidelity", "lt"},
           {"compare", "--frame", "frame.json", "--set", "tc.bins=3"},
           {"microbench", "kill-rate", "--fidelity", "bound", "--set", "tc.bins=9"},
           {"reproduce", "--quick", "--size", "64x48", "--set", "tc.bins=9"},
           {"accuracy", "--config", "some.toml", "--quick", "--platform", "desktop"}}) {
    const std::string text = printed(command);
    SCOPED_TRACE(text);
    write("printed.toml", text);
    const auto without_comments = [](const std::string& of) {
      return std::regex_replace(of, std::regex(" *#[^\n]*"), "");
    };
    // As its first line says.
    std::vector<std::string> again_words;
    std::istringstream says(
        text.substr(text.find("vrpipe ") + 7, text.find(" --config THIS_FILE") - text.find("vrpipe ") - 7));
    for (std::string word; says >> word;) again_words.push_back(word);
    again_words.insert(again_words.end(), {"--config", "printed.toml"});
    EXPECT_EQ(without_comments(printed(again_words)), without_comments(text));
    if (command[0] != "run" && command[0] != "compare") continue;
    const json first = json_of(command), again = json_of(again_words);
    EXPECT_EQ(comparable(first), comparable(again));
  }
}

// Defaults of a scene may be others in a later version.
TEST_F(ConfigFile, PrintedHasTheCameraOfTheScene) {
  std::filesystem::copy_file(VRPIPE_FORMATS "/sh0.ply", folder() / "small.ply");
  for (const std::vector<std::string>& scene :
       std::vector<std::vector<std::string>>{{"--scene", "builtin:object", "--size", "48x32", "--set",
                                              "preprocess.sh_degree=0"},
                                             {"--scene", "small.ply", "--fovy", "30"},
                                             {"--scene", "train=small.ply", "--size", "48x32"},
                                             {"--scene", "small.ply", "--size", "48x32", "--orthographic", "3"}}) {
    std::vector<std::string> command{"run", "--fidelity", "lt"};
    command.insert(command.end(), scene.begin(), scene.end());
    const std::string text = printed(command);
    SCOPED_TRACE(text);
    for (const char* option : {"size", "eye", "look-at", "up"})
      EXPECT_NE(text.find(std::string("\n") + option + " = "), std::string::npos) << option;
    write("printed.toml", text);
    const json first = json_of(command), again = json_of({"run", "--config", "printed.toml"});
    EXPECT_EQ(comparable(first), comparable(again));
    EXPECT_FALSE(first["camera"].is_null());
  }
  EXPECT_NE(printed({"run", "--scene", "builtin:train"}).find("\nsize = \"980x545\" "), std::string::npos);
  EXPECT_EQ(printed({"run", "--scene", "tiny.spl"}).find("\nsize = "), std::string::npos) << "it has no other";
}

TEST_F(ConfigFile, PrintedHasEveryParameterAndItsOrigin) {
  write("config.toml", "scene = \"tiny.spl\"\nplatform = \"mobile\"\n[set]\ntc.bin_quads = 16\n");
  const std::string text = printed({"run", "--config", "config.toml", "--set", "tgc.bins=7"});
  const auto line = [&](const std::string& key) {
    std::smatch found;
    EXPECT_TRUE(std::regex_search(text, found, std::regex("\n(" + key + " = [^\n]*)"))) << key << "\n" << text;
    return std::regex_replace(found[1].str(), std::regex(" +"), " ");
  };
  EXPECT_EQ(line("tc.bin_quads"), "tc.bin_quads = 16 # config.toml");
  EXPECT_EQ(line("tgc.bins"), "tgc.bins = 7 # command line");
  EXPECT_EQ(line("fidelity"), "fidelity = \"cycle\" # default");
  EXPECT_EQ(line("platform"), "platform = \"mobile\" # config.toml");
  EXPECT_EQ(line("sm.cores"), "sm.cores = 4 # platform");
  const json result = json_of({"run", "--config", "config.toml", "--set", "tgc.bins=7"});
  for (const auto& [name, value] : result["platform"]["parameters"].items()) line(name);
  EXPECT_EQ(files(), (std::vector<std::string>{"config.toml", "tiny.spl"})) << "nothing is simulated";
}

TEST_F(ConfigFile, PrintedHasWhatRunsDifferInAsComments) {
  const std::string text =
      printed({"compare", "--scene", "tiny.spl", "--variant", "baseline", "--variant", "x=qm,dram=lpddr5-6400"});
  const std::size_t of_baseline = text.find("\n# baseline has these, of its own\n");
  const std::size_t of_x = text.find("\n# x has these, of its own\n");
  ASSERT_LT(of_baseline, of_x);
  ASSERT_LT(of_x, text.size());
  EXPECT_LT(text.find("\ndram.channels = "), of_baseline);
  EXPECT_EQ(text.find("\ndram.banks = "), std::string::npos);
  const std::size_t eight = text.find("\n# dram.banks = 8 ");
  EXPECT_LT(of_baseline, eight);
  EXPECT_LT(eight, of_x);
  EXPECT_LT(of_x, text.find("\n# dram.banks = 16 "));
  EXPECT_EQ(text.find("crop.latency_cycles", of_baseline), std::string::npos);
}

TEST_F(ConfigFile, ThatSaysWhatIsSoAnywayChangesNothingInTheReport) {
  const json result = with("scene = \"tiny.spl\"\n[set]\ntc.bins = 32\ntc.bin_quads = 16\n", "run");
  EXPECT_EQ(result["platform"]["origins"]["tc.bins"], "default");
  const Finished finished = vrpipe({"run", "--config", "config.toml"});
  EXPECT_NE(finished.out.find("tc.bin_quads=16"), std::string::npos);
  EXPECT_EQ(finished.out.find("tc.bins="), std::string::npos);
}

TEST_F(ConfigFile, ThatCannotBeUsedIsRefusedWithItsLine) {
  bad("sise = \"32x32\"\n", {"unknown key 'sise'", "config.toml:1", "did you mean size"});
  bad("scene = \"tiny.spl\"\n\nsize = \"32\"\n", {"config.toml:3", "--size", "WIDTHxHEIGHT"});
  bad("fidelity = \"lt\"\nscene = \"nowhere.ply\"\n", {"cannot read scene (config.toml:2, nowhere.ply)"});
  bad("fidelity = \"lt\"\nscene = \"train=nowhere.ply\"\n", {"cannot read scene (config.toml:2, nowhere.ply)"});
  bad("scene = \"builtin:nowhere\"\n", {"config.toml:1, builtin:nowhere"});
  bad("\nmesh = [\n  \"nowhere.obj\"]\n", {"cannot read mesh (config.toml:3, nowhere.obj)"});
  bad("[set]\n\ntc.bin = 4\n", {"'bin'", "config.toml:3", "tc.bins"});
  bad("[set]\ntc.bins = 0\n", {"config.toml:2", "tc.bins"});
  bad("[set]\n\ntc = 3\n", {"'tc'", "config.toml:3", "no UNIT.PARAMETER"});
  bad("[set]\ntc.bins = true\n", {"bad value 'true' (config.toml:2, tc.bins)"});
  bad("[set]\nnowhere.bins = 1\n", {"config.toml:2", "nowhere"});
  bad("[unit]\nqru = \"nothing\"\n", {"config.toml:2", "nothing"});
  bad("[variants.a]\nbase = \"hat\"\n", {"config.toml:", "'hat'", "did you mean het"});
  bad("[variants.a]\nbsae = \"het\"\n", {"config.toml:2", "'bsae'", "did you mean base"});
  bad("[variants.a]\nset.tc.bins = 1\n", {"config.toml:", "has no base"});
  bad("[variants.a]\nbase = \"het\"\nset.tc.bin = 1\n", {"config.toml:3", "'bin'"});
  bad("[variants.a]\nbase = \"b\"\n[variants.b]\nbase = \"a\"\n", {"config.toml:", "based on itself: a on b on a"});
  bad("[variants.a]\nbase = \"a\"\n", {"config.toml:1", "based on itself: a on a"});
  bad("variants = 3\n", {"config.toml:1", "table"});
  bad("explain-effects = 3\n", {"config.toml:1", "true or false"});
  bad("fidelity = 2020-01-01\n", {"config.toml:1", "fidelity"});
  bad("fidelity = \"lt\"\nfidelity = \"at\"\n", {"config.toml:2", "cannot read configuration"});
  bad("fidelity = lt\n", {"config.toml:1"});
  bad("config = \"other.toml\"\n", {"unknown key 'config'"});
  bad("\xff = 1\n", {"config.toml:1"});
  std::string deep = "a";
  for (int part = 0; part < 50000; ++part) deep += ".a";
  bad("\n" + deep + " = 1\n", {"config.toml:2", "more than 64 parts"});
  bad("[" + deep + "]\n", {"config.toml:1", "more than 64 parts"});
  bad("set = { " + deep + " = 1 }\n", {"config.toml:1", "more than 64 parts"});
  refused({"run", "--config", "nowhere.toml"}, {"nowhere.toml", "no such file"});
  refused({"run", "--config", "."}, {"cannot read configuration (--config .): it is a directory"});
  refused({"units", "--config", "config.toml"}, {"--config"});
}

TEST(TomlKeys, DotsOfNumbersTextsAndCommentsAreNoPartsOfAKey) {
  const std::string dots(200, '.');
  std::string numbers = "a = [";
  for (int i = 0; i < 200; ++i) numbers += "0.5, ";
  for (const std::string& text : {"a = \"" + dots + "\"\n", "a = '" + dots + "'\n", "# " + dots + "\n", numbers + "]\n",
                                  "a = \"\"\"\n" + dots + "\n\"" + dots + "\"\"\"\n", "\"\\\"" + dots + "\" = 1\n"}) {
    EXPECT_EQ(tools::line_of_too_deep_a_key(text), 0U) << text;
  }
  std::string key = "a";
  for (int part = 1; part < 64; ++part) key += " . 'b.'";
  EXPECT_EQ(tools::line_of_too_deep_a_key(key + " = 1\n"), 0U);
  EXPECT_EQ(tools::line_of_too_deep_a_key("a = 1\n\n" + key + ".c = 1\n"), 3U);
}

}  // namespace
}  // namespace vrpipe::testing
