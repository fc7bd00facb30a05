#include <cstddef>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "camera_format.h"

// The cameras.json that the INRIA code writes beside what it trained: an array of cameras.

namespace vrpipe {
namespace {

constexpr char kInriaLayout[] =
    "an INRIA cameras.json is an array of {\"width\", \"height\", \"position\": [3], \"rotation\": [3][3], \"fx\", "
    "\"fy\"}";

Vec3 read_triple(const JsonObject& json, const nlohmann::json& value, const std::string& name) {
  if (!value.is_array() || value.size() != 3) json.refuse(name + " is not an array of 3 numbers");
  return {json.number(value[0], name), json.number(value[1], name), json.number(value[2], name)};
}

Camera read_camera(const JsonObject& json) {
  Camera camera;
  camera.width = checked_side(json.number("width"), json.where(), "\"width\"");
  camera.height = checked_side(json.number("height"), json.where(), "\"height\"");
  camera.eye = read_triple(json, json.at("position"), "\"position\"");
  const nlohmann::json& rotation = json.at("rotation");
  if (!rotation.is_array() || rotation.size() != 3) json.refuse("\"rotation\" is not an array of 3 rows");
  for (std::size_t row = 0; row < 3; ++row) {
    camera.rotation[row] = read_triple(json, rotation[row], "\"rotation\" row " + std::to_string(row));
  }
  check_rotation(camera, json.where(), "\"rotation\"",
                 "its columns must be right, down and forward: unit vectors at right angles, right-handed");
  camera.fx = json.number("fx");
  camera.fy = json.number("fy");
  check_focal_lengths(camera, json.where(), "\"fx\" or \"fy\"");
  set_principal_point(camera, json.optional_number("cx"), json.optional_number("cy"), json.where(),
                      "\"cx\" and \"cy\"");
  camera.name = json.text("img_name");
  return camera;
}

bool is_inria(const CameraSource& source) { return source.json() != nullptr && source.json()->is_array(); }

/// The INRIA code undistorts before it trains, and its files have no distortion.
std::vector<Camera> read_inria(const CameraSource& source, Lenses /*lenses*/) {
  std::vector<Camera> cameras;
  for (const nlohmann::json& camera : *source.json()) {
    const std::string where = source.path() + " camera " + std::to_string(cameras.size());
    cameras.push_back(read_camera(JsonObject(camera, where, kInriaLayout)));
  }
  return cameras;
}

const CameraFormatRegistrar inria_registrar({"INRIA cameras.json",
                                             "a JSON array of cameras with \"position\" and \"rotation\"", is_inria,
                                             read_inria, nullptr});

}  // namespace
}  // namespace vrpipe
