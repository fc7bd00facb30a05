#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/payload.h>
#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

/// The slots of an SM array's fragment warps, core by core. Consecutive warps of a screen tile go to one core, so many at most and
/// while it has slots, those behind them to the next core that has one. A warp takes the lowest slot that is free there, and slots
/// belong to the core's schedulers in turn, as in Accel-Sim (docs/silicon.md: what a GPU says of that).
class WarpSlots {
 public:
  explicit WarpSlots(const SmTime& time)
      : warps_to_one_core_(time.warps_to_one_core),
        warps_per_core_(time.warps_per_core),
        words_per_core_((time.warps_per_core + 63) / 64),
        free_(time.fragment_slots()),
        free_of_core_(time.cores, time.warps_per_core),
        is_free_(std::size_t{time.cores} * words_per_core_) {
    for (std::uint32_t core = 0; core < time.cores; ++core) {
      for (std::uint32_t warp = 0; warp < time.warps_per_core; ++warp) {
        places_.push_back({core, core * time.schedulers_per_core + warp % time.schedulers_per_core, warp});
        set(places_.back());
      }
    }
  }

  /// Whether one is free.
  bool any() const { return free_ > 0; }
  /// For the next warp, one that is free: there has to be one.
  std::uint32_t take(TileId tile) {
    if (tile != tile_ || taken_ == warps_to_one_core_ || free_of_core_[core_] == 0) {
      do {
        core_ = core_ + 1 == free_of_core_.size() ? 0 : core_ + 1;
      } while (free_of_core_[core_] == 0);
      taken_ = 0;
    }
    tile_ = tile;
    ++taken_;
    --free_of_core_[core_];
    --free_;
    std::uint64_t* word = &is_free_[std::size_t{core_} * words_per_core_];
    std::uint32_t first = core_ * warps_per_core_;
    for (; *word == 0; ++word) first += 64;
    const auto bit = static_cast<std::uint32_t>(__builtin_ctzll(*word));
    *word &= *word - 1;
    return first + bit;
  }
  void release(std::uint32_t slot) {
    ++free_of_core_[core_of(slot)];
    ++free_;
    set(places_[slot]);
  }
  std::uint32_t core_of(std::uint32_t slot) const { return places_[slot].core; }
  /// Of all cores' schedulers.
  std::uint32_t scheduler_of(std::uint32_t slot) const { return places_[slot].scheduler; }

 private:
  struct Place {
    std::uint32_t core;
    std::uint32_t scheduler;
    std::uint32_t warp;  ///< of the core
  };
  void set(const Place& place) {
    is_free_[std::size_t{place.core} * words_per_core_ + place.warp / 64] |= std::uint64_t{1} << (place.warp % 64);
  }

  const std::uint32_t warps_to_one_core_;
  const std::uint32_t warps_per_core_;
  const std::uint32_t words_per_core_;
  TileId tile_;              ///< of the last warp
  std::uint32_t core_ = 0;   ///< where it went
  std::uint32_t taken_ = 0;  ///< there, one after the other
  std::uint32_t free_;       ///< of all cores
  std::vector<std::uint32_t> free_of_core_;
  std::vector<std::uint64_t> is_free_;  ///< a bit a slot, in words of a core's
  std::vector<Place> places_;           ///< by slot
};

}  // namespace vrpipe
