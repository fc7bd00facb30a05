#include "host/stdout_to_stderr.h"

#include <unistd.h>

#include <cstdio>
#include <iostream>

namespace vrpipe::tools {
namespace {

void flush() {
  std::cout.flush();
  std::fflush(stdout);
}

}  // namespace

StdoutToStderr::StdoutToStderr() {
  flush();
  saved_ = ::dup(STDOUT_FILENO);
  if (saved_ >= 0) ::dup2(STDERR_FILENO, STDOUT_FILENO);
}

StdoutToStderr::~StdoutToStderr() {
  flush();
  if (saved_ < 0) return;
  ::dup2(saved_, STDOUT_FILENO);
  ::close(saved_);
}

}  // namespace vrpipe::tools
