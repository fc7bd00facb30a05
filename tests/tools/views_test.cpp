#include <pty.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <map>
#include <numeric>
#include <thread>

#include <fmt/format.h>

#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/gaussian_scene.h>

#include "documented_keys.h"
#include "forked.h"
#include "jobs/distribution.h"
#include "jobs/journal.h"

namespace vrpipe::testing {
namespace {

using nlohmann::json;
using tools::Distribution;
using tools::distribution_of;

// Distributions.

TEST(Distribution, QuartilesOfFourValuesAreBetweenThem) {
  const Distribution of = distribution_of({4.0, 1.0, 3.0, 2.0}).value();
  EXPECT_EQ(of.count, 4U);
  EXPECT_EQ(of.minimum, 1);
  EXPECT_DOUBLE_EQ(of.lower_quartile, 1.75);
  EXPECT_DOUBLE_EQ(of.median, 2.5);
  EXPECT_DOUBLE_EQ(of.upper_quartile, 3.25);
  EXPECT_EQ(of.maximum, 4);
  EXPECT_NEAR(of.geometric_mean, std::sqrt(std::sqrt(24.0)), 1e-14);
  EXPECT_EQ(of.least, 1U);
  EXPECT_EQ(of.most, 0U);
}

TEST(Distribution, QuartilesOfFiveValuesAreValues) {
  const Distribution of = distribution_of({10.0, 20.0, 40.0, 80.0, 160.0}).value();
  EXPECT_EQ(of.lower_quartile, 20);
  EXPECT_EQ(of.median, 40);
  EXPECT_EQ(of.upper_quartile, 80);
  EXPECT_NEAR(of.geometric_mean, 40, 1e-12);
}

TEST(Distribution, WhatIsNotThereIsLeftOutAndOfEqualValuesTheFirstIsNamed) {
  EXPECT_FALSE(distribution_of({}).has_value());
  EXPECT_FALSE(distribution_of({std::nullopt, std::nullopt}).has_value());
  const Distribution one = distribution_of({std::nullopt, 1.5}).value();
  EXPECT_EQ(one.count, 1U);
  EXPECT_EQ(one.least, 1U);
  EXPECT_EQ(one.most, 1U);
  for (const double value : {one.minimum, one.lower_quartile, one.median, one.upper_quartile, one.maximum}) {
    EXPECT_EQ(value, 1.5);
  }
  const Distribution ties = distribution_of({2.0, std::nullopt, 3.0, 2.0, 3.0}).value();
  EXPECT_EQ(ties.least, 0U);
  EXPECT_EQ(ties.most, 2U);
}

// Views.

/// An environment variable, which is what it was when this object ends.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    if (const char* const before = std::getenv(name)) before_ = before;
    ::setenv(name, value.c_str(), 1);
  }
  ~Variable() {
    if (before_) {
      ::setenv(name_, before_->c_str(), 1);
    } else {
      ::unsetenv(name_);
    }
  }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

constexpr std::size_t cameras_there = 5;
constexpr int splats_there = 300;

/// A cloud of splats, five cameras in front of it, and a cache folder of its own.
class Views : public ToolTest {
 protected:
  void SetUp() override {
    GaussianSceneBuilder builder(0);
    for (int i = 0; i < splats_there; ++i) {
      GaussianAttributes gaussian;
      const auto spread = [i](int step) { return 0.04F * static_cast<float>((i * step) % 23 - 11); };
      gaussian.position = {spread(7), spread(5), 4 + spread(3)};
      gaussian.log_scale = {-2.0F, -1.7F, -1.9F};
      gaussian.opacity_logit = i % 2 == 0 ? 6.0F : 0.5F;
      gaussian.f_dc = {1, 0.2F, -0.5F};
      builder.add(gaussian);
    }
    write_gaussian_file(folder() / "cloud.ply", builder.build());
    write("cameras.json", cameras().dump());
  }

  static json cameras() {
    json all = json::array();
    for (std::size_t i = 0; i < cameras_there; ++i) {
      all.push_back({{"img_name", "image_" + std::to_string(i)},
                     {"width", 64},
                     {"height", 48},
                     {"position", {0.1 * static_cast<double>(i), 0, 0.6 * static_cast<double>(i)}},
                     {"rotation", {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
                     {"fx", 90},
                     {"fy", 90}});
    }
    return all;
  }

  std::filesystem::path cache() const { return folder().parent_path() / "cache"; }
  std::vector<std::filesystem::path> journals() const {
    std::vector<std::filesystem::path> found;
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(cache() / "vrpipe", ignored)) {
      found.push_back(entry.path());
    }
    return found;
  }
  static std::vector<std::string> command(std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"compare", "--scene", "cloud.ply"});
    if (std::find(more.begin(), more.end(), "--fidelity") == more.end()) more.insert(more.end(), {"--fidelity", "lt"});
    return more;
  }
  static std::vector<std::string> of_file(std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"--camera", "cameras.json"});
    return command(std::move(more));
  }
  json views_of(const std::vector<std::string>& arguments) const { return json_of(arguments)["views"]; }

  /// All but what the host did meanwhile.
  static std::string without_host(json result) {
    result.erase("host");
    for (json& view : result["views"]) {
      for (json& run : view["runs"]) {
        run.erase("host_seconds");
        run.erase("cpu_seconds");
      }
    }
    return result.dump();
  }

  /// Whether the run said on stderr how many views it did not have to repeat.
  static std::string done_before(std::size_t done, std::size_t views) {
    return "--views: " + std::to_string(done) + " of " + std::to_string(views) + " views were done before\n";
  }

 private:
  const Variable cache_{"XDG_CACHE_HOME", cache().string()};
};

/// The quantile by the definition that the documentation gives, from a list that is sorted.
double quantile_of(const std::vector<double>& sorted, double p) {
  const double place = p * (static_cast<double>(sorted.size()) - 1);
  const double below = std::floor(place);
  const double low = sorted[static_cast<std::size_t>(below)];
  const double high = sorted[static_cast<std::size_t>(std::ceil(place))];
  return low * (1 - (place - below)) + high * (place - below);
}

void expect_distribution(const json& found, const std::vector<double>& values) {
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(found["views"], values.size());
  EXPECT_DOUBLE_EQ(found["minimum"], sorted.front());
  EXPECT_NEAR(found["lower_quartile"], quantile_of(sorted, 0.25), 1e-12);
  EXPECT_NEAR(found["median"], quantile_of(sorted, 0.5), 1e-12);
  EXPECT_NEAR(found["upper_quartile"], quantile_of(sorted, 0.75), 1e-12);
  EXPECT_DOUBLE_EQ(found["maximum"], sorted.back());
  double product = 1;
  for (const double value : values) product *= value;
  EXPECT_NEAR(found["geometric_mean"], std::pow(product, 1.0 / static_cast<double>(values.size())), 1e-12);
  EXPECT_EQ(values[found["minimum_in_view"].get<std::size_t>()], sorted.front());
  EXPECT_EQ(values[found["maximum_in_view"].get<std::size_t>()], sorted.back());
}

TEST_F(Views, OfAFileAreWhatCompareSaysOfEachCameraAndItsDistribution) {
  const json result = json_of(of_file({"--views", "all"}));
  EXPECT_EQ(result["schema"], "vrpipe.views/1");
  EXPECT_EQ(result["cameras"], (json{{"file", "cameras.json"}, {"count", 5}, {"orbit", false}}));
  ASSERT_EQ(result["views"].size(), cameras_there);
  std::map<std::string, std::vector<double>> speedups;
  std::vector<double> ratios;
  for (std::size_t i = 0; i < cameras_there; ++i) {
    SCOPED_TRACE(i);
    const json& view = result["views"][i];
    const json alone = json_of(command({"--camera", "cameras.json#" + std::to_string(i)}));
    EXPECT_EQ(view["index"], i);
    EXPECT_EQ(view["name"], "image_" + std::to_string(i));
    EXPECT_EQ(view["camera"], alone["camera"]);
    EXPECT_EQ(view["scene"]["gaussians_visible"], alone["scene"]["gaussians_visible"]);
    EXPECT_EQ(view["speedup"], alone["speedup"]);
    EXPECT_EQ(view["early_termination_ratio"], alone["early_termination_ratio"]);
    ASSERT_EQ(view["runs"].size(), 4U);
    for (std::size_t run = 0; run < 4; ++run) {
      for (const auto& entry : view["runs"][run].items()) {
        if (entry.key() == "host_seconds" || entry.key() == "cpu_seconds") continue;
        EXPECT_EQ(entry.value(), alone["runs"][run][entry.key()]) << entry.key();
      }
      EXPECT_EQ(result["implementations"][alone["runs"][run]["variant"]], alone["runs"][run]["implementations"]);
    }
    for (const auto& entry : alone["speedup"].items()) speedups[entry.key()].push_back(entry.value());
    ratios.push_back(alone["early_termination_ratio"]);
    if (i > 0) continue;
    for (const char* key : {"version", "seed", "platform", "fidelity", "format", "termination", "effects", "passes",
                            "quad_merging_storage_bytes"}) {
      EXPECT_EQ(result[key], alone[key]) << key;
    }
    EXPECT_EQ(result["scene"]["name"], "cloud.ply");
    EXPECT_EQ(result["scene"]["gaussians_total"], splats_there);
  }
  EXPECT_EQ(speedups.size(), 3U);
  for (const auto& [variant, values] : speedups) {
    SCOPED_TRACE(variant);
    expect_distribution(result["distribution"]["speedup"][variant], values);
  }
  expect_distribution(result["distribution"]["early_termination_ratio"], ratios);
  EXPECT_GT(*std::max_element(ratios.begin(), ratios.end()), 1.2) << "nothing terminates";
}

TEST_F(Views, AreEvenlySpacedAmongTheCamerasFromTheFirstOn) {
  const std::map<std::string, std::vector<int>> expected{{"1", {0}},
                                                         {"2", {0, 2}},
                                                         {"3", {0, 1, 3}},
                                                         {"5", {0, 1, 2, 3, 4}}};
  for (const auto& [count, indices] : expected) {
    const json views = views_of(of_file({"--views", count, "--fidelity", "functional"}));
    std::vector<int> found;
    for (const json& view : views) found.push_back(view["index"]);
    EXPECT_EQ(found, indices);
  }
}

TEST_F(Views, WithoutAFileGoRoundTheScene) {
  const json result = json_of(command({"--views", "4", "--size", "64x48"}));
  EXPECT_EQ(result["cameras"], (json{{"file", nullptr}, {"count", 4}, {"orbit", true}}));
  const json alone = json_of(command({"--size", "64x48"}));
  EXPECT_EQ(result["views"][0]["camera"], alone["camera"]);
  EXPECT_EQ(result["views"][0]["runs"][3]["result_hash"], alone["runs"][3]["result_hash"]);
  const auto eye = [&](std::size_t i, std::size_t axis) {
    return result["views"][i]["camera"]["eye"][axis].get<double>() -
           result["views"][i]["camera"]["look_at"][axis].get<double>();
  };
  // A quarter round -y: x becomes -z, and z becomes x.
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(eye((i + 1) % 4, 0), -eye(i, 2), 1e-9) << i;
    EXPECT_NEAR(eye((i + 1) % 4, 1), eye(i, 1), 1e-9) << i;
    EXPECT_NEAR(eye((i + 1) % 4, 2), eye(i, 0), 1e-9) << i;
  }
  const json tilted = json_of(command({"--views", "2", "--size", "16x12", "--up", "0,0,1"}));
  EXPECT_EQ(tilted["views"][1]["camera"]["up"], (json{0, 0, 1}));
  EXPECT_NEAR(tilted["views"][0]["camera"]["eye"][2].get<double>(),
              tilted["views"][1]["camera"]["eye"][2].get<double>(), 1e-9);
}

TEST_F(Views, WithoutPerspectiveGoRoundTheSceneLikewise) {
  const json result = json_of(command({"--views", "2", "--size", "16x12", "--orthographic", "3"}));
  for (const json& view : result["views"]) {
    EXPECT_EQ(view["camera"]["orthographic_height"], 3);
    EXPECT_GT(view["scene"]["gaussians_visible"], 0);
  }
}

TEST_F(Views, SayOnceWhatWasAssumedOfTheirCameras) {
  json frames = json::array();
  for (const double x : {-0.1, 0.0, 0.1}) {
    frames.push_back({{"file_path", fmt::format("{}.png", x)},
                      {"transform_matrix", {{1, 0, 0, x}, {0, -1, 0, 0}, {0, 0, -1, 0}, {0, 0, 0, 1}}}});
  }
  json file{{"fl_x", 90}, {"w", 64}, {"h", 48}, {"k1", 0.2}, {"frames", frames}};
  write("transforms.json", file.dump());
  const std::vector<std::string> all = command({"--camera", "transforms.json", "--views", "all"});
  refused(all, {"k1 = 0.2", "--undistorted"});
  std::vector<std::string> undistorted = all;
  undistorted.emplace_back("--undistorted");
  const std::string said = "note: cameras of transforms.json are taken without their distortion";
  const std::string text = vrpipe(undistorted).out;
  const std::size_t at = text.find(said);
  ASSERT_NE(at, std::string::npos) << text;
  EXPECT_EQ(text.find("note: ", at + 1), std::string::npos) << text;
  file["camera_model"] = "OPENCV";
  write("transforms.json", file.dump());
  EXPECT_NE(vrpipe(all).out.find("taken as undistorted: nerfstudio"), std::string::npos);
}

TEST_F(Views, WithoutTimeHaveARatioAlone) {
  const json result = json_of(of_file({"--views", "3", "--fidelity", "functional"}));
  for (const json& view : result["views"]) {
    EXPECT_TRUE(view["runs"][0]["cycles"].is_null());
    EXPECT_TRUE(view["speedup"]["het"].is_null());
    EXPECT_TRUE(view["early_termination_ratio"].is_number_float());
  }
  EXPECT_TRUE(result["distribution"]["speedup"]["het+qm"].is_null());
  EXPECT_EQ(result["distribution"]["early_termination_ratio"]["views"], 3);
  const std::string text = vrpipe(of_file({"--views", "3", "--fidelity", "functional"})).out;
  EXPECT_EQ(text.find("speed-up over"), std::string::npos) << text;
  EXPECT_NE(text.find("ratio"), std::string::npos) << text;
}

TEST_F(Views, ThatShowNothingAreSaidAndLeftOutOfDistributions) {
  json moved = cameras();
  moved[1]["position"] = {0, 0, 100};
  write("cameras.json", moved.dump());
  const json result = json_of(of_file({"--views", "all"}));
  EXPECT_TRUE(result["views"][1]["speedup"]["qm"].is_null());
  EXPECT_EQ(result["distribution"]["speedup"]["qm"]["views"], 4);
  EXPECT_EQ(result["distribution"]["early_termination_ratio"]["views"], 4);
  EXPECT_NE(vrpipe(of_file({"--views", "all"})).out.find("1 view with nothing visible"), std::string::npos);
}

TEST_F(Views, TheReportHasDistributionsAndTheViewsInOrder) {
  const Finished finished = vrpipe(of_file({"--views", "3", "--jobs", "2"}));
  EXPECT_EQ(finished.code, 0);
  EXPECT_EQ(finished.err, "");
  for (const char* part :
       {"cloud.ply, 64x48, 3 views, of the 5 cameras in cameras.json: 300 Gaussians", "agx-orin (", "lt fidelity",
        "minimum", "lower quartile", "median", "upper quartile", "maximum", "geometric mean", "view of min",
        "view of max", "speed-up over baseline", "het+qm", "ratio", "in 2 processes at a time"}) {
    EXPECT_NE(finished.out.find(part), std::string::npos) << part << " is not in:\n" << finished.out;
  }
  const std::size_t first = finished.out.find("image_0"), second = finished.out.find("image_1"),
                    third = finished.out.find("image_3");
  EXPECT_TRUE(first < second && second < third && third != std::string::npos) << finished.out;
}

TEST_F(Views, DoNotDependOnTheNumberOfProcesses) {
  std::string one, other;
  for (const auto& [jobs, text] : {std::pair{"1", &one}, std::pair{"3", &other}}) {
    json result = json_of(of_file({"--views", "all", "--jobs", jobs}));
    result.erase("command");
    *text = without_host(result);
  }
  EXPECT_EQ(one, other);
}

TEST_F(Views, HaveTheirImagesInFoldersOfTheirOwn) {
  const json views = views_of(of_file({"--views", "2", "--output", "images", "--background", "1,0,0"}));
  for (const char* view : {"0", "2"}) {
    for (const char* variant : {"baseline", "qm", "het", "het+qm"}) {
      for (const char* extension : {".png", ".exr"}) {
        EXPECT_TRUE(
            std::filesystem::exists(folder() / "images" / view / (std::string("cloud-") + variant + extension)));
      }
    }
  }
  EXPECT_EQ(views[1]["runs"][2]["images"]["png"], "images/2/cloud-het.png");
  ASSERT_EQ(vrpipe(command({"--camera", "cameras.json#2", "--output", "alone", "--background", "1,0,0"})).code, 0);
  EXPECT_EQ(read_file(folder() / "images/2/cloud-het.png"), read_file(folder() / "alone/cloud-het.png"));
  EXPECT_EQ(read_file(folder() / "images/2/cloud-qm.exr"), read_file(folder() / "alone/cloud-qm.exr"));
}

TEST_F(Views, DrawScenesInPassesAndWithMeshesToo) {
  write("wall.obj", "v -1 -1 6\nv 1 -1 6\nv 1 1 6\nv -1 1 6\nf 1 2 3 4\nf 4 3 2 1\n");
  const std::vector<std::string> more{"--multi-pass", "2", "--mesh", "wall.obj"};
  std::vector<std::string> many = of_file({"--views", "2"}), one = command({"--camera", "cameras.json#2"});
  many.insert(many.end(), more.begin(), more.end());
  one.insert(one.end(), more.begin(), more.end());
  const json views = json_of(many), alone = json_of(one);
  EXPECT_EQ(views["passes"], 2);
  EXPECT_GT(alone["scene"]["triangles"], 0);
  EXPECT_EQ(views["views"][1]["scene"]["triangles"], alone["scene"]["triangles"]);
  for (std::size_t run = 0; run < 4; ++run) {
    EXPECT_EQ(views["views"][1]["runs"][run]["result_hash"], alone["runs"][run]["result_hash"]);
  }
}

TEST_F(Views, RefuseWhatHasNoViewsAndWhatTheyAreNot) {
  refused(command({"--views", "0"}), {"'0' (--views)", "neither `all` nor a whole number"});
  refused(command({"--views", "-1"}), {"'-1' (--views)"});
  refused(command({"--views", "many"}), {"'many' (--views)"});
  refused(command({"--views", "all"}), {"'all' (--views)", "--camera FILE", "round the scene"});
  refused(of_file({"--views", "6"}), {"--views 6", "cameras.json has 5 cameras", "1 to 5"});
  refused(command({"--camera", "cameras.json#1", "--views", "2"}), {"(--camera)", "names one camera"});
  refused({"compare", "--scene", "tiny.spl", "--views", "2"}, {"(--scene)", "draw list"});
  refused(command({"--views", "2", "--save-draw", "d.spl"}), {"(--save-draw)"});
  refused(command({"--views", "2", "--explain-effects"}), {"(--explain-effects)"});
  refused({"compare", "--frame", "f.json", "--views", "2"}, {"(--frame)"});
  refused(command({"--journal", "j.jsonl"}), {"(--journal)", "--views"});
  refused({"run", "--scene", "cloud.ply", "--views", "2"}, {"'--views'", "`vrpipe compare`"});
  write("none.json", "[]");
  refused(command({"--camera", "none.json", "--views", "all"}), {"none.json"});
  EXPECT_TRUE(journals().empty());
}

TEST_F(Views, NeverOverwriteWhatTheyReadOrWriteElse) {
  refused(of_file({"--views", "2", "--json", "cameras.json"}), {"--json cameras.json", "same file"});
  refused(of_file({"--views", "2", "--journal", "cameras.json"}), {"--journal cameras.json", "same file"});
  refused(of_file({"--views", "2", "--journal", "a", "--json", "a"}), {"same file"});
  std::filesystem::create_directories(folder() / "images/2/cloud-het.png");
  refused(of_file({"--views", "2", "--output", "images"}), {"images/2/cloud-het.png", "folder"});
  write("model.txt", "");
  write("cameras.txt", "1 PINHOLE 64 48 90 90 32 24\n");
  write("images.txt", "1 1 0 0 0 0 0 0 1 a.jpg\n\n");
  refused(command({"--camera", ".", "--views", "1", "--json", "images.txt"}), {"images.txt", "same file"});
}

// Journals.

TEST_F(Views, RemoveJournalsThatWereLeftAloneForAMonth) {
  const auto left_alone = [&](const std::string& name, int days) {
    const std::filesystem::path path = cache() / "vrpipe" / name;
    std::ofstream(path) << "{}\n";
    std::filesystem::last_write_time(path,
                                     std::filesystem::file_time_type::clock::now() - std::chrono::hours(24 * days));
    return path;
  };
  std::filesystem::create_directories(cache() / "vrpipe");
  const auto old = left_alone("sweep-0123456789abcdef.jsonl", 31);
  const auto recent = left_alone("views-0123456789abcdef.jsonl", 29), users = left_alone("mine.jsonl", 31);
  const Finished finished = vrpipe(of_file({"--views", "2"}));
  EXPECT_EQ(finished.code, 0) << finished.err;
  EXPECT_FALSE(std::filesystem::exists(old));
  EXPECT_TRUE(std::filesystem::exists(recent));
  EXPECT_TRUE(std::filesystem::exists(users)) << "--journal may name a file there";
}

TEST_F(Views, ARunThatWasKilledGoesOnAndEndsWithTheSameBytes) {
  const std::vector<std::string> words =
      command({"--views", "60", "--size", "64x48", "--platform", "agx-orin-ideal-memory", "--json", "result.json"});
  const auto result = [&] { return json::parse(read_file(folder() / "result.json")); };
  ASSERT_EQ(vrpipe(words).code, 0);
  const std::string undisturbed = without_host(result());
  EXPECT_TRUE(journals().empty()) << "a journal is left of a run that is complete";
  std::filesystem::remove(folder() / "result.json");

  const pid_t process = ::fork();
  if (process == 0) {
    const bool ready = ::chdir(folder().c_str()) == 0 && std::freopen("/dev/null", "w", stdout) != nullptr;
    ::_exit(ready ? become_vrpipe(words) : 98);
  }
  // Its first line, and a view or two.
  std::size_t lines = 0;
  for (int waited = 0; lines < 3 && waited < 30000; ++waited) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (journals().empty()) continue;
    const std::string text = read_file(journals().front());
    lines = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }
  ::kill(process, SIGKILL);
  int status = 0;
  ::waitpid(process, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status)) << "it was done before it could be killed";
  EXPECT_FALSE(std::filesystem::exists(folder() / "result.json"));
  ASSERT_EQ(journals().size(), 1U);

  const Finished other = vrpipe(command({"--views", "2", "--size", "32x24"}));
  EXPECT_EQ(other.err, "") << "the journal of another run is not its own";
  const Finished resumed = vrpipe(words);
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_EQ(without_host(result()), undisturbed);
  std::size_t done = 0;
  EXPECT_EQ(std::sscanf(resumed.err.c_str(), "--views: %zu of 60 views were done before", &done), 1) << resumed.err;
  EXPECT_GE(done, 2U);
  EXPECT_LT(done, 60U);
  EXPECT_TRUE(journals().empty());
}

TEST_F(Views, ANamedJournalStaysAndServesAgain) {
  const std::vector<std::string> words = of_file({"--views", "all", "--journal", "j.jsonl", "--json", "r.json"});
  ASSERT_EQ(vrpipe(words).code, 0);
  const json first = json::parse(read_file(folder() / "r.json"));
  const std::string journal = read_file(folder() / "j.jsonl");
  EXPECT_EQ(std::count(journal.begin(), journal.end(), '\n'), 6);
  EXPECT_TRUE(journals().empty());
  const Finished again = vrpipe(words);
  EXPECT_EQ(again.code, 0);
  EXPECT_EQ(again.err, done_before(5, 5));
  json second = json::parse(read_file(folder() / "r.json"));
  second["host"] = first["host"];
  EXPECT_EQ(first, second) << "the seconds are those of the run that took them";
  EXPECT_EQ(read_file(folder() / "j.jsonl"), journal);
  // How many at a time, and where the result goes, are no matter.
  EXPECT_EQ(vrpipe(of_file({"--views", "all", "--journal", "j.jsonl", "--jobs", "1"})).err, done_before(5, 5));
  // Nor how the files are named.
  const auto from_here = [&](const char* name) { return (folder() / ".." / folder().filename() / name).string(); };
  const Finished elsewhere =
      vrpipe({"compare", "--scene", from_here("cloud.ply"), "--camera", from_here("cameras.json"), "--fidelity", "lt",
              "--views", "all", "--journal", "j.jsonl"});
  EXPECT_EQ(elsewhere.err, done_before(5, 5));
}

TEST_F(Views, AJournalThatEndsInTheMiddleOfARecordLosesThatRecord) {
  const std::vector<std::string> words = of_file({"--views", "all", "--journal", "j.jsonl", "--json", "r.json"});
  const auto result = [&] { return without_host(json::parse(read_file(folder() / "r.json"))); };
  ASSERT_EQ(vrpipe(words).code, 0);
  const std::string undisturbed = result(), whole = read_file(folder() / "j.jsonl");
  std::vector<std::size_t> ends;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (whole[i] == '\n') ends.push_back(i + 1);
  }
  // Within the first line, at its end, within a record, and before the end of a record's line.
  const std::vector<std::pair<std::size_t, std::size_t>> cuts{{0, 0},       {10, 0},          {ends[0] - 1, 0},
                                                              {ends[0], 0}, {ends[1] + 9, 1}, {ends[3] - 1, 2},
                                                              {ends[4], 4}};
  for (const auto& [size, done] : cuts) {
    SCOPED_TRACE(size);
    write("j.jsonl", whole.substr(0, size));
    const Finished finished = vrpipe(words);
    EXPECT_EQ(finished.code, 0);
    EXPECT_EQ(finished.err, done == 0 ? "" : done_before(done, 5));
    EXPECT_EQ(result(), undisturbed);
    const std::string journal = read_file(folder() / "j.jsonl");
    EXPECT_EQ(std::count(journal.begin(), journal.end(), '\n'), 6);
  }
}

TEST_F(Views, ADamagedRecordIsSimulatedAgain) {
  const std::vector<std::string> words = of_file({"--views", "all", "--journal", "j.jsonl"});
  ASSERT_EQ(vrpipe(words).code, 0);
  const std::string whole = read_file(folder() / "j.jsonl");
  const std::size_t start = whole.find('\n') + 1, end = whole.find('\n', start);
  const std::string nested = std::string(100'000, '[') + std::string(100'000, ']');
  // A bit of a number, so that the line still reads well.
  std::string flipped = whole.substr(start, end - start);
  flipped[flipped.find_last_of("0123456789")] ^= 1;
  for (const std::string& record :
       {flipped, std::string("garbage"), std::string("[]"), std::string(R"({"view": 0})"),
        std::string(R"({"view": "x", "runs": 3})"), R"({"view": 0, "scene": {}, "runs": [1, 2, 3, )" + nested + "]}"}) {
    write("j.jsonl", whole.substr(0, start) + record + whole.substr(end));
    const Finished finished = vrpipe(words);
    EXPECT_EQ(finished.code, 0) << record.substr(0, 50) << finished.err;
    EXPECT_EQ(finished.err, done_before(4, 5)) << record.substr(0, 50);
  }
}

TEST_F(Views, AViewWhoseImagesAreGoneIsDrawnAgain) {
  const std::vector<std::string> words = of_file({"--views", "all", "--journal", "j.jsonl", "--output", "images"});
  ASSERT_EQ(vrpipe(words).code, 0);
  const std::string image = read_file(folder() / "images/3/cloud-qm.png");
  EXPECT_EQ(vrpipe(words).err, done_before(5, 5));
  std::filesystem::remove(folder() / "images/3/cloud-qm.png");
  EXPECT_EQ(vrpipe(words).err, done_before(4, 5));
  EXPECT_EQ(read_file(folder() / "images/3/cloud-qm.png"), image);
}

TEST_F(Views, AJournalOfSomethingElseIsRefusedAndLeftAsItIs) {
  ASSERT_EQ(vrpipe(of_file({"--views", "all", "--journal", "j.jsonl"})).code, 0);
  const std::string journal = read_file(folder() / "j.jsonl");
  const auto expect_other = [&](const std::vector<std::string>& words, const std::string& what) {
    refused(words, {"cannot use journal (--journal j.jsonl)", "belongs to another run", what, "name another file"});
    EXPECT_EQ(read_file(folder() / "j.jsonl"), journal);
  };
  expect_other(of_file({"--views", "all", "--journal", "j.jsonl", "--set", "tc.bins=16"}), "settings.set");
  expect_other(of_file({"--views", "all", "--journal", "j.jsonl", "--format", "rgba8"}), "settings.format");
  expect_other(of_file({"--views", "3", "--journal", "j.jsonl"}), "cameras");
  expect_other(of_file({"--views", "all", "--journal", "j.jsonl", "--size", "32x24"}), "cameras");
  const auto time = std::filesystem::last_write_time(folder() / "cloud.ply");
  std::filesystem::last_write_time(folder() / "cloud.ply", time + std::chrono::seconds(1));
  expect_other(of_file({"--views", "all", "--journal", "j.jsonl"}), "scene.modified");
  for (const char* text : {"a thesis\n", "{}", "\n"}) {
    write("j.jsonl", text);
    refused(of_file({"--views", "2", "--journal", "j.jsonl"}), {"--journal j.jsonl", "no journal of this command"});
    EXPECT_EQ(read_file(folder() / "j.jsonl"), text);
  }
  std::filesystem::create_directory(folder() / "d");
  refused(of_file({"--views", "2", "--journal", "d"}), {"--journal d", "folder"});
  refused(of_file({"--views", "2", "--journal", "none/j.jsonl"}), {"--journal none/j.jsonl", "no folder none"});
  refused(of_file({"--views", "2", "--journal", "/dev/null"}), {"--journal /dev/null", "not a regular file"});
}

TEST_F(Views, AJournalIsOfTheVeryFileThatTakesABuiltinScenesPlace) {
  for (const char* scene : {"train=cloud.ply", "builtin:train=cloud.ply"}) {
    const std::vector<std::string> words{"compare", "--scene",    scene,        "--size",    "16x16",  "--views",
                                         "2",       "--fidelity", "functional", "--journal", "j.jsonl"};
    ASSERT_EQ(vrpipe(words).code, 0) << scene;
    const auto time = std::filesystem::last_write_time(folder() / "cloud.ply");
    std::filesystem::last_write_time(folder() / "cloud.ply", time + std::chrono::seconds(1));
    refused(words, {"belongs to another run", "scene.modified"});
    std::filesystem::remove(folder() / "j.jsonl");
  }
}

TEST_F(Views, AJournalThatAnotherProcessWritesIsRefused) {
  const int file = ::open((folder() / "j.jsonl").c_str(), O_RDWR | O_CREAT, 0600);
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  ASSERT_EQ(::fcntl(file, F_SETLK, &lock), 0);
  refused(of_file({"--views", "2", "--journal", "j.jsonl"}), {"--journal j.jsonl", "another vrpipe is writing it"});
  ::close(file);
}

TEST_F(Views, WhenTheDiskIsFullGoOnAndLaterFromThere) {
  const std::vector<std::string> words = of_file({"--views", "all", "--journal", "j.jsonl"});
  const Finished full = in_fork(folder(), [&] {
    // Enough for the first line and a record, not for five.
    const rlimit limit{60'000, 60'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    return become_vrpipe(words);
  });
  EXPECT_EQ(full.code, 0);
  EXPECT_EQ(full.err.rfind("--journal: nothing more is stored: j.jsonl: File too large", 0), 0U) << full.err;
  EXPECT_EQ(std::count(full.err.begin(), full.err.end(), '\n'), 1) << full.err;
  const std::string journal = read_file(folder() / "j.jsonl");
  const auto records = std::count(journal.begin(), journal.end(), '\n') - 1;
  ASSERT_TRUE(records > 0 && records < 5) << records;
  EXPECT_EQ(vrpipe(words).err, done_before(static_cast<std::size_t>(records), 5));
}

TEST(JournalText, BringsTextsOfAnyBytesBack) {
  json record;
  record["plain"] = "caf\xc3\xa9";
  record["foreign"] = json::binary({'c', 'a', 'f', 0xe9});  // as results are encoded
  record["list"] = {{1, 2.5, nullptr}, {{"bytes", 7}, {"subtype", "of its own"}}};
  EXPECT_EQ(tools::with_binaries(json::parse(record.dump())), record);
  json deep = 1;
  for (int i = 0; i < 100; ++i) deep = json::array({deep});
  EXPECT_THROW(tools::with_binaries(deep), std::runtime_error);
}

TEST_F(Views, WithoutACacheFolderGoOnAndSaySo) {
  const std::string expected = without_host(json_of(of_file({"--views", "2"})));
  for (const auto& [cache, home] :
       {std::pair{"/dev/null/cache", "/"}, std::pair{"relative", "/dev/null"}, std::pair{"", ""}}) {
    const Variable cache_home("XDG_CACHE_HOME", cache), home_folder("HOME", home);
    const Finished finished = vrpipe(of_file({"--views", "2", "--fidelity", "lt", "--json", "-"}));
    EXPECT_EQ(finished.code, 0) << finished.err;
    EXPECT_EQ(finished.err.rfind("--views: nothing is stored", 0), 0U) << finished.err;
    EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1) << finished.err;
    EXPECT_EQ(without_host(json::parse(finished.out)), expected);
  }
  EXPECT_EQ(files(), (std::vector<std::string>{"cameras.json", "cloud.ply", "tiny.spl"}));
}

TEST_F(Views, AtATerminalTheProgressCountsViews) {
  int master = -1;
  int slave = -1;
  ASSERT_EQ(::openpty(&master, &slave, nullptr, nullptr, nullptr), 0);
  const Variable terminal("TERM", "xterm");
  std::string drawn;
  std::thread reader([&] {
    char buffer[4096];
    for (ssize_t count; (count = ::read(master, buffer, sizeof buffer)) > 0;) {
      drawn.append(buffer, static_cast<std::size_t>(count));
    }
  });
  const Finished finished = vrpipe(of_file({"--views", "3"}), slave);
  ::close(slave);
  reader.join();
  ::close(master);
  EXPECT_EQ(finished.code, 0);
  EXPECT_EQ(finished.out.find('\x1b'), std::string::npos) << "stdout is a file";
  EXPECT_NE(drawn.find("0 of 3 views"), std::string::npos) << drawn;
  EXPECT_NE(drawn.find("3 of 3 views"), std::string::npos) << drawn;
  EXPECT_EQ(drawn.substr(drawn.size() - 4), "\r\x1b[J") << "it is erased at the end";
}

// The documentation.

TEST_F(Views, EveryKeyIsDocumentedAndEveryDocumentedKeyExists) {
  const std::string page = read_file(std::filesystem::path(RESULTS_PAGE).parent_path() / "cameras.md");
  std::vector<std::string> with_plugin = of_file({"--views", "2", "--fidelity", "functional"});
  with_plugin.insert(with_plugin.end(), {"--plugin", TEST_PLUGIN, "--output", "images"});
  expect_documented({json_of(of_file({"--views", "2"})), json_of(with_plugin),
                     json_of(command({"--views", "2", "--size", "32x24"}))},
                    documented(page, "Keys"));
}

}  // namespace
}  // namespace vrpipe::testing
