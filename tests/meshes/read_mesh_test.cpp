#include <array>
#include <cmath>
#include <limits>
#include <set>

#include <glm/geometric.hpp>

#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/mesh.h>

#include "../workloads/workload_test_support.h"
#include "mesh_files.h"

namespace vrpipe {
namespace {

using testing::expect_user_error;
using Floats = std::array<float, 3>;

class MeshFile : public testing::FolderTest {
 protected:
  Mesh read(const std::string& name, const std::string& bytes) { return read_mesh(write(name, bytes), rejected_); }
  void expect_refused(const std::string& name, const std::string& bytes, std::vector<std::string> parts) {
    const auto path = write(name, bytes);
    parts.push_back("cannot read mesh (" + path.string() + ")");
    expect_user_error([&] { read_mesh(path, rejected_); }, parts);
  }
  RejectedTriangles rejected_;
};

Vec3 corner(const Mesh& mesh, std::size_t triangle, std::size_t i) {
  const Floats& p = mesh.positions[mesh.triangles[triangle][i]];
  return {p[0], p[1], p[2]};
}

/// Twice its area, as a vector along the side from which its corners go counter-clockwise.
Vec3 area_of(const Mesh& mesh, std::size_t triangle) {
  return glm::cross(corner(mesh, triangle, 1) - corner(mesh, triangle, 0),
                    corner(mesh, triangle, 2) - corner(mesh, triangle, 0));
}

/// Whether a mesh is the unit square at z = 5, all of it once.
void expect_square(const Mesh& mesh) {
  ASSERT_EQ(mesh.triangles.size(), 2u);
  double area = 0;
  std::set<Floats> corners;
  for (std::size_t t = 0; t < 2; ++t) {
    EXPECT_GT(area_of(mesh, t).z, 0) << "the winding of the file";
    area += 0.5 * area_of(mesh, t).z;
    for (std::size_t i = 0; i < 3; ++i) corners.insert(mesh.positions[mesh.triangles[t][i]]);
  }
  EXPECT_EQ(area, 1);
  EXPECT_EQ(corners, (std::set<Floats>{{0, 0, 5}, {1, 0, 5}, {1, 1, 5}, {0, 1, 5}}));
  EXPECT_EQ(mesh.normals.size(), mesh.positions.size());
  EXPECT_EQ(mesh.colours.size(), mesh.positions.size());
}

TEST_F(MeshFile, EveryFormatGivesTheSameSquare) {
  const std::pair<const char*, std::string> files[] = {{"square.obj", testing::square_obj()},
                                                       {"ascii.ply", testing::square_ply_ascii()},
                                                       {"little.PLY", testing::square_ply_binary(false)},
                                                       {"big.ply", testing::square_ply_binary(true)},
                                                       {"square.gltf", testing::square_gltf()},
                                                       {"square.glb", testing::square_glb()}};
  for (const auto& [name, bytes] : files) {
    SCOPED_TRACE(name);
    const Mesh mesh = read(name, bytes);
    expect_square(mesh);
    const bool obj = std::string(name) == "square.obj";
    for (const Floats& colour : mesh.colours) EXPECT_EQ(colour, obj ? (Floats{1, 1, 1}) : (Floats{1, 0, 0}));
    // The .obj has normals, against the winding; those of the others are made.
    for (const Floats& normal : mesh.normals) EXPECT_EQ(normal, obj ? (Floats{0, 0, -1}) : (Floats{0, 0, 1}));
  }
  EXPECT_EQ(rejected_.total(), 0u);
}

TEST_F(MeshFile, MissingNormalsAreFlat) {
  const Mesh mesh = read("ridge.obj", "v 0 0 0\nv 3 0 0\nv 0 4 0\nv 0 0 2\nf 1 2 3\nf 1 4 2\n");
  ASSERT_EQ(mesh.triangles.size(), 2u);
  for (std::size_t t = 0; t < 2; ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      EXPECT_EQ(mesh.normals[v], t == 0 ? (Floats{0, 0, 1}) : (Floats{0, 1, 0}));
    }
  }
}

TEST_F(MeshFile, ConcavePolygonsAreTriangulatedInside) {
  // An L of area 3; a fan from its first corner would leave it.
  const Mesh mesh = read("l.obj", "v 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\nv 2 0 0\nf 1 2 3 4 5 6\n");
  ASSERT_EQ(mesh.triangles.size(), 4u);
  double area = 0;
  for (std::size_t t = 0; t < 4; ++t) {
    EXPECT_GT(area_of(mesh, t).z, 0);
    area += 0.5 * area_of(mesh, t).z;
    const Vec3 middle = (corner(mesh, t, 0) + corner(mesh, t, 1) + corner(mesh, t, 2)) / 3.0;
    EXPECT_FALSE(middle.x > 1 && middle.y > 1);
  }
  EXPECT_EQ(area, 3);
}

TEST_F(MeshFile, ColoursAreThoseOfVerticesOrElseOfMaterialsOrElseWhite) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", use = "mtllib m.mtl\nusemtl paint\n";
  write("m.mtl", "newmtl paint\nKd 0.25 0.5 0.75\n");
  EXPECT_EQ(read("a.obj", vertices + "f 1 2 3\n").colours[0], (Floats{1, 1, 1}));
  EXPECT_EQ(read("b.obj", use + vertices + "f 1 2 3\n").colours[0], (Floats{0.25f, 0.5f, 0.75f}));
  EXPECT_EQ(read("c.obj", "mtllib none.mtl\nusemtl paint\n" + vertices + "f 1 2 3\n").colours[0], (Floats{1, 1, 1}));
  const Mesh painted = read("d.obj", use + "v 0 0 0 1 0 0\nv 1 0 0 0 0.5 0\nv 0 1 0 0 0 0.125\nf 1 2 3\n");
  EXPECT_EQ(std::set<Floats>(painted.colours.begin(), painted.colours.end()),
            (std::set<Floats>{{1, 0, 0}, {0, 0.5f, 0}, {0, 0, 0.125f}}));
  const Mesh plain = read("e.ply",
                          "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                          "property float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n"
                          "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  EXPECT_EQ(plain.colours[0], (Floats{1, 1, 1}));
}

TEST_F(MeshFile, LinearColoursOfGltfAreEncoded) {
  std::string gltf = testing::square_gltf();
  gltf.replace(gltf.find("[1, 0, 0, 1]"), 12, "[0.5, 0.002, 1, 1]");
  const Mesh mesh = read("square.gltf", gltf);
  // IEC 61966-2-1.
  EXPECT_NEAR(mesh.colours[0][0], 0.735357, 1e-6);
  EXPECT_NEAR(mesh.colours[0][1], 0.02584, 1e-6);
  EXPECT_NEAR(mesh.colours[0][2], 1, 1e-6);
}

TEST_F(MeshFile, TransformsOfNodesApply) {
  // A quarter turn about z, then twice as large, then moved.
  const Mesh mesh = read("square.gltf", testing::square_gltf(R"("mesh": 0, "translation": [10, 20, 30],
      "rotation": [0, 0, 0.7071067811865476, 0.7071067811865476], "scale": [2, 2, 2])"));
  ASSERT_EQ(mesh.triangles.size(), 2u);
  const Floats expected[] = {{10, 20, 40}, {10, 22, 40}, {8, 22, 40}};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(mesh.positions[mesh.triangles[0][i]][axis], expected[i][axis], 1e-5);
    }
  }
}

TEST_F(MeshFile, NodesBelowNodesMultiplyAndAMeshMayStandTwice) {
  std::string gltf = testing::square_gltf(R"("children": [1, 2], "scale": [1, 1, 0.5])");
  gltf.replace(gltf.find("}], \"meshes\""), 2, R"(}, {"mesh": 0, "translation": [0, 0, 5]}, {"mesh": 0}])");
  const Mesh mesh = read("twice.gltf", gltf);
  ASSERT_EQ(mesh.triangles.size(), 4u);
  EXPECT_EQ(corner(mesh, 0, 0).z, 5) << "(5 + 5) / 2";
  EXPECT_EQ(corner(mesh, 2, 0).z, 2.5);
}

TEST_F(MeshFile, AMirrorKeepsFrontFacesInFront) {
  const Mesh mesh = read("mirror.gltf", testing::square_gltf(R"("mesh": 0, "scale": [1, 1, -1])"));
  ASSERT_EQ(mesh.triangles.size(), 2u);
  // Mirrored in z, what faced +z faces -z.
  for (std::size_t t = 0; t < 2; ++t) {
    EXPECT_EQ(corner(mesh, t, 0).z, -5);
    EXPECT_LT(area_of(mesh, t).z, 0);
    EXPECT_EQ(mesh.normals[mesh.triangles[t][0]][2], -1);
  }
}

TEST_F(MeshFile, NormalsStayAtRightAnglesUnderUnevenScales) {
  // A slope of 45 degrees with its normal, then flattened to an eighth along y: seven eighths turned.
  std::string buffer = testing::bytes_of<float>({0, 0, 0, 1, 1, 0, 0, 0, -1, -1, 1, 0, -1, 1, 0, -1, 1, 0});
  const std::string json = R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0, "scale": [1, 0.125, 1]}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                  {"bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": 3, "type": "VEC3"}],
    "bufferViews": [{"buffer": 0, "byteLength": 72}], "buffers": [{"byteLength": 72}]})";
  const Mesh mesh = read("slope.glb", testing::glb_of(json, buffer));
  ASSERT_EQ(mesh.triangles.size(), 1u);
  const Vec3 area = area_of(mesh, 0);
  for (const Floats& n : mesh.normals) {
    const Vec3 normal = {n[0], n[1], n[2]};
    EXPECT_NEAR(std::fabs(glm::dot(glm::normalize(normal), glm::normalize(area))), 1, 1e-6);
    EXPECT_GT(normal.y, 0);
  }
}

TEST_F(MeshFile, ABufferMayBeAFileOfItsOwn) {
  write("square.bin", testing::square_buffer());
  expect_square(read("square.gltf", testing::square_json(R"("uri": "square.bin", )", R"("mesh": 0)")));
  write("square.bin", testing::square_buffer().substr(0, 59));
  expect_refused("square.gltf", testing::square_json(R"("uri": "square.bin", )", R"("mesh": 0)"), {});
  expect_refused("square.gltf", testing::square_json(R"("uri": "none.bin", )", R"("mesh": 0)"), {"no such file"});
  std::filesystem::create_directory(in_folder("folder.bin"));
  expect_refused("square.gltf", testing::square_json(R"("uri": "folder.bin", )", R"("mesh": 0)"), {"directory"});
}

TEST_F(MeshFile, WhatCannotBeDrawnIsLeftOutAndCounted) {
  const Mesh mesh =
      read("mixed.obj",
           "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nv 2 0 0\nv 1 1 0\nv inf 1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n"
           "f 1 1 2\nl 1 2\np 3\nf 1 2 6 7\n");
  EXPECT_EQ(mesh.triangles.size(), 1u);
  EXPECT_EQ(rejected_.not_finite, 3u) << "a quad is two triangles";
  EXPECT_EQ(rejected_.degenerate, 2u);
  EXPECT_EQ(rejected_.lines_and_points, 2u);

  rejected_ = {};
  std::string ply = testing::square_ply_ascii();
  ply.replace(ply.find("face 1"), 6, "face 4");
  read("lying.ply", ply + "3 0 1 4\n3 0 -1 2\n4 0 1 2 4000000000\n");
  EXPECT_EQ(rejected_.index_out_of_range, 4u);
  EXPECT_EQ(rejected_.total(), 4u);
}

TEST_F(MeshFile, IndicesBeyondTheVerticesOfAGltfAreLeftOut) {
  std::string buffer = testing::square_buffer();
  const std::uint16_t beyond = 4;
  std::memcpy(&buffer[48 + 2 * 4], &beyond, sizeof beyond);
  EXPECT_EQ(read("lying.glb", testing::glb_of(testing::square_json("", R"("mesh": 0)"), buffer)).triangles.size(), 1u);
  EXPECT_EQ(rejected_.index_out_of_range, 1u);
}

TEST_F(MeshFile, FilesThatAreNoMeshesAreRefused) {
  expect_refused("empty.obj", "", {"empty"});
  expect_refused("points.obj", "v 0 0 0\nv 1 0 0\np 1 2\n", {"no triangle", "1 lines and points"});
  expect_refused("degenerate.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", {"no triangle", "1 have no area"});
  expect_refused("lying.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", {"no triangle", "1 have indices beyond"});
  expect_refused("words.obj", "v 0 zero 0\n", {"`v 0` is malformed"});
  expect_refused("words.obj", "v 0 0 0\nf 1 1/2/3/4 1\n", {"`f 1` is malformed"});
  expect_refused("text.gltf", "hello", {"it is no glTF: it begins neither"});
  expect_refused("cut.gltf", " {", {"not valid JSON"});
  expect_refused("text.glb", "hello", {"it is no glTF: it begins neither"});
  expect_refused("text.ply", "hello", {"does not begin with a line `ply`"});
  expect_refused("mesh.stl", "solid", {"`.stl`", "give an .obj, .ply, .gltf or .glb"});
  expect_refused("mesh", "v 0 0 0", {"no extension"});
  std::filesystem::create_directory(in_folder("folder.obj"));
  expect_user_error([&] { read_mesh(in_folder("folder.obj"), rejected_); }, {"cannot read mesh", "directory"});
  expect_user_error([&] { read_mesh(in_folder("none.obj"), rejected_); }, {"cannot read mesh", "no such file"});
}

TEST_F(MeshFile, GaussiansAreNoMeshAndAMeshIsNoGaussians) {
  write_gaussian_file(in_folder("splats.ply"), testing::scene_of({testing::ordinary_gaussian()}));
  EXPECT_FALSE(is_mesh_file(in_folder("splats.ply")));
  expect_user_error([&] { read_mesh(in_folder("splats.ply"), rejected_); }, {"no faces", "Gaussians"});
  for (const char* name : {"a.obj", "a.gltf", "a.GLB", "none/at/all.Obj"}) EXPECT_TRUE(is_mesh_file(in_folder(name)));
  EXPECT_FALSE(is_mesh_file(in_folder("a.spl")));
  EXPECT_FALSE(is_mesh_file("builtin:object"));
  EXPECT_TRUE(is_mesh_file(write("mesh.ply", testing::square_ply_ascii())));
  EXPECT_TRUE(is_mesh_file(write("mesh.ply", testing::square_ply_binary(true))));
  expect_user_error([&] { is_mesh_file(in_folder("none.ply")); }, {"no such file"});
  expect_user_error([&] { is_mesh_file(write("bad.ply", "hello")); }, {"line `ply`"});
}

TEST_F(MeshFile, AnObjMayCountBackwardsGoOnInTheNextLineAndHoldWhatMeshesDoNotNeed) {
  const Mesh mesh =
      read("odd.obj",
           "\xef\xbb\xbfo thing\ng a b\ns 1\nvt 0 0\nvp 1 2\nv 0 0 5 1.0\nv +1 0 5 # a comment\r\nv 1 1 5e0 # \\\n"
           "v 0 1 5\nf -4/1 -3/1 \\\n-2/1\ncstype bezier\nf 1 3/1/ 4\nv 4e-60 7 7\n");
  expect_square(mesh);
  EXPECT_EQ(rejected_.total(), 0u);
}

TEST_F(MeshFile, APlyMayHoldWhatMeshesDoNotNeed) {
  expect_square(read("rich.ply",
                     "ply\nformat ascii 1.0\ncomment TextureFile x.png\nobj_info y\nelement camera 1\nproperty int q\n"
                     "element vertex 4\nproperty float quality\nproperty double x\nproperty list uchar int more\n"
                     "property int y\nproperty float z\nproperty float s\nelement face 1\nproperty uchar flags\n"
                     "property list uchar uint vertex_index\nproperty list uchar float texcoord\nelement edge 1\n"
                     "property int vertex1\nend_header\n8\n1 0 0 0 5 0\n1 1 1 9 0 5 0\n\n1 1 2 9 9 1 5 0\n1 0 0 1 5 0\n"
                     "255 4 0 1 2 3 8 0 0 0 0 0 0 0 0\n77\n"));
}

TEST_F(MeshFile, RecordsOfAPlyThatLieAreRefused) {
  const std::string ascii = testing::square_ply_ascii();
  const auto with = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  expect_refused("a.ply", with(ascii, "vertex 4", "vertex 5"), {"too few values"});
  expect_refused("a.ply", with(ascii, "face 1", "face 2"), {"cut short"});
  expect_refused("a.ply", with(ascii, "vertex 4", "vertex 99999999999"), {"99999999999 records", "at most 16777216"});
  expect_refused("a.ply", with(ascii, "face 1", "face 0"), {"no faces"});
  expect_refused("a.ply", with(ascii, "4 0 1 2 3", "5 0 1 2 3"), {"too few values"});
  expect_refused("a.ply", with(ascii, "4 0 1 2 3", "-4 0 1 2 3"), {"not the length of a list"});
  expect_refused("a.ply", with(ascii, "4 0 1 2 3", "4000000000 0 1 2 3"), {"4000000000 values"});
  expect_refused("a.ply", with(ascii, "1 0 5 255", "1 zero 5 255"), {"`zero` is not a number of its type"});
  expect_refused("a.ply", with(ascii, "ascii 1.0", "ascii 2.0"), {"`ascii 2.0`"});
  expect_refused("a.ply", with(ascii, "element face 1", "element vertex 1"), {"no faces"});
  expect_refused("a.ply", with(ascii, "uchar red", "purple red"), {"unknown type"});
  const std::string binary = testing::square_ply_binary(false);
  expect_refused("b.ply", with(binary, "vertex 4", "vertex 6"), {"cut short"});
  expect_refused("b.ply", with(binary, "uchar int vertex", "float int vertex"), {"no integer"});
  std::string list = binary;
  list[list.size() - 17] = '\xff';
  expect_refused("b.ply", list, {"cut short"});
}

TEST_F(MeshFile, DocumentsOfGltfThatLieAreRefused) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = testing::square_gltf();
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  expect_refused("a.gltf", with("\"2.0\"", "\"1.0\""), {"version 2"});
  expect_refused("a.gltf", with("\"count\": 4", "\"count\": 5"), {"accessors[0] exceeds its bufferView"});
  expect_refused("a.gltf", with("\"count\": 4", "\"count\": -4"), {"accessors[0].count is not a whole number"});
  expect_refused("a.gltf", with("\"count\": 4", "\"count\": 18446744073709551615"), {"accessors[0] has 1844"});
  expect_refused("a.gltf", with("\"count\": 6", "\"count\": 0"), {"accessors[1] has 0 elements"});
  expect_refused("a.gltf", with("\"byteLength\": 48", "\"byteLength\": 61"), {"bufferViews[0] exceeds its buffer"});
  expect_refused("a.gltf", with("\"byteOffset\": 48", "\"byteOffset\": 18446744073709551610"), {"exceeds its buffer"});
  expect_refused("a.gltf", with("\"byteLength\": 60", "\"byteLength\": 61"), {});
  expect_refused("a.gltf", with("\"indices\": 1", "\"indices\": 2"), {"indices is 2, of 2 accessors"});
  expect_refused("a.gltf", with("\"indices\": 1", "\"indices\": 0"), {"not unsigned whole numbers"});
  expect_refused("a.gltf", with("\"POSITION\": 0", "\"POSITION\": 1"), {"not of a type"});
  expect_refused("a.gltf", with("\"mesh\": 0", "\"mesh\": 7"), {"nodes[0].mesh is 7, of 1 meshes"});
  expect_refused("a.gltf", with("\"mesh\": 0", "\"children\": [0]"), {"circle"});
  expect_refused("a.gltf", with("\"mesh\": 0", "\"children\": [1]"), {"not there"});
  expect_refused("a.gltf", with("\"nodes\": [0]", "\"nodes\": [1]"), {"not there"});
  expect_refused("a.gltf", with("\"bufferView\": 0, \"comp", "\"sparse\": {}, \"comp"), {"sparse"});
  expect_refused("a.gltf", with("\"asset\"", "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"], \"asset\""),
                 {"requires the extension KHR_draco_mesh_compression"});
  expect_refused("a.gltf", std::string(1000000, '['), {"JSON"});
  expect_refused("a.gltf", with("\"scene\": 0", "\"extras\": " + std::string(100, '[') + std::string(100, ']')),
                 {"nested too deep"});
  std::string glb = testing::square_glb();
  glb[8] = '\1';
  expect_refused("a.glb", glb, {"cut short"});
}

TEST_F(MeshFile, PolygonsOfAbsurdSizeAreRefused) {
  std::string vertices, face = "f";
  for (int i = 1; i <= 1100; ++i) {
    vertices += "v " + std::to_string(i) + " " + std::to_string(i * i) + " 0\n";
    face += " " + std::to_string(i);
  }
  expect_refused("round.obj", vertices + face + "\n", {"1100 corners", "1024"});
}

TEST_F(MeshFile, TheReaderSaysNothingItself) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  read("square.obj", "mtllib none.mtl\nusemtl nothing\nstrange\n" + testing::square_obj());
  expect_refused("lying.obj", "v 0 0 0\nf 1 2 3\n", {});
  expect_refused("b.ply", testing::square_ply_binary(true).substr(0, 250), {});
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

/// Files that are broken somewhere: whatever comes out is refused in one line, or can be drawn.
class BrokenMeshFile : public MeshFile, public ::testing::WithParamInterface<std::pair<const char*, std::string>> {
 protected:
  void expect_sound_or_refused(const std::string& bytes) {
    std::filesystem::remove(in_folder(GetParam().first));  // some file systems write through what replaces a file
    const auto path = write(GetParam().first, bytes);
    Mesh mesh;
    try {
      mesh = read_mesh(path, rejected_);
    } catch (const UserError& error) {
      ++refused_;
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return;
    }
    ++read_;
    EXPECT_FALSE(mesh.empty());
    RejectedTriangles none;
    reject_triangles(mesh, none);
    EXPECT_EQ(none.total(), 0u);
  }
  int refused_ = 0, read_ = 0;
};

TEST_F(MeshFile, AMaterialFileIsReadHoweverBroken) {
  const std::string whole = testing::rich_mtl();
  write("rich.mtl", whole);
  EXPECT_EQ(read("rich.obj", testing::rich_obj()).triangles.size(), 5u);
  constexpr char replacements[] = {'\0', '\xff', '-', '\n'};
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string broken = whole;
    broken[at] = replacements[at % sizeof replacements];
    std::filesystem::remove(in_folder("rich.mtl"));
    write("rich.mtl", broken);
    const Mesh mesh = read_mesh(in_folder("rich.obj"), rejected_);
    EXPECT_EQ(mesh.triangles.size(), 5u);
    for (const Floats& colour : mesh.colours) ASSERT_TRUE(std::isfinite(colour[0]) && colour[0] >= 0);
  }
}

TEST_P(BrokenMeshFile, CutAtEveryByte) {
  const std::string& whole = GetParam().second;
  for (std::size_t length = 0; length < whole.size(); ++length) expect_sound_or_refused(whole.substr(0, length));
  EXPECT_GT(refused_, 0);
}

TEST_P(BrokenMeshFile, WithEveryByteReplaced) {
  const std::string& whole = GetParam().second;
  constexpr char kReplacements[] = {'\0', '\xff', '9', '-', ' ', '\n', '\x80'};
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string broken = whole;
    broken[at] = kReplacements[at % sizeof kReplacements];
    expect_sound_or_refused(broken);
  }
  EXPECT_GT(refused_, 0);
  EXPECT_GT(read_, 0);
}

INSTANTIATE_TEST_SUITE_P(
    All, BrokenMeshFile,
    ::testing::Values(std::pair{"mesh.obj", testing::square_obj()}, std::pair{"rich.obj", testing::rich_obj()},
                      std::pair{"rich.ply", testing::rich_ply()}, std::pair{"ascii.ply", testing::square_ply_ascii()},
                      std::pair{"little.ply", testing::square_ply_binary(false)},
                      std::pair{"big.ply", testing::square_ply_binary(true)},
                      std::pair{"mesh.gltf", testing::square_gltf()}, std::pair{"mesh.glb", testing::square_glb()}),
    [](const auto& parameter) {
      std::string name = parameter.param.first;
      name[name.find('.')] = '_';
      return name;
    });

}  // namespace
}  // namespace vrpipe
