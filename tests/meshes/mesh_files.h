#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace vrpipe::testing {

/// Little-endian bytes of numbers.
template <class Number>
std::string bytes_of(const std::vector<Number>& numbers) {
  return std::string(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
}

std::string base64(const std::string& bytes);

/// A square of two triangles at z = 5, corners (0,0) (1,0) (1,1) (0,1), in every format. In red, but for the .obj.
std::string square_obj();
std::string square_ply_ascii();
std::string square_ply_binary(bool big_endian);
/// One mesh of a square, whose `node` (members of a JSON object) places it.
std::string square_gltf(const std::string& node = R"("mesh": 0)");
std::string square_glb();

/// What files of modelling programs hold beside a mesh, and meshes do not need. On some of this, broken, Assimp crashes.
std::string rich_obj();  ///< names rich.mtl
std::string rich_mtl();
std::string rich_ply();

/// The JSON of square_gltf with this URI (with its key and a comma), or without any.
std::string square_json(const std::string& uri, const std::string& node);
std::string square_buffer();
std::string glb_of(std::string json, std::string binary);

}  // namespace vrpipe::testing
