#include <cstdlib>

#include <vrpipe/pipeline/registry.h>

#undef VRPIPE_PLUGIN_TAG
#define VRPIPE_PLUGIN_TAG "vrpipe-plugin/0.0.1/itanium-abi"
VRPIPE_PLUGIN

namespace {
// Code of a plugin built for another version must not run.
[[maybe_unused]] const bool ran = [] {
  std::abort();
  return true;
}();
}  // namespace
