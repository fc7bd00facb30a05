#pragma once

#include <algorithm>
#include <cstddef>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/ring.h>

namespace vrpipe {

/// A warp scheduler at lt: it issues what has been ready longest. Whoever comes with an earlier cycle than others that have issued
/// already goes before them, and they move; who was told when they end is not told again.
class TimedScheduler {
 public:
  /// When something that is ready in a cycle, no earlier than all before it, issues for so many.
  Cycle append(Cycle ready, Cycle cycles) {
    const Cycle begin = std::max(ready, free_at_);
    free_at_ = begin + cycles;
    return begin;
  }
  /// The same in any order. Nothing comes any more that was ready before the cycle `from`.
  Cycle put(Cycle ready, Cycle cycles, Cycle from) {
    for (; !issues_.empty() && issues_.front().ready < from; issues_.pop()) forgotten_until_ = issues_.front().end;
    if (!issues_.empty() && issues_.back().ready > ready) return insert(ready, cycles);
    const Cycle begin = append(ready, cycles);
    issues_.push({ready, begin, free_at_});
    return begin;
  }

  /// The same of something that is late: others that were told already, but are ready later, should have waited for it. Unless a
  /// gap has its size those that come next do instead.
  Cycle put_late(Cycle ready, Cycle cycles) {
    Cycle begin = std::max(ready, forgotten_until_);
    std::size_t next = 0;
    for (; next < issues_.size() && issues_[next].ready <= ready; ++next) begin = std::max(begin, issues_[next].end);
    const bool fits = next == issues_.size() || issues_[next].begin >= begin + cycles;
    put(fits ? ready : issues_.back().ready, cycles, 0);
    return begin;
  }

 private:
  struct Issue {
    Cycle ready = 0;
    Cycle begin = 0;
    Cycle end = 0;
  };
  [[gnu::noinline]] Cycle insert(Cycle ready, Cycle cycles) {
    issues_.push();
    std::size_t place = issues_.size() - 1;
    for (; place > 0 && issues_[place - 1].ready > ready; --place) issues_[place] = issues_[place - 1];
    const Cycle begin = std::max(ready, place > 0 ? issues_[place - 1].end : forgotten_until_);
    issues_[place] = {ready, begin, begin + cycles};
    for (; ++place < issues_.size() && issues_[place].begin < issues_[place - 1].end;) {
      const Cycle later = issues_[place - 1].end - issues_[place].begin;
      issues_[place].begin += later;
      issues_[place].end += later;
    }
    free_at_ = issues_.back().end;
    return begin;
  }
  Cycle free_at_ = 0;
  Ring<Issue> issues_;  ///< in the order of `ready`
  Cycle forgotten_until_ = 0;
};

}  // namespace vrpipe
