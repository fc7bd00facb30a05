#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <unistd.h>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/gaussian_scene.h>

#include "support/data.h"

namespace vrpipe::testing {

/// A folder of its own for each test, removed afterwards.
class FolderTest : public ::testing::Test {
 protected:
  FolderTest() {
    std::string name = (std::filesystem::temp_directory_path() / "vrpipe-test-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    folder_ = name;
  }
  ~FolderTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  std::filesystem::path in_folder(const std::string& name) const { return folder_ / name; }
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(in_folder(name), std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return in_folder(name);
  }
  std::size_t files_in_folder() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder_), std::filesystem::directory_iterator{}));
  }

 private:
  std::filesystem::path folder_;
};

inline std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

/// Checks that `action` throws a UserError whose message holds every one of `parts`.
template <class Action>
void expect_user_error(const Action& action, const std::vector<std::string>& parts) {
  try {
    action();
    ADD_FAILURE() << "no error";
  } catch (const UserError& error) {
    const std::string message = error.what();
    for (const std::string& part : parts) {
      EXPECT_NE(message.find(part), std::string::npos) << "`" << part << "` is not in: " << message;
    }
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

/// A small opaque ball 5 in front of a camera at the origin; tests change what they are about.
inline GaussianAttributes ordinary_gaussian() {
  GaussianAttributes g;
  g.position = {0, 0, 5};
  g.log_scale = {-2, -2, -2};
  g.opacity_logit = 3;
  g.f_dc = {1, 0.5f, 0.2f};
  return g;
}

inline GaussianScene scene_of(const std::vector<GaussianAttributes>& gaussians, int sh_degree = 0) {
  GaussianSceneBuilder builder(sh_degree);
  for (const GaussianAttributes& g : gaussians) builder.add(g);
  return builder.build();
}

}  // namespace vrpipe::testing
