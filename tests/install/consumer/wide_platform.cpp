// A platform as a plugin: `vrpipe compare --plugin wide_platform.so --platform wide`.
#include <vrpipe/platforms/wiring.h>
#include <vrpipe/registry.h>

VRPIPE_PLUGIN

namespace {

vrpipe::Platform wide() {
  vrpipe::Platform platform;
  platform.name = "wide";
  platform.description = "agx-orin with two GPCs";
  platform.gpcs = 2;
  platform.frequency_mhz = 612;
  platform.settings = {{"qru", "quads_per_cycle", "4"}};
  platform.wire = vrpipe::wire_pipeline;
  return platform;
}

[[maybe_unused]] const bool added = [] {
  vrpipe::add_platform(wide());
  return true;
}();

}  // namespace
