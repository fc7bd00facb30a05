#pragma once

#include <algorithm>

#include "beat_lines.h"
#include "late_quads.h"

#include <vrpipe/kernel/link.h>
#include <vrpipe/kernel/rate.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/cache_port.h>

namespace vrpipe {

/// At cycle, warps to be tested late between their look-up in the z-cache and their test. As of beats (z_port.h), what a warp
/// needs is read in order as soon as it is there, and then its line may go.
class LateLookUps {
 public:
  LateLookUps(unsigned quads_per_cycle, unsigned most_quads) : limit_(quads_per_cycle), most_quads_(most_quads) {}

  bool empty() const { return warps_.empty(); }
  /// Whether the look-up of a warp at the link is under way.
  bool has_begun() const { return begun_; }
  bool is_there() const { return !warps_.empty() && reads_done_ >= warps_.front().reads; }
  const ShadedWarpItem& front() const { return warps_.front().item; }
  void pop() {
    queued_quads_ -= warps_.front().item.warp->count;
    warps_.pop();
  }
  /// After a warp wider than the unit.
  Cycle next() const { return next_; }

  /// Looks up what is at the link. `look_up(line)` goes on with a look-up and says whether it is done, as CachePort does;
  /// `accessed(quads)` is called for each warp.
  template <class LookUp, class Accessed>
  bool take(StreamIn<ShadedWarpItem>& in, const BeatLines& lines, Cycle now, const LookUp& look_up,
            const Accessed& accessed) {
    bool any = false;
    for (; in.ready(); in.pop()) {
      const ShadedWarp& warp = *in.front().warp;
      if (!begun_ && !begin(warp, lines, now)) break;
      for (; at_ < needed_.count; ++at_) {
        if (!look_up(line_)) return any;
        reads_.push({line_.line, line_.sectors});
        ++reads_asked_;
        any = true;
        if (at_ + 1 < needed_.count) begin_line(at_ + 1);
      }
      begun_ = false;
      if (needed_.count > 0) accessed(warp.count);
      warps_.push({in.front(), reads_asked_});
      queued_quads_ += warp.count;
      any = true;
    }
    return any;
  }
  /// Reads what has come: `is_there(line, sectors)` says so, and is told that the line may go.
  template <class IsThere>
  bool read(const IsThere& is_there) {
    bool any = false;
    for (; !reads_.empty() && is_there(reads_.front().line, reads_.front().sectors); reads_.pop()) {
      ++reads_done_;
      any = true;
    }
    return any;
  }

 private:
  struct Waiting {
    ShadedWarpItem item;
    std::uint64_t reads = 0;  ///< of lines, that are done once it has what it needs
  };
  struct Read {
    SectoredCache::Line line = SectoredCache::no_line;
    std::uint32_t sectors = 0;
  };
  /// False if the look-up has to wait.
  bool begin(const ShadedWarp& warp, const BeatLines& lines, Cycle now) {
    if (!warps_.empty() && queued_quads_ + warp.count > most_quads_) return false;
    const unsigned width = std::max<unsigned>(warp.count, 1);
    if (!limit_.allows(width, now)) return false;
    limit_.take(width);
    next_ = limit_.next(now);
    needed_.count = 0;
    at_ = 0;
    if (warp.count > 0) {
      const QuadBeat quads = quads_of(warp);
      lines.find(quads.tile, quads.quads.data(), quads.count, needed_);
      begin_line(0);
    }
    begun_ = true;
    return true;
  }
  void begin_line(unsigned at) {
    line_ = {needed_.lines[at].address, needed_.lines[at].sectors, SectoredCache::no_line, 0};
  }

  BatchLimit limit_;
  const unsigned most_quads_;
  Cycle next_ = 0;
  // Of the warp at the link:
  bool begun_ = false;
  BeatLines::Needed needed_;
  unsigned at_ = 0;         ///< of the lines needed
  CachePort::LookUp line_;  ///< that one

  Ring<Waiting> warps_;
  unsigned queued_quads_ = 0;
  Ring<Read> reads_;  ///< that are not done yet
  std::uint64_t reads_asked_ = 0;
  std::uint64_t reads_done_ = 0;
};

}  // namespace vrpipe
