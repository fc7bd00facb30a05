#pragma once

#include <string>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/kernel/accounting.h>

namespace vrpipe::tools {

/// The cycles of a run that something is wanted of.
struct CycleWindow {
  Cycle from = 0;
  Cycle to = never;  ///< excluded
  bool contains(Cycle cycle) const { return from <= cycle && cycle < to; }
  /// Throws UserError, `what` in `where`, if it begins after a run of so many cycles.
  void check_begun(Cycle cycles, const std::string& what, const std::string& where) const {
    if (cycles > from) return;
    throw UserError(what, fmt::format("{}@{}:", where, from), fmt::format("the run ends after {} cycles", cycles),
                    "begin earlier");
  }
};

}  // namespace vrpipe::tools
