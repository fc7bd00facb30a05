#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/memory/cache_organization.h>

namespace vrpipe {

/// The ROPs' port to L2 (measured on a GH100 graphics GPC: a flit of 32 bytes a cycle). What it has not taken yet waits in a
/// backlog; while there is more than fits, who would add to it waits.
class FlitPort {
 public:
  /// @param per_cycle  flits; 0: there is no port, and nobody waits
  FlitPort(unsigned per_cycle, std::uint32_t backlog) : per_cycle_(per_cycle), backlog_(backlog) {}
  bool is_on() const { return per_cycle_ > 0; }
  unsigned per_cycle() const { return static_cast<unsigned>(per_cycle_); }
  std::uint32_t backlog() const { return static_cast<std::uint32_t>(backlog_); }
  double cycles_of_a_flit() const { return is_on() ? 1.0 / static_cast<double>(per_cycle_) : 0; }
  /// The first cycle from one on in which its backlog takes more.
  Cycle open_from(Cycle cycle) const {
    if (done_ <= cycle * per_cycle_ + backlog_) return cycle;
    return (done_ - backlog_ + per_cycle_ - 1) / per_cycle_;
  }
  /// Takes so many from a cycle on, whatever waits. Returns when they begin to go, and when the last has gone.
  std::pair<Cycle, Cycle> take(unsigned flits, Cycle at) {
    const std::uint64_t begin = std::max(done_, at * per_cycle_);
    done_ = begin + flits;
    return {begin / per_cycle_, (done_ + per_cycle_ - 1) / per_cycle_};
  }
  /// At the end of a frame, of what it took for one that moves lines of a cache. What who is let in sends at once: a line
  /// that is written back, and two fetches.
  std::uint64_t most_waiting(const CacheOrganization& cache) const { return backlog_ + cache.sectors_of_a_line() + 3; }

 private:
  std::uint64_t per_cycle_;
  std::uint64_t backlog_;
  std::uint64_t done_ = 0;  ///< flits' time from the beginning, idle ones included
};

}  // namespace vrpipe
