#include <cstdlib>

#include <vrpipe/pipeline/registry.h>

VRPIPE_PLUGIN

namespace {
[[maybe_unused]] const bool ran = []() -> bool { std::exit(0); }();
}
