// A platform and a variant as a plugin: `vrpipe compare --plugin wide_platform.so --platform wide`, whose table has the
// variant beside the others.
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/wiring.h>

VRPIPE_PLUGIN

namespace {

vrpipe::Platform wide() {
  vrpipe::Platform platform;
  platform.name = "wide";
  platform.description = "agx-orin-ideal-memory with two GPCs";
  platform.gpcs = 2;
  platform.frequency_mhz = 612;
  platform.settings = {{"qru", "quads_per_cycle", "4"}};
  platform.wire = vrpipe::wire_pipeline;
  return platform;
}

/// Quad merging with a quarter of the tile-grid bins.
vrpipe::Variant small_bins() {
  vrpipe::Variant variant;
  variant.name = "qm-small";
  variant.quad_merging = true;
  variant.settings = {{"tgc", "bins", "32"}};
  return variant;
}

[[maybe_unused]] const bool added = [] {
  vrpipe::add_platform(wide());
  vrpipe::add_variant(small_bins());
  return true;
}();

}  // namespace
