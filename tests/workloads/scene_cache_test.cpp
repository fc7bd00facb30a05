#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/scene.h>

#include "builtin/scene_cache.h"

namespace vrpipe {
namespace {

namespace fs = std::filesystem;

/// A cache folder of its own for each test.
class SceneCache : public ::testing::Test {
 protected:
  SceneCache() {
    std::string name = (fs::temp_directory_path() / "vrpipe_scene_cache_XXXXXX").string();
    home_ = mkdtemp(name.data());
    if (const char* const before = std::getenv("XDG_CACHE_HOME")) before_ = before;
    setenv("XDG_CACHE_HOME", home_.c_str(), 1);
  }
  ~SceneCache() override {
    if (before_.empty()) {
      unsetenv("XDG_CACHE_HOME");
    } else {
      setenv("XDG_CACHE_HOME", before_.c_str(), 1);
    }
    fs::remove_all(home_);
  }

  /// The one scene that is stored.
  fs::path stored() const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(home_ / "vrpipe" / "scenes")) files.push_back(entry.path());
    EXPECT_EQ(files.size(), 1U);
    return files.at(0);
  }

  fs::path home_;

 private:
  std::string before_;
};

GaussianScene small_scene(float first) {
  GaussianSceneBuilder builder(1);
  for (int i = 0; i < 100; ++i) {
    GaussianAttributes gaussian;
    gaussian.position = {first, static_cast<float>(i), -1.0F};
    gaussian.f_rest[2][1] = 0.5F * static_cast<float>(i);
    gaussian.opacity_logit = 3.0F;
    builder.add(gaussian);
  }
  return builder.build();
}

std::string bytes_of(const GaussianScene& scene) {
  const auto* records = reinterpret_cast<const char*>(scene.records());
  return {records, records + scene.size() * GaussianArray::bytes_per_gaussian(scene.sh_degree())};
}

void overwrite(const fs::path& file, std::streamoff offset) {
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekg(offset);
  const int byte = stream.get();
  stream.seekp(offset);
  stream.put(static_cast<char>(byte ^ 1));
}

TEST_F(SceneCache, HasNothingAtFirst) { EXPECT_FALSE(cached_scene("some")); }

TEST_F(SceneCache, GivesBackTheSameBits) {
  const GaussianScene scene = small_scene(1);
  cache_scene("some", scene);
  const auto cached = cached_scene("some");
  ASSERT_TRUE(cached);
  EXPECT_EQ(cached->sh_degree(), 1);
  EXPECT_EQ((*cached)[7].f_rest(2, 2), 3.5F);
  EXPECT_EQ(bytes_of(*cached), bytes_of(scene));
  EXPECT_FALSE(cached_scene("other"));
}

TEST_F(SceneCache, TakesNoFileWithAFlippedBit) {
  cache_scene("some", small_scene(1));
  const auto size = static_cast<std::streamoff>(fs::file_size(stored()));
  // In the magic, the build id, the degree, the count, the checksum, the first and the last record.
  for (const std::streamoff offset : {0, 8, 28, 32, 40, 48, static_cast<int>(size) - 1}) {
    overwrite(stored(), offset);
    EXPECT_FALSE(cached_scene("some")) << "byte " << offset;
    overwrite(stored(), offset);
  }
  EXPECT_TRUE(cached_scene("some"));
}

TEST_F(SceneCache, TakesNoFileOfAnotherScene) {
  cache_scene("some", small_scene(1));
  const fs::path file = stored();
  std::string name = file.filename().string();
  fs::rename(file, file.parent_path() / name.replace(0, 4, "other"));
  EXPECT_FALSE(cached_scene("other"));
}

TEST_F(SceneCache, TakesNoFileThatIsCutShort) {
  cache_scene("some", small_scene(1));
  for (const std::uintmax_t size : {9199U, 9200U, 48U, 47U, 0U}) {
    fs::resize_file(stored(), size);
    EXPECT_FALSE(cached_scene("some")) << size;
  }
}

TEST_F(SceneCache, ReplacesWhatItDidNotTake) {
  cache_scene("some", small_scene(1));
  overwrite(stored(), 100);
  cache_scene("some", small_scene(2));
  const auto cached = cached_scene("some");
  ASSERT_TRUE(cached);
  EXPECT_EQ((*cached)[0].position()[0], 2.0F);
}

TEST_F(SceneCache, IsDoneWithoutWhereNoFolderCanBeMade) {
  std::ofstream(home_ / "file") << "in the way";
  setenv("XDG_CACHE_HOME", (home_ / "file").c_str(), 1);
  cache_scene("some", small_scene(1));
  EXPECT_FALSE(cached_scene("some"));
}

TEST_F(SceneCache, ServesProcessesThatWriteAndReadAtOnce) {
  std::vector<pid_t> children;
  for (int child = 0; child < 4; ++child) {
    const pid_t pid = fork();
    ASSERT_GE(pid, 0);
    if (pid == 0) {
      bool right = true;
      for (int i = 0; i < 50; ++i) {
        cache_scene("some", small_scene(1));
        const auto cached = cached_scene("some");
        right = right && cached && bytes_of(*cached) == bytes_of(small_scene(1));
      }
      _exit(right ? 0 : 1);
    }
    children.push_back(pid);
  }
  for (const pid_t pid : children) {
    int status = 0;
    ASSERT_EQ(waitpid(pid, &status, 0), pid);
    EXPECT_EQ(status, 0);
  }
  stored();  // no temporary file is left
}

TEST_F(SceneCache, HoldsABuiltInSceneAsItIsMade) {
  const std::string made = bytes_of(make_builtin_scene("courtyard").gaussians);
  EXPECT_EQ(bytes_of(cached_builtin_scene("courtyard").gaussians), made);
  stored();
  const BuiltinScene again = cached_builtin_scene("courtyard");
  EXPECT_EQ(bytes_of(again.gaussians), made);
  EXPECT_EQ(again.meshes.size(), 1U);
  EXPECT_EQ(again.info.name, "courtyard");
}

TEST_F(SceneCache, IsLeftAloneByARequestThatSaysSo) {
  SceneRequest request;
  request.scene = "builtin:courtyard";
  request.size = ImageSize{16, 9};
  request.scene_cache = false;
  load_scene(request);
  EXPECT_FALSE(fs::exists(home_ / "vrpipe"));
}

}  // namespace
}  // namespace vrpipe
