#include <stdexcept>

#include <vrpipe/pipeline/registry.h>

VRPIPE_PLUGIN

namespace {
[[maybe_unused]] const bool ran = []() -> bool { throw std::runtime_error("no licence"); }();
}
