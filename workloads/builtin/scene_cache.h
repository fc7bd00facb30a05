#pragma once

#include <optional>
#include <string>

#include <vrpipe/workloads/gaussian_scene.h>

namespace vrpipe {

// Built-in scenes that this build has made before, as files in `vrpipe/scenes` of the user's cache folder. A file is taken
// only if it is of this build, by the build id that the linker has made of all code, and if its checksum holds. Nothing that
// goes wrong with a file or the folder is an error: the scene is made again.

/// None if it is not there, or not as it was written.
std::optional<GaussianScene> cached_scene(const std::string& name);

/// Stores a scene of at most 256 MB, and removes the oldest until all take at most 512 MB. Safe beside other processes that
/// read and write the same scene.
void cache_scene(const std::string& name, const GaussianScene& scene);

}  // namespace vrpipe
