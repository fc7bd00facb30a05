#include <vrpipe/workloads/camera.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/portable_math.h>

#include "cameras/camera_format.h"

namespace vrpipe {
namespace {

constexpr char kCannotUseCamera[] = "cannot use camera";
/// With this, no product of a projection overflows a double.
constexpr float kMinNearPlane = 1e-6f;

bool all_finite(const Vec3& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }

/// Divides by the largest component first, so that no square overflows or vanishes. Zero stays zero.
Vec3 normalized(Vec3 v) {
  const double largest = std::fmax(std::fabs(v[0]), std::fmax(std::fabs(v[1]), std::fabs(v[2])));
  if (!(largest > 0)) return {0, 0, 0};
  v /= largest;
  return v / glm::length(v);
}

/// A file's name without the folder, and without what follows its last dot.
std::string without_folder(const std::string& name) { return name.substr(name.rfind('/') + 1); }
std::string without_extension(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  const bool is_extension = dot != std::string::npos && dot > name.rfind('/') + 1;
  return is_extension ? name.substr(0, dot) : name;
}

/// Whether people may mean `name` when they write `text`.
bool is_short_for(const std::string& text, const std::string& name) {
  return text == without_folder(name) || text == without_extension(name) ||
         text == without_extension(without_folder(name));
}

/// An index as it is written: no sign, no leading zeros.
std::optional<std::size_t> read_index(const std::string& text) {
  std::size_t index = 0;
  const char* const end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, index);
  const bool is_number = result.ec == std::errc{} && result.ptr == end;
  return is_number && std::to_string(index) == text ? std::optional<std::size_t>(index) : std::nullopt;
}

/// What to give in place of a camera that is not there.
std::string other_cameras(const std::vector<Camera>& cameras, const std::string& meant) {
  if (cameras.empty()) return "use another file";
  std::string remedy = fmt::format("give an index of 0 to {}", cameras.size() - 1);
  std::vector<std::string> names;
  for (const Camera& camera : cameras) {
    if (!camera.name.empty()) names.push_back(camera.name);
  }
  const std::string near = near_name(meant, names);
  if (!names.empty()) remedy += fmt::format(", or a name, such as {}", near.empty() ? names.front() : near);
  return remedy;
}

std::size_t find_by_name(const std::vector<Camera>& cameras, const std::string& name, const std::string& where) {
  for (const bool is_exact : {true, false}) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const std::string& image = cameras[i].name;
      if (image.empty() || !(is_exact ? image == name : is_short_for(name, image))) continue;
      found.push_back(i);
    }
    if (found.size() > 1) {
      throw UserError(kCannotUseCamera, where,
                      fmt::format("{} of its cameras are called {}, the first two are #{} and #{}", found.size(), name,
                                  found[0], found[1]),
                      "give the index of one");
    }
    if (!found.empty()) return found.front();
  }
  throw UserError(kCannotUseCamera, where, fmt::format("none of its {} cameras is called {}", cameras.size(), name),
                  other_cameras(cameras, name));
}

/// @param up_source  as View has it
Camera camera_at(const Vec3& eye, const Vec3& target, const Vec3& up, double fovy_degrees, ImageSize size,
                 const std::string& up_source) {
  const auto [width, height] = size;
  check_image_size(width, height, "--size");
  if (!all_finite(eye)) throw UserError(kCannotUseCamera, "--eye", "a component is not finite", "give three numbers");
  if (!all_finite(target))
    throw UserError(kCannotUseCamera, "--look-at", "a component is not finite", "give three numbers");
  if (!all_finite(up)) throw UserError(kCannotUseCamera, "--up", "a component is not finite", "give three numbers");
  if (!(fovy_degrees >= 1e-6 && fovy_degrees < 180.0 - 1e-3)) {
    throw UserError(kCannotUseCamera, "--fovy", fmt::format("the field of view is {:g} degrees", fovy_degrees),
                    "give 1e-6 to less than 179.999");
  }
  // Halved first: the difference of two large numbers must not overflow.
  const Vec3 forward = normalized(0.5 * target - 0.5 * eye);
  if (dot(forward, forward) == 0) {
    throw UserError(kCannotUseCamera, "--look-at", "it is the point where the camera stands (--eye)",
                    "give another point");
  }
  const Vec3 unit_up = normalized(up);
  if (dot(unit_up, unit_up) == 0) throw UserError(kCannotUseCamera, "--up", "it has no direction", "give e.g. 0,-1,0");
  const Vec3 side = cross(forward, unit_up);
  if (!(dot(side, side) > 1e-20)) {
    const bool is_option = up_source == "--up";
    throw UserError(kCannotUseCamera, up_source,
                    fmt::format("{} is parallel to the view from --eye to --look-at",
                                is_option ? "it"
                                          : fmt::format("the up of its world, {:g},{:g},{:g},", up.x, up.y, up.z)),
                    (is_option ? "give another direction, e.g. " : "give another, e.g. --up ") +
                        up_for_view(eye, target));
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
  // Not a NaN either.
  good = good && std::fabs(camera.principal_x) <= kMaxPrincipalOffset &&
         std::fabs(camera.principal_y) <= kMaxPrincipalOffset;
  good = good && near_plane >= kMinNearPlane && near_plane < far_plane && std::isfinite(far_plane);
  for (std::size_t i = 0; i < 3; ++i) {
    good = good && std::isfinite(camera.eye[i]);
    for (std::size_t k = 0; k < 3; ++k) good = good && std::fabs(camera.rotation[i][k]) <= 2;
  }
  if (!good) {
    throw UserError(
        what, "camera",
        "an element is not finite, a focal length is not above 0, the principal point is more than 1e6 pixels "
        "from the centre, the near plane is below 1e-6, or the far plane is not beyond it",
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

double clip_w(const Camera& camera, double z) { return camera.projection == Projection::perspective ? z : 1.0; }

double window_depth(const Camera& camera, double z) {
  const double near_plane = camera.near_plane, far_plane = camera.far_plane;
  const double depth = camera.projection == Projection::perspective
                           ? far_plane / (far_plane - near_plane) * (1.0 - near_plane / z)
                           : (z - near_plane) / (far_plane - near_plane);
  return std::min(1.0, std::max(0.0, depth));
}

Camera look_at(const Vec3& eye, const Vec3& target, const Vec3& up, double fovy_degrees, std::uint32_t width,
               std::uint32_t height) {
  return camera_at(eye, target, up, fovy_degrees, {width, height}, View().up_source);
}

Camera look_at(const View& view, ImageSize size) {
  if (!view.orthographic_height) {
    return camera_at(view.eye, view.look_at, view.up, view.fovy_degrees, size, view.up_source);
  }
  const double height = *view.orthographic_height;
  if (!(height >= kMinOrthographicHeight && height <= kMaxOrthographicHeight)) {
    throw UserError(kCannotUseCamera, "--orthographic", fmt::format("the image is {:g} world units high", height),
                    fmt::format("give {:g} to {:g}", kMinOrthographicHeight, kMaxOrthographicHeight));
  }
  Camera camera = camera_at(view.eye, view.look_at, view.up, View().fovy_degrees, size, view.up_source);
  camera.projection = Projection::orthographic;
  camera.fx = camera.fy = size.height / height;
  return camera;
}

std::string up_for_view(const Vec3& eye, const Vec3& target) {
  const Vec3 forward = normalized(0.5 * target - 0.5 * eye);
  // Up as INRIA's worlds have it, else what is level in them.
  return std::fabs(forward.y) < 0.9 ? "0,-1,0" : "0,0,1";
}

Camera resized(const Camera& camera, ImageSize size) {
  check_image_size(size.width, size.height, "--size");
  Camera result = camera;
  const double scale = static_cast<double>(size.height) / camera.height;
  result.fx *= scale;
  result.fy *= scale;
  result.principal_x *= scale;
  result.principal_y *= scale;
  result.width = size.width;
  result.height = size.height;
  return result;
}

std::vector<View> orbit_views(const View& view, std::size_t count) {
  const Vec3 up = normalized(view.up);
  if (dot(up, up) == 0) throw UserError(kCannotUseCamera, "--up", "it has no direction", "give e.g. 0,-1,0");
  const Vec3 arm = view.eye - view.look_at;
  const Vec3 upright = up * dot(up, arm);
  const Vec3 level = arm - upright;
  const Vec3 aside = cross(up, level);
  std::vector<View> views(count, view);
  for (std::size_t i = 1; i < count; ++i) {
    const double angle = 2 * 3.14159265358979323846 * static_cast<double>(i) / static_cast<double>(count);
    views[i].eye = view.look_at + upright + level * portable_cos(angle) + aside * portable_sin(angle);
  }
  return views;
}

std::vector<Camera> load_cameras(const std::string& path, Lenses lenses) {
  const CameraSource source(path);
  std::string known;
  for (const CameraFormat& format : camera_formats()) {
    if (format.recognises(source)) return format.read(source, lenses);
    known += fmt::format("{}{} ({})", known.empty() ? "" : ", ", format.name, format.looks_like);
  }
  if (source.complaint()) throw UserError(*source.complaint());
  throw UserError(kCannotReadCameras, path,
                  source.is_folder() ? "it is a directory without a COLMAP model"
                                     : "it is none of the kinds of camera files",
                  "give one of these: " + known);
}

std::vector<std::filesystem::path> camera_files(const std::string& path) {
  const CameraSource source(path);
  for (const CameraFormat& format : camera_formats()) {
    if (format.files != nullptr && format.recognises(source)) return format.files(source);
  }
  return {path};
}

CameraChoice camera_choice(const std::string& text) {
  const std::size_t mark = text.rfind('#');
  std::error_code ignored;
  if (mark == std::string::npos || std::filesystem::exists(text, ignored)) return {text, std::nullopt};
  return {text.substr(0, mark), text.substr(mark + 1)};
}

NamedCamera camera_from_file(const std::string& text, const std::optional<ImageSize>& size, Lenses lenses) {
  const CameraChoice choice = camera_choice(text);
  const std::vector<Camera> cameras = load_cameras(choice.file, lenses);
  const std::string where = "--camera " + text;
  const std::string camera = choice.camera.value_or("0");
  if (camera.empty()) {
    throw UserError(kCannotUseCamera, where, "nothing follows #", "give FILE#INDEX, index from 0, or FILE#NAME");
  }
  const std::optional<std::size_t> given = read_index(camera);
  const std::size_t index = given ? *given : find_by_name(cameras, camera, where);
  if (index >= cameras.size()) {
    throw UserError(kCannotUseCamera, where,
                    fmt::format("there is no camera {}, the file has {}", index, cameras.size()),
                    other_cameras(cameras, camera));
  }
  return {size ? resized(cameras[index], *size) : cameras[index], {choice.file, index, cameras[index].name}};
}

}  // namespace vrpipe
