// What a file says of how its Gaussians are to be drawn, beside them.
#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/preprocess.h>

#include "../workloads/workload_test_support.h"

namespace vrpipe {
namespace {

namespace fs = std::filesystem;
using testing::data_file;
using testing::read_bytes;

std::string with_changed(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

class AntiAliased : public testing::FolderTest {
 protected:
  /// Of a .ply with a comment.
  GaussianFile with_comment(const std::string& fixture, const std::string& comment) const {
    const std::string bytes = read_bytes(data_file("formats/" + fixture));
    return read_gaussian_file(
        write("a.ply", with_changed(bytes, "element", "comment " + comment + "\nelement")).string());
  }
};

void expect_anti_aliased(const GaussianFile& file, const std::string& said) {
  EXPECT_TRUE(file.gaussians.compensates_opacity());
  EXPECT_EQ(file.notes, (std::vector<std::string>{"it was trained anti-aliased (`" + said +
                                                  "`): preprocess.opacity_compensation is on unless it is set"}));
}

TEST_F(AntiAliased, CommentsOfBothKindsOfPlySaySo) {
  for (const char* fixture : {"sh0.ply", "18_columns.compressed.ply"}) {
    for (const char* comment : {"SplatRenderMode: mip", "splatrendermode: MIP", "antialiased 1", "Antialiased: true"})
      expect_anti_aliased(with_comment(fixture, comment), comment);
    for (const char* comment :
         {"SplatRenderMode: default", "antialiased 0", "made by antialiased 1", "antialiasedness 1"}) {
      const GaussianFile file = with_comment(fixture, comment);
      EXPECT_FALSE(file.gaussians.compensates_opacity()) << comment;
      EXPECT_TRUE(file.notes.empty()) << comment;
    }
  }
}

TEST_F(AntiAliased, ACommentOfAKnownKindThatIsNotUnderstoodIsSaid) {
  for (const char* comment : {"SplatRenderMode: 2dgs", "antialiased maybe", "Vertical axis: sideways"}) {
    EXPECT_EQ(with_comment("sh0.ply", comment).notes,
              (std::vector<std::string>{fmt::format("its comment `{}` is not understood, nor used", comment)}));
  }
}

TEST_F(AntiAliased, TheUpAxisIsReadInCompressedPlyToo) {
  EXPECT_EQ(with_comment("18_columns.compressed.ply", "Vertical axis: 0 0 1").up, Vec3(0, 0, 1));
}

TEST_F(AntiAliased, FlagsOfSpzSaySo) {
  for (const char* fixture : {"v3_bare_sh3.spz", "v4.spz"}) {
    std::string bytes = read_bytes(data_file(std::string("formats/") + fixture));
    bytes[14] = static_cast<char>(bytes[14] | 1);
    expect_anti_aliased(read_gaussian_file(write("a.spz", bytes).string()), "flag 1 of its header");
  }
}

TEST_F(AntiAliased, MetaOfSogSaysSo) {
  fs::copy(data_file("formats/sog"), in_folder("sog"), fs::copy_options::recursive);
  const std::string meta = read_bytes(in_folder("sog/meta.json"));
  EXPECT_FALSE(read_gaussian_file(in_folder("sog").string()).gaussians.compensates_opacity());
  write("sog/meta.json", with_changed(meta, "\"antialias\":false", "\"antialias\":true"));
  expect_anti_aliased(read_gaussian_file(in_folder("sog").string()), "antialias: true");
  fs::copy(data_file("formats/streamed"), in_folder("streamed"), fs::copy_options::recursive);
  const std::string part = read_bytes(in_folder("streamed/L_0/meta.json"));
  write("streamed/L_0/meta.json", with_changed(part, "\"antialias\":false", "\"antialias\":true"));
  expect_anti_aliased(read_gaussian_file(in_folder("streamed").string()), "antialias: true");
}

TEST_F(AntiAliased, WhatIsWrittenSaysIt) {
  GaussianFile file = with_comment("sh1.ply", "SplatRenderMode: mip");
  file.up = {0, 0, 1};
  EXPECT_TRUE(write_gaussian_file(in_folder("b.ply"), file).empty());
  const GaussianFile again = read_gaussian_file(in_folder("b.ply").string());
  expect_anti_aliased(again, "SplatRenderMode: mip");
  EXPECT_EQ(again.up, file.up);
  const std::vector<std::string> left_out = write_gaussian_file(in_folder("b.splat"), file);
  ASSERT_EQ(left_out.size(), 3U);
  EXPECT_NE(left_out[1].find("preprocess.opacity_compensation=on"), std::string::npos);
  EXPECT_NE(left_out[2].find("0,0,1"), std::string::npos);
}

// On the camera's axis, of scales along its axes, so that the 2-D covariance is a diagonal.
TEST(OpacityCompensation, IsTheRootOfTheDeterminantsRatio) {
  constexpr double focal = 400, distance = 4, dilation = 0.1;
  GaussianAttributes g = testing::ordinary_gaussian();
  g.position = {0, 0, 0};
  g.rotation = {1, 0, 0, 0};
  g.opacity_logit = 1;
  Camera camera;
  camera.eye = {0, 0, -distance};
  camera.fx = camera.fy = focal;
  camera.width = camera.height = 320;
  PreprocessOptions options;
  options.dilation = dilation;
  for (const double logarithm : {-7.0, -5.5, -4.0, -2.0}) {
    g.log_scale = {static_cast<float>(logarithm), static_cast<float>(logarithm + 1), -3};
    GaussianScene scene = testing::scene_of({g});
    const double a = std::exp(logarithm) * focal / distance, b = a * std::exp(1.0);
    const double share = std::sqrt(a * a * b * b / ((a * a + dilation) * (b * b + dilation)));
    const double opacity = 1 / (1 + std::exp(-1.0));
    for (const bool of_scene : {false, true}) {
      scene.set_compensates_opacity(of_scene);
      options.opacity_compensation = of_scene ? std::nullopt : std::optional<bool>(true);
      SceneSummary summary;
      const Draw draw = preprocess(scene, camera, options, summary);
      EXPECT_EQ(summary.gaussians_compensated, 1U);
      ASSERT_EQ(draw.splats.size(), 1U) << logarithm;
      EXPECT_NEAR(draw.splats[0].opacity, opacity * share, 1e-6);
      EXPECT_NEAR(draw.splats[0].r, std::sqrt(2 * std::log(255 * opacity * share)), 1e-5);
      EXPECT_NEAR(std::fmax(std::fabs(draw.splats[0].ay), std::fabs(draw.splats[0].by)) / draw.splats[0].r,
                  std::sqrt(b * b + dilation), 1e-5);
    }
    options.opacity_compensation = false;  // whatever the scene says
    SceneSummary summary;
    const Draw draw = preprocess(scene, camera, options, summary);
    EXPECT_EQ(summary.gaussians_compensated, 0U);
    EXPECT_NEAR(draw.splats[0].opacity, opacity, 1e-6);
  }
}

TEST(OpacityCompensation, WhatItLeavesNothingOfIsCulled) {
  GaussianAttributes g = testing::ordinary_gaussian();
  g.position = {0, 0, 0};
  Camera camera;
  camera.eye = {0, 0, -4};
  camera.width = camera.height = 64;
  camera.fx = camera.fy = 64;
  PreprocessOptions options;
  options.opacity_compensation = true;
  for (const float logarithm : {-20.0F, -std::numeric_limits<float>::infinity()}) {
    g.log_scale = {logarithm, logarithm, logarithm};
    SceneSummary summary;
    EXPECT_TRUE(preprocess(testing::scene_of({g}), camera, options, summary).splats.empty());
  }
}

TEST(Dilation, OutOfRangeIsRefused) {
  PreprocessOptions options;
  SceneSummary summary;
  for (const double dilation : {0.0, -1.0, 101.0, std::numeric_limits<double>::quiet_NaN()}) {
    options.dilation = dilation;
    testing::expect_user_error(
        [&] { preprocess(testing::scene_of({testing::ordinary_gaussian()}), Camera(), options, summary); },
        {"dilation"});
  }
}

}  // namespace
}  // namespace vrpipe
