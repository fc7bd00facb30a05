// `vrpipe sweep`: studies, their points, and how they go on.
#include "tool_test_support.h"

#include <sys/wait.h>

#include <chrono>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <thread>

#include <fmt/format.h>

#include "documented_keys.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;

const std::string small_sweep = "scene = \"tiny.spl\"\nfidelity = \"lt\"\n";

class Sweep : public ToolTest {
 protected:
  json sweep(const std::string& study, std::vector<std::string> options = {}) const {
    write("study.toml", study);
    options.insert(options.begin(), {"sweep", "study.toml"});
    return json_of(std::move(options));
  }
  void bad(const std::string& study, const std::vector<std::string>& parts,
           std::vector<std::string> options = {}) const {
    SCOPED_TRACE(study);
    write("study.toml", study);
    options.insert(options.begin(), {"sweep", "study.toml", "--csv", "out.csv"});
    refused(options, parts);
  }
};

std::vector<std::vector<json>> values(const json& result) {
  std::vector<std::vector<json>> all;
  for (const json& point : result["points"]) {
    all.emplace_back();
    for (const json& axis : result["axes"]) all.back().push_back(point[axis["name"].get<std::string>()]);
  }
  return all;
}

TEST_F(Sweep, RunsTheProductOfItsAxesTheLastFastest) {
  const json result =
      sweep(small_sweep + "[axes]\nvariant = [\"baseline\", \"het\"]\ntc.bins = { from = 8, to = 32, factor = 2 }\n");
  EXPECT_EQ(values(result),
            (std::vector<std::vector<json>>{
                {"baseline", 8}, {"baseline", 16}, {"baseline", 32}, {"het", 8}, {"het", 16}, {"het", 32}}));
  EXPECT_EQ(result["product"], 6);
}

// baseline's TGC passes through: it has no bins.
TEST_F(Sweep, HasOnePointWhereNoUnitDeclaresTheParameterOfAnAxis) {
  const json result = sweep(small_sweep + "[axes]\nvariant = [\"baseline\", \"qm\"]\ntgc.bins = [4, 64, 128]\n");
  EXPECT_EQ(values(result),
            (std::vector<std::vector<json>>{{"baseline", nullptr}, {"qm", 4}, {"qm", 64}, {"qm", 128}}));
  const double of_baseline = result["points"][0]["cycles"];
  for (const json& point : result["points"]) {
    ASSERT_TRUE(point["speedup"].is_number()) << "over baseline, which has one point: " << point;
    EXPECT_DOUBLE_EQ(point["speedup"], of_baseline / point["cycles"].get<double>());
  }
  for (const json& effect : result["effects"]) {
    if (effect["axis"] != "tgc.bins") continue;
    for (const json& value : effect["values"]) EXPECT_EQ(value["points"], 1) << value;
  }
  const json list = sweep(small_sweep +
                          "[[points]]\nvariant = \"baseline\"\ntgc.bins = 4\n"
                          "[[points]]\nvariant = \"baseline\"\ntgc.bins = 8\n"
                          "[[points]]\nvariant = \"qm\"\ntgc.bins = 8\n");
  EXPECT_EQ(values(list), (std::vector<std::vector<json>>{{"baseline", nullptr}, {"qm", 8}}));
}

// Found a month later, results say what they are of.
TEST_F(Sweep, SaysWhatAllPointsHaveInCommon) {
  const std::string study = "scene = \"tiny.spl\"\nformat = \"rgba8\"\n[set]\ntgc.bins = 9\n[axes]\ntc.bins = [4, 8]\n";
  write("study.toml", study);
  const Finished finished =
      vrpipe({"sweep", "study.toml", "--fidelity", "lt", "--jobs", "2", "--json", "s.json", "--html=s.html"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  const json result = json::parse(read_file(folder() / "s.json"));
  const json run = json_of({"run", "--scene", "tiny.spl", "--format", "rgba8", "--fidelity", "lt", "--variant",
                            result["variant"], "--set", "tgc.bins=9"});
  for (const char* key : {"name", "gaussians_total", "gaussians_visible", "width", "height"})
    EXPECT_EQ(result["scene"][key], run["scene"][key]) << key;
  for (const char* key : {"fidelity", "format", "termination", "passes", "version", "plugins"})
    EXPECT_EQ(result[key], run[key]) << key;
  EXPECT_EQ(result["platform"]["name"], run["platform"]["name"]);
  for (const auto& [name, value] : run["platform"]["parameters"].items()) {
    if (name == "tc.bins") continue;
    EXPECT_EQ(result["platform"]["parameters"][name], value) << name;
    const json origin = name == "tgc.bins" ? json("file") : run["platform"]["origins"][name];
    EXPECT_EQ(result["platform"]["origins"][name], origin) << name;
  }
  EXPECT_FALSE(result["platform"]["parameters"].contains("tc.bins")) << "points say it";
  EXPECT_EQ(result["config"], "study.toml");
  EXPECT_EQ(result["command"], json::array({"vrpipe", "sweep", "study.toml", "--fidelity", "lt"}))
      << "who simulates and writes it is not of the result";
  EXPECT_EQ(result["options"],
            json({{"scene", {"tiny.spl"}}, {"set", {"tgc.bins=9"}}, {"fidelity", {"lt"}}, {"format", {"rgba8"}}}));
  EXPECT_EQ(finished.out.find("tiny.spl, 48x40: 60 of 60 Gaussians visible\n"), 0U) << finished.out;
  EXPECT_NE(finished.out.find("\nlt fidelity, rgba8 colour, "), std::string::npos) << finished.out;
  EXPECT_NE(finished.out.find(", tgc.bins=9\n"), std::string::npos) << finished.out;
  const std::string page = read_file(folder() / "s.html");
  EXPECT_NE(page.find("<title>vrpipe sweep: study.toml</title>"), std::string::npos);
  for (const char* fact : {"tiny.spl, 48x40", "lt fidelity, rgba8 colour", "sweep study.toml --fidelity lt</code>"})
    EXPECT_NE(page.find(fact), std::string::npos) << fact;
}

TEST_F(Sweep, SaysOfWhatAxesSayNothingElse) {
  write("study.toml",
        "[axes]\nscene = [\"builtin:object\"]\nsize = [\"16x16\", \"24x16\"]\nplatform = [\"mobile\", \"desktop\"]\n"
        "fidelity = [\"functional\"]\nformat = [\"rgba8\"]\n");
  const std::string text = vrpipe({"sweep", "study.toml", "--json", "s.json"}).out;
  const json result = json::parse(read_file(folder() / "s.json"));
  for (const char* key : {"platform", "fidelity", "format"}) EXPECT_TRUE(result[key].is_null()) << key;
  EXPECT_TRUE(result["scene"]["width"].is_null());
  EXPECT_EQ(result["scene"]["name"], "builtin:object");
  EXPECT_GT(result["scene"]["gaussians_total"], 0);
  for (const char* platform : {"mobile (", "desktop ("}) EXPECT_NE(text.find(platform), std::string::npos) << text;
  for (const char* not_of_all : {"functional fidelity", "rgba8 colour"})
    EXPECT_EQ(text.find(not_of_all), std::string::npos) << text;
  EXPECT_EQ(text.find("speed-ups are over"), std::string::npos) << "nothing has time";
}

TEST_F(Sweep, SaysWhichAxesHaveNoEffect) {
  // Of a 48x40 image there are fewer tile grids than bins.
  const std::string axes = "[axes]\nvariant = [\"baseline\", \"qm\"]\ntgc.bins = [64, 128]\n";
  const json timed = sweep(small_sweep + axes);
  EXPECT_EQ(timed["without_effect"], json({{{"axis", "tgc.bins"}, {"on", "results"}}}));
  const std::string text = vrpipe({"sweep", "study.toml"}).out;
  EXPECT_NE(text.find("\ntgc.bins: no effect\n"), std::string::npos) << text;
  EXPECT_NE(text.find("\n3 points: 4 combinations, of which 1 is the same as another"), std::string::npos) << text;
  const std::string cycles = timed["points"][0]["cycles"].dump();
  ASSERT_GT(cycles.size(), 3U);
  EXPECT_NE(text.find(cycles.substr(0, cycles.size() - 3) + "," + cycles.substr(cycles.size() - 3)), std::string::npos)
      << text;
  const json untimed = sweep("scene = \"tiny.spl\"\nfidelity = \"functional\"\n" + axes);
  EXPECT_EQ(untimed["without_effect"], timed["without_effect"]);
  EXPECT_EQ(sweep(small_sweep + "[axes]\ncrop.bytes_per_cycle = [16, 64]\n")["without_effect"], json::array());
}

TEST_F(Sweep, ItsPageHasVariantsBySceneWithTheirGeometricMean) {
  write_draw_list(folder() / "other.spl", [] {
    Draw draw = tiny_draw();
    draw.splats.resize(20);
    return draw;
  }());
  const json result = sweep(
      "fidelity = \"lt\"\n[axes]\nscene = [\"tiny.spl\", \"other.spl\"]\n"
      "variant = [\"baseline\", \"qm\"]\n",
      {"--html", "s.html"});
  double product = 1;
  for (const json& point : result["points"]) {
    if (point["variant"] == "qm") product *= point["speedup"].get<double>();
  }
  const std::string page = read_file(folder() / "s.html");
  const std::size_t mean = page.find(">geometric mean</text>");
  ASSERT_NE(mean, std::string::npos);
  EXPECT_LT(page.find(">other.spl</text>"), mean);
  EXPECT_LT(mean, page.find(fmt::format("<title>qm: {:.3g}</title>", std::sqrt(product)), mean));
  EXPECT_NE(page.find(">simulated time, ms</text>"), std::string::npos) << "words, no keys";
}

TEST_F(Sweep, NamesThePointThatCannotBe) {
  bad(small_sweep + "[axes]\nvariant = [\"baseline\", \"qm\"]\ntgc.bins = [4, 0]\n",
      {"'0'", "study.toml:", "of the point variant=qm, tgc.bins=0", "give a whole number"});
  bad(small_sweep + "[axes]\nvariant = [\"baseline\", \"qm\"]\ntgc.binz = [4]\n",
      {"'binz'", "of the point variant=baseline, tgc.binz=4", "did you mean tgc.bins"});
}

TEST_F(Sweep, APointIsTheRunOfItsSettings) {
  const json result = sweep(small_sweep +
                            "[set]\ntgc.bins = 9\n[variants.mine]\nbase = \"het+qm\"\nunit.qru = \"pass-through\"\n"
                            "[axes]\nplatform = [\"mobile\", \"desktop\"]\nvariant = [\"mine\", \"qm\"]\n"
                            "format = [\"rgba8\"]\ntermination = [\"strict\"]\ntc.bins = [3, 5]\n");
  ASSERT_EQ(result["points"].size(), 8U);
  for (const json& point : result["points"]) {
    const std::string variant = point["variant"] == "mine" ? "mine=het+qm,qru=pass-through" : "qm";
    const json run = json_of({"run", "--scene", "tiny.spl", "--fidelity", "lt", "--platform", point["platform"],
                              "--variant", variant, "--format", "rgba8", "--termination", "strict", "--set",
                              "tgc.bins=9", "--set", "tc.bins=" + point["tc.bins"].dump()})["runs"][0];
    EXPECT_EQ(point["result_hash"], run["result_hash"]) << point;
    EXPECT_EQ(point["cycles"], run["cycles"]);
    EXPECT_EQ(point["counts.warps"], run["counts"]["warps"]);
    EXPECT_EQ(point["utilization.crop"], run["utilization"]["crop"]);
  }
}

TEST_F(Sweep, HasTheStatisticsThatItNamesAsColumns) {
  const json result =
      sweep(small_sweep +
            "columns = [\"crop.cache.sector_hits\", \"tc.quads_per_flush\", \"zrop.cache.sector_hits\"]\n"
            "pareto = [\"cycles\", \"-crop.cache.sector_hits\"]\n[axes]\nvariant = [\"baseline\", \"qm\"]\n");
  for (const json& point : result["points"]) {
    const json run =
        json_of({"run", "--scene", "tiny.spl", "--fidelity", "lt", "--variant", point["variant"]})["runs"][0];
    for (const char* column : {"crop.cache.sector_hits", "tc.quads_per_flush"}) {
      const auto found = std::find_if(run["statistics"].begin(), run["statistics"].end(),
                                      [&](const json& statistic) { return statistic["name"] == column; });
      ASSERT_NE(found, run["statistics"].end()) << column;
      EXPECT_EQ(point[column], (*found)["value"]) << column;
    }
    EXPECT_GT(point["crop.cache.sector_hits"], 0);
    EXPECT_TRUE(point["zrop.cache.sector_hits"].is_null()) << "the z-cache is bound to nothing";
  }
  EXPECT_EQ(result["pareto"][0]["metrics"].size(), 2U);
  bad(small_sweep + "columns = [\"crop.cache.sector_hit\"]\n[axes]\ntc.bins = [1, 2]\n",
      {"'crop.cache.sector_hit'", "did you mean crop.cache.sector_hits?"});
  bad(small_sweep + "columns = \"crop.quads_blended\"\n[axes]\ntc.bins = [1, 2]\n", {"'columns'", "no list"});
}

TEST_F(Sweep, MeasuresImagesAgainstTheExactOne) {
  const std::string study = small_sweep +
                            "columns = [\"image.psnr_db\", \"tc.flushes\", \"image.ssim\", \"image.max_abs_error\"]\n"
                            "[axes]\nformat = [\"rgba8\", \"rgba32f\"]\nstate.termination_threshold = [0.9, 0.999]\n";
  const json result = sweep(study);
  // The exact image: by another command.
  const json accuracy = json_of({"accuracy", "--scene", "tiny.spl", "--quick", "--fidelity", "lt", "--format", "rgba8",
                                 "--set", "state.termination_threshold=0.9"});
  for (const json& row : accuracy["precision"]) {
    if (!row["default"]) continue;
    EXPECT_EQ(result["points"][0]["image.psnr_db"], row["psnr_db"]);
  }
  for (const json& point : result["points"]) {
    EXPECT_GT(point["image.psnr_db"], 30);
    EXPECT_GT(point["image.ssim"], 0.9);
    EXPECT_LT(point["image.max_abs_error"], 0.1);
    EXPECT_GT(point["tc.flushes"], 0);
  }
  EXPECT_GT(result["points"][3]["image.psnr_db"], result["points"][1]["image.psnr_db"]) << "32 bits for 8";
  EXPECT_GT(result["points"][3]["image.psnr_db"], result["points"][2]["image.psnr_db"]) << "a threshold of 0.999";
  // Taken from the journal they are the same.
  for (const char* file : {"first.json", "second.json"}) {
    const Finished finished = vrpipe({"sweep", "study.toml", "--journal", "j", "--json", file});
    ASSERT_EQ(finished.code, 0) << finished.err;
    EXPECT_EQ(json::parse(read_file(folder() / file))["points"], result["points"]) << file;
  }
}

TEST_F(Sweep, DrawsScenesViewsAndSizes) {
  const json result = sweep("fidelity = \"functional\"\n[axes]\nscene = [\"builtin:object\", \"tiny.spl\"]\n");
  EXPECT_NE(result["points"][0]["result_hash"], result["points"][1]["result_hash"]);
  const json views = sweep(
      "fidelity = \"functional\"\nfovy = 20\n[axes]\nview = [0, 1, 2]\nsize = [\"16x16\", \"24x16\"]\n"
      "preprocess.sh_degree = [0, 3]\n");
  std::set<std::string> hashes;
  for (const json& point : views["points"]) hashes.insert(point["result_hash"]);
  EXPECT_EQ(hashes.size(), 12U);
  const json run = json_of(
      {"run", "--size", "24x16", "--fovy", "20", "--fidelity", "functional", "--set", "preprocess.sh_degree=0"});
  EXPECT_EQ(views["points"][2]["result_hash"], run["runs"][0]["result_hash"]);
}

TEST_F(Sweep, NamesScenesFromTheStudysFolder) {
  std::filesystem::create_directory(folder() / "study");
  std::filesystem::copy(folder() / "tiny.spl", folder() / "study" / "own.spl");
  write("study/s.toml", "fidelity = \"functional\"\n[axes]\nscene = [\"own.spl\"]\n");
  EXPECT_EQ(json_of({"sweep", "study/s.toml"})["points"][0]["scene"], "own.spl");
}

TEST_F(Sweep, TakesAListOfPoints) {
  const json result =
      sweep(small_sweep + "[[points]]\nvariant = \"qm\"\ntc.bins = 4\n[[points]]\nvariant = \"het\"\ntc.bins = 2\n");
  EXPECT_EQ(values(result), (std::vector<std::vector<json>>{{"qm", 4}, {"het", 2}}));
  EXPECT_EQ(result["product"], 0);
}

TEST_F(Sweep, TakesASampleThatItsSeedDecides) {
  const std::string axes =
      "[axes]\ntc.bins = { from = 1, to = 40, step = 1 }\ntgc.bins = { from = 1, to = 50, step = 1 }\n";
  const auto sample = [&](const std::string& keys) { return values(sweep(keys + small_sweep + axes)); };
  const auto first = sample("sample = 6\nseed = 1\n");
  EXPECT_EQ(first.size(), 6U);
  EXPECT_TRUE(std::is_sorted(first.begin(), first.end()));
  EXPECT_EQ(std::set(first.begin(), first.end()).size(), 6U);
  EXPECT_EQ(sample("sample = 6\nseed = 1\n"), first);
  EXPECT_NE(sample("sample = 6\nseed = 2\n"), first);
  EXPECT_EQ(sweep("sample = 4\n" + small_sweep + "[axes]\ntc.bins = [1, 2, 3, 4]\n")["points"].size(), 4U);
}

TEST_F(Sweep, SpeedUpsAreOverOnePointOfTheSameScene) {
  const std::string study =
      "fidelity = \"lt\"\nsize = \"24x24\"\nfovy = 10\n[axes]\nview = [0, 1]\n"
      "variant = [\"baseline\", \"het\"]\ntc.bins = [4, 32]\n";
  const json usual = sweep(study);
  for (std::size_t i = 0; i < 8; ++i) {
    const json& point = usual["points"][i];
    const json& reference = usual["points"][i < 4 ? 1 : 5];  // of the platform's own 32 bins
    EXPECT_DOUBLE_EQ(point["speedup"].get<double>(), reference["cycles"].get<double>() / point["cycles"].get<double>());
  }
  EXPECT_EQ(usual["relative_to"], "variant=baseline, tc.bins=32");
  const json named = sweep(study, {"--relative-to", "variant=het,tc.bins=32"});
  EXPECT_EQ(named["relative_to"], "variant=het, tc.bins=32");
  EXPECT_EQ(named["points"][3]["speedup"], 1.0);
  EXPECT_EQ(named["points"][7]["speedup"], 1.0);
}

TEST_F(Sweep, RanksAxesByHowMuchTheyMoveTime) {
  const json result = sweep(small_sweep + "[axes]\nl2.latency_cycles = [100, 101]\ncrop.bytes_per_cycle = [16, 64]\n");
  ASSERT_EQ(result["effects"].size(), 2U);
  EXPECT_EQ(result["effects"][0]["axis"], "crop.bytes_per_cycle");
  EXPECT_GT(result["effects"][0]["ratio"], result["effects"][1]["ratio"]);
  double product = 1;
  for (const json& point : result["points"]) {
    if (point["crop.bytes_per_cycle"] == 64) product *= point["speedup"].get<double>();
  }
  EXPECT_NEAR(result["effects"][0]["values"][1]["mean"].get<double>(), std::sqrt(product), 1e-12);
}

TEST_F(Sweep, MarksGpusThatNoOtherBeats) {
  const json result = sweep("pareto = [\"milliseconds\", \"quad_merging_storage_bytes\"]\n" + small_sweep +
                            "[axes]\nvariant = [\"baseline\", \"het+qm\"]\ntgc.bins = [16, 128]\n");
  std::map<std::string, bool> front;
  for (const json& gpu : result["pareto"]) {
    front[gpu["axes"]["variant"].get<std::string>() + gpu["axes"]["tgc.bins"].get<std::string>()] = gpu["on_front"];
    for (const json& other : result["pareto"]) {
      const bool beats = other["metrics"]["milliseconds"] < gpu["metrics"]["milliseconds"] &&
                         other["metrics"]["quad_merging_storage_bytes"] < gpu["metrics"]["quad_merging_storage_bytes"];
      EXPECT_FALSE(beats && gpu["on_front"]);
    }
  }
  EXPECT_EQ(front.size(), 3U) << "baseline has no bins";
  EXPECT_TRUE(std::any_of(front.begin(), front.end(), [](const auto& each) { return each.second; }));
}

TEST_F(Sweep, WritesTheSamePointsAsCsvAndJsonLines) {
  write("study.toml", small_sweep + "[axes]\nvariant = [\"baseline\", \"het\"]\ntc.bins = [3]\n");
  const Finished finished =
      vrpipe({"sweep", "study.toml", "--csv", "s.csv", "--jsonl", "s.jsonl", "--html", "s.html", "--json", "s.json"});
  ASSERT_EQ(finished.code, 0) << finished.err;
  const json result = json::parse(read_file(folder() / "s.json"));
  std::istringstream lines(read_file(folder() / "s.jsonl")), rows(read_file(folder() / "s.csv"));
  std::string header, row;
  std::getline(rows, header);
  for (const json& point : result["points"]) {
    std::string line;
    std::getline(lines, line);
    EXPECT_EQ(json::parse(line), point);
    std::getline(rows, row);
    std::istringstream names(header), cells(row);
    for (std::string name, cell; std::getline(names, name, ',') && std::getline(cells, cell, ',');) {
      if (!name.empty() && name.back() == '\r') continue;
      const json& value = point[name];
      EXPECT_EQ(cell, value.is_null() ? "" : value.is_string() ? value.get<std::string>() : value.dump()) << name;
    }
  }
  const std::string page = read_file(folder() / "s.html");
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_EQ(page.find("http://"), page.find("http://www.w3.org/2000/svg"));
  EXPECT_EQ(page.find("nan"), std::string::npos);
}

TEST_F(Sweep, KilledAtAnyMomentEndsWithTheSameBytes) {
  write("study.toml",
        "fidelity = \"lt\"\nsize = \"64x64\"\nfovy = 5\n[axes]\nview = [0, 1]\n"
        "variant = [\"baseline\", \"het+qm\"]\ntc.bins = [4, 32]\n");
  const std::vector<std::string> outputs{"--csv",  "s.csv",  "--jsonl", "s.jsonl",
                                         "--html", "s.html", "--json",  "s.json"};
  std::vector<std::string> command{"sweep", "study.toml"};
  command.insert(command.end(), outputs.begin(), outputs.end());
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(vrpipe(command).code, 0);
  const auto duration = std::chrono::steady_clock::now() - start;
  std::map<std::string, std::string> undisturbed;
  for (const char* file : {"s.csv", "s.jsonl", "s.html", "s.json"}) {
    undisturbed[file] = read_file(folder() / file);
    std::filesystem::remove(folder() / file);
  }
  command.insert(command.end(), {"--journal", "j.jsonl"});
  for (const int tenths : {4, 6, 8}) {
    const pid_t process = ::fork();
    if (process == 0) {
      std::filesystem::current_path(folder());
      std::vector<char*> argv;
      std::vector<std::string> words = command;
      words.insert(words.begin(), VRPIPE_BINARY);
      for (std::string& word : words) argv.push_back(word.data());
      argv.push_back(nullptr);
      ::close(1);
      ::close(2);
      ::execv(VRPIPE_BINARY, argv.data());
      ::_exit(1);
    }
    std::this_thread::sleep_for(duration * tenths / 10);
    ::kill(process, SIGKILL);
    ::waitpid(process, nullptr, 0);
  }
  ASSERT_EQ(vrpipe(command).code, 0);
  for (const auto& [file, bytes] : undisturbed) EXPECT_EQ(read_file(folder() / file), bytes) << file;
}

TEST_F(Sweep, InShardsIsTheSameAsAlone) {
  const std::string study = small_sweep + "[axes]\nvariant = [\"baseline\", \"qm\", \"het\"]\ntc.bins = [4, 32]\n";
  write("study.toml", study);
  ASSERT_EQ(vrpipe({"sweep", "study.toml", "--csv", "alone.csv", "--json", "alone.json"}).code, 0);
  for (const char* shard : {"2/3", "1/3", "3/3"}) {
    const Finished finished = vrpipe({"sweep", "study.toml", "--journal", "j", "--shard", shard});
    ASSERT_EQ(finished.code, 0) << finished.err;
    EXPECT_NE(finished.out.find("its 2 points are done"), std::string::npos) << finished.out;
  }
  const Finished merged =
      vrpipe({"sweep", "study.toml", "--journal", "j", "--csv", "merged.csv", "--json", "merged.json"});
  EXPECT_NE(merged.err.find("6 of 6 points were done before"), std::string::npos) << merged.err;
  for (const std::string format : {"csv", "json"})
    EXPECT_EQ(read_file(folder() / ("merged." + format)), read_file(folder() / ("alone." + format)));
}

TEST_F(Sweep, ThatGrowsKeepsWhatIsDone) {
  write("study.toml", small_sweep + "[axes]\ntc.bins = [4, 32]\n");
  ASSERT_EQ(vrpipe({"sweep", "study.toml", "--journal", "j"}).code, 0);
  write("study.toml", small_sweep + "[axes]\ntc.bins = [4, 8, 32]\n");
  EXPECT_NE(vrpipe({"sweep", "study.toml", "--journal", "j"}).err.find("2 of 3 points were done before"),
            std::string::npos);
  refused({"sweep", "study.toml", "--journal", "j", "--set", "tgc.bins=3"}, {"--journal j", "belongs to another run"});
}

TEST_F(Sweep, AsAnArrayOfABatchSystemOnOneNode) {
  write("study.toml", small_sweep + "[axes]\ntc.bins = [4, 8, 32]\n");
  for (const char* task : {"1", "2"}) {
    const std::string command = "cd " + folder().string() + " && SLURM_ARRAY_TASK_ID=" + task +
                                " SLURM_ARRAY_TASK_COUNT=2 VRPIPE=" VRPIPE_BINARY " bash " VRPIPE_EXAMPLES
                                "/study.slurm study.toml j >/dev/null 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
  }
  const Finished all = vrpipe({"sweep", "study.toml", "--journal", "j", "--jobs", "1"});
  EXPECT_NE(all.err.find("3 of 3 points were done before"), std::string::npos) << all.err;
}

/// With mpirun; false where there is none.
bool has_mpi() { return std::system("command -v mpirun >/dev/null 2>&1") == 0 && std::filesystem::exists(VRPIPE_MPI); }

std::string under_mpi(const std::filesystem::path& folder, unsigned ranks, const std::string& words) {
  return "cd " + folder.string() +
         " && OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun --oversubscribe -n " +
         std::to_string(ranks) + " " VRPIPE_BINARY " " + words + " >mpi.out 2>mpi.err";
}

TEST_F(Sweep, OverMpiRanksIsTheSameAsAlone) {
  if (!has_mpi()) GTEST_SKIP() << "built or run without MPI";
  write("study.toml", small_sweep + "[axes]\nvariant = [\"baseline\", \"qm\", \"het\"]\ntc.bins = [4, 32]\n");
  ASSERT_EQ(vrpipe({"sweep", "study.toml", "--csv", "alone.csv", "--json", "alone.json"}).code, 0);
  ASSERT_EQ(std::system(under_mpi(folder(), 3, "sweep study.toml --csv mpi.csv --json mpi.json").c_str()), 0)
      << read_file(folder() / "mpi.err");
  EXPECT_EQ(read_file(folder() / "mpi.csv"), read_file(folder() / "alone.csv"));
  EXPECT_EQ(read_file(folder() / "mpi.json"), read_file(folder() / "alone.json"));
  const std::string out = read_file(folder() / "mpi.out");
  EXPECT_EQ(out.find("6 points"), out.rfind("6 points")) << "one rank says it";
}

TEST_F(Sweep, OfWhichARankIsLostGoesOn) {
  if (!has_mpi()) GTEST_SKIP() << "built or run without MPI";
  write("study.toml",
        "fidelity = \"lt\"\nsize = \"64x64\"\nfovy = 20\n[axes]\nview = [0, 1]\ntc.bins = [4, 8, 16, 32]\n");
  ASSERT_EQ(vrpipe({"sweep", "study.toml", "--csv", "alone.csv"}).code, 0);
  const std::string command = under_mpi(folder(), 2, "sweep study.toml --csv lost.csv --journal j");
  // A rank is killed once there are results; mpirun then ends the others.
  const std::string killing =
      "(cd " + folder().string() +
      " && until [ -s j ]; do sleep 0.1; done; sleep 0.1; for p in /proc/[0-9]*; do if tr '\\0' ' ' <$p/cmdline "
      "2>/dev/null | grep -q '^[^ ]*vrpipe sweep study.toml --csv lost.csv'; then rank=${p#/proc/}; fi; done; "
      "kill -KILL $rank) & " +
      command;
  static_cast<void>(std::system(killing.c_str()));
  ASSERT_EQ(std::system(command.c_str()), 0) << read_file(folder() / "mpi.err");
  EXPECT_EQ(read_file(folder() / "lost.csv"), read_file(folder() / "alone.csv"));
}

TEST_F(Sweep, ThatCannotBeIsRefusedWithItsLine) {
  bad("", {"nothing to study", "study.toml"});
  bad("[axes]\ntcbins = [1]\n", {"unknown axis 'tcbins'", "study.toml:2"});
  bad("[axes]\nsceen = [1]\n", {"'sceen'", "did you mean scene"});
  bad("[axes]\ntc.bins = []\n", {"empty axis 'tc.bins'", "study.toml:2"});
  bad("[axes]\ntc.bins = [4, 4]\n", {"'4' given twice"});
  bad("[axes]\ntc.bins = { from = 4, to = 2, step = 1 }\n", {"never comes to its end"});
  bad("[axes]\ntc.bins = { from = 4, to = 8 }\n", {"step and factor"});
  bad("[axes]\ntc.bins = { from = 4, to = 8, stp = 1 }\n", {"'stp'", "did you mean step"});
  bad("[axes]\ntc.bins = { from = 1, to = 2000000, step = 1 }\n", {"more than"});
  bad("sample = 9\n[axes]\ntc.bins = [4]\n", {"sample", "study.toml:1"});
  bad("seed = 9\n[axes]\ntc.bins = [4]\n", {"there is no sample"});
  bad("[[points]]\ntc.bins = 4\n[[points]]\ntgc.bins = 4\n", {"study.toml:", "'tgc.bins'"});
  bad("seed = -1\nsample = 1\n[axes]\ntc.bins = [4]\n", {"'seed'", "study.toml:1", "negative"});
  bad("[[points]]\ntc.bins = 4\n[[points]]\ntc.bins = 4\n", {"study.toml:3", "it is there twice"});
  bad("pareto = [\"cycles\", \"-cycles\"]\n[axes]\ntc.bins = [3]\n", {"study.toml:1", "it has cycles twice"});
  bad("[[points]]\ntc.bins = 4\n[axes]\ntc.bins = [4]\n", {"points and axes"});
  bad("sise = \"3x3\"\n[axes]\ntc.bins = [4]\n", {"unknown key 'sise'", "study.toml:1", "did you mean size"});
  bad("[axes]\ntc.bins = [0]\n", {"study.toml:2", "tc.bins", "from 1 to"});
  bad("[axes]\ntc.bins = { from = 0, to = 4, step = 4 }\n", {"study.toml:2", "tc.bins", "from 1 to"});
  bad("[axes]\ntc.bin = [3]\n", {"'bin'", "study.toml:2", "tc.bins"});
  bad("[[points]]\ntc.bins = 3\n[[points]]\ntc.bins = 0\n", {"study.toml:4", "tc.bins", "from 1 to"});
  bad("[axes]\nvariant = [\"hat\"]\n", {"'hat'", "study.toml:2", "het"});
  bad("[axes]\nplatform = [\"moby\"]\n", {"'moby'", "study.toml:2", "mobile"});
  bad("[axes]\nview = [\"left\"]\n", {"'left'", "study.toml:2", "axis view"});
  bad("[axes]\nsize = [\"3\"]\n", {"study.toml:2", "axis size"});
  bad("[variants.m]\nbase = \"qm\"\nset.tc.bins = 3\n[axes]\nvariant = [\"m\"]\ntc.bins = [3, 4]\n",
      {"axis tc.bins changes nothing", "variant m"});
  bad("pareto = [\"speed\", \"cycles\"]\n" + small_sweep + "[axes]\ntc.bins = [3]\n", {"'speed'", "pareto"});
  bad(small_sweep + "[axes]\ntc.bins = [3]\n", {"unknown axis 'tc.bin'", "did you mean tc.bins"},
      {"--relative-to", "tc.bin=3"});
  bad(small_sweep + "[axes]\ntc.bins = [3]\n", {"unknown value '4'"}, {"--relative-to", "tc.bins=4"});
  write("study.toml", small_sweep + "[axes]\ntc.bins = [3]\n");
  refused({"sweep", "study.toml", "--shard", "1/2"}, {"--shard", "--journal"});
  refused({"sweep", "study.toml", "--shard", "3/2", "--journal", "j"}, {"'3/2'", "I/N"});
  refused({"sweep", "study.toml", "--shard", "1/2", "--journal", "j", "--csv", "s.csv"},
          {"--csv", "a shard has not all points"});
  refused({"sweep", "study.toml", "--csv", "study.toml"}, {"study.toml"});
  write("study.toml", "fidelity = \"functional\"\n[axes]\nscene = [\n  \"tiny.spl\",\n  \"nowhere.ply\"]\n");
  refused({"sweep", "study.toml", "--jobs", "1"}, {"cannot read scene (study.toml:5, nowhere.ply): no such file"});
  write("study.toml", "fidelity = \"functional\"\n[axes]\nscene = [\n  \"tiny.spl\",\n  \"builtin:nowhere\"]\n");
  refused({"sweep", "study.toml"}, {"(study.toml:5, builtin:nowhere)"});
  refused({"sweep", "nowhere.toml"}, {"cannot read study (nowhere.toml): there is no such file"});
  refused({"sweep", "."}, {"cannot read study (.): it is a directory"});
  refused({"sweep"}, {"STUDY.toml"});
}

TEST_F(Sweep, EveryKeyIsDocumentedAndEveryDocumentedKeyExists) {
  const std::string page = read_file(VRPIPE_DOCS "/studies.md");
  std::set<std::string> known;
  const std::string heading = "\n## JSON\n";
  ASSERT_NE(page.find(heading), std::string::npos);
  std::string section = page.substr(page.find(heading));
  section.replace(0, heading.size(), "\n### JSON\n");
  known = documented(section, "JSON");
  known.insert("schema");
  expect_documented(
      {sweep("sample = 2\n" + small_sweep + "[axes]\nvariant = [\"baseline\", \"het\"]\ntc.bins = [3, 4]\n"),
       sweep(small_sweep + "[axes]\nvariant = [\"qm\"]\ntgc.bins = [64, 128]\n", {"--plugin", TEST_PLUGIN})},
      known);
}

}  // namespace
}  // namespace vrpipe::testing
