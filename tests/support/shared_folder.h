#pragma once

#include <cstdlib>
#include <filesystem>

namespace vrpipe::testing {

/// The folder with real scenes beside the project: the environment's VRPIPE_SHARED, else the build's, else the
/// folder `shared` beside the repository. It may be absent.
inline std::filesystem::path shared_folder() {
  if (const char* named = std::getenv("VRPIPE_SHARED")) return named;
#ifdef VRPIPE_SHARED
  return VRPIPE_SHARED;
#else
  return std::filesystem::path(__FILE__).parent_path() / ".." / ".." / ".." / "shared";
#endif
}

}  // namespace vrpipe::testing
