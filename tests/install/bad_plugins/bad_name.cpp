#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/simulation.h>

VRPIPE_PLUGIN

namespace {
[[maybe_unused]] const bool added = [] {
  vrpipe::Platform platform = vrpipe::platform_named("mobile");
  platform.name = "a/b\n\x1b[31m";
  vrpipe::add_platform(platform);
  return true;
}();
}  // namespace
