// Variants and platforms of the user's own, side by side in one comparison.
#include "tool_test_support.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

class Variants : public ToolTest {
 protected:
  json compare(std::vector<std::string> options) const {
    options.insert(options.begin(), {"compare", "--scene", "tiny.spl"});
    return json_of(std::move(options));
  }
};

std::vector<std::string> names(const json& result) {
  std::vector<std::string> all;
  for (const json& run : result["runs"]) all.push_back(run["name"]);
  return all;
}

TEST_F(Variants, OfTheUserRunAsTheirBaseWithItsChangesSetDoes) {
  const json own = compare({"--variant", "mine=het+qm,qru=pass-through,tc.bins=3"});
  const json set = json_of(
      {"run", "--scene", "tiny.spl", "--variant", "het+qm", "--unit", "qru=pass-through", "--set", "tc.bins=3"});
  ASSERT_EQ(own["runs"].size(), 1U);
  EXPECT_EQ(own["runs"][0]["result_hash"], set["runs"][0]["result_hash"]);
  EXPECT_EQ(own["runs"][0]["implementations"]["qru"], "pass-through");
  EXPECT_EQ(own["runs"][0]["variant"], "mine");
  EXPECT_EQ(own["runs"][0]["changes"],
            json({{"base", "het+qm"}, {"unit", {{"qru", "pass-through"}}}, {"set", {{"tc.bins", "3"}}}}));
}

TEST_F(Variants, AreComparedInTheOrderGiven) {
  const json result = compare({"--variant", "het+qm", "--variant", "small=het+qm,tc.bins=2", "--variant", "baseline"});
  EXPECT_EQ(names(result), (std::vector<std::string>{"het+qm", "small", "baseline"}));
  EXPECT_EQ(result["relative_to"], "het+qm");
  EXPECT_EQ(result["speedup"].size(), 2U);
}

TEST_F(Variants, MayBeChangesOfOneAnother) {
  const json result =
      compare({"--variant", "qm", "--variant", "a=qm,tc.bins=2,tgc.bins=4", "--variant", "b=a,tc.bins=5"});
  EXPECT_EQ(result["runs"][1]["parameters"], json({{"tc.bins", 2}, {"tgc.bins", 4}}));
  EXPECT_EQ(result["runs"][2]["parameters"], json({{"tc.bins", 5}, {"tgc.bins", 4}}));
  EXPECT_EQ(result["runs"][2]["changes"]["base"], "a");
}

// The run's own come first: a variant's changes are what tells it from the others.
TEST_F(Variants, KeepTheirChangesWhateverIsSetForAll) {
  const json result = compare({"--set", "tc.bins=7", "--variant", "het+qm", "--variant", "small=het+qm,tc.bins=2"});
  EXPECT_EQ(result["platform"]["parameters"]["tc.bins"], 7);
  EXPECT_EQ(result["runs"][0]["parameters"].size(), 0U);
  EXPECT_EQ(result["runs"][1]["parameters"], json({{"tc.bins", 2}}));
}

TEST_F(Variants, WithAnotherUnitTakeOfWhatIsSetForAllWhatItDeclares) {
  const json result =
      compare({"--set", "qru.bin_quads=8", "--variant", "het+qm", "--variant", "none=het+qm,qru=pass-through"});
  EXPECT_EQ(result["platform"]["parameters"]["qru.bin_quads"], 8);
  refused({"compare", "--scene", "tiny.spl", "--set", "qru.bin_quad=8", "--variant", "none=het+qm,qru=pass-through"},
          {"bin_quad", "qru"});
}

TEST_F(Variants, OfSeveralPlatformsAreComparedInSimulatedTime) {
  const json result = compare({"--platform", "agx-orin-ideal-memory", "--platform", "mobile", "--variant", "baseline",
                               "--variant", "het+qm", "--relative-to", "mobile/baseline"});
  EXPECT_EQ(names(result), (std::vector<std::string>{"agx-orin-ideal-memory/baseline", "agx-orin-ideal-memory/het+qm",
                                                     "mobile/baseline", "mobile/het+qm"}));
  const json& orin = result["runs"][0];
  const json& mobile = result["runs"][2];
  EXPECT_EQ(orin["platform"], "agx-orin-ideal-memory");
  EXPECT_EQ(mobile["variant"], "baseline");
  const double milliseconds = mobile["milliseconds"].get<double>() / orin["milliseconds"].get<double>();
  EXPECT_NEAR(result["speedup"]["agx-orin-ideal-memory/baseline"].get<double>(), milliseconds, 1e-9);
  EXPECT_EQ(result["speedup"].count("mobile/baseline"), 0U);
  // Alone, each is the same.
  const json alone = json_of({"run", "--scene", "tiny.spl", "--platform", "mobile", "--variant", "het+qm"});
  EXPECT_EQ(result["runs"][3]["result_hash"], alone["runs"][0]["result_hash"]);
  for (const auto& [name, value] : alone["platform"]["parameters"].items()) {
    const json& own = result["runs"][3]["parameters"];
    EXPECT_EQ(own.contains(name) ? own[name] : result["platform"]["parameters"][name], value) << name;
  }
}

// A unit for all is taken by those that have none of their own in its place; of none there is no use.
TEST_F(Variants, KeepAUnitOfTheirOwn) {
  for (const char* slot : {"crop", "gpc0.crop"}) {
    const std::string unit = std::string(slot) + "=color-rop";
    refused({"run", "--scene", "tiny.spl", "--variant", "in-shader", "--unit", unit},
            {"--unit " + unit, "variant in-shader has a unit of its own in slot crop, in-shader"});
  }
  refused({"compare", "--scene", "tiny.spl", "--variant", "in-shader", "--variant", "own=in-shader", "--unit",
           "crop=color-rop"},
          {"--unit crop=color-rop", "a unit of its own in slot crop"});
  refused({"run", "--scene", "tiny.spl", "--variant", "own=het,tgc=pass-through", "--unit", "tgc=tile-grid-coalescing"},
          {"variant own has a unit of its own in slot tgc"});
  refused({"compare", "--scene", "tiny.spl", "--variant", "in-shader", "--variant", "software", "--unit",
           "crop=color-rop"},
          {"--unit crop=color-rop", "variant in-shader has a unit of its own in slot crop"});
  const std::vector<std::string> both{"compare",   "--scene",   "tiny.spl", "--variant",     "baseline",
                                      "--variant", "in-shader", "--unit",   "crop=color-rop"};
  const json result = json_of(both);
  EXPECT_EQ(result["runs"][0]["implementations"]["crop"], "color-rop");
  EXPECT_EQ(result["runs"][1]["implementations"]["crop"], "in-shader");
  EXPECT_NE(vrpipe(both).out.find("crop=color-rop (not in in-shader, with its own)"), std::string::npos);
  std::vector<std::string> on_a_page = both;
  on_a_page.insert(on_a_page.end(), {"--variant", "software", "--fidelity", "functional", "--html", "page.html"});
  EXPECT_EQ(vrpipe(on_a_page).code, 0);
  EXPECT_NE(read_file(folder() / "page.html")
                .find("crop = color-rop (not in in-shader, with its own; not in software, without crop)"),
            std::string::npos);
}

TEST_F(Variants, HaveImagesOfTheirOwn) {
  const Finished finished = vrpipe({"compare", "--scene", "tiny.spl", "--platform", "agx-orin", "--platform", "mobile",
                                    "--variant", "mine=het,tc.bins=2", "--fidelity", "functional", "--output", "out"});
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_EQ(files(), (std::vector<std::string>{"out", "out/tiny-agx-orin-mine.exr", "out/tiny-agx-orin-mine.png",
                                               "out/tiny-mobile-mine.exr", "out/tiny-mobile-mine.png", "tiny.spl"}));
}

TEST_F(Variants, AreSaidInTheReport) {
  const Finished finished = vrpipe({"compare", "--scene", "tiny.spl", "--variant", "baseline", "--variant",
                                    "small=het+qm,tgc.bins=64", "--variant", "het+qm", "--relative-to", "small"});
  EXPECT_NE(finished.out.find("small: het+qm with tgc.bins=64\n"), std::string::npos) << finished.out;
  EXPECT_NE(finished.out.find("speed-up over small"), std::string::npos);
  EXPECT_NE(finished.out.find("quad merging of het+qm adds 24.92 KB"), std::string::npos);
  EXPECT_NE(finished.out.find("quad merging of small adds"), std::string::npos);
}

TEST_F(Variants, OfManyViewsAreRelativeToAnyOfThem) {
  const json result =
      json_of({"compare", "--scene", "builtin:object", "--fovy", "5", "--size", "24x24", "--views", "2", "--fidelity",
               "lt", "--variant", "het", "--variant", "baseline", "--relative-to", "baseline"});
  EXPECT_EQ(result["relative_to"], "baseline");
  EXPECT_EQ(result["distribution"]["speedup"].size(), 1U);
  EXPECT_TRUE(result["distribution"]["speedup"].contains("het"));
}

TEST_F(Variants, ThatCannotBeAreRefused) {
  const auto bad = [&](const std::string& variant, const std::vector<std::string>& parts) {
    refused({"compare", "--scene", "tiny.spl", "--output", "images", "--variant", variant}, parts);
  };
  bad("mine", {"unknown variant 'mine'", "qm"});
  bad("mine=", {"NAME=BASE"});
  bad("mine=hat", {"unknown variant 'hat'", "--variant mine", "did you mean het"});
  bad("het=qm", {"'het'", "there is one of that name"});
  bad("a/b=qm", {"'a/b'", "letters, digits"});
  bad("-a=qm", {"'-a'"});
  bad("mine=qm,", {"''"});
  bad("mine=qm,tc.bins", {"'tc.bins'", "UNIT.PARAMETER=VALUE"});
  bad("mine=qm,tc.bins=2,tc.bins=3", {"'tc.bins' given twice", "--variant mine"});
  bad("mine=qm,qrru=fifo", {"unknown slot 'qrru'", "did you mean qru"});
  bad("mine=qm,qru=nothing", {"nothing", "pairing"});
  bad("mine=qm,tc.bin=2", {"'bin'", "tc.bins"});
  bad("mine=qm,tc.bins=0", {"tc.bins", "from 1 to"});
  bad("mine=qm,preprocess.sh_degree=1", {"preprocess.sh_degree", "--set"});
  refused({"compare", "--scene", "tiny.spl", "--variant", "qm", "--variant", "qm"}, {"'qm' given twice"});
  refused({"compare", "--scene", "tiny.spl", "--platform", "mobile", "--platform", "mobile"}, {"given twice"});
  refused({"compare", "--scene", "tiny.spl", "--relative-to", "hett"}, {"unknown run 'hett'", "did you mean het"});
  refused({"run", "--scene", "tiny.spl", "--variant", "qm", "--variant", "het"}, {"given twice"});
  refused({"run", "--scene", "tiny.spl", "--platform", "mobile", "--platform", "agx-orin-ideal-memory"},
          {"given twice"});
}

}  // namespace
}  // namespace vrpipe::testing
