#pragma once

namespace vrpipe::tools {

/// While it lives, what is written to stdout goes to stderr: SystemC and plugins may print, and stdout is for results.
class StdoutToStderr {
 public:
  StdoutToStderr();
  ~StdoutToStderr();
  StdoutToStderr(const StdoutToStderr&) = delete;
  StdoutToStderr& operator=(const StdoutToStderr&) = delete;

 private:
  int saved_;
};

}  // namespace vrpipe::tools
