#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <functional>
#include <iostream>
#include <string>
#include <vector>

#include "tool_test_support.h"

namespace vrpipe::testing {

/// Becomes the built command; for what has to be arranged in its process first. Returns only when that fails.
inline int become_vrpipe(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), VRPIPE_BINARY);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  ::execv(VRPIPE_BINARY, argv.data());
  return 99;
}

/// Runs `act` in a folder and a process of its own, and takes what it returns for the exit code.
inline Finished in_fork(const std::filesystem::path& folder, const std::function<int()>& act) {
  const std::filesystem::path out = folder.parent_path() / "stdout";
  const std::filesystem::path err = folder.parent_path() / "stderr";
  std::cout.flush();
  std::fflush(nullptr);
  const pid_t process = ::fork();
  if (process == 0) {
    const bool ready = ::chdir(folder.c_str()) == 0 && std::freopen(out.c_str(), "w", stdout) != nullptr &&
                       std::freopen(err.c_str(), "w", stderr) != nullptr;
    const int code = ready ? act() : 98;
    std::cout.flush();
    std::fflush(nullptr);
    ::_exit(code);
  }
  int status = 0;
  EXPECT_EQ(::waitpid(process, &status, 0), process);
  Finished finished;
  finished.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  finished.out = read_file(out);
  finished.err = read_file(err);
  return finished;
}

}  // namespace vrpipe::testing
