#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <vrpipe/workloads/portable_math.h>

#include "camera_format.h"

// transforms.json of NeRF's Blender data sets, instant-ngp and nerfstudio: an object with "frames". Cameras are OpenGL's:
// x right, y up, z back; worlds have z up.

namespace vrpipe {
namespace {

constexpr char kLayout[] =
    "a transforms.json is {\"fl_x\" or \"camera_angle_x\", \"w\", \"h\", \"frames\": [{\"file_path\", "
    "\"transform_matrix\": [4][4]}]}";
constexpr char kUndistort[] =
    "undistort the images, e.g. with `colmap image_undistorter`, or set these to 0 to draw without distortion";

/// Of the synthetic data sets of NeRF, whose files have an angle and no size.
constexpr double kBlenderSide = 800;

/// What a frame says of its camera, or the file of all of them.
class Frame {
 public:
  Frame(const JsonObject& frame, const JsonObject& file) : frame_(frame), file_(file) {}

  std::optional<double> number(const char* key) const {
    const std::optional<double> own = frame_.optional_number(key);
    return own ? own : file_.optional_number(key);
  }
  const nlohmann::json* find(const char* key) const {
    const nlohmann::json* const own = frame_.find(key);
    return own != nullptr ? own : file_.find(key);
  }

 private:
  const JsonObject& frame_;
  const JsonObject& file_;
};

void refuse_distortion(const Frame& frame, const std::string& where) {
  for (const char* key : {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"}) {
    if (frame.number(key).value_or(0) == 0) continue;
    throw UserError(kCannotReadCameras, where, fmt::format("\"{}\" is not 0: the camera is distorted", key),
                    kUndistort);
  }
  const nlohmann::json* const fisheye = frame.find("is_fisheye");
  const nlohmann::json* const model = frame.find("camera_model");
  std::string name = model != nullptr && model->is_string() ? model->get<std::string>() : std::string();
  if (fisheye != nullptr && *fisheye == true) name = "fisheye";
  constexpr std::array<const char*, 7> pinholes{"",       "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL",
                                                "RADIAL", "OPENCV",  "FULL_OPENCV"};
  if (std::find(pinholes.begin(), pinholes.end(), name) != pinholes.end()) return;
  throw UserError(kCannotReadCameras, where, "its camera model is " + name + ", which is no pinhole",
                  "use a pinhole camera");
}

void read_size(const JsonObject& json, const Frame& frame, Camera& camera) {
  const std::optional<double> width = frame.number("w"), height = frame.number("h");
  const bool has_size = width || height;
  if (has_size && !(width && height)) json.refuse(width ? "it has \"w\" and no \"h\"" : "it has \"h\" and no \"w\"");
  if (!has_size && (frame.number("fl_x") || frame.number("fl_y"))) {
    json.refuse("it has a focal length in pixels, and no \"w\" and \"h\"");
  }
  camera.width = checked_side(width.value_or(kBlenderSide), json.where(), "\"w\"");
  camera.height = checked_side(height.value_or(kBlenderSide), json.where(), "\"h\"");
}

/// Along one side: in pixels, or from the angle of view, radians.
std::optional<double> focal_length(const JsonObject& json, const Frame& frame, const char* pixels, const char* angle,
                                   double side) {
  if (const std::optional<double> given = frame.number(pixels)) return given;
  const std::optional<double> radians = frame.number(angle);
  if (!radians) return std::nullopt;
  const double half_degrees = *radians * (90 / 3.14159265358979323846);
  if (!(half_degrees > 0 && half_degrees < 90)) {
    json.refuse(JsonObject::quoted(angle) + " is not above 0 and below pi radians");
  }
  return 0.5 * side / portable_tan_degrees(half_degrees);
}

void read_pose(const JsonObject& json, Camera& camera) {
  const nlohmann::json& matrix = json.at("transform_matrix");
  const std::string name = "\"transform_matrix\"";
  const bool is_matrix =
      matrix.is_array() && (matrix.size() == 3 || matrix.size() == 4) &&
      std::all_of(matrix.begin(), matrix.end(), [](const auto& row) { return row.is_array() && row.size() == 4; });
  if (!is_matrix) json.refuse(name + " is not 4 rows of 4 numbers");
  for (std::size_t row = 0; row < matrix.size(); ++row) {
    std::array<double, 4> values{};
    for (std::size_t i = 0; i < 4; ++i) {
      values[i] = json.number(matrix[row][i], fmt::format("{} row {}", name, row));
    }
    if (row == 3) {
      if (values != std::array<double, 4>{0, 0, 0, 1}) json.refuse(name + " has a last row that is not 0, 0, 0, 1");
      break;
    }
    // From y up and z back to y down and z forward.
    camera.rotation[row] = {values[0], -values[1], -values[2]};
    camera.eye[row] = values[3];
  }
  // Said apart, since tools do it.
  std::array<double, 3> lengths{};
  for (std::size_t i = 0; i < 3; ++i) {
    lengths[i] = glm::length(Vec3{camera.rotation[0][i], camera.rotation[1][i], camera.rotation[2][i]});
  }
  const auto [least, largest] = std::minmax_element(lengths.begin(), lengths.end());
  if (*least > 0 && std::fabs(*largest / *least - 1) < 1e-3 && std::fabs(*largest - 1) > 1e-3) {
    throw UserError(kCannotReadCameras, json.where(), fmt::format("{} scales by {:g}", name, *largest),
                    "divide its first three columns by that, so that they are unit vectors");
  }
  check_rotation(camera, json.where(), name,
                 "its first three columns must be right, up and back: unit vectors at right angles, right-handed");
}

Camera read_camera(const JsonObject& json, const JsonObject& file) {
  const Frame frame(json, file);
  refuse_distortion(frame, json.where());
  Camera camera;
  read_size(json, frame, camera);
  const std::optional<double> fx = focal_length(json, frame, "fl_x", "camera_angle_x", camera.width);
  const std::optional<double> fy = focal_length(json, frame, "fl_y", "camera_angle_y", camera.height);
  if (!fx && !fy) json.refuse("it has neither \"fl_x\" nor \"camera_angle_x\"");
  // Pixels are square where only one is given.
  camera.fx = fx.value_or(fy.value_or(0));
  camera.fy = fy.value_or(camera.fx);
  check_focal_lengths(camera, json.where(), "\"fl_x\", \"fl_y\" or what an angle of view gives");
  read_pose(json, camera);
  camera.name = json.text("file_path");
  return camera;
}

bool recognises(const CameraSource& source) {
  return source.json() != nullptr && source.json()->is_object() && source.json()->contains("frames");
}

std::vector<Camera> read(const CameraSource& source) {
  const JsonObject file(*source.json(), source.path(), kLayout);
  const nlohmann::json& frames = source.json()->at("frames");
  if (!frames.is_array()) file.refuse("\"frames\" is not an array");
  std::vector<Camera> cameras;
  for (const nlohmann::json& frame : frames) {
    const std::string where = source.path() + " frame " + std::to_string(cameras.size());
    cameras.push_back(read_camera(JsonObject(frame, where, kLayout), file));
  }
  return cameras;
}

const CameraFormatRegistrar registrar({"NeRF transforms.json", "a JSON object with \"frames\"", recognises, read,
                                       nullptr});

}  // namespace
}  // namespace vrpipe
