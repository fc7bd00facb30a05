// One scene in every format: each file holds the Gaussians that the others hold, within the quanta of its format.
#include <cmath>
#include <fstream>

#include <nlohmann/json.hpp>

#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/preprocess.h>

#include "../workloads/workload_test_support.h"

namespace vrpipe {
namespace {

std::string fixture(const std::string& name) { return testing::data_file("formats").string() + "/" + name; }

const nlohmann::json& expected() {
  static const nlohmann::json json = nlohmann::json::parse(std::ifstream(fixture("expected.json")));
  return json;
}

/// Components of a unit quaternion, of which the largest is positive: q and -q are one rotation.
std::array<double, 4> canonical(const std::array<double, 4>& q) {
  double length = 0, largest = 0;
  for (const double c : q) {
    length += c * c;
    if (std::fabs(c) > std::fabs(largest)) largest = c;
  }
  std::array<double, 4> unit{};
  for (std::size_t i = 0; i < 4; ++i) unit[i] = q[i] / std::sqrt(length) * (largest < 0 ? -1 : 1);
  return unit;
}

class OneScene : public ::testing::TestWithParam<std::size_t> {};

TEST_P(OneScene, HoldsTheSameGaussians) {
  const nlohmann::json& file = expected()["files"][GetParam()];
  const std::string name = file["file"];
  SCOPED_TRACE(name);
  const GaussianFile read = read_gaussian_file(fixture(name));
  const int degree = file["sh_degree"];
  EXPECT_EQ(read.format, file["format"]);
  EXPECT_EQ(read.gaussians.sh_degree(), degree);
  const bool says_something = name == "v4_sh4.spz" || name == "v4_sh3.spz" || name == "logarithms.glb";
  EXPECT_EQ(read.notes.size(), says_something ? 1U : 0U);
  const auto& indices = file["indices"];
  ASSERT_EQ(read.gaussians.size(), indices.size());
  const auto tolerance = [&](const char* attribute) { return file["tolerance"][attribute].get<double>(); };
  for (std::size_t i = 0; i < indices.size(); ++i) {
    SCOPED_TRACE("Gaussian " + std::to_string(i));
    const nlohmann::json& original = expected()["gaussians"][indices[i].get<std::size_t>()];
    const GaussianRef g = read.gaussians[i];
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(g.position()[k], original["position"][k].get<float>(), tolerance("position"));
      EXPECT_NEAR(g.log_scale()[k], original["log_scale"][k].get<float>(), tolerance("log_scale"));
      EXPECT_NEAR(g.f_dc()[k], original["f_dc"][k].get<float>(), tolerance("f_dc"));
    }
    EXPECT_NEAR(sigmoid(g.opacity_logit()), sigmoid(original["opacity_logit"].get<float>()), tolerance("opacity"));
    std::array<double, 4> here{}, there{};
    for (std::size_t k = 0; k < 4; ++k) {
      here[k] = g.rotation()[k];
      there[k] = original["rotation"][k].get<float>();
    }
    // The largest components may be two of one size, so that either sign is right.
    double same = 0, other = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      same = std::fmax(same, std::fabs(canonical(here)[k] - canonical(there)[k]));
      other = std::fmax(other, std::fabs(canonical(here)[k] + canonical(there)[k]));
    }
    EXPECT_LE(std::fmin(same, other), tolerance("rotation"));
    for (std::uint32_t channel = 0; channel < 3; ++channel) {
      for (std::uint32_t c = 1; c <= kShRestPerChannel[static_cast<std::size_t>(degree)]; ++c) {
        EXPECT_NEAR(g.f_rest(channel, c), original["f_rest"][channel][c - 1].get<float>(), tolerance("f_rest"));
      }
    }
  }
}

std::string test_name(const ::testing::TestParamInfo<std::size_t>& info) {
  std::string name = expected()["files"][info.param]["file"];
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(Formats, OneScene, ::testing::Range<std::size_t>(0, expected()["files"].size()), test_name);

TEST(OneSceneInAll, TheFixturesCoverEveryFormat) {
  for (const GaussianFormat& format : gaussian_formats()) {
    const auto& files = expected()["files"];
    EXPECT_TRUE(std::any_of(files.begin(), files.end(), [&](const auto& file) {
      return file["format"] == format.name;
    })) << format.name;
  }
}

/// Files of other programs.
TEST(FilesOfOtherPrograms, MetalSplattersHoldTheSameThreePoints) {
  const GaussianScene ply = read_gaussian_file(testing::data_file("train_3_points.ply").string()).gaussians;
  const GaussianScene spz = read_gaussian_file(fixture("metalsplatter/train_3_points.spz")).gaussians;
  const GaussianScene splat = read_gaussian_file(fixture("metalsplatter/train_3_points.splat")).gaussians;
  ASSERT_EQ(ply.size(), 3U);
  ASSERT_EQ(spz.size(), 3U);
  ASSERT_EQ(splat.size(), 3U);
  EXPECT_EQ(spz.sh_degree(), 3);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(spz[i].position()[k], ply[i].position()[k], 1.0 / 4096) << i;
      EXPECT_NEAR(splat[i].position()[k], ply[i].position()[k], 1e-5) << i;
      EXPECT_NEAR(spz[i].log_scale()[k], ply[i].log_scale()[k], 1.0 / 16) << i;
    }
    EXPECT_NEAR(sigmoid(spz[i].opacity_logit()), sigmoid(ply[i].opacity_logit()), 1.0 / 255) << i;
    EXPECT_NEAR(sigmoid(splat[i].opacity_logit()), sigmoid(ply[i].opacity_logit()), 1.0 / 255) << i;
  }
}

TEST(FilesOfOtherPrograms, SplatTransformsHoldTheSameFourPoints) {
  const GaussianScene splat = read_gaussian_file(fixture("splat-transform/minimal.splat")).gaussians;
  // Those of version 2 were stored without turning their axes.
  for (const char* name :
       {"minimal-raw.spz#axes=rdf", "minimal-v2.spz#axes=rdf", "minimal-v3.spz", "minimal-v4.spz", "minimal.ksplat"}) {
    const GaussianScene scene = read_gaussian_file(fixture(std::string("splat-transform/") + name)).gaussians;
    ASSERT_EQ(scene.size(), splat.size()) << name;
    for (std::size_t i = 0; i < splat.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(scene[i].position()[k], splat[i].position()[k], 1.0 / 4096) << name << " " << i;
        EXPECT_NEAR(scene[i].log_scale()[k], splat[i].log_scale()[k], 1.0 / 16) << name << " " << i;
      }
      EXPECT_NEAR(sigmoid(scene[i].opacity_logit()), sigmoid(splat[i].opacity_logit()), 1.0 / 255) << name << " " << i;
    }
  }
}

}  // namespace
}  // namespace vrpipe
