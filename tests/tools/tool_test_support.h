#pragma once

#include <gtest/gtest.h>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/workloads/draw_list.h>

namespace vrpipe::testing {

/// What a finished command left behind.
struct Finished {
  int code = -1;  ///< exit code; 128 + signal when a signal ended it
  std::string out;
  std::string err;
};

inline std::string read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

/// A few dozen overlapping splats, some of them opaque, on 48x40 pixels.
inline Draw tiny_draw() {
  Draw draw;
  draw.width = 48;
  draw.height = 40;
  for (unsigned i = 0; i < 60; ++i) {
    Splat splat{};
    splat.cx = static_cast<float>(4 + (i * 7) % 40);
    splat.cy = static_cast<float>(4 + (i * 11) % 32);
    splat.opacity = i % 3 == 0 ? 0.999F : 0.4F;
    splat.r = i % 3 == 0 ? 3.3279F : 3.0416F;
    const float sigma = 2.0F + static_cast<float>(i % 5);
    splat.ax = sigma * splat.r * 0.8F;
    splat.ay = sigma * splat.r * 0.6F;
    splat.bx = -sigma * splat.r * 0.3F;
    splat.by = sigma * splat.r * 0.4F;
    splat.red = 0.9F;
    splat.green = static_cast<float>(i % 4) / 4.0F;
    splat.blue = static_cast<float>(i % 7) / 7.0F;
    draw.splats.push_back(splat);
  }
  return draw;
}

/// Runs the built command in a folder of its own, removed afterwards.
class ToolTest : public ::testing::Test {
 protected:
  ToolTest() {
    std::string name = (std::filesystem::temp_directory_path() / "vrpipe-tool-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    base_ = name;
    std::filesystem::create_directory(folder());
    write_draw_list(folder() / "tiny.spl", tiny_draw());
  }
  ~ToolTest() override {
    std::error_code ignored;
    std::filesystem::remove_all(base_, ignored);
  }

  /// Where commands run; holds tiny.spl.
  std::filesystem::path folder() const { return base_ / "folder"; }

  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder() / name, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return folder() / name;
  }

  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder())) {
      names.push_back(entry.path().lexically_relative(folder()).string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  /// @param err_descriptor  what becomes the command's stderr; -1 to catch it in `err`
  Finished vrpipe(std::vector<std::string> arguments, int err_descriptor = -1) const {
    const std::filesystem::path out = base_ / "stdout";
    const std::filesystem::path err = base_ / "stderr";
    arguments.insert(arguments.begin(), VRPIPE_BINARY);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, folder().c_str());
    posix_spawn_file_actions_addopen(&actions, 1, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (err_descriptor >= 0) {
      posix_spawn_file_actions_adddup2(&actions, err_descriptor, 2);
    } else {
      posix_spawn_file_actions_addopen(&actions, 2, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    }
    pid_t process = 0;
    const int failed = posix_spawn(&process, VRPIPE_BINARY, &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    Finished finished;
    if (failed != 0) {
      ADD_FAILURE() << "cannot start " << VRPIPE_BINARY;
      return finished;
    }
    int status = 0;
    ::waitpid(process, &status, 0);
    finished.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    finished.out = read_file(out);
    if (err_descriptor < 0) finished.err = read_file(err);
    return finished;
  }

  /// The JSON that a command, which has to succeed, prints with `--json -`.
  nlohmann::json json_of(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--json", "-"});
    const Finished finished = vrpipe(std::move(arguments));
    EXPECT_EQ(finished.code, 0) << finished.err;
    EXPECT_EQ(finished.err, "");
    return nlohmann::json::parse(finished.out, nullptr, false);
  }

  /// The contract for a mistake of the user: exit code 2, one line on stderr, nothing on stdout, nothing written.
  /// `parts`: what the message has to name.
  void refused(const std::vector<std::string>& arguments, const std::vector<std::string>& parts) const {
    const std::vector<std::string> before = files();
    const Finished finished = vrpipe(arguments);
    std::string command = "vrpipe";
    for (const std::string& argument : arguments) command += " " + argument;
    SCOPED_TRACE(command + "\n" + finished.err);
    EXPECT_EQ(finished.code, 2);
    EXPECT_EQ(finished.out, "");
    EXPECT_EQ(finished.err.rfind("vrpipe: error: ", 0), 0U);
    EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1);
    EXPECT_EQ(finished.err.back(), '\n');
    // WHAT (WHERE): WHY; WHAT TO DO
    const std::size_t where = finished.err.find(" (");
    const std::size_t why = finished.err.find("): ", where);
    const std::size_t remedy = finished.err.find("; ", why);
    EXPECT_TRUE(where != std::string::npos && why != std::string::npos && remedy != std::string::npos);
    for (const std::string& part : parts) EXPECT_NE(finished.err.find(part), std::string::npos) << part;
    EXPECT_EQ(files(), before);
  }

 private:
  std::filesystem::path base_;
};

}  // namespace vrpipe::testing
