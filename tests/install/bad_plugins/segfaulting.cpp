#include <csignal>

#include <vrpipe/registry.h>

VRPIPE_PLUGIN

namespace {
[[maybe_unused]] const bool ran = [] { return std::raise(SIGSEGV) == 0; }();
}
