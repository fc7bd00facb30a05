// The shape of the paper on real and built-in scenes, at cycle fidelity.

#include <fstream>
#include <map>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <vrpipe/workloads/scene.h>

#include "support/data.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

Vec3 vector_of(const nlohmann::json& numbers) {
  return {numbers.at(0).get<double>(), numbers.at(1).get<double>(), numbers.at(2).get<double>()};
}

void expect_the_papers_shape(const Draw& draw) {
  std::map<std::string, RunResult> results;
  for (const Variant& variant : variants())
    results.emplace(variant.name, testing::run(testing::request_of(variant.name), draw));
  const auto cycles = [&](const std::string& variant) { return static_cast<double>(*results.at(variant).cycles); };
  const double qm = cycles("baseline") / cycles("qm");
  const double het = cycles("baseline") / cycles("het");
  const double both = cycles("baseline") / cycles("het+qm");
  ::testing::Test::RecordProperty("speedups",
                                  std::to_string(qm) + " " + std::to_string(het) + " " + std::to_string(both));
  EXPECT_GT(qm, 1.0);
  EXPECT_GT(het, 1.0);
  EXPECT_GT(both, het);
  EXPECT_GT(both, qm);

  const RunResult& baseline = results.at("baseline");
  for (const auto& [unit, share] : baseline.utilization)
    EXPECT_LE(share, testing::utilization(baseline, "crop")) << unit;
  EXPECT_LT(testing::utilization(baseline, "sm"), 0.5);
  EXPECT_GT(baseline.counts.fragments_blended, results.at("het").counts.fragments_blended);
  EXPECT_GT(results.at("het").counts.fragments_blended, results.at("het+qm").counts.fragments_blended);
}

TEST(PaperShape, HoldsOnAScannedRobot) {
  const testing::UnpackedFile robot("robot.ply");
  std::ifstream views(testing::data_file("views.json"));
  SceneRequest request;
  request.scene = robot.path().string();
  for (const nlohmann::json& view : nlohmann::json::parse(views)) {
    if (view.value("scene", "") != "robot.ply") continue;
    request.size = ImageSize{view.at("width"), view.at("height")};
    request.eye = vector_of(view.at("eye"));
    request.look_at = vector_of(view.at("look_at"));
    request.up = vector_of(view.at("up"));
    request.fovy_degrees = view.at("fovy_deg").get<double>();
  }
  ASSERT_TRUE(request.size.has_value());
  expect_the_papers_shape(load_scene(request).draw);
}

class BuiltinScene : public ::testing::TestWithParam<std::pair<std::string, ImageSize>> {};

TEST_P(BuiltinScene, HasThePapersShapeAtReducedSize) {
  SceneRequest request;
  request.scene = "builtin:" + GetParam().first;
  request.size = GetParam().second;
  request.fovy_degrees = 25;
  expect_the_papers_shape(load_scene(request).draw);
}

INSTANTIATE_TEST_SUITE_P(All, BuiltinScene,
                         ::testing::Values(std::pair<std::string, ImageSize>{"object", {200, 200}},
                                           std::pair<std::string, ImageSize>{"indoor", {234, 156}},
                                           std::pair<std::string, ImageSize>{"outdoor", {200, 112}}),
                         [](const auto& scene) { return scene.param.first; });

}  // namespace
}  // namespace vrpipe
