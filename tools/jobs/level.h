#pragma once

#include <algorithm>
#include <cstdint>
#include <map>

#include <vrpipe/kernel/accounting.h>

namespace vrpipe::tools {

/// A level that is known by its changes, taken at the cycles 0, `every`, 2 `every` ... The changes need not come in the
/// order of cycles, as they do not at `lt`: they wait until they are given.
class Level {
 public:
  explicit Level(Cycle every) : every_(every) {}

  /// A change that is too late for what has been given counts from then on.
  void change(Cycle at, std::int64_t by) { changes_[std::max((at + every_ - 1) / every_, next_)] += by; }

  /// Calls `give(cycle, level)` for cycles before `until` at which it is another than before.
  template <class Give>
  void give_before(Cycle until, const Give& give) {
    while (!changes_.empty() && changes_.begin()->first * every_ < until) {
      const auto [place, by] = *changes_.begin();
      changes_.erase(changes_.begin());
      next_ = place + 1;
      level_ += by;
      if (by != 0) give(place * every_, level_);
    }
  }

 private:
  const Cycle every_;
  std::map<Cycle, std::int64_t> changes_;  ///< by the cycle from which on they show, in `every_`
  std::int64_t level_ = 0;
  Cycle next_ = 0;  ///< not given yet, in `every_`
};

}  // namespace vrpipe::tools
