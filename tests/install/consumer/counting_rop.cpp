#include "counting_rop.h"

VRPIPE_PLUGIN

namespace {
[[maybe_unused]] const bool registered = [] {
  vrpipe::Registry::instance().add(
      vrpipe::CropMaker<CountingRop>::implementation("counting-rop", "color-rop, and counts blends without a change"));
  return true;
}();
}  // namespace
