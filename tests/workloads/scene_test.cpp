#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/scene.h>

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include <vrpipe/workloads/draw_list.h>

#include "../support/reference_renderer.h"
#include "workload_test_support.h"

namespace vrpipe {
namespace {

using testing::expect_user_error;

class SceneFile : public testing::FolderTest {
 protected:
  SceneFile() {
    std::vector<GaussianAttributes> gaussians(4, testing::ordinary_gaussian());
    gaussians[1].position = {1, 0, 6};
    gaussians[2].position = {0, 1, 5};
    gaussians[3].rotation = {0, 0, 0, 0};
    write_gaussian_file(in_folder("four.ply"), testing::scene_of(gaussians));
    request_.scene = in_folder("four.ply").string();
  }
  SceneRequest request_;
};

TEST_F(SceneFile, PlyWithoutAnyOptionGetsAViewThatShowsItAll) {
  const LoadedScene loaded = load_scene(request_);
  EXPECT_EQ(loaded.summary.name, "four.ply");
  EXPECT_EQ(loaded.summary.gaussians_total, 4u);
  EXPECT_EQ(loaded.summary.gaussians_visible, 3u);
  EXPECT_EQ(loaded.summary.rejected.zero_quaternion, 1u);
  EXPECT_EQ(loaded.draw.width, kDefaultImageSize.width);
  EXPECT_EQ(loaded.draw.height, kDefaultImageSize.height);
  for (const Splat& s : loaded.draw.splats) {
    EXPECT_TRUE(s.cx > 0 && s.cx < static_cast<float>(loaded.draw.width) && s.cy > 0 &&
                s.cy < static_cast<float>(loaded.draw.height));
  }
}

TEST_F(SceneFile, TheWorldsUpIsMinusYUnlessSaidOtherwise) {
  request_.eye = Vec3{0, 0, 0};
  request_.look_at = Vec3{0, 0, 1};
  const auto lowest = [](const Draw& draw) {
    return std::max_element(draw.splats.begin(), draw.splats.end(),
                            [](const Splat& a, const Splat& b) { return a.cy < b.cy; })
        ->cy;
  };
  const auto highest = [](const Draw& draw) {
    return std::min_element(draw.splats.begin(), draw.splats.end(),
                            [](const Splat& a, const Splat& b) { return a.cy < b.cy; })
        ->cy;
  };
  const float middle = static_cast<float>(kDefaultImageSize.height) / 2;
  EXPECT_GT(lowest(load_scene(request_).draw), middle + 50) << "the one at y = 1 is below";
  request_.up = Vec3{0, 1, 0};
  EXPECT_LT(highest(load_scene(request_).draw), middle - 50) << "with y up it is above";
}

TEST_F(SceneFile, ViewOptionsReplaceWhatTheyName) {
  request_.eye = Vec3{0, 0, 0};
  request_.look_at = Vec3{0, 0, 1};
  request_.fovy_degrees = 90;
  request_.size = ImageSize{64, 64};
  SceneSummary summary;
  const Draw expected = preprocess(read_gaussian_file(request_.scene).gaussians,
                                   look_at({0, 0, 0}, {0, 0, 1}, {0, -1, 0}, 90, 64, 64), {}, summary);
  const Draw draw = load_scene(request_).draw;
  ASSERT_EQ(draw.splats.size(), expected.splats.size());
  EXPECT_EQ(std::memcmp(draw.splats.data(), expected.splats.data(), draw.splats.size() * sizeof(Splat)), 0);
}

TEST_F(SceneFile, CameraFileGivesSizeAndViewAndExcludesViewOptions) {
  write("cameras.json",
        R"([{"width":64,"height":48,"position":[0,0,0],"rotation":[[1,0,0],[0,1,0],[0,0,1]],"fx":40,"fy":40}])");
  request_.camera = in_folder("cameras.json").string();
  EXPECT_EQ(load_scene(request_).draw.height, 48u);
  EXPECT_EQ(load_scene(request_).draw.splats[0].cx, 32);
  request_.size = ImageSize{128, 96};
  EXPECT_EQ(load_scene(request_).draw.splats[0].cx, 64);
  request_.fovy_degrees = 40;
  expect_user_error([&] { load_scene(request_); }, {"--fovy", "--camera gives a whole camera"});
  request_.fovy_degrees.reset();
  request_.eye = Vec3{};
  expect_user_error([&] { load_scene(request_); }, {"--eye", "--camera gives a whole camera"});
}

TEST_F(SceneFile, APrincipalPointOffTheCentreShowsThatPartOfALargerImageWhicheverKindOfFileSaysIt) {
  const std::string pose = R"("position":[0,0,0],"rotation":[[1,0,0],[0,1,0],[0,0,1]])";
  write("whole.json", R"([{"width":80,"height":60,)" + pose + R"(,"fx":40,"fy":40}])");
  write("inria.json", R"([{"width":64,"height":48,)" + pose + R"(,"fx":40,"fy":40,"cx":40,"cy":30}])");
  write("transforms.json", R"({"fl_x":40,"fl_y":40,"cx":40,"cy":30,"w":64,"h":48,)"
                           R"("frames":[{"transform_matrix":[[1,0,0,0],[0,-1,0,0],[0,0,-1,0],[0,0,0,1]]}]})");
  write("cameras.txt", "1 PINHOLE 64 48 40 40 40 30\n");
  write("images.txt", "1 1 0 0 0 0 0 0 1 a.png\n\n");
  const auto drawn = [&](const std::string& camera) {
    request_.camera = in_folder(camera).string();
    return testing::render_reference(load_scene(request_).draw);
  };
  const testing::ReferenceImage whole = drawn("whole.json");
  unsigned drawn_pixels = 0;
  for (const char* file : {"inria.json", "transforms.json", "cameras.txt"}) {
    const testing::ReferenceImage part = drawn(file);
    ASSERT_EQ(part.width, 64U);
    for (std::uint32_t y = 0; y < part.height; ++y) {
      for (std::uint32_t x = 0; x < part.width; ++x) {
        ASSERT_EQ(part.at(x, y), whole.at(x, y)) << file << " at " << x << "," << y;
        drawn_pixels += part.at(x, y)[3] > 0 ? 1U : 0U;
      }
    }
  }
  EXPECT_GT(drawn_pixels, 100U);
}

TEST_F(SceneFile, WhatWasAssumedOfACameraIsAmongTheNotesOnce) {
  write("transforms.json", R"({"camera_angle_x":1,"camera_model":"OPENCV","k1":0.1,)"
                           R"("frames":[{"transform_matrix":[[1,0,0,0],[0,-1,0,0],[0,0,-1,0],[0,0,0,1]]}]})");
  request_.camera = in_folder("transforms.json").string();
  const std::vector<std::string> notes = load_scene(request_).summary.notes;
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_NE(notes[0].find("800x800"), std::string::npos) << notes[0];
  EXPECT_NE(notes[1].find("taken as undistorted"), std::string::npos) << notes[1];
  request_.lenses = Lenses::undistorted;
  EXPECT_NE(load_scene(request_).summary.notes.at(1).find("--undistorted"), std::string::npos);
}

TEST_F(SceneFile, WithoutPerspectiveTheViewIsThatOfTheOptions) {
  request_.orthographic_height = 3;
  request_.size = ImageSize{64, 48};
  const OpenedScene scene = open_scene(request_);
  EXPECT_EQ(scene.viewpoint.camera.projection, Projection::orthographic);
  EXPECT_EQ(scene.viewpoint.camera.fy, 16);
  EXPECT_EQ(scene.viewpoint.view->orthographic_height, 3);
  EXPECT_EQ(preprocess_scene(scene, {}).summary.gaussians_visible, 3U) << "where a perspective would see all";
  for (const View& view : orbit_views(*scene.viewpoint.view, 3)) EXPECT_EQ(view.orthographic_height, 3);
  request_.fovy_degrees = 40;
  expect_user_error([&] { load_scene(request_); }, {"--fovy", "--orthographic is without perspective"});
  request_.fovy_degrees.reset();
  request_.camera = "cameras.json";
  expect_user_error([&] { load_scene(request_); }, {"--orthographic", "--camera gives a whole camera"});
}

TEST(BuiltinRequest, TheDefaultMayBeSeenWithoutPerspective) {
  SceneRequest request;
  request.size = ImageSize{64, 64};
  request.orthographic_height = 4;
  EXPECT_EQ(open_scene(request).viewpoint.camera.fx, 16);
}

TEST_F(SceneFile, AnUpThatNobodyGaveIsNamedAsTheScenes) {
  request_.eye = Vec3{0, 5, 0};
  request_.look_at = Vec3{0, 0, 0};
  expect_user_error([&] { load_scene(request_); },
                    {"four.ply): the up of its world, 0,-1,0, is parallel to the view from --eye to --look-at",
                     "--up 0,0,1"});
  request_.up = Vec3{0, 2, 0};
  expect_user_error([&] { load_scene(request_); }, {"(--up): it is parallel", "e.g. 0,0,1"});
  request_.scene = "builtin:object";
  request_.up.reset();
  expect_user_error([&] { load_scene(request_); }, {"(builtin:object): the up of its world, ", "is parallel"});
}

TEST_F(SceneFile, ADrawListComesInAsItIsAndRefusesCameras) {
  LoadedScene original = load_scene(request_);
  write_draw_list(in_folder("saved.SPL"), original.draw);
  SceneRequest replay;
  replay.scene = in_folder("saved.SPL").string();
  const LoadedScene loaded = load_scene(replay);
  ASSERT_EQ(loaded.draw.splats.size(), original.draw.splats.size());
  for (Splat& splat : original.draw.splats) splat.depth = 0;  // which the format does not have
  EXPECT_EQ(std::memcmp(loaded.draw.splats.data(), original.draw.splats.data(),
                        original.draw.splats.size() * sizeof(Splat)),
            0);
  EXPECT_EQ(loaded.draw.width, original.draw.width);
  EXPECT_EQ(loaded.summary.gaussians_total, 3u);
  EXPECT_EQ(loaded.summary.name, "saved.SPL");
  SceneRequest sized = replay;
  sized.size = ImageSize{64, 64};
  expect_user_error([&] { load_scene(sized); }, {"--size", ".spl"});
  SceneRequest viewed = replay;
  viewed.up = Vec3{0, 1, 0};
  expect_user_error([&] { load_scene(viewed); }, {"--up", ".spl"});
  viewed = replay;
  viewed.orthographic_height = 2;
  expect_user_error([&] { load_scene(viewed); }, {"--orthographic", ".spl"});
  SceneRequest filmed = replay;
  filmed.camera = "cameras.json";
  expect_user_error([&] { load_scene(filmed); }, {"--camera", ".spl"});
  SceneRequest preprocessed = replay;
  preprocessed.preprocess.sh_degree = 1;
  expect_user_error([&] { load_scene(preprocessed); }, {"preprocess.sh_degree", "preprocessed already"});
  preprocessed.preprocess = {};
  preprocessed.preprocess.depth_key_bits = 16;
  expect_user_error([&] { load_scene(preprocessed); }, {"preprocess.depth_key_bits", "preprocessed already"});
}

TEST_F(SceneFile, AnOpenedSceneCanBePreprocessedAgain) {
  const OpenedScene scene = open_scene(request_);
  for (const int bits : {32, 12, 32}) {
    request_.preprocess.depth_key_bits = bits;
    const LoadedScene expected = load_scene(request_);
    const LoadedScene again = preprocess_scene(scene, request_.preprocess);
    EXPECT_TRUE(again.preprocessed_here);
    EXPECT_EQ(again.summary.name, expected.summary.name);
    ASSERT_EQ(again.draw.splats.size(), expected.draw.splats.size());
    EXPECT_EQ(std::memcmp(again.draw.splats.data(), expected.draw.splats.data(),
                          expected.draw.splats.size() * sizeof(Splat)),
              0);
  }
  write_draw_list(in_folder("saved.spl"), load_scene(request_).draw);
  SceneRequest replay;
  replay.scene = in_folder("saved.spl").string();
  const LoadedScene list = preprocess_scene(open_scene(replay), {});
  EXPECT_FALSE(list.preprocessed_here);
  EXPECT_EQ(list.summary.name, "saved.spl");
  EXPECT_EQ(list.draw.splats.size(), load_scene(request_).draw.splats.size());
}

TEST_F(SceneFile, UnknownKindsOfFilesAreRefusedWithWhatIsSupported) {
  request_.scene = write("scene.3ds", "MM").string();
  expect_user_error([&] { load_scene(request_); },
                    {"scene.3ds", "known format", ".ply", ".splat", ".spl", "builtin:NAME"});
  request_.scene = "objct";
  expect_user_error([&] { load_scene(request_); },
                    {"no such file", "or take a built-in scene: did you mean builtin:object?"});
  request_.scene = "builtin:objekt";
  expect_user_error([&] { load_scene(request_); }, {"builtin:object?"});
}

TEST_F(SceneFile, SizeOutOfRangeIsRefused) {
  request_.size = ImageSize{0, 10};
  expect_user_error([&] { load_scene(request_); }, {"--size", "0x10", "1 to 16384"});
  request_.size = ImageSize{10, 16385};
  expect_user_error([&] { load_scene(request_); }, {"--size", "10x16385"});
}

TEST_F(SceneFile, AnEmptySceneIsAnEmptyDraw) {
  write_gaussian_file(in_folder("none.ply"), GaussianScene());
  request_.scene = in_folder("none.ply").string();
  EXPECT_TRUE(load_scene(request_).draw.splats.empty());
}

TEST_F(SceneFile, GaussiansTooFarOutForACameraBesideThemAreRefusedForThat) {
  GaussianAttributes far = testing::ordinary_gaussian();
  far.position = {-1e38F, -1e38F, -1e38F};
  write_gaussian_file(in_folder("far.ply"), testing::scene_of({far, far}));
  request_.scene = in_folder("far.ply").string();
  expect_user_error([&] { load_scene(request_); }, {"far.ply", "-1e+38,-1e+38,-1e+38", "too far out", "--camera"});
  request_.eye = Vec3{0, 0, 0};
  EXPECT_EQ(load_scene(request_).summary.gaussians_total, 2u) << "with a camera elsewhere it can be drawn";
}

TEST(SceneName, IsTheFilesWithoutFolderOrTheBuiltInOnes) {
  EXPECT_EQ(scene_name(""), "builtin:object");
  EXPECT_EQ(scene_name("builtin:indoor"), "builtin:indoor");
  EXPECT_EQ(scene_name("a/b.c/scene.ply"), "scene.ply");
}

TEST(BuiltinRequest, TheDefaultIsTheObjectSceneAndOptionsChangeIt) {
  SceneRequest request;
  request.size = ImageSize{100, 80};
  const LoadedScene loaded = load_scene(request);
  EXPECT_EQ(loaded.summary.name, "builtin:object");
  EXPECT_EQ(loaded.draw.width, 100u);
  EXPECT_GT(loaded.summary.gaussians_visible, 100000u);
  request.eye = Vec3{0, -20, 0.001};
  EXPECT_NE(load_scene(request).summary.gaussians_visible, loaded.summary.gaussians_visible);
}

TEST(RealScene, AScannedRobotRendersAsInAnotherRenderer) {
  const testing::UnpackedFile robot("robot.ply");
  SceneRequest request;
  request.scene = robot.path().string();
  request.eye = Vec3{-2, -1.5, -2};
  request.look_at = Vec3{0, -0.35, 0};
  request.fovy_degrees = 45;
  request.size = ImageSize{640, 480};
  const LoadedScene loaded = load_scene(request);
  EXPECT_EQ(loaded.summary.gaussians_total, 125000u);
  // A CPU renderer that shares no code with this one kept 124862 and lets 0.6972 of the light through.
  EXPECT_NEAR(static_cast<double>(loaded.summary.gaussians_visible), 124862, 700);
  const testing::ReferenceImage image = testing::render_reference(loaded.draw);
  double transmitted = 0;
  for (const auto& rgba : image.rgba) transmitted += 1 - rgba[3];
  EXPECT_NEAR(transmitted / static_cast<double>(image.rgba.size()), 0.6972, 0.01);
}

/// A tensor of a safetensors file: an 8-byte header length, a JSON header, raw data.
std::vector<float> read_tensor(const std::string& bytes, const std::string& name) {
  std::uint64_t length = 0;
  std::memcpy(&length, bytes.data(), sizeof length);
  const auto header = nlohmann::json::parse(bytes.substr(8, static_cast<std::size_t>(length)));
  const std::size_t begin = header.at(name).at("data_offsets").at(0), end = header.at(name).at("data_offsets").at(1);
  std::vector<float> values((end - begin) / sizeof(float));
  std::memcpy(values.data(), bytes.data() + 8 + length + begin, end - begin);
  return values;
}

TEST(GoldenImage, AgreesWithGsplatWithinSixThousandths) {
  const std::string bytes = testing::unpacked("gsplat_case.safetensors");
  const auto means = read_tensor(bytes, "means"), scales = read_tensor(bytes, "scales"),
             quats = read_tensor(bytes, "quats"), opacities = read_tensor(bytes, "opacities"),
             coefficients = read_tensor(bytes, "coeffs"), golden = read_tensor(bytes, "out_img");
  std::vector<GaussianAttributes> gaussians(opacities.size());
  for (std::size_t i = 0; i < gaussians.size(); ++i) {
    GaussianAttributes& g = gaussians[i];
    for (std::size_t k = 0; k < 3; ++k) {
      g.position[k] = means[3 * i + k];
      g.log_scale[k] = scales[3 * i + k];
      g.f_dc[k] = coefficients[48 * i + k];
      for (std::size_t c = 1; c < 16; ++c) g.f_rest[k][c - 1] = coefficients[48 * i + 3 * c + k];
    }
    for (std::size_t k = 0; k < 4; ++k) g.rotation[k] = quats[4 * i + k];
    g.opacity_logit = opacities[i];
  }
  Camera camera;
  camera.eye = {0.123, 0.456, -8};
  camera.fx = camera.fy = 61.5;
  camera.width = 123;
  camera.height = 82;
  SceneSummary summary;
  const Draw draw = preprocess(testing::scene_of(gaussians, 3), camera, {}, summary);
  const testing::ReferenceImage image = testing::render_reference(draw);
  ASSERT_EQ(golden.size(), image.rgba.size() * 4);
  double largest = 0, brightest = 0;
  for (std::size_t i = 0; i < golden.size(); ++i) {
    largest = std::max(largest, std::fabs(image.rgba[i / 4][i % 4] - static_cast<double>(golden[i])));
    brightest = std::max(brightest, static_cast<double>(golden[i]));
  }
  EXPECT_LE(largest, 0.006);
  EXPECT_GT(brightest, 0.3) << "the golden image is not empty";
}

}  // namespace
}  // namespace vrpipe
