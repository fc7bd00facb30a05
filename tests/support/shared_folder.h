#pragma once

#include <filesystem>

namespace vrpipe::testing {

/// The folder with real scenes and measurements: the environment's VRPIPE_SHARED, else the build's. It may be absent.
std::filesystem::path shared_folder();

}  // namespace vrpipe::testing
