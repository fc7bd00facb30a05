#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

/// Lines of a surface that left a cache and are wanted again: they are not there before so many cycles after the last use
/// that they had before they left (measured on a GH100 graphics GPC: 461 to 503 cycles).
class LineReturns {
 public:
  /// None has been used. @param base  address of the surface, bytes; at least `bytes` follow
  LineReturns(std::uint64_t base, std::uint64_t bytes, std::uint32_t line_bytes, Cycle wait)
      : base_(base),
        shift_(static_cast<unsigned>(__builtin_ctz(line_bytes))),
        wait_(wait),
        from_((bytes >> shift_) + 1) {}
  void used(std::uint64_t address, Cycle at) { from_[index(address)] = at + wait_; }
  /// From when on a line that left can be used again; 0 for one that was not used yet.
  Cycle from(std::uint64_t address) const { return from_[index(address)]; }
  /// The last use so far; 0 where there was none.
  Cycle last_use(std::uint64_t address) const {
    const Cycle from = from_[index(address)];
    return from == 0 ? 0 : from - wait_;
  }
  /// The line of the surface, from 0.
  std::size_t index(std::uint64_t address) const { return static_cast<std::size_t>((address - base_) >> shift_); }
  std::size_t lines() const { return from_.size(); }

 private:
  std::uint64_t base_;
  unsigned shift_;
  Cycle wait_;
  std::vector<Cycle> from_;
};

}  // namespace vrpipe
