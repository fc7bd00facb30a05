#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/simulation.h>

VRPIPE_PLUGIN

namespace {
[[maybe_unused]] const bool added = [] {
  vrpipe::add_platform(vrpipe::platform_named("mobile"));
  return true;
}();
}  // namespace
