#pragma once

#include <algorithm>
#include <cstdint>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/sectored_cache.h>

namespace vrpipe {

/// The lines of a cache that queued items need, at `lt`: they do not go for others. Only where the line that goes may be
/// another than the one whose last use is longest ago, and so is free first.
class TimedPins {
 public:
  static bool are_needed(Replacement replacement) { return replacement != Replacement::lru; }

  void pin(SectoredCache& cache, SectoredCache::Line line, Cycle until) {
    cache.pin(line);
    pinned_.push_in_order({until, line}, &Pinned::until);
  }
  /// The first cycle from `at` on in which an address finds its line, or one that may go.
  [[gnu::noinline]] Cycle line_free_from(SectoredCache& cache, std::uint64_t address, Cycle at) {
    const auto finds_line = [&] {
      return cache.find(address) != SectoredCache::no_line || cache.can_allocate(address);
    };
    for (; !pinned_.empty() && (pinned_.front().until <= at || !finds_line()); pinned_.pop()) {
      at = std::max(at, pinned_.front().until);
      cache.unpin(pinned_.front().line);
    }
    return at;
  }

 private:
  struct Pinned {
    Cycle until = 0;
    SectoredCache::Line line = SectoredCache::no_line;
  };
  Ring<Pinned> pinned_;
};

}  // namespace vrpipe
