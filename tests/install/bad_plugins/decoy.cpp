// A good plugin that mentions another's tag before its own.
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/wiring.h>

extern "C" __attribute__((visibility("default"), used)) const char a_note[] = "unlike vrpipe-plugin/0.0.1/itanium-abi";
VRPIPE_PLUGIN

namespace {
[[maybe_unused]] const bool added = [] {
  vrpipe::Platform platform = vrpipe::platform_named("agx-orin-ideal-memory");
  platform.name = "decoy";
  vrpipe::add_platform(platform);
  return true;
}();
}  // namespace
