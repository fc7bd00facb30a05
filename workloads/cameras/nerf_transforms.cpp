#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <vrpipe/workloads/portable_math.h>

#include "camera_format.h"
#include "lens.h"

// transforms.json of NeRF's Blender data sets, instant-ngp and nerfstudio: an object with "frames". Cameras are OpenGL's:
// x right, y up, z back; worlds have z up.

namespace vrpipe {
namespace {

constexpr char kNerfLayout[] =
    "a transforms.json is {\"fl_x\" or \"camera_angle_x\", \"w\", \"h\", \"frames\": [{\"file_path\", "
    "\"transform_matrix\": [4][4]}]}";
constexpr char kUndistort[] =
    "give --undistorted if the model was trained on undistorted images, or give the cameras of these";
constexpr char kOwnView[] = "draw a view of your own, with --eye and --look-at in place of --camera";

/// Of the synthetic data sets of NeRF, whose files have an angle and no size.
constexpr double kBlenderSide = 800;

/// What a frame says of its camera, or the file of all of them.
class NerfFrame {
 public:
  NerfFrame(const JsonObject& frame, const JsonObject& file) : frame_(frame), file_(file) {}

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

/// By keys that ns-process-data and the tools that write for nerfstudio set, and instant-ngp's colmap2nerf does not. Models of
/// such files are nerfstudio's, which undistorts images before it trains.
bool is_for_nerfstudio(const NerfFrame& frame) {
  const auto has = [&frame](const char* key) { return frame.find(key) != nullptr; };
  return has("camera_model") || has("applied_transform") || has("ply_file_path") || has("colmap_im_id");
}

Projection projection_of(const NerfFrame& frame, const std::string& where) {
  const nlohmann::json* const fisheye = frame.find("is_fisheye");
  const nlohmann::json* const model = frame.find("camera_model");
  std::string name = model != nullptr && model->is_string() ? model->get<std::string>() : std::string();
  if (fisheye != nullptr && *fisheye == true) name = "fisheye";
  if (name == "ORTHOPHOTO") return Projection::orthographic;
  constexpr std::array<const char*, 7> pinholes{"",       "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL",
                                                "RADIAL", "OPENCV",  "FULL_OPENCV"};
  if (std::find(pinholes.begin(), pinholes.end(), name) != pinholes.end()) return Projection::perspective;
  throw UserError(kCannotReadCameras, where, "its camera model is " + name + ", which is no pinhole", kOwnView);
}

void check_distortion(const JsonObject& json, const NerfFrame& frame, const std::string& file, Lenses lenses,
                      Camera& camera) {
  Lens lens;
  for (const char* key : {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"}) {
    lens.parameters.push_back({key, frame.number(key).value_or(0)});
  }
  // In no other model are there as many.
  if (frame.number("k5").value_or(0) != 0 || frame.number("k6").value_or(0) != 0) lens.model = LensModel::rational;
  lens.complaint = "it is distorted by";
  if (is_for_nerfstudio(frame)) {
    lens.undistorted_by = "nerfstudio, for which they are written, trains on undistorted images";
  }
  lens.remedy = kUndistort;
  check_lens(lens, lenses, file, json.where(), camera);
}

void read_size(const JsonObject& json, const NerfFrame& frame, const std::string& file, Camera& camera) {
  const std::optional<double> width = frame.number("w"), height = frame.number("h");
  const bool has_size = width || height;
  if (has_size && !(width && height)) json.refuse(width ? "it has \"w\" and no \"h\"" : "it has \"h\" and no \"w\"");
  if (!has_size) {
    for (const char* key : {"fl_x", "fl_y", "cx", "cy"}) {
      if (frame.number(key)) json.refuse(JsonObject::quoted(key) + " is in pixels, and there is no \"w\" and \"h\"");
    }
    camera.notes.push_back(
        fmt::format("{} says no size of its images, \"w\" and \"h\": they are taken to have {}x{} pixels, as NeRF's "
                    "synthetic data sets",
                    std::filesystem::path(file).filename().string(), kBlenderSide, kBlenderSide));
  }
  camera.width = checked_side(width.value_or(kBlenderSide), json.where(), "\"w\"");
  camera.height = checked_side(height.value_or(kBlenderSide), json.where(), "\"h\"");
}

/// Along one side: in pixels, or from the angle of view, radians.
std::optional<double> focal_length(const JsonObject& json, const NerfFrame& frame, const char* pixels,
                                   const char* angle, double side) {
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

Camera read_camera(const JsonObject& json, const JsonObject& file, Lenses lenses) {
  const NerfFrame frame(json, file);
  Camera camera;
  camera.projection = projection_of(frame, json.where());
  read_size(json, frame, file.where(), camera);
  std::optional<double> fx, fy;
  if (camera.projection == Projection::orthographic) {
    fx = frame.number("fl_x");
    fy = frame.number("fl_y");
    if (!fx && !fy) json.refuse("it is ORTHOPHOTO, and has no \"fl_x\", pixels for each world unit");
  } else {
    fx = focal_length(json, frame, "fl_x", "camera_angle_x", camera.width);
    fy = focal_length(json, frame, "fl_y", "camera_angle_y", camera.height);
    if (!fx && !fy) json.refuse("it has neither \"fl_x\" nor \"camera_angle_x\"");
  }
  // Pixels are square where only one is given.
  camera.fx = fx.value_or(fy.value_or(0));
  camera.fy = fy.value_or(camera.fx);
  check_focal_lengths(camera, json.where(), "\"fl_x\", \"fl_y\" or what an angle of view gives");
  set_principal_point(camera, frame.number("cx"), frame.number("cy"), json.where(), "\"cx\" and \"cy\"");
  if (camera.projection == Projection::perspective) check_distortion(json, frame, file.where(), lenses, camera);
  read_pose(json, camera);
  camera.name = json.text("file_path");
  return camera;
}

bool is_nerf(const CameraSource& source) {
  return source.json() != nullptr && source.json()->is_object() && source.json()->contains("frames");
}

std::vector<Camera> read_nerf(const CameraSource& source, Lenses lenses) {
  const JsonObject file(*source.json(), source.path(), kNerfLayout);
  const nlohmann::json& frames = source.json()->at("frames");
  if (!frames.is_array()) file.refuse("\"frames\" is not an array");
  std::vector<Camera> cameras;
  for (const nlohmann::json& frame : frames) {
    const std::string where = source.path() + " frame " + std::to_string(cameras.size());
    cameras.push_back(read_camera(JsonObject(frame, where, kNerfLayout), file, lenses));
  }
  return cameras;
}

const CameraFormatRegistrar nerf_registrar({"NeRF transforms.json", "a JSON object with \"frames\"", is_nerf, read_nerf,
                                            nullptr});

}  // namespace
}  // namespace vrpipe
