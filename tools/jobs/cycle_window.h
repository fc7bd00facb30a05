#pragma once

#include <vrpipe/kernel/accounting.h>

namespace vrpipe::tools {

/// The cycles of a run that something is wanted of.
struct CycleWindow {
  Cycle from = 0;
  Cycle to = never;  ///< excluded
  bool contains(Cycle cycle) const { return from <= cycle && cycle < to; }
};

}  // namespace vrpipe::tools
