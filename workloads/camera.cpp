#include <vrpipe/workloads/camera.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/portable_math.h>

#include "file_io.h"

namespace vrpipe {
namespace {

constexpr char kCannotUse[] = "cannot use camera";
constexpr char kCannotRead[] = "cannot read camera file";
/// With this, no product of a projection overflows a double.
constexpr float kMinNearPlane = 1e-6f;
constexpr char kLayoutRemedy[] =
    "an INRIA cameras.json is an array of {\"width\", \"height\", \"position\": [3], \"rotation\": [3][3], \"fx\", "
    "\"fy\"}";

bool all_finite(const Vec3& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }

/// Divides by the largest component first, so that no square overflows or vanishes. Zero stays zero.
Vec3 normalized(Vec3 v) {
  const double largest = std::fmax(std::fabs(v[0]), std::fmax(std::fabs(v[1]), std::fabs(v[2])));
  if (!(largest > 0)) return {0, 0, 0};
  v /= largest;
  return v / glm::length(v);
}

double read_number(const nlohmann::json& value, const std::string& where, const std::string& name) {
  if (!value.is_number()) throw UserError(kCannotRead, where, name + " is not a number", kLayoutRemedy);
  const double number = value.get<double>();
  if (!std::isfinite(number)) throw UserError(kCannotRead, where, name + " is not finite", kLayoutRemedy);
  return number;
}

const nlohmann::json& read_member(const nlohmann::json& camera, const std::string& where, const char* name) {
  const auto found = camera.find(name);
  if (found == camera.end())
    throw UserError(kCannotRead, where, std::string("it has no \"") + name + "\"", kLayoutRemedy);
  return *found;
}

Vec3 read_vector(const nlohmann::json& value, const std::string& where, const std::string& name) {
  if (!value.is_array() || value.size() != 3) {
    throw UserError(kCannotRead, where, name + " is not an array of 3 numbers", kLayoutRemedy);
  }
  return {read_number(value[0], where, name), read_number(value[1], where, name), read_number(value[2], where, name)};
}

std::uint32_t read_side(const nlohmann::json& value, const std::string& where, const std::string& name) {
  const double side = read_number(value, where, name);
  if (!(side >= 1 && side <= kMaxImageSize) || side != std::floor(side)) {
    throw UserError(kCannotRead, where, name + " is not a whole number of 1 to " + std::to_string(kMaxImageSize),
                    "correct the file");
  }
  return static_cast<std::uint32_t>(side);
}

void check_rotation(const Camera& camera, const std::string& where) {
  const auto column = [&camera](std::size_t i) {
    return Vec3{camera.rotation[0][i], camera.rotation[1][i], camera.rotation[2][i]};
  };
  constexpr double kTolerance = 1e-3;
  bool good = dot(cross(column(0), column(1)), column(2)) > 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = i; j < 3; ++j) {
      good = good && std::fabs(dot(column(i), column(j)) - (i == j ? 1.0 : 0.0)) <= kTolerance;
    }
  }
  if (!good) {
    throw UserError(kCannotRead, where, "\"rotation\" is not a rotation matrix",
                    "its columns must be right, down and forward: unit vectors at right angles, right-handed");
  }
}

Camera read_camera(const nlohmann::json& json, const std::string& where) {
  if (!json.is_object()) throw UserError(kCannotRead, where, "it is not an object", kLayoutRemedy);
  Camera camera;
  camera.width = read_side(read_member(json, where, "width"), where, "\"width\"");
  camera.height = read_side(read_member(json, where, "height"), where, "\"height\"");
  camera.eye = read_vector(read_member(json, where, "position"), where, "\"position\"");
  const nlohmann::json& rotation = read_member(json, where, "rotation");
  if (!rotation.is_array() || rotation.size() != 3) {
    throw UserError(kCannotRead, where, "\"rotation\" is not an array of 3 rows", kLayoutRemedy);
  }
  for (std::size_t row = 0; row < 3; ++row) {
    camera.rotation[row] = read_vector(rotation[row], where, "\"rotation\" row " + std::to_string(row));
  }
  check_rotation(camera, where);
  camera.fx = read_number(read_member(json, where, "fx"), where, "\"fx\"");
  camera.fy = read_number(read_member(json, where, "fy"), where, "\"fy\"");
  // The same range as that of a field of view of 1e-6 to 180 - 1e-3 degrees.
  const auto usable = [](double focal, std::uint32_t side) { return focal > 4e-6 * side && focal < 6e7 * side; };
  if (!usable(camera.fx, camera.width) || !usable(camera.fy, camera.height)) {
    throw UserError(kCannotRead, where, "\"fx\" or \"fy\" is not a usable focal length", "give it in pixels, above 0");
  }
  return camera;
}

}  // namespace

void check_image_size(std::uint64_t width, std::uint64_t height, const std::string& where) {
  if (width >= 1 && width <= kMaxImageSize && height >= 1 && height <= kMaxImageSize) return;
  throw UserError("cannot use image size", where, "it is " + std::to_string(width) + "x" + std::to_string(height),
                  "both sides must be 1 to " + std::to_string(kMaxImageSize));
}

void check_camera(const Camera& camera, const std::string& what) {
  check_image_size(camera.width, camera.height, "camera");
  const float near_plane = camera.near_plane, far_plane = camera.far_plane;
  bool good = camera.fx > 0 && camera.fy > 0 && std::isfinite(camera.fx) && std::isfinite(camera.fy);
  good = good && near_plane >= kMinNearPlane && near_plane < far_plane && std::isfinite(far_plane);
  for (std::size_t i = 0; i < 3; ++i) {
    good = good && std::isfinite(camera.eye[i]);
    for (std::size_t k = 0; k < 3; ++k) good = good && std::fabs(camera.rotation[i][k]) <= 2;
  }
  if (!good) {
    throw UserError(what, "camera",
                    "an element is not finite, a focal length is not above 0, the near plane is below 1e-6, or the far "
                    "plane is not beyond it",
                    "make it with look_at or load_cameras");
  }
}

Vec3 camera_space(const Camera& camera, const Vec3& world) {
  // The eye is subtracted in double, so a scene far from the origin loses nothing.
  const Vec3 offset = world - camera.eye;
  Vec3 seen;
  for (std::size_t i = 0; i < 3; ++i) {
    seen[i] = dot(Vec3{camera.rotation[0][i], camera.rotation[1][i], camera.rotation[2][i]}, offset);
  }
  return seen;
}

double window_depth(const Camera& camera, double z) {
  const double near_plane = camera.near_plane, far_plane = camera.far_plane;
  const double depth = far_plane / (far_plane - near_plane) * (1.0 - near_plane / z);
  return std::min(1.0, std::max(0.0, depth));
}

Camera look_at(const Vec3& eye, const Vec3& target, const Vec3& up, double fovy_degrees, std::uint32_t width,
               std::uint32_t height) {
  check_image_size(width, height, "--size");
  if (!all_finite(eye)) throw UserError(kCannotUse, "--eye", "a component is not finite", "give three numbers");
  if (!all_finite(target)) throw UserError(kCannotUse, "--look-at", "a component is not finite", "give three numbers");
  if (!all_finite(up)) throw UserError(kCannotUse, "--up", "a component is not finite", "give three numbers");
  if (!(fovy_degrees >= 1e-6 && fovy_degrees < 180.0 - 1e-3)) {
    throw UserError(kCannotUse, "--fovy", fmt::format("the field of view is {:g} degrees", fovy_degrees),
                    "give 1e-6 to less than 179.999");
  }
  // Halved first: the difference of two large numbers must not overflow.
  const Vec3 forward = normalized(0.5 * target - 0.5 * eye);
  if (dot(forward, forward) == 0) {
    throw UserError(kCannotUse, "--look-at", "it is the point where the camera stands (--eye)", "give another point");
  }
  const Vec3 unit_up = normalized(up);
  if (dot(unit_up, unit_up) == 0) throw UserError(kCannotUse, "--up", "it has no direction", "give e.g. 0,-1,0");
  const Vec3 side = cross(forward, unit_up);
  if (!(dot(side, side) > 1e-20)) {
    throw UserError(kCannotUse, "--up", "it is parallel to the view from --eye to --look-at",
                    "give another direction, e.g. 0,0,1");
  }
  const Vec3 right = normalized(side);
  const Vec3 down = cross(forward, right);
  Camera camera;
  camera.eye = eye;
  for (std::size_t row = 0; row < 3; ++row) camera.rotation[row] = {right[row], down[row], forward[row]};
  camera.width = width;
  camera.height = height;
  camera.fy = 0.5 * height / portable_tan_degrees(0.5 * fovy_degrees);
  camera.fx = camera.fy;
  return camera;
}

Camera look_at(const View& view, ImageSize size) {
  return look_at(view.eye, view.look_at, view.up, view.fovy_degrees, size.width, size.height);
}

Camera resized(const Camera& camera, ImageSize size) {
  check_image_size(size.width, size.height, "--size");
  Camera result = camera;
  const double scale = static_cast<double>(size.height) / camera.height;
  result.fx *= scale;
  result.fy *= scale;
  result.width = size.width;
  result.height = size.height;
  return result;
}

std::vector<Camera> load_cameras(const std::string& path) {
  const InputFile file(path, kCannotRead);
  std::string text(static_cast<std::size_t>(file.size()), '\0');
  file.read(0, text.data(), text.size());
  file.check_unchanged();
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) throw UserError(kCannotRead, path, "it is not valid JSON", kLayoutRemedy);
  if (!json.is_array()) throw UserError(kCannotRead, path, "it is not an array of cameras", kLayoutRemedy);
  std::vector<Camera> cameras;
  for (std::size_t i = 0; i < json.size(); ++i) {
    cameras.push_back(read_camera(json[i], path + " camera " + std::to_string(i)));
  }
  return cameras;
}

CameraName camera_name(const std::string& text) {
  const std::size_t mark = text.rfind('#');
  if (mark == std::string::npos) return {text, 0};
  CameraName name{text.substr(0, mark), 0};
  const char* end = text.data() + text.size();
  const auto result = std::from_chars(text.data() + mark + 1, end, name.index);
  if (result.ec != std::errc{} || result.ptr != end) {
    throw UserError(kCannotUse, "--camera " + text, "what follows # is not an index", "give FILE#INDEX, index from 0");
  }
  return name;
}

Camera camera_from_file(const std::string& text, const std::optional<ImageSize>& size) {
  const auto [file, index] = camera_name(text);
  const std::vector<Camera> cameras = load_cameras(file);
  if (index >= cameras.size()) {
    throw UserError(kCannotUse, "--camera " + text,
                    "there is no camera " + std::to_string(index) + ", the file has " + std::to_string(cameras.size()),
                    cameras.empty() ? "use another file"
                                    : "give an index of 0 to " + std::to_string(cameras.size() - 1));
  }
  return size ? resized(cameras[index], *size) : cameras[index];
}

}  // namespace vrpipe
