#include <vrpipe/workloads/camera.h>

#include <cmath>
#include <functional>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "workload_test_support.h"

namespace vrpipe {
namespace {

using nlohmann::json;
using testing::expect_user_error;

// Two cameras, worked out by hand.
// a.jpg: a quaternion of w2c = (0.5, 0.5, 0.5, 0.5) turns x to y, y to z and z to x. So the camera's right, which w2c takes
//   to (1, 0, 0), is the world's z, its down x and its forward y; it stands at (1, 2, 3), so that t = -(3, 1, 2).
// b.jpg: w2c = (0.8, 0, 0.6, 0) turns round y by an angle of cosine 0.28 and sine 0.96; it stands at (2, -1, 4), so that
//   t = -(0.28 * 2 + 0.96 * 4, -1, -0.96 * 2 + 0.28 * 4).

constexpr double k28 = 0.28, k96 = 0.96;

std::vector<Camera> by_hand() {
  std::vector<Camera> cameras(2);
  cameras[0].name = "a.jpg";
  cameras[0].eye = {1, 2, 3};
  cameras[0].rotation = {Vec3{0, 1, 0}, Vec3{0, 0, 1}, Vec3{1, 0, 0}};
  cameras[1].name = "b.jpg";
  cameras[1].eye = {2, -1, 4};
  cameras[1].rotation = {Vec3{k28, 0, -k96}, Vec3{0, 1, 0}, Vec3{k96, 0, k28}};
  for (Camera& camera : cameras) {
    camera.width = 64;
    camera.height = 48;
    camera.fx = 50;
    camera.fy = 51;
  }
  return cameras;
}

json inria() {
  json cameras = json::array();
  for (const Camera& camera : by_hand()) {
    json rows = json::array();
    for (const Vec3& row : camera.rotation) rows.push_back({row.x, row.y, row.z});
    cameras.push_back({{"img_name", camera.name},
                       {"width", 64},
                       {"height", 48},
                       {"position", {camera.eye.x, camera.eye.y, camera.eye.z}},
                       {"rotation", rows},
                       {"fx", 50},
                       {"fy", 51}});
  }
  return cameras;
}

json transforms() {
  return {{"fl_x", 50},
          {"fl_y", 51},
          {"w", 64},
          {"h", 48},
          {"cx", 32},
          {"cy", 24},
          {"k1", 0},
          {"p2", 0.0},
          {"camera_model", "OPENCV"},
          {"frames",
           {{{"file_path", "a.jpg"}, {"transform_matrix", {{0, -1, 0, 1}, {0, 0, -1, 2}, {1, 0, 0, 3}, {0, 0, 0, 1}}}},
            {{"file_path", "b.jpg"},
             {"transform_matrix", {{k28, 0, k96, 2}, {0, -1, 0, -1}, {k96, 0, -k28, 4}, {0, 0, 0, 1}}}}}}};
}

constexpr char kCamerasText[] =
    "# Camera list with one line of data per camera:\n"
    "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
    "7 PINHOLE 64 48 50 51 32 24\n";
// The images stand in no order, the second has no points.
constexpr char kImagesText[] =
    "# Image list with two lines of data per image:\n"
    "2 0.8 0 0.6 0 -4.4 1 0.8 7 b.jpg\n"
    "1.5 2.5 -1 3.5 4.5 11\n"
    "9 0.5 0.5 0.5 0.5 -3 -1 -2 7 a.jpg\n"
    "\n";

/// Little-endian, as COLMAP writes.
class Binary {
 public:
  template <class Number>
  Binary& add(Number value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  Binary& add(const std::vector<double>& values) {
    for (const double value : values) add(value);
    return *this;
  }
  Binary& text(const std::string& value) {
    bytes_.append(value.c_str(), value.size() + 1);
    return *this;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string cameras_binary(std::uint64_t count = 1, std::uint32_t model = 1,
                           const std::vector<double>& parameters = {50, 51, 32, 24}) {
  Binary file;
  file.add(count).add(std::uint32_t{7}).add(model).add(std::uint64_t{64}).add(std::uint64_t{48}).add(parameters);
  return file.bytes();
}

std::string images_binary(std::uint64_t count = 2, std::uint64_t points = 2) {
  Binary file;
  file.add(count);
  file.add(std::uint32_t{2}).add({0.8, 0, 0.6, 0, -4.4, 1, 0.8}).add(std::uint32_t{7}).text("b.jpg").add(points);
  for (const double x : {1.5, 3.5}) file.add(x).add(2.5).add(std::int64_t{-1});
  file.add(std::uint32_t{9}).add({0.5, 0.5, 0.5, 0.5, -3, -1, -2}).add(std::uint32_t{7}).text("a.jpg");
  file.add(std::uint64_t{0});
  return file.bytes();
}

void expect_same(const std::vector<Camera>& cameras, const std::vector<Camera>& expected) {
  ASSERT_EQ(cameras.size(), expected.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Camera &camera = cameras[i], &other = expected[i];
    SCOPED_TRACE(camera.name);
    EXPECT_EQ(camera.name, other.name);
    EXPECT_EQ(camera.width, other.width);
    EXPECT_EQ(camera.height, other.height);
    EXPECT_NEAR(camera.fx, other.fx, 1e-9 * other.fx);
    EXPECT_NEAR(camera.fy, other.fy, 1e-9 * other.fy);
    EXPECT_EQ(camera.cx(), other.cx());
    EXPECT_EQ(camera.cy(), other.cy());
    EXPECT_EQ(camera.projection, other.projection);
    EXPECT_LE(glm::length(camera.eye - other.eye), 1e-12);
    for (std::size_t row = 0; row < 3; ++row) {
      EXPECT_LE(glm::length(camera.rotation[row] - other.rotation[row]), 1e-12) << "row " << row;
    }
  }
}

class CameraFiles : public testing::FolderTest {
 protected:
  std::string write_json(const json& document) const { return write("cameras.json", document.dump()).string(); }
  /// A folder with both files of a model.
  std::string write_model(const std::string& extension, const std::string& cameras, const std::string& images) const {
    write("cameras" + extension, cameras);
    write("images" + extension, images);
    return in_folder("").string();
  }
  void expect_transforms_refused(const std::function<void(json&)>& change, const std::vector<std::string>& parts) {
    json document = transforms();
    change(document);
    const std::string path = write_json(document);
    expect_user_error([&] { load_cameras(path); }, parts);
  }
  void expect_text_refused(const std::string& cameras, const std::string& images,
                           const std::vector<std::string>& parts) {
    const std::string folder = write_model(".txt", cameras, images);
    expect_user_error([&] { load_cameras(folder); }, parts);
  }
};

TEST_F(CameraFiles, TheSameCamerasInEveryFormatAreTheSame) {
  expect_same(load_cameras(write_json(inria())), by_hand());
  expect_same(load_cameras(write_json(transforms())), by_hand());
  expect_same(load_cameras(write_model(".txt", kCamerasText, kImagesText)), by_hand());
  expect_same(load_cameras(write_model(".bin", cameras_binary(), images_binary())), by_hand());
}

TEST_F(CameraFiles, RealInriaCamerasAreTheSameAsTransforms) {
  const std::vector<Camera> real = load_cameras(testing::data_file("train_cameras.json").string());
  ASSERT_EQ(real.size(), 10U);
  EXPECT_EQ(real[1].name, "00009");
  json document{{"frames", json::array()}};
  for (const Camera& camera : real) {
    json matrix = json::array();
    for (std::size_t row = 0; row < 3; ++row) {
      const Vec3& axes = camera.rotation[row];
      matrix.push_back({axes.x, -axes.y, -axes.z, camera.eye[row]});
    }
    matrix.push_back({0, 0, 0, 1});
    document["frames"].push_back({{"file_path", camera.name},
                                  {"camera_angle_x", 2 * std::atan(0.5 * camera.width / camera.fx)},
                                  {"camera_angle_y", 2 * std::atan(0.5 * camera.height / camera.fy)},
                                  {"w", camera.width},
                                  {"h", camera.height},
                                  {"transform_matrix", matrix}});
  }
  expect_same(load_cameras(write_json(document)), real);
}

// Principal points.

TEST_F(CameraFiles, PrincipalPointsAreReadInEveryFormat) {
  std::vector<Camera> expected = by_hand();
  for (Camera& camera : expected) {
    camera.principal_x = 20.25 - 32;
    camera.principal_y = 30.5 - 24;
  }
  json cameras = inria(), document = transforms();
  for (json& camera : cameras) camera.update({{"cx", 20.25}, {"cy", 30.5}});
  document.update({{"cx", 20.25}, {"cy", 30.5}});
  expect_same(load_cameras(write_json(cameras)), expected);
  expect_same(load_cameras(write_json(document)), expected);
  const std::string text = "7 PINHOLE 64 48 50 51 20.25 30.5\n";
  expect_same(load_cameras(write_model(".txt", text, kImagesText)), expected);
  expect_same(load_cameras(write_model(".bin", cameras_binary(1, 1, {50, 51, 20.25, 30.5}), images_binary())),
              expected);
  for (Camera& camera : expected) camera.fy = 50;
  for (const char* line : {"7 SIMPLE_PINHOLE 64 48 50 20.25 30.5", "7 SIMPLE_RADIAL 64 48 50 20.25 30.5 0",
                           "7 RADIAL 64 48 50 20.25 30.5 0 0", "7 OPENCV 64 48 50 50 20.25 30.5 0 0 0 0"}) {
    std::filesystem::remove(in_folder("cameras.bin"));
    expect_same(load_cameras(write_model(".txt", line, kImagesText)), expected);
  }
  const Camera small = camera_from_file(write_json(document), ImageSize{32, 24}).camera;
  EXPECT_EQ(small.cx(), 10.125) << "scales with the image";
  EXPECT_EQ(small.cy(), 15.25);
}

TEST_F(CameraFiles, AFileWithoutAPrincipalPointHasItInTheCentreAndAFrameItsOwn) {
  json document = transforms();
  document.erase("cx");
  document["cy"] = 20;
  document["frames"][1]["cx"] = 30;
  const std::vector<Camera> cameras = load_cameras(write_json(document));
  EXPECT_EQ(cameras[0].cx(), 32);
  EXPECT_EQ(cameras[0].cy(), 20);
  EXPECT_EQ(cameras[1].cx(), 30);
  expect_transforms_refused([](json& d) { d["cx"] = 2e6; },
                            {"frame 0", "\"cx\" and \"cy\"", "principal point", "1e+06"});
  expect_transforms_refused([](json& d) { d["cy"] = "x"; }, {"\"cy\" is not a number"});
  expect_transforms_refused([](json& d) { d.erase("fl_x"), d.erase("fl_y"), d.erase("w"), d.erase("h"); },
                            {"\"cx\" is in pixels, and there is no \"w\" and \"h\""});
  expect_text_refused("7 PINHOLE 64 48 50 51 1e9 24", kImagesText, {"line 1", "principal point"});
}

// Distortion.

/// Of k1 in a camera of 64x48 with 50 pixels of focal length: at the corner r = 40 / 50, which moves by 50 k1 r^3.
constexpr double kPixelsOfK1 = 50 * 0.8 * 0.8 * 0.8;

TEST_F(CameraFiles, DistortionBelowATenthOfAPixelIsNone) {
  json document = transforms();
  document.erase("camera_model");
  document["fl_y"] = 50;
  for (const double sign : {-1.0, 1.0}) {
    document["k1"] = sign * 0.099 / kPixelsOfK1;
    const Camera camera = load_cameras(write_json(document))[0];
    EXPECT_TRUE(camera.notes.empty());
    EXPECT_EQ(camera.fx, 50);
    document["k1"] = sign * 0.101 / kPixelsOfK1;
    const std::string path = write_json(document);
    expect_user_error([&] { load_cameras(path); },
                      {"frame 0", "distorted by k1 = " + fmt::format("{:g}", document["k1"].get<double>()), "up to 0.1",
                       "--undistorted"});
  }
  // k times r^3 of COLMAP, likewise.
  for (const double pixels : {0.099, 0.101}) {
    const std::string line = fmt::format("7 SIMPLE_RADIAL 64 48 50 32 24 {}", pixels / kPixelsOfK1);
    if (pixels < 0.1) {
      EXPECT_EQ(load_cameras(write_model(".txt", line, kImagesText)).size(), 2U);
    } else {
      expect_text_refused(line, kImagesText, {"SIMPLE_RADIAL", "k = ", "colmap image_undistorter", "--undistorted"});
    }
  }
  // More of the field of view, more pixels.
  document["k1"] = 0.099 / kPixelsOfK1;
  document["w"] = 128;
  const std::string wider = write_json(document);
  expect_user_error([&] { load_cameras(wider); }, {"k1"});
}

TEST_F(CameraFiles, WhatMovesPixelsFarthestIsNamed) {
  json document = transforms();
  document.erase("camera_model");
  document.update({{"k1", 0.01}, {"k2", -0.5}, {"p1", 0.001}});
  const std::string path = write_json(document);
  expect_user_error([&] { load_cameras(path); }, {"distorted by k2 = -0.5"});
  expect_text_refused("7 FULL_OPENCV 64 48 50 50 32 24 0 0 0 0 0 0 0 0.25", kImagesText, {"FULL_OPENCV", "k6 = 0.25"});
  expect_text_refused("7 FOV 64 48 50 50 32 24 0.5", kImagesText, {"FOV", "omega = 0.5"});
  EXPECT_EQ(load_cameras(write_model(".txt", "7 FOV 64 48 50 50 32 24 1e-3", kImagesText)).size(), 2U);
  // Whose distortion overflows.
  document["k1"] = 1e308;
  document["k2"] = -1e308;
  const std::string huge = write_json(document);
  expect_user_error([&] { load_cameras(huge); }, {"distorted by k", "up to inf"});
}

TEST_F(CameraFiles, CamerasForNerfstudioAreTakenAsUndistortedAndSayIt) {
  // Each of what ns-process-data writes tells.
  const std::vector<json> marks{{{"camera_model", "OPENCV"}},
                                {{"applied_transform", json::array()}},
                                {{"ply_file_path", "sparse_pc.ply"}}};
  json document = transforms();
  document.erase("camera_model");
  document.update({{"k1", 0.058}, {"k2", -0.07}, {"p1", 1e-4}});
  for (const json& mark : marks) {
    json marked = document;
    marked.update(mark);
    const std::vector<Camera> cameras = load_cameras(write_json(marked));
    expect_same(cameras, by_hand());
    ASSERT_EQ(cameras[1].notes.size(), 1U);
    EXPECT_NE(cameras[1].notes[0].find("cameras.json are taken as undistorted: nerfstudio"), std::string::npos)
        << cameras[1].notes[0];
  }
  document["frames"][0]["colmap_im_id"] = 1;
  document["frames"][1]["colmap_im_id"] = 2;
  expect_same(load_cameras(write_json(document)), by_hand());
  EXPECT_TRUE(load_cameras(write_json(transforms()))[0].notes.empty()) << "nothing to undo";
}

TEST_F(CameraFiles, ASwitchTakesAnyLensAsUndistorted) {
  json document = transforms();
  document.erase("camera_model");
  document["k1"] = 0.058;
  const std::string path = write_json(document);
  const auto check = [](const std::vector<Camera>& cameras, const std::string& name) {
    expect_same(cameras, by_hand());
    ASSERT_EQ(cameras[0].notes.size(), 1U);
    EXPECT_NE(cameras[0].notes[0].find(name + " are taken without their distortion, as --undistorted says"),
              std::string::npos)
        << cameras[0].notes[0];
  };
  check(load_cameras(path, Lenses::undistorted), "cameras.json");
  EXPECT_EQ(camera_from_file(path + "#b", {}, Lenses::undistorted).camera.notes.size(), 1U);
  check(load_cameras(write_model(".txt", "7 OPENCV 64 48 50 51 32 24 0.1 0 0 0", kImagesText), Lenses::undistorted),
        "cameras.txt");
  expect_user_error(
      [&] {
        load_cameras(write_model(".txt", "7 SIMPLE_RADIAL_FISHEYE 64 48 50 32 24 0", kImagesText), Lenses::undistorted);
      },
      {"SIMPLE_RADIAL_FISHEYE", "no pinhole"});
}

// Without perspective.

TEST_F(CameraFiles, AnOrthophotoIsOrthographicWithPixelsForEachUnit) {
  json document = transforms();
  document["camera_model"] = "ORTHOPHOTO";
  document["k1"] = 0.1;  // which has no meaning
  std::vector<Camera> expected = by_hand();
  for (Camera& camera : expected) camera.projection = Projection::orthographic;
  expect_same(load_cameras(write_json(document)), expected);
  document.erase("fl_x");
  document.erase("fl_y");
  document["camera_angle_x"] = 1;
  const std::string path = write_json(document);
  expect_user_error([&] { load_cameras(path); }, {"frame 0", "ORTHOPHOTO", "no \"fl_x\"", "world unit"});
}

// Which camera.

TEST_F(CameraFiles, AnImagesNameChoosesACamera) {
  json document = transforms();
  document["frames"][0]["file_path"] = "images/left/frame_00042.png";
  document["frames"][1]["file_path"] = "./images/right/frame_00043.png";
  const std::string path = write_json(document);
  for (const char* name :
       {"images/left/frame_00042.png", "frame_00042.png", "images/left/frame_00042", "frame_00042"}) {
    EXPECT_EQ(camera_from_file(path + "#" + name).name.index, 0U) << name;
  }
  const NamedCamera second = camera_from_file(path + "#frame_00043");
  EXPECT_EQ(second.name.index, 1U);
  EXPECT_EQ(second.name.image, "./images/right/frame_00043.png");
  EXPECT_EQ(second.camera.eye, (Vec3{2, -1, 4}));
  expect_user_error([&] { camera_from_file(path + "#frame_00044"); },
                    {"none of its 2 cameras is called frame_00044", "0 to 1", "such as"});
  document["frames"][1]["file_path"] = "images/right/frame_00042.png";
  write_json(document);
  expect_user_error([&] { camera_from_file(path + "#frame_00042"); },
                    {"2 of its cameras are called frame_00042", "#0 and #1", "index"});
  EXPECT_EQ(camera_from_file(path + "#images/right/frame_00042.png").name.index, 1U);
}

TEST_F(CameraFiles, ANumberIsAnIndexAndWithLeadingZerosAName) {
  json document = inria();
  document[0]["img_name"] = "1";
  document[1]["img_name"] = "00000";
  const std::string path = write_json(document);
  EXPECT_EQ(camera_from_file(path + "#0").name.index, 0U);
  EXPECT_EQ(camera_from_file(path + "#1").name.index, 1U);
  EXPECT_EQ(camera_from_file(path + "#00000").name.index, 1U);
}

TEST_F(CameraFiles, AFileWhoseNameHasAMarkInItIsAFile) {
  const std::string path = write("take #2.json", inria().dump()).string();
  EXPECT_FALSE(camera_choice(path).camera.has_value());
  EXPECT_EQ(camera_from_file(path).name.index, 0U);
  EXPECT_EQ(camera_from_file(path + "#b").name.index, 1U);
}

// transforms.json

TEST_F(CameraFiles, BlenderFilesHaveAnAngleAndTheSizeOfTheirDataSet) {
  json document = transforms();
  for (const char* key : {"fl_x", "fl_y", "w", "h", "cx", "cy"}) document.erase(key);
  document["camera_angle_x"] = 2 * std::atan(0.5);
  const std::vector<Camera> cameras = load_cameras(write_json(document));
  EXPECT_EQ(cameras[0].width, 800U);
  EXPECT_EQ(cameras[0].height, 800U);
  EXPECT_NEAR(cameras[0].fx, 800, 1e-9);
  EXPECT_EQ(cameras[0].fy, cameras[0].fx);
  ASSERT_EQ(cameras[0].notes.size(), 1U);
  EXPECT_NE(cameras[0].notes[0].find("cameras.json says no size"), std::string::npos) << cameras[0].notes[0];
  EXPECT_NE(cameras[0].notes[0].find("800x800"), std::string::npos) << cameras[0].notes[0];
  const Camera small = camera_from_file(in_folder("cameras.json").string(), ImageSize{200, 100}).camera;
  EXPECT_NEAR(small.fy, 100, 1e-9) << "the vertical field of view stays";
}

TEST_F(CameraFiles, AFramesOwnIntrinsicsComeBeforeTheFiles) {
  json document = transforms();
  document["frames"][1].update({{"fl_x", 60}, {"w", 128}, {"camera_angle_x", 1}});
  const std::vector<Camera> cameras = load_cameras(write_json(document));
  EXPECT_EQ(cameras[0].fx, 50);
  EXPECT_EQ(cameras[1].fx, 60) << "pixels before the angle";
  EXPECT_EQ(cameras[1].fy, 51);
  EXPECT_EQ(cameras[1].width, 128U);
  EXPECT_EQ(cameras[1].height, 48U);
}

TEST_F(CameraFiles, ThreeRowsAreAPoseToo) {
  json document = transforms();
  for (json& frame : document["frames"]) frame["transform_matrix"].erase(3);
  expect_same(load_cameras(write_json(document)), by_hand());
}

TEST_F(CameraFiles, TransformsThatCannotBeUsedNameTheFrame) {
  expect_transforms_refused([](json& d) { d["frames"] = 3; }, {"\"frames\" is not an array"});
  expect_transforms_refused([](json& d) { d["frames"][1] = 3; }, {"frame 1", "not an object"});
  expect_transforms_refused([](json& d) { d["frames"][1].erase("transform_matrix"); },
                            {"frame 1", "no \"transform_matrix\""});
  expect_transforms_refused([](json& d) { d["frames"][1]["transform_matrix"][2].erase(3); },
                            {"frame 1", "not 4 rows of 4 numbers"});
  expect_transforms_refused([](json& d) { d["frames"][1]["transform_matrix"][2][1] = "x"; },
                            {"frame 1", "\"transform_matrix\" row 2 is not a number"});
  expect_transforms_refused([](json& d) { d["frames"][0]["transform_matrix"][3][3] = 2; }, {"frame 0", "last row"});
  expect_transforms_refused([](json& d) { d["frames"][0]["transform_matrix"][0][1] = 1; },
                            {"frame 0", "not a rotation matrix", "right, up and back"});
  expect_transforms_refused(
      [](json& d) {
        for (json& row : d["frames"][1]["transform_matrix"]) {
          for (std::size_t i = 0; i < 3; ++i) row[i] = 0.25 * row[i].get<double>();
        }
      },
      {"frame 1", "scales by 0.25", "divide"});
  for (const char* key : {"k1", "k2", "k3", "k4", "p1", "p2"}) {
    expect_transforms_refused([&](json& d) { d.erase("camera_model"), d[key] = 0.05; },
                              {"frame 0", key + std::string(" = 0.05"), "distorted", "--undistorted"});
  }
  expect_transforms_refused([](json& d) { d["camera_model"] = "OPENCV_FISHEYE"; }, {"OPENCV_FISHEYE", "no pinhole"});
  expect_transforms_refused([](json& d) { d["is_fisheye"] = true; }, {"fisheye", "no pinhole", "--eye"});
  expect_transforms_refused([](json& d) { d.erase("h"); }, {"\"w\" and no \"h\""});
  expect_transforms_refused([](json& d) { d.erase("w"), d.erase("h"); },
                            {"\"fl_x\" is in pixels, and there is no \"w\" and \"h\""});
  expect_transforms_refused([](json& d) { d["w"] = 16385; }, {"\"w\"", "1 to 16384"});
  expect_transforms_refused([](json& d) { d.erase("fl_x"), d.erase("fl_y"); }, {"neither \"fl_x\" nor"});
  expect_transforms_refused([](json& d) { d["fl_x"] = -1; }, {"\"fl_x\"", "focal length"});
  for (const double angle : {0.0, -1.0, 3.2}) {
    expect_transforms_refused([&](json& d) { d.erase("fl_x"), d["camera_angle_x"] = angle; }, {"\"camera_angle_x\""});
  }
}

// COLMAP

TEST_F(CameraFiles, AModelIsFoundInItsFolderInSparseAndByEitherOfItsFiles) {
  write_model(".txt", kCamerasText, kImagesText);
  for (const char* file : {"cameras.txt", "images.txt", ""}) {
    expect_same(load_cameras(in_folder(file).string()), by_hand());
  }
  EXPECT_EQ(camera_from_file(in_folder("").string() + "#b.jpg").name.index, 1U);
  EXPECT_EQ(camera_files(in_folder("images.txt").string()),
            (std::vector{in_folder("cameras.txt"), in_folder("images.txt")}));
  for (const char* folder : {"project/sparse/0", "dense/sparse"}) {
    const std::filesystem::path place = in_folder(folder);
    std::filesystem::create_directories(place);
    for (const char* file : {"cameras.txt", "images.txt"}) std::filesystem::copy(in_folder(file), place / file);
  }
  expect_same(load_cameras(in_folder("project").string()), by_hand());
  expect_same(load_cameras(in_folder("dense").string()), by_hand());
  // As COLMAP does, .bin is taken before .txt.
  write_model(".bin", cameras_binary(), images_binary());
  write("cameras.txt", "not read\n");
  expect_same(load_cameras(in_folder("").string()), by_hand());
}

TEST_F(CameraFiles, ABinaryModelThatBeginsLikeJsonIsAModel) {
  const std::string folder = write_model(".bin", cameras_binary('['), images_binary('{'));
  expect_user_error([&] { load_cameras(folder); }, {"cameras.bin byte", "ends before"});
}

TEST_F(CameraFiles, AFolderWithoutAModelOrWithHalfOfOneSaysSo) {
  expect_user_error([&] { load_cameras(in_folder("").string()); },
                    {"a directory without a COLMAP model", "cameras.bin"});
  write("cameras.txt", kCamerasText);
  for (const char* path : {"", "cameras.txt"}) {
    expect_user_error([&] { load_cameras(in_folder(path).string()); }, {"images.txt", "no such file"});
  }
}

TEST_F(CameraFiles, DistortionIsAcceptedWhereItIsNone) {
  // Focal length(s), principal point, distortion.
  const std::vector<std::pair<std::string, std::string>> undistorted{{"SIMPLE_PINHOLE", "50 32 24"},
                                                                     {"SIMPLE_RADIAL", "50 32 24 0"},
                                                                     {"RADIAL", "50 32 24 0 0"},
                                                                     {"OPENCV", "50 50 32 24 0 0 0 0"},
                                                                     {"FULL_OPENCV", "50 50 32 24 0 0 0 0 0 0 0 0"},
                                                                     {"FOV", "50 50 32 24 0"}};
  for (const auto& [model, parameters] : undistorted) {
    const std::string line = "7 " + model + " 64 48 " + parameters;
    const std::vector<Camera> cameras = load_cameras(write_model(".txt", line, kImagesText));
    EXPECT_EQ(cameras[0].fx, 50) << model;
    EXPECT_EQ(cameras[0].fy, 50) << model;
    if (model == "SIMPLE_PINHOLE") continue;
    expect_text_refused(line.substr(0, line.size() - 1) + "0.3", kImagesText,
                        {"cameras.txt line 1", model, "distorted by", " = 0.3, ", "colmap image_undistorter"});
  }
  // The remedy is one that there is.
  const std::vector<std::pair<std::string, std::string>> others{
      {"OPENCV_FISHEYE 64 48 50 50 32 24 0 0 0 0", "colmap image_undistorter"},
      {"SIMPLE_RADIAL_FISHEYE 64 48 50 32 24 0", "colmap image_undistorter"},
      {"EUCM 64 48 50 50 32 24 0 0", "colmap image_undistorter"},
      {"EQUIRECTANGULAR 64 48 64 48", "panorama_sfm.py"},
      {"NOT_KNOWN 64 48", "--eye"}};
  for (const auto& [model, remedy] : others) {
    expect_text_refused("7 " + model, kImagesText, {model.substr(0, model.find(' ')), "no pinhole", remedy});
  }
  for (const auto& [model, parts] : std::vector<std::pair<std::uint32_t, std::vector<std::string>>>{
           {5U, {"OPENCV_FISHEYE", "image_undistorter"}},
           {11U, {"RAD_TAN_THIN_PRISM_FISHEYE", "image_undistorter"}},
           {17U, {"EQUIRECTANGULAR", "panorama_sfm.py"}},
           {4'000'000'000U, {"number 4000000000", "--eye"}}}) {
    const std::string folder = write_model(".bin", cameras_binary(1, model, std::vector<double>(16)), images_binary());
    expect_user_error([&] { load_cameras(folder); }, {"cameras.bin byte 8", "no pinhole"});
    expect_user_error([&] { load_cameras(folder); }, parts);
  }
}

TEST_F(CameraFiles, TextThatCannotBeUsedNamesTheLine) {
  const std::string cameras = kCamerasText, images = kImagesText;
  const auto with = [](std::string text, const std::string& part, const std::string& other) {
    return text.replace(text.find(part), part.size(), other);
  };
  expect_text_refused(with(cameras, "PINHOLE 64", "PINHOLE 0"), images, {"cameras.txt line 3", "width"});
  expect_text_refused(with(cameras, " 24\n", "\n"), images, {"cameras.txt line 3", "ends before a parameter"});
  expect_text_refused(with(cameras, " 24\n", " 24 1\n"), images, {"line 3", "4 parameters, and there are more"});
  expect_text_refused(with(cameras, "51", "x"), images, {"line 3", "a parameter is not a number"});
  expect_text_refused(with(cameras, "51", "nan"), images, {"line 3", "not finite"});
  expect_text_refused(with(cameras, "51", "0"), images, {"line 3", "focal length"});
  expect_text_refused(cameras + "7 PINHOLE 64 48 50 51 32 24", images, {"line 4", "a camera 7 already"});
  expect_text_refused(cameras, with(images, "7 b.jpg", "8 b.jpg"), {"images.txt line 2", "no camera 8", "same model"});
  expect_text_refused(cameras, with(images, " b.jpg", ""), {"images.txt line 2", "ends before the name"});
  expect_text_refused(cameras, with(images, "0.6", "1e999"), {"line 2", "quaternion is not a number"});
  expect_text_refused(cameras, with(images, "0.6", "inf"), {"line 2", "pose is not finite"});
  expect_text_refused(cameras, with(images, "0.8 0 0.6 0", "0 0 0 0"), {"line 2", "quaternion is zero"});
  expect_text_refused(cameras, with(images, "1.5 2.5 -1 3.5 4.5 11\n", ""),
                      {"images.txt line 3", "not the line of an image's points"});
  expect_text_refused("", images, {"cameras.txt", "empty"});
}

TEST_F(CameraFiles, QuaternionsNeedNotBeUnitOnes) {
  std::string images = kImagesText;
  const std::string unit = "0.5 0.5 0.5 0.5";
  images.replace(images.find(unit), unit.size(), "1e300 1e300 1e300 1e300");
  expect_same(load_cameras(write_model(".txt", kCamerasText, images)), by_hand());
}

TEST_F(CameraFiles, ImageNamesMayHoldSpacesAndLinesEndAsOnWindows) {
  std::string images = kImagesText;
  images.replace(images.find("a.jpg"), 5, "a b.jpg \r");
  const std::vector<Camera> cameras = load_cameras(write_model(".txt", kCamerasText, images));
  EXPECT_EQ(cameras[0].name, "a b.jpg");
}

TEST_F(CameraFiles, ABinaryFileCutAnywhereIsAnErrorThatNamesTheByte) {
  const std::string cameras = cameras_binary(), images = images_binary();
  const std::string folder = write_model(".bin", cameras, images);
  for (const auto& [name, whole] : {std::pair{"images.bin", images}, std::pair{"cameras.bin", cameras}}) {
    for (std::size_t size = 1; size < whole.size(); ++size) {
      write(name, whole.substr(0, size));
      expect_user_error([&] { load_cameras(folder); }, {std::string(name) + " byte ", "ends before"});
    }
    write(name, whole + '\0');
    expect_user_error([&] { load_cameras(folder); }, {name, "byte ", "goes on after all that its count says"});
    write(name, whole);
  }
}

TEST_F(CameraFiles, CountsThatLieTakeNoMemory) {
  for (const std::uint64_t lie : {std::uint64_t{3}, std::uint64_t{1} << 61U, ~std::uint64_t{0}}) {
    std::string folder = write_model(".bin", cameras_binary(lie), images_binary());
    expect_user_error([&] { load_cameras(folder); }, {"cameras.bin byte 64", "ends before a camera"});
    folder = write_model(".bin", cameras_binary(), images_binary(lie));
    expect_user_error([&] { load_cameras(folder); }, {"images.bin", "ends before an image"});
    // Three points would be there, but for the zero byte that ends the name which they would swallow.
    folder = write_model(".bin", cameras_binary(), images_binary(2, lie == 3 ? 9 : lie));
    expect_user_error([&] { load_cameras(folder); }, {"images.bin", "points, and the file ends before"});
  }
  Binary endless;
  endless.add(std::uint64_t{1}).add(std::uint32_t{2}).add({0.8, 0, 0.6, 0, -4.4, 1, 0.8}).add(std::uint32_t{7});
  const std::string folder = write_model(".bin", cameras_binary(), endless.bytes() + std::string(100'000, 'x'));
  expect_user_error([&] { load_cameras(folder); }, {"name of an image is longer than 4096 bytes"});
}

TEST_F(CameraFiles, HugeFilesOfNothingTakeNoMemory) {
  const std::uintmax_t huge = std::uintmax_t{1} << 40U;  // all but the beginning a hole
  std::filesystem::resize_file(write("cameras.json", "["), huge);
  expect_user_error([&] { load_cameras(in_folder("cameras.json").string()); }, {"1099511627776 bytes, and at most"});
  std::filesystem::resize_file(write("other", "#"), huge);
  expect_user_error([&] { load_cameras(in_folder("other").string()); }, {"none of the kinds"});
  const std::string folder = write_model(".txt", kCamerasText, kImagesText);
  std::filesystem::resize_file(in_folder("images.txt"), huge);
  expect_user_error([&] { load_cameras(folder); }, {"images.txt line 6", "longer than"});
}

TEST_F(CameraFiles, LinesOfAnyLengthAreRead) {
  // Around the size of what is read at a time.
  for (const std::size_t length : {65000U, 65535U, 65536U, 65537U, 200000U}) {
    const std::string comment = "#" + std::string(length, '-') + "\n";
    std::string points;
    while (points.size() < length) points += "1.5 2.5 -1 ";
    std::string images = comment + kImagesText;
    images.replace(images.find("1.5 2.5 -1 3.5 4.5 11"), 21, points);
    expect_same(load_cameras(write_model(".txt", comment + kCamerasText, images)), by_hand());
  }
}

TEST_F(CameraFiles, WhateverAByteBecomesItIsReadOrRefused) {
  const std::string cameras = cameras_binary(), images = images_binary();
  const auto is_read_or_refused = [](const std::string& path) {
    try {
      for (const Camera& camera : load_cameras(path)) check_camera(camera, "cannot use it");
    } catch (const UserError&) {
      return;
    }
  };
  const std::string folder = write_model(".bin", cameras, images);
  for (const auto& [name, whole] : {std::pair{"images.bin", images}, std::pair{"cameras.bin", cameras}}) {
    for (const char byte : {'\0', '\x7f', '\xff'}) {
      for (std::size_t i = 0; i < whole.size(); ++i) {
        std::string changed = whole;
        changed[i] = byte;
        write(name, changed);
        is_read_or_refused(folder);
      }
    }
    write(name, whole);
  }
  std::filesystem::remove(in_folder("cameras.bin"));
  const std::string text = kImagesText;
  write("cameras.txt", kCamerasText);
  for (std::size_t size = 1; size < text.size(); ++size) {
    write("images.txt", text.substr(0, size));
    is_read_or_refused(in_folder("").string());
  }
}

TEST_F(CameraFiles, JsonCutAnywhereIsAnError) {
  for (const json& document : {inria(), transforms()}) {
    const std::string text = document.dump();
    for (std::size_t size = 1; size < text.size(); ++size) {
      const std::string path = write("cameras.json", text.substr(0, size)).string();
      expect_user_error([&] { load_cameras(path); }, {"cannot read camera file", "not valid JSON"});
    }
  }
  const std::string deep = write("cameras.json", std::string(1'000'000, '[')).string();
  expect_user_error([&] { load_cameras(deep); }, {"not valid JSON"});
}

// Orbits.

void expect_at(const View& view, const Vec3& eye) {
  EXPECT_LE(glm::length(view.eye - eye), 1e-12) << view.eye.x << " " << view.eye.y << " " << view.eye.z;
}

TEST(Orbit, GoesRoundTheWorldsUpCounterClockwiseAsSeenFromAbove) {
  View view;
  view.look_at = {10, 0, 0};
  view.eye = {10, -1, -4};  // above the ground, since y points down
  view.fovy_degrees = 40;
  const std::vector<View> views = orbit_views(view, 4);
  ASSERT_EQ(views.size(), 4U);
  EXPECT_EQ(views[0].eye, view.eye) << "the view itself, to the last bit";
  // From above, with x to the right, z points up; from below it (-z) counter-clockwise is to the right.
  expect_at(views[1], {14, -1, 0});
  expect_at(views[2], {10, -1, 4});
  expect_at(views[3], {6, -1, 0});
  for (const View& each : views) {
    EXPECT_EQ(each.look_at, view.look_at);
    EXPECT_EQ(each.up, view.up);
    EXPECT_EQ(each.fovy_degrees, 40);
  }
}

TEST(Orbit, KeepsDistanceAndElevationWhateverIsUp) {
  for (const Vec3& up : {Vec3{0, 1, 0}, Vec3{0, 0, 3}, Vec3{-1e-9, 2e-9, 0}}) {
    View view;
    view.up = up;
    view.look_at = {1, 2, 3};
    view.eye = {4, 6, 8};
    const Vec3 unit = up / glm::length(up);
    for (const View& each : orbit_views(view, 7)) {
      EXPECT_NEAR(glm::length(each.eye - each.look_at), glm::length(view.eye - view.look_at), 1e-12);
      EXPECT_NEAR(glm::dot(each.eye - each.look_at, unit), glm::dot(view.eye - view.look_at, unit), 1e-12);
    }
  }
  // z up: from x to y.
  View view;
  view.up = {0, 0, 1};
  view.look_at = {0, 0, 0};
  view.eye = {2, 0, 1};
  expect_at(orbit_views(view, 4)[1], {0, 2, 1});
  view.up = {0, 0, 0};
  expect_user_error([&] { orbit_views(view, 4); }, {"--up", "no direction"});
}

}  // namespace
}  // namespace vrpipe
