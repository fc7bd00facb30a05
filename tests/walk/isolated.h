#pragma once

#include <vector>

#include "walk/oracle.h"

namespace vrpipe::walk {

/// What a child process may take before it is ended, which is a finding.
struct Limits {
  unsigned seconds = 60;  ///< of processor time; five times that on the clock
  std::uint64_t bytes = std::uint64_t{3} << 30U;
};

/// Judges a case in a process of its own, so that a crash, a hang or a lack of memory is a finding like any other.
std::vector<Finding> judged_apart(const Case& c, const Limits& limits);

}  // namespace vrpipe::walk
