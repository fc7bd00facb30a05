#include "camera_format.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "../file_io.h"

namespace vrpipe {
namespace {

std::vector<CameraFormat>& formats() {
  static std::vector<CameraFormat> all;
  return all;
}

/// Far more than any data set has cameras for; what it holds takes up to twenty times as much memory.
constexpr std::uint64_t kMaxJsonBytes = std::uint64_t{64} << 20;

/// Whether a file begins as JSON does, behind white space and a byte order mark.
bool begins_as_json(const std::string& beginning) {
  const std::size_t first = beginning.find_first_not_of("\xEF\xBB\xBF \t\r\n");
  return first != std::string::npos && (beginning[first] == '[' || beginning[first] == '{');
}

}  // namespace

const std::vector<CameraFormat>& camera_formats() { return formats(); }

CameraFormatRegistrar::CameraFormatRegistrar(const CameraFormat& format) {
  std::vector<CameraFormat>& all = formats();
  all.push_back(format);
  std::sort(all.begin(), all.end(),
            [](const CameraFormat& a, const CameraFormat& b) { return std::strcmp(a.name, b.name) < 0; });
}

CameraSource::CameraSource(std::string path) : path_(std::move(path)) {
  std::error_code ignored;
  is_folder_ = std::filesystem::is_directory(path_, ignored);
}

CameraSource::~CameraSource() = default;

const nlohmann::json* CameraSource::json() const {
  if (is_read_ || is_folder_) return json_.get();
  const InputFile file(path_, kCannotReadCameras);
  std::string text(static_cast<std::size_t>(std::min<std::uint64_t>(file.size(), 4096)), '\0');
  file.read(0, text.data(), text.size());
  is_read_ = true;
  if (!begins_as_json(text)) return nullptr;
  if (file.size() > kMaxJsonBytes) {
    complaint_.emplace(kCannotReadCameras, path_,
                       fmt::format("it has {} bytes, and at most {} are read", file.size(), kMaxJsonBytes),
                       "leave out what is no camera");
    return nullptr;
  }
  text.resize(static_cast<std::size_t>(file.size()));
  file.read(0, text.data(), text.size());
  file.check_unchanged();
  try {
    json_ = std::make_unique<const nlohmann::json>(nlohmann::json::parse(text));
  } catch (const nlohmann::json::parse_error& error) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
    complaint_.emplace(kCannotReadCameras, path_ + fmt::format(" line {}", 1 + std::count(text.begin(), end, '\n')),
                       fmt::format("it is not valid JSON at byte {}", error.byte), "get or write the file again");
  } catch (const nlohmann::json::exception&) {
    // A number beyond all doubles.
    complaint_.emplace(kCannotReadCameras, path_, "a number in it is out of range", "get or write the file again");
  }
  return json_.get();
}

std::uint32_t checked_side(double side, const std::string& where, const std::string& name) {
  if (!(side >= 1 && side <= kMaxImageSize) || side != std::floor(side)) {
    throw UserError(kCannotReadCameras, where, fmt::format("{} is not a whole number of 1 to {}", name, kMaxImageSize),
                    "correct the file");
  }
  return static_cast<std::uint32_t>(side);
}

void check_rotation(const Camera& camera, const std::string& where, const std::string& name,
                    const std::string& remedy) {
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
  if (!good) throw UserError(kCannotReadCameras, where, name + " is not a rotation matrix", remedy);
}

void set_principal_point(Camera& camera, const std::optional<double>& cx, const std::optional<double>& cy,
                         const std::string& where, const std::string& names) {
  if (cx) camera.principal_x = *cx - 0.5 * camera.width;
  if (cy) camera.principal_y = *cy - 0.5 * camera.height;
  // Not a NaN either.
  if (std::fabs(camera.principal_x) <= kMaxPrincipalOffset && std::fabs(camera.principal_y) <= kMaxPrincipalOffset)
    return;
  throw UserError(kCannotReadCameras, where,
                  fmt::format("{}, the principal point, is more than {:g} pixels from the image's centre", names,
                              kMaxPrincipalOffset),
                  "give it in pixels from the image's upper left corner");
}

void check_focal_lengths(const Camera& camera, const std::string& where, const std::string& names) {
  // The same range as that of a field of view of 1e-6 to 180 - 1e-3 degrees.
  // Or as that of an image of the heights that an orthographic view may have.
  const bool is_perspective = camera.projection == Projection::perspective;
  const double least = is_perspective ? 4e-6 : 1 / kMaxOrthographicHeight;
  const double most = is_perspective ? 6e7 : 1 / kMinOrthographicHeight;
  const auto usable = [=](double focal, std::uint32_t side) { return focal > least * side && focal < most * side; };
  if (usable(camera.fx, camera.width) && usable(camera.fy, camera.height)) return;
  throw UserError(kCannotReadCameras, where, names + " is not a usable focal length",
                  is_perspective ? "give it in pixels, above 0" : "give it in pixels for each world unit, above 0");
}

JsonObject::JsonObject(const nlohmann::json& json, std::string where, const char* layout)
    : json_(json), where_(std::move(where)), layout_(layout) {
  if (!json.is_object()) refuse("it is not an object");
}

void JsonObject::refuse(const std::string& why) const { throw UserError(kCannotReadCameras, where_, why, layout_); }

const nlohmann::json* JsonObject::find(const char* key) const {
  const auto found = json_.find(key);
  return found == json_.end() || found->is_null() ? nullptr : &*found;
}

const nlohmann::json& JsonObject::at(const char* key) const {
  const nlohmann::json* const found = find(key);
  if (found == nullptr) refuse("it has no " + quoted(key));
  return *found;
}

double JsonObject::number(const nlohmann::json& value, const std::string& name) const {
  if (!value.is_number()) refuse(name + " is not a number");
  const double number = value.get<double>();
  if (!std::isfinite(number)) refuse(name + " is not finite");
  return number;
}

std::optional<double> JsonObject::optional_number(const char* key) const {
  const nlohmann::json* const found = find(key);
  if (found == nullptr) return std::nullopt;
  return number(*found, quoted(key));
}

std::string JsonObject::text(const char* key) const {
  const nlohmann::json* const found = find(key);
  return found != nullptr && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace vrpipe
