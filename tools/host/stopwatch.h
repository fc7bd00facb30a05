#pragma once

#include <chrono>

namespace vrpipe::tools {

/// Wall time, for progress and reports; never part of a result.
inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace vrpipe::tools
