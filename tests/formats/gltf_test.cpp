// KHR_gaussian_splatting: how nodes place its Gaussians, what it says of how they are to be drawn, and what is refused. That
// attributes are read is in one_scene_test.cpp.
#include <cmath>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>

#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/mesh.h>
#include <vrpipe/workloads/preprocess.h>
#include <vrpipe/workloads/scene.h>

#include "../workloads/workload_test_support.h"

namespace vrpipe {
namespace {

using Document = nlohmann::json;
using testing::expect_user_error;

constexpr std::size_t few_gaussians = 24;

/// A .gltf with its buffer inside, of degree 1.
class Gltf : public testing::FolderTest {
 protected:
  Gltf() : document_(Document::parse(testing::read_bytes(testing::data_file("formats/embedded.gltf")))) {}

  GaussianFile read() const { return read_gaussian_file(write("a.gltf", document_.dump()).string()); }
  void refused(const std::vector<std::string>& parts) const {
    expect_user_error([&] { read(); }, parts);
  }
  Document& primitive() { return document_["meshes"][0]["primitives"][0]; }
  Document& extension() { return primitive()["extensions"]["KHR_gaussian_splatting"]; }

  Document document_;
};

/// 3-D covariance, rows: R S S R^T.
std::array<Vec3, 3> covariance(const GaussianRef& g) {
  const std::array<float, 4> q = g.rotation();
  const glm::dmat3 rotation = glm::mat3_cast(glm::normalize(glm::dquat(q[0], q[1], q[2], q[3])));
  std::array<Vec3, 3> sum{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double scale = std::exp(static_cast<double>(g.log_scale()[k]));
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) sum[i][j] += rotation[k][i] * rotation[k][j] * scale * scale;
    }
  }
  return sum;
}

Vec3 position(const GaussianScene& scene, std::uint64_t i) {
  const std::array<float, 3> p = scene[i].position();
  return {scene.origin()[0] + p[0], scene.origin()[1] + p[1], scene.origin()[2] + p[2]};
}

/// `there` is `here` with x becoming scale turn x + offset, also as it is seen.
void expect_placed(const GaussianScene& here, const GaussianScene& there, const glm::dmat3& turn, double scale,
                   const Vec3& offset) {
  ASSERT_EQ(here.size(), there.size());
  for (std::uint64_t i = 0; i < here.size(); ++i) {
    const Vec3 expected = scale * (turn * position(here, i)) + offset;
    EXPECT_LT(glm::length(position(there, i) - expected), 1e-5) << i;
    const std::array<Vec3, 3> a = covariance(here[i]), b = covariance(there[i]);
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c) {
        double turned = 0;
        for (std::size_t j = 0; j < 3; ++j) {
          for (std::size_t k = 0; k < 3; ++k) turned += turn[j][r] * a[j][k] * turn[k][c];
        }
        EXPECT_NEAR(b[r][c], scale * scale * turned, 1e-6) << i;
      }
    }
    for (const Vec3& seen : {Vec3{1, 0, 0}, Vec3{0.6, -0.64, 0.48}, Vec3{-0.28, 0, 0.96}}) {
      const auto old = sh_colour(here[i], seen, 3), now = sh_colour(there[i], turn * seen, 3);
      for (std::size_t channel = 0; channel < 3; ++channel) EXPECT_NEAR(now[channel], old[channel], 2e-6) << i;
    }
  }
}

TEST_F(Gltf, ANodeTurnsMovesAndScalesItsGaussians) {
  const GaussianScene plain = read().gaussians;
  const glm::dquat turn = glm::normalize(glm::dquat(0.8, 0.1, -0.4, 0.3));
  Document& node = document_["nodes"][0];
  node["rotation"] = {turn.x, turn.y, turn.z, turn.w};
  node["scale"] = {2.5, 2.5, 2.5};
  node["translation"] = {1, -2, 3};
  expect_placed(plain, read().gaussians, glm::mat3_cast(turn), 2.5, {1, -2, 3});
}

TEST_F(Gltf, AChildIsPlacedByItsParentsAndAMatrixMayMirror) {
  const GaussianScene plain = read().gaussians;
  document_["nodes"] = {{{"children", {1}}, {"translation", {0, 5, 0}}},
                        {{"mesh", 0}, {"matrix", {-2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 0, 0, 1}}}};
  expect_placed(plain, read().gaussians, {-1, 0, 0, 0, 1, 0, 0, 0, 1}, 2, {1, 5, 0});
}

TEST_F(Gltf, GaussiansFarFromTheOriginKeepTheirPlaces) {
  const GaussianScene plain = read().gaussians;
  document_["nodes"][0]["translation"] = {500000.25, 4000000.5, 0};
  expect_placed(plain, read().gaussians, glm::dmat3(1), 1, {500000.25, 4000000.5, 0});
}

TEST_F(Gltf, SeveralNodesAndPrimitivesAreOneScene) {
  document_["meshes"][0]["primitives"].push_back(primitive());
  document_["nodes"].push_back({{"mesh", 0}});
  document_["scenes"][0]["nodes"] = {0, 1};
  EXPECT_EQ(read().gaussians.size(), 4 * few_gaussians);
}

TEST_F(Gltf, YIsUp) { EXPECT_EQ(read().up, Vec3(0, 1, 0)); }

TEST_F(Gltf, WhatItSaysAndIsNotDoneIsSaid) {
  EXPECT_TRUE(read().notes.empty());
  extension()["sortingMethod"] = "cameraDistance";
  extension()["colorSpace"] = "lin_rec709_display";
  document_["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}});
  const std::vector<std::string> notes = read().notes;
  ASSERT_EQ(notes.size(), 3U);
  EXPECT_NE(notes[0].find("1 primitive of it without Gaussians is not drawn"), std::string::npos) << notes[0];
  EXPECT_NE(notes[2].find("of the space lin_rec709_display"), std::string::npos) << notes[2];
  EXPECT_NE(notes[1].find("sorted by distance from the camera, and is by depth"), std::string::npos) << notes[1];
}

TEST_F(Gltf, APrimitiveThatIsNotSupportedIsNamed) {
  const Document good = document_;
  const auto with = [&](const auto& change, const std::vector<std::string>& parts) {
    document_ = good;
    change();
    refused(parts);
  };
  const std::string primitive_name = "meshes[0].primitives[0]";
  with([&] { extension()["kernel"] = "disc"; }, {primitive_name, "the kernel disc"});
  with([&] { extension()["projection"] = "fisheye"; }, {primitive_name, "the projection fisheye"});
  with(
      [&] {
        extension()["extensions"]["KHR_gaussian_splatting_compression_spz_2"] = {{"bufferView", 0}};
      },
      {primitive_name, "KHR_gaussian_splatting_compression_spz_2"});
  with([&] { primitive()["mode"] = 4; }, {primitive_name, "not of points"});
  with([&] { primitive()["attributes"].erase("KHR_gaussian_splatting:SCALE"); }, {"no `KHR_gaussian_splatting:SCALE`"});
  with([&] { primitive()["attributes"].erase("KHR_gaussian_splatting:SH_DEGREE_1_COEF_2"); }, {"SH_DEGREE_1_COEF_2"});
  with([&] { document_["accessors"][0]["count"] = 5; }, {"has 24 elements, and its POSITION 5"});
  with([&] { document_["accessors"][0]["count"] = 25; }, {"POSITION"});
  with([&] { document_["accessors"][1]["count"] = 1ULL << 52U; }, {"ROTATION"});
  with([&] { document_["accessors"][0]["type"] = "VEC2"; }, {"POSITION", "VEC3"});
  with([&] { document_["accessors"][0]["sparse"] = Document::object(); }, {"sparse"});
  with([&] { document_["bufferViews"][0]["byteLength"] = 1 << 20; }, {"POSITION"});
  with([&] { document_["buffers"][0]["uri"] = "data:application/octet-stream;base64,%%%%"; }, {"base64"});
  with([&] { document_["buffers"][0]["uri"] = "../elsewhere.bin"; }, {"../elsewhere.bin"});
  with([&] { document_["nodes"][0]["scale"] = {1, 2, 1}; }, {"nodes[0]", "scale its axes differently"});
  with([&] { document_["nodes"][0]["children"] = {0}; }, {"nodes[0] is there twice"});
  with([&] { document_["extensionsRequired"] = {"EXT_meshopt_compression"}; }, {"EXT_meshopt_compression"});
  with(
      [&] {
        primitive()["extensions"] = Document::object();
        document_["asset"]["extras"] = "KHR_gaussian_splatting";
      },
      {"no primitive of its scene has KHR_gaussian_splatting"});
}

TEST_F(Gltf, IsASceneAndNoMesh) {
  const std::filesystem::path file = write("a.gltf", document_.dump());
  EXPECT_FALSE(is_mesh_file(file));
  EXPECT_FALSE(is_mesh_file(testing::data_file("formats/linear_sh3.glb")));
  EXPECT_EQ(open_gaussians(file.string()).gaussians.size(), few_gaussians);
  RejectedTriangles rejected;
  expect_user_error([&] { read_mesh(file, rejected); }, {"it has Gaussians (KHR_gaussian_splatting)", "--scene"});
}

}  // namespace
}  // namespace vrpipe
