#include "mesh_files.h"

#include <algorithm>

namespace vrpipe::testing {

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += i + k > bytes.size() ? '=' : kDigits[group >> (18 - 6 * k) & 63U];
    }
  }
  return text;
}

std::string square_obj() {
  return "# a square\nv 0 0 5\nv 1 0 5\nv 1 1 5\nv 0 1 5\nvn 0 0 -1\nf 1//1 2//1 3//1 4//1\n";
}

std::string square_ply_ascii() {
  return "ply\nformat ascii 1.0\ncomment a square\nelement vertex 4\nproperty float x\nproperty float y\n"
         "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
         "property list uchar int vertex_indices\nend_header\n"
         "0 0 5 255 0 0\n1 0 5 255 0 0\n1 1 5 255 0 0\n0 1 5 255 0 0\n4 0 1 2 3\n";
}

std::string square_ply_binary(bool big_endian) {
  std::string bytes = "ply\nformat binary_" + std::string(big_endian ? "big" : "little") +
                      "_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
                      "property list uchar int vertex_indices\nend_header\n";
  const auto append = [&](std::string number) {
    if (big_endian) std::reverse(number.begin(), number.end());
    bytes += number;
  };
  const float corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (const auto& corner : corners) {
    append(bytes_of<float>({corner[0]}));
    append(bytes_of<float>({corner[1]}));
    append(bytes_of<float>({5}));
    bytes += std::string("\xff\0\0", 3);
  }
  bytes += '\4';
  for (std::int32_t i = 0; i < 4; ++i) append(bytes_of<std::int32_t>({i}));
  return bytes;
}

std::string rich_obj() {
  return "mtllib rich.mtl\no thing\nv 0 0 5 1 0 0\nv 1 0 5 0 1 0\nv 1 1 5 1 1 1\nv 0 1 5 .5 .5 .5\nvt 0 0\nvt 1 0 "
         "0\nvn 0 0 -1\n"
         "g a b\nusemtl paint\ns 1\nf 1/1/1 2/2/1 3/1/1 4/2/1\nf -4 -3 -2\nf 1//1 2//1 \\\n 3//1\nl 1 2 3\np 1 2\n"
         "usemtl other\nf 1/1 2/2 3/1\nvp 1 2\nmg 1 2\ncstype bezier\n";
}

std::string rich_mtl() {
  return "newmtl paint\nKd 0.25 0.5 0.75\nKa 1 1 1\nNs 10\nd 0.5\nTr 0.1\nillum 2\nmap_Kd -o 1 1 1 -clamp on x.png\n"
         "bump -bm 2 y.png\nnewmtl other\nKd spectral\nKe 1 1 1\nPr 0.5\nrefl -type sphere z.png\n";
}

std::string rich_ply() {
  return "ply\nformat ascii 1.0\ncomment TextureFile x.png\nobj_info hey\nelement vertex 4\nproperty double x\n"
         "property float y\nproperty float z\nproperty float nx\nproperty float ny\nproperty float nz\nproperty float "
         "s\n"
         "property float t\nproperty float red\nproperty float green\nproperty float blue\nproperty float alpha\n"
         "element face 2\nproperty uchar flags\nproperty list uchar int vertex_indices\n"
         "property list uchar float texcoord\nelement edge 1\nproperty int vertex1\nproperty int vertex2\n"
         "element tristrips 1\nproperty list int int vertex_indices\nelement material 1\nproperty uchar diffuse_red\n"
         "property float specular_power\nend_header\n"
         "0 0 5 0 0 1 0 0 1 0 0 1\n1 0 5 0 0 1 0 0 1 0 0 1\n1 1 5 0 0 1 0 0 1 0 0 1\n0 1 5 0 0 1 0 0 1 0 0 1\n"
         "7 3 0 1 2 6 0 0 0 0 0 0\n7 4 0 1 2 3 0\n0 1\n5 0 1 2 -1 3\n255 3.5\n";
}

std::string square_buffer() {
  return bytes_of<float>({0, 0, 5, 1, 0, 5, 1, 1, 5, 0, 1, 5}) + bytes_of<std::uint16_t>({0, 1, 2, 0, 2, 3});
}

std::string square_json(const std::string& uri, const std::string& node) {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{)" + node +
         R"(}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
 "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
               {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}],
 "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
 "buffers": [{)" +
         uri + R"("byteLength": 60}]})";
}

std::string square_gltf(const std::string& node) {
  return square_json("\"uri\": \"data:application/octet-stream;base64," + base64(square_buffer()) + "\", ", node);
}

std::string glb_of(std::string json, std::string binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  const auto length = [](std::size_t bytes) { return static_cast<std::uint32_t>(bytes); };
  return "glTF" + bytes_of<std::uint32_t>({2, length(28 + json.size() + binary.size()), length(json.size())}) + "JSON" +
         json + bytes_of<std::uint32_t>({length(binary.size())}) + std::string("BIN\0", 4) + binary;
}

std::string square_glb() { return glb_of(square_json("", R"("mesh": 0)"), square_buffer()); }

}  // namespace vrpipe::testing
