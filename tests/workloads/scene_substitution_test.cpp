#include <vrpipe/workloads/scene_substitution.h>

#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/draw_list.h>
#include <vrpipe/workloads/scene.h>

#include "workload_test_support.h"

namespace vrpipe {
namespace {

using testing::expect_user_error;

TEST(SceneSubstitution, IsANameAndAFile) {
  for (const char* text : {"train=a/b.ply", "builtin:train=a/b.ply"}) {
    const auto read = scene_substitution(text);
    ASSERT_TRUE(read) << text;
    EXPECT_EQ(read->name, "train");
    EXPECT_EQ(read->file, "a/b.ply");
    EXPECT_EQ(scene_name(text), "train=b.ply");
    EXPECT_EQ(scene_file(text), "a/b.ply");
  }
  EXPECT_EQ(scene_substitution("lego=a=b.ply")->file, "a=b.ply");
}

TEST(SceneSubstitution, APathWithAnEqualsSignIsAPath) {
  for (const char* text :
       {"", "builtin:train", "a.ply", "./train=a.ply", "x/train=a.ply", "a.b=c.ply", "=a.ply", "scene#lod=2"}) {
    EXPECT_FALSE(scene_substitution(text)) << text;
    EXPECT_EQ(scene_file(text), text);
  }
}

TEST(SceneSubstitution, AnUnknownNameGetsTheNearest) {
  expect_user_error([] { scene_substitution("trian=model.ply"); },
                    {"unknown built-in scene (trian=model.ply)", "did you mean train?", "./trian=model.ply"});
  expect_user_error([] { scene_substitution("train="); }, {"no file is named", "train=FILE"});
  expect_user_error([] { scene_substitution("train=builtin:truck"); }, {"`builtin:truck` is a built-in scene as well"});
}

TEST(SceneSubstitution, AListReplacesThoseItNames) {
  const auto list = scene_substitutions({"train=t.ply", "lego=l.ply"}, "--scene");
  EXPECT_EQ(scene_in_place("train", list), "train=t.ply");
  EXPECT_EQ(scene_in_place("lego", list), "lego=l.ply");
  EXPECT_EQ(scene_in_place("truck", list), "builtin:truck");
  expect_user_error(
      [] {
        scene_substitutions({"train=a.ply", "train=b.ply"}, "--scene");
      },
      {"--scene train", "'a.ply'", "'b.ply'"});
  expect_user_error([] { scene_substitutions({"a.ply"}, "--scene"); }, {"--scene a.ply", "NAME=FILE"});
}

class SubstitutedScene : public testing::FolderTest {
 protected:
  SubstitutedScene() {
    std::vector<GaussianAttributes> gaussians(3, testing::ordinary_gaussian());
    gaussians[1].position = {1, 0, 6};
    gaussians[2].position = {0, 1, 5};
    write_gaussian_file(file_, testing::scene_of(gaussians));
  }
  const std::string file_ = in_folder("model.ply").string();
};

TEST_F(SubstitutedScene, HasTheStandInsSizeAndTheFilesView) {
  SceneRequest in_place, alone;
  in_place.scene = "train=" + file_;
  alone.scene = file_;
  alone.size = builtin_scene_named("train").size;
  const LoadedScene loaded = load_scene(in_place), expected = load_scene(alone);
  EXPECT_EQ(loaded.summary.name, "train=model.ply");
  EXPECT_EQ(loaded.summary.gaussians_total, 3u);
  EXPECT_EQ(loaded.draw.width, 980u);
  EXPECT_EQ(loaded.draw.height, 545u);
  ASSERT_EQ(loaded.draw.splats.size(), expected.draw.splats.size());
  EXPECT_EQ(std::memcmp(loaded.draw.splats.data(), expected.draw.splats.data(),
                        expected.draw.splats.size() * sizeof(Splat)),
            0);
  in_place.size = ImageSize{64, 48};
  EXPECT_EQ(load_scene(in_place).draw.width, 64u);
}

TEST_F(SubstitutedScene, ACameraKeepsItsFieldOfViewAtTheStandInsSize) {
  write("cameras.json",
        R"([{"width":1960,"height":1090,"position":[0,0,0],"rotation":[[1,0,0],[0,1,0],[0,0,1]],"fx":800,"fy":800}])");
  SceneRequest request;
  request.scene = "train=" + file_;
  request.camera = in_folder("cameras.json").string();
  const LoadedScene loaded = load_scene(request);
  EXPECT_EQ(loaded.draw.width, 980u);
  EXPECT_EQ(loaded.viewpoint->camera.fx, 400);
}

TEST_F(SubstitutedScene, ADrawListHasItsOwnSize) {
  Draw draw;
  draw.width = 32;
  draw.height = 16;
  write_draw_list(in_folder("saved.spl"), draw);
  SceneRequest request;
  request.scene = "lego=" + in_folder("saved.spl").string();
  EXPECT_TRUE(is_draw_list(request.scene));
  const LoadedScene loaded = load_scene(request);
  EXPECT_EQ(loaded.draw.width, 32u);
  EXPECT_EQ(loaded.summary.name, "lego=saved.spl");
}

}  // namespace
}  // namespace vrpipe
