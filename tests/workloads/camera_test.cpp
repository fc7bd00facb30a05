#include <vrpipe/workloads/camera.h>

#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "workload_test_support.h"

namespace vrpipe {
namespace {

using testing::expect_user_error;

Vec3 column(const Camera& camera, std::size_t i) {
  return {camera.rotation[0][i], camera.rotation[1][i], camera.rotation[2][i]};
}

void expect_near(const Vec3& a, const Vec3& b, double tolerance) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], tolerance) << i;
}

TEST(LookAt, InAYDownWorldLookingAlongZIsTheIdentity) {
  const Camera camera = look_at({1, 2, 3}, {1, 2, 9}, {0, -1, 0}, 90, 640, 480);
  expect_near(column(camera, 0), {1, 0, 0}, 0);
  expect_near(column(camera, 1), {0, 1, 0}, 0);
  expect_near(column(camera, 2), {0, 0, 1}, 0);
  EXPECT_NEAR(camera.fy, 240, 1e-12);
  EXPECT_EQ(camera.fx, camera.fy);
  EXPECT_EQ(camera.near_plane, 0.2f);
}

TEST(LookAt, AxesAreRightDownForwardAndRightHanded) {
  const Camera camera = look_at({3, 1, -4}, {-1, 0.5, 2}, {0.2, 1, 0.1}, 50, 640, 480);
  const Vec3 right = column(camera, 0), down = column(camera, 1), forward = column(camera, 2);
  const Vec3 cross = {right[1] * down[2] - right[2] * down[1], right[2] * down[0] - right[0] * down[2],
                      right[0] * down[1] - right[1] * down[0]};
  expect_near(cross, forward, 1e-15);
  const double length = std::sqrt(16 + 0.25 + 36);
  expect_near(forward, {-4 / length, -0.5 / length, 6 / length}, 1e-15);
  EXPECT_LT(0.2 * down[0] + down[1] + 0.1 * down[2], 0) << "down points away from up";
  EXPECT_NEAR(0.2 * right[0] + right[1] + 0.1 * right[2], 0, 1e-15) << "the horizon is level";
}

TEST(LookAt, LengthsAndMagnitudesOfTheArgumentsDoNotMatter) {
  const Camera a = look_at({0, 0, 0}, {1, 1, 2}, {0, -1, 0}, 50, 64, 64);
  const Camera b = look_at({0, 0, 0}, {1e200, 1e200, 2e200}, {0, -1e-200, 0}, 50, 64, 64);
  for (std::size_t row = 0; row < 3; ++row) expect_near(a.rotation[row], b.rotation[row], 1e-15);
}

TEST(LookAt, RefusesWhatHasNoDirection) {
  expect_user_error(
      [] {
        look_at({1, 2, 3}, {1, 2, 3}, {0, -1, 0}, 50, 64, 64);
      },
      {"--look-at", "where the camera stands"});
  expect_user_error([] { look_at({0, 0, 0}, {0, 3, 0}, {0, -1, 0}, 50, 64, 64); }, {"--up", "parallel"});
  expect_user_error([] { look_at({0, 0, 0}, {0, 0, 1}, {0, 0, 0}, 50, 64, 64); }, {"--up", "no direction"});
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  expect_user_error([=] { look_at({nan, 0, 0}, {0, 0, 1}, {0, -1, 0}, 50, 64, 64); }, {"--eye", "not finite"});
  expect_user_error([=] { look_at({0, 0, 0}, {0, 0, infinity}, {0, -1, 0}, 50, 64, 64); }, {"--look-at", "not finite"});
  expect_user_error([=] { look_at({0, 0, 0}, {0, 0, 1}, {0, -infinity, 0}, 50, 64, 64); }, {"--up", "not finite"});
}

// P05: a field of view of 180 degrees.
TEST(LookAt, AnUpThatIsParallelIsNamedByWhereItComesFromWithOneThatIsNot) {
  for (const Vec3& up : {Vec3{0, 0, 1}, Vec3{0, -1, 0}, Vec3{1, 0, 0}, Vec3{3, -2, 9}}) {
    View view;
    view.eye = {1, 2, 3};
    view.look_at = view.eye + up;
    view.up = up;
    std::string suggested = up_for_view(view.eye, view.look_at);
    expect_user_error(
        [&] {
          look_at(view, {64, 64});
        },
        {"(--up)", "it is parallel", "another direction, e.g. " + suggested});
    view.up_source = "scene.ply";
    expect_user_error(
        [&] {
          look_at(view, {64, 64});
        },
        {"(scene.ply): the up of its world, ", "is parallel", "e.g. --up " + suggested});
    Vec3 other;
    for (std::size_t i = 0; i < 3; ++i) {
      other[i] = std::stod(suggested);
      suggested.erase(0, suggested.find(',') + 1);
    }
    view.up = other;
    EXPECT_NO_THROW(look_at(view, {64, 64}));
  }
}

TEST(LookAt, WithoutPerspectiveTheHeightIsInWorldUnits) {
  View view;
  view.eye = {3, 1, -4};
  view.look_at = {-1, 0.5, 2};
  const Camera perspective = look_at(view, {640, 480});
  EXPECT_EQ(perspective.projection, Projection::perspective);
  view.orthographic_height = 2.5;
  const Camera camera = look_at(view, {640, 480});
  EXPECT_EQ(camera.projection, Projection::orthographic);
  EXPECT_EQ(camera.fy, 192);
  EXPECT_EQ(camera.fx, 192);
  EXPECT_EQ(camera.eye, perspective.eye);
  EXPECT_EQ(camera.rotation, perspective.rotation);
  EXPECT_EQ(resized(camera, {320, 240}).fy, 96) << "the same height of the world";
  for (const double height : {0.0, -1.0, 1e-10, 1e10, std::nan("")}) {
    view.orthographic_height = height;
    expect_user_error([&] { look_at(view, {640, 480}); }, {"--orthographic", "world units high", "1e-09 to 1e+09"});
  }
}

TEST(WindowDepth, WithoutPerspectiveIsLinear) {
  Camera camera;
  camera.projection = Projection::orthographic;
  camera.near_plane = 1;
  camera.far_plane = 5;
  for (const double z : {1.0, 2.0, 3.5, 5.0}) EXPECT_EQ(window_depth(camera, z), (z - 1) / 4);
  EXPECT_EQ(window_depth(camera, 0.5), 0);
  EXPECT_EQ(window_depth(camera, 6), 1);
}

TEST(LookAt, FieldOfViewMustLieBetweenZeroAndAlmost180Degrees) {
  for (const double fovy : {0.0, -10.0, 179.999, 180.0, 1e9, std::nan("")}) {
    expect_user_error([=] { look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, fovy, 64, 64); }, {"--fovy"});
  }
  expect_user_error([] { look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 1e-300, 64, 64); }, {" is 1e-300 degrees"});
  expect_user_error([] { look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 1e300, 64, 64); }, {" is 1e+300 degrees"});
  for (const double fovy : {1e-6, 0.01, 179.9, 179.9989}) {
    const Camera camera = look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, fovy, 64, 64);
    EXPECT_TRUE(std::isfinite(camera.fy) && camera.fy > 0);
    EXPECT_NEAR(camera.fy / (32 / std::tan(fovy * 3.14159265358979323846 / 360)), 1.0, 1e-9);
  }
}

TEST(LookAt, ImageSizeMustBeOneTo16384) {
  for (const std::uint32_t side : {0u, 16385u, 4294967295u}) {
    expect_user_error([=] { look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 50, side, 64); }, {"image size", "1 to 16384"});
    expect_user_error([=] { look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 50, 64, side); }, {"image size", "1 to 16384"});
  }
  EXPECT_EQ(look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 50, 16384, 1).width, 16384u);
}

TEST(Resized, ThePrincipalPointStaysWhereItIsInTheImage) {
  Camera camera = look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 60, 320, 240);
  EXPECT_EQ(camera.cx(), 160);
  EXPECT_EQ(camera.cy(), 120);
  camera.principal_x = -60;
  camera.principal_y = -60;
  EXPECT_EQ(camera.cx(), 100);
  const Camera half = resized(camera, {160, 120});
  EXPECT_EQ(half.cx(), 50);
  EXPECT_EQ(half.cy(), 30);
  const Camera wide = resized(camera, {640, 240});
  EXPECT_EQ(wide.cx(), 260) << "as far from the centre, as everything";
  EXPECT_EQ(wide.cy(), 60);
}

TEST(CheckCamera, RefusesAPrincipalPointFarOutAndNone) {
  for (const double far_out : {1.1e6, -1e300, std::nan(""), std::numeric_limits<double>::infinity()}) {
    for (const bool is_x : {true, false}) {
      Camera camera;
      (is_x ? camera.principal_x : camera.principal_y) = far_out;
      expect_user_error([&] { check_camera(camera, "cannot use it"); }, {"cannot use it", "principal point"});
    }
  }
}

TEST(Resized, KeepsTheVerticalFieldOfViewAndSquarePixels) {
  const Camera camera = resized(look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 50, 640, 480), {1000, 240});
  EXPECT_EQ(camera.width, 1000u);
  EXPECT_NEAR(camera.fy, look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 50, 1000, 240).fy, 1e-12);
  EXPECT_EQ(camera.fx, camera.fy);
  expect_user_error([&] { resized(camera, {0, 240}); }, {"--size"});
}

class CameraFile : public testing::FolderTest {
 protected:
  static nlohmann::json camera_json() {
    return {{"id", 0},
            {"img_name", "00001"},
            {"width", 64},
            {"height", 48},
            {"position", {1, 2, 3}},
            {"rotation", {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
            {"fx", 50.0},
            {"fy", 51.0}};
  }
  void expect_refused(const std::string& text, const std::vector<std::string>& parts) {
    const std::string path = write("cameras.json", text).string();
    expect_user_error([&] { load_cameras(path); }, parts);
  }
  void expect_refused_with(const char* key, const nlohmann::json& value, const std::vector<std::string>& parts) {
    nlohmann::json camera = camera_json();
    camera[key] = value;
    expect_refused(nlohmann::json::array({camera}).dump(), parts);
  }
};

TEST_F(CameraFile, ReadsTheInriaLayout) {
  nlohmann::json second = camera_json();
  second["rotation"] = {{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}};
  const std::string path = write("cameras.json", nlohmann::json::array({camera_json(), second}).dump()).string();
  const std::vector<Camera> cameras = load_cameras(path);
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0].eye, (Vec3{1, 2, 3}));
  EXPECT_EQ(cameras[0].fx, 50);
  EXPECT_EQ(cameras[0].fy, 51);
  EXPECT_EQ(column(cameras[1], 2), (Vec3{1, 0, 0})) << "columns are right, down, forward";
}

TEST_F(CameraFile, IndexSelectsAndSizeRescales) {
  nlohmann::json second = camera_json();
  second["fx"] = 70;
  const std::string path = write("cameras.json", nlohmann::json::array({camera_json(), second}).dump()).string();
  EXPECT_EQ(camera_from_file(path).camera.fx, 50);
  EXPECT_EQ(camera_from_file(path + "#1").camera.fx, 70);
  EXPECT_EQ(camera_from_file(path + "#1").name.index, 1U);
  EXPECT_EQ(camera_from_file(path + "#1").name.file, path);
  const Camera large = camera_from_file(path + "#1", ImageSize{200, 96}).camera;
  EXPECT_EQ(large.fx, 140);
  EXPECT_EQ(large.fy, 102);
  EXPECT_EQ(large.width, 200u);
  expect_user_error([&] { camera_from_file(path + "#2"); }, {"no camera 2", "the file has 2", "0 to 1"});
  for (const char* index : {"#-1", "#x", "#1x", "#01", "#99999999999999999999"}) {
    expect_user_error([&] { camera_from_file(path + index); }, {path + index, "none of its 2 cameras", "0 to 1"});
  }
  expect_user_error([&] { camera_from_file(path + "#"); }, {path + "#", "FILE#INDEX", "FILE#NAME"});
}

TEST_F(CameraFile, WhatCannotBeUsedIsNamed) {
  expect_user_error([&] { load_cameras(in_folder("none.json").string()); },
                    {"cannot read camera file", "no such file"});
  expect_refused("[\n{", {"line 2", "not valid JSON at byte 4"});
  expect_refused("[1e999]", {"out of range"});
  for (const char* text : {"{}", "3", "# cameras"}) {
    expect_refused(text, {"none of the kinds", "INRIA cameras.json", "NeRF transforms.json", "COLMAP model"});
  }
  expect_refused("[3]", {"camera 0", "not an object"});
  for (const char* key : {"width", "height", "position", "rotation", "fx", "fy"}) {
    nlohmann::json camera = camera_json();
    camera.erase(key);
    expect_refused(nlohmann::json::array({camera_json(), camera}).dump(),
                   {"camera 1", std::string("no \"") + key + "\""});
  }
  expect_refused_with("width", 0, {"\"width\"", "1 to 16384"});
  expect_refused_with("height", 16385, {"\"height\"", "1 to 16384"});
  expect_refused_with("width", 3.5, {"\"width\""});
  expect_refused_with("position", {1, 2}, {"\"position\"", "3 numbers"});
  expect_refused_with("position", {1, 2, "x"}, {"\"position\"", "not a number"});
  expect_refused_with("rotation", {{1, 0, 0}, {0, 1, 0}}, {"\"rotation\"", "3 rows"});
  expect_refused_with("rotation", {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}}, {"not a rotation matrix", "right-handed"});
  expect_refused_with("rotation", {{2, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {"not a rotation matrix"});
  expect_refused_with("fx", 0, {"focal length"});
  expect_refused_with("fy", -5, {"focal length"});
  const std::string empty = write("empty.json", "[]").string();
  expect_user_error([&] { camera_from_file(empty); }, {"no camera 0", "the file has 0"});
}

TEST(RealCameras, InriaTrainCamerasLoad) {
  const std::vector<Camera> cameras = load_cameras(testing::data_file("train_cameras.json").string());
  ASSERT_EQ(cameras.size(), 10u);
  EXPECT_EQ(cameras[0].width, 1959u);
  EXPECT_NEAR(cameras[0].fy, 1164.66, 0.01);
}

TEST(RealCameras, LookAtAgreesWithAnotherRenderersViews) {
  const auto vec = [](const nlohmann::json& v) { return Vec3{v[0], v[1], v[2]}; };
  const auto views = nlohmann::json::parse(testing::read_bytes(testing::data_file("views.json")));
  ASSERT_EQ(views.size(), 10u);
  for (const auto& view : views) {
    const Camera camera = look_at(vec(view["eye"]), vec(view["look_at"]), vec(view["up"]), view["fovy_deg"],
                                  view["width"], view["height"]);
    EXPECT_NEAR(camera.fy, view["fy"].get<double>(), 1e-9);
    for (std::size_t row = 0; row < 3; ++row) expect_near(camera.rotation[row], vec(view["rotation"][row]), 1e-9);
  }
}

}  // namespace
}  // namespace vrpipe
