#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/mixed_frame.h>

#include <cmath>

#include <vrpipe/workloads/draw_list.h>
#include <vrpipe/workloads/scene.h>

#include "../workloads/workload_test_support.h"
#include "mesh_files.h"

namespace vrpipe {
namespace {

using testing::expect_user_error;

Draw some_splats() {
  Draw draw;
  draw.width = 32;
  draw.height = 16;
  draw.splats.resize(5);
  return draw;
}

Draw some_mesh(std::size_t triangles) {
  Draw draw;
  draw.width = 32;
  draw.height = 16;
  draw.mesh.resize(triangles);
  return draw;
}

void expect_test(const DepthState& depth, Compare compare, bool write) {
  EXPECT_TRUE(depth.test);
  EXPECT_EQ(depth.compare, compare);
  EXPECT_EQ(depth.write, write);
}

TEST(MixedFrame, WithoutMeshesIsTheFrameOfTheSplats) {
  const Draw splats = some_splats();
  MixedFrameOptions options;
  options.splats.early_termination = true;
  options.splats.pruning_threshold = 0.02F;
  const auto mixed = mixed_frame(splats, {}, options), plain = Frame::of(splats, options.splats);
  ASSERT_EQ(mixed->draws().size(), 1u);
  EXPECT_EQ(mixed->commands().size(), plain->commands().size());
  EXPECT_EQ(mixed->draw_call(0).state, plain->draw_call(0).state);
  EXPECT_FALSE(mixed->draw_call(0).state.depth.test);
  EXPECT_EQ(mixed->draw_call(0).geometry.get(), &splats);
  EXPECT_EQ(mixed->draw_call(0).name, plain->draw_call(0).name);
}

TEST(MixedFrame, IsDepthThenSplatsThenColour) {
  const Draw splats = some_splats();
  const std::vector<Draw> meshes = {some_mesh(2), some_mesh(3)};
  MixedFrameOptions options;
  options.splats.early_termination = true;
  options.splats.termination_threshold = 0.9F;
  options.light = {0, 0.6F, 0.8F, 0.25F};
  const auto frame = mixed_frame(splats, meshes, options);
  ASSERT_EQ(frame->commands().size(), 5u) << "no clears";
  ASSERT_EQ(frame->draws().size(), 5u);
  for (const std::size_t i : {0U, 1U}) {
    const DrawCall& depth = frame->draws()[i];
    EXPECT_EQ(depth.geometry.get(), &meshes[i]);
    EXPECT_EQ(depth.splats, meshes[i].mesh.size());
    expect_test(depth.state.depth, Compare::less, true);
    EXPECT_EQ(depth.state.shader, FragmentShader::none);
    EXPECT_EQ(depth.state.cull, CullMode::back);
    EXPECT_FALSE(depth.state.early_termination);

    const DrawCall& colour = frame->draws()[3 + i];
    EXPECT_EQ(colour.geometry.get(), &meshes[i]);
    expect_test(colour.state.depth, Compare::equal, false);
    EXPECT_EQ(colour.state.shader, FragmentShader::lit);
    EXPECT_EQ(colour.state.light.z, 0.8F);
    EXPECT_EQ(colour.state.light.ambient, 0.25F);
    EXPECT_EQ(colour.state.cull, CullMode::back);
    EXPECT_FALSE(colour.state.early_termination);
  }
  const DrawCall& drawn = frame->draws()[2];
  EXPECT_EQ(drawn.geometry.get(), &splats);
  expect_test(drawn.state.depth, Compare::less, false);
  EXPECT_EQ(drawn.state.shader, FragmentShader::splat);
  EXPECT_EQ(drawn.state.cull, CullMode::none);
  EXPECT_TRUE(drawn.state.early_termination);
  EXPECT_EQ(drawn.state.termination_threshold, 0.9F);
  EXPECT_EQ(drawn.splats, 5u);
  for (const DrawCall& draw : frame->draws()) EXPECT_FALSE(draw.state.stencil.test);
}

TEST(MixedFrame, AMeshOutOfSightDrawsNothingAndTheDepthTestStays) {
  const Draw splats = some_splats();
  const std::vector<Draw> meshes = {some_mesh(0)};
  const auto frame = mixed_frame(splats, meshes);
  ASSERT_EQ(frame->draws().size(), 1u);
  EXPECT_TRUE(frame->draw_call(0).state.depth.test);
}

TEST(MixedFrame, ImpossibleOptionsAreRefused) {
  const Draw splats = some_splats();
  const std::vector<Draw> meshes = {some_mesh(1)};
  for (const FragmentShader shader : {FragmentShader::splat, FragmentShader::none}) {
    MixedFrameOptions options;
    options.mesh_shader = shader;
    expect_user_error([&] { mixed_frame(splats, meshes, options); }, {"shader", "lit or vertex"});
  }
  for (const Light light : {Light{1, 1, 0, 0.5F}, Light{0, 0, 0, 0}, Light{0, 1, 0, 1.5F}, Light{0, 1, 0, -0.5F},
                            Light{std::nanf(""), 1, 0, 0}, Light{0, 1, 0, std::nanf("")}}) {
    MixedFrameOptions options;
    options.light = light;
    expect_user_error([&] { mixed_frame(splats, meshes, options); }, {"light", "unit length"});
  }
}

class SceneWithMeshes : public testing::FolderTest {};

TEST_F(SceneWithMeshes, MeshesAreReadOnceAndProjectedWithTheCameraOfTheSplats) {
  SceneRequest request;
  write_gaussian_file(in_folder("splats.ply"), testing::scene_of({testing::ordinary_gaussian()}));
  request.scene = in_folder("splats.ply").string();
  request.eye = Vec3{0, 0, 0};
  request.look_at = Vec3{0, 0, 1};
  request.size = ImageSize{64, 64};
  request.meshes = {write("a.obj", testing::square_obj()).string(),
                    write("b.ply",
                          "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
                          "property float z\nelement face 2\nproperty list uchar int vertex_index\nend_header\n"
                          "0 0 5\n1 0 5\n0 1 5\n3 0 1 2\n3 0 1 1\n")
                        .string()};
  const OpenedScene opened = open_scene(request);
  std::filesystem::remove(request.meshes[0]);
  const LoadedScene scene = preprocess_scene(opened, {});
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.meshes[0].mesh.size(), 2u);
  EXPECT_EQ(scene.meshes[1].mesh.size(), 1u);
  EXPECT_EQ(scene.rejected_triangles.degenerate, 1u);
  // A corner of both lies on the axis, as the Gaussian does.
  EXPECT_EQ(scene.meshes[1].mesh[0].vertices[0].x, scene.draw.splats[0].cx);
  EXPECT_EQ(scene.meshes[1].mesh[0].vertices[0].depth, scene.draw.splats[0].depth);
}

TEST_F(SceneWithMeshes, ADrawListTakesNone) {
  Draw draw = some_splats();
  write_draw_list(in_folder("a.spl"), draw);
  SceneRequest request;
  request.scene = in_folder("a.spl").string();
  request.meshes = {"mesh.obj"};
  expect_user_error([&] { load_scene(request); }, {"mesh", ".spl"});
}

TEST_F(SceneWithMeshes, AMeshInThePlaceOfASceneIsRefusedAsWhatItIs) {
  SceneRequest request;
  for (const auto& path : {write("a.obj", testing::square_obj()), write("a.ply", testing::square_ply_ascii()),
                           write("a.glb", testing::square_glb())}) {
    request.scene = path.string();
    expect_user_error([&] { load_scene(request); }, {"cannot read scene", "triangle mesh, no Gaussians"});
  }
}

}  // namespace
}  // namespace vrpipe
