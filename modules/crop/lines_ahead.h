#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "crop/crop_time.h"

#include <vrpipe/component/statistic.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/cache_port.h>
#include <vrpipe/memory/line_visits.h>

namespace vrpipe {

/// The colour cache at cycle where its tags run ahead of its data (Igehy et al., "Prefetching in a texture cache
/// architecture", 1998): a line goes for another though quads wait to be blended into it, so that more lines are under
/// way than the cache holds. What it held is written back once the last of them has been.
///
/// Tags are looked at twice. A first look asks for sectors at once; quads then wait, in order, for a second, where they stop for
/// lines that come back (LineVisits), and first looks with them. What was asked for while quads still waited to be blended into an
/// earlier stay of the line is fetched again there; quads wait for that where the line comes back.
class LinesAhead {
 public:
  /// A stay of a line in the cache, by number.
  using Stay = std::uint32_t;
  static constexpr Stay no_stay = ~0U;
  using Visit = LineVisits::Visit;

  /// The port's cache has been made. All but `mshrs` outlive it. `fetched_again`: sectors, a second time.
  LinesAhead(CachePort& port, SectoredCacheStatistics& statistics, Counter& fetched_again, const ColorSurface& surface,
             unsigned mshrs)
      : port_(port),
        statistics_(statistics),
        fetched_again_(fetched_again),
        base_(surface.address(0)),
        line_shift_(static_cast<unsigned>(__builtin_ctz(port.cache().organization().line_bytes))),
        sector_bytes_(port.cache().organization().sector_bytes),
        sectors_of_a_line_(port.cache().organization().sectors_of_a_line()),
        half_(port.cache().organization().sectors_of_a_half()),
        mshrs_(mshrs),
        stay_of_line_(port.cache().organization().lines(), no_stay),
        latest_((surface.size_bytes() >> line_shift_) + 1, no_stay),
        uses_(latest_.size()) {}

  /// The first look at a quad's tag; `no_stay` while it has to wait for the memory port or a register. One that replaces
  /// what is there does not read. `fills`: whether sectors are asked for.
  Stay look_up(std::uint64_t address, std::uint32_t sectors, bool reads, bool& fills) {
    const auto most = static_cast<unsigned>(__builtin_popcount(sectors));
    if (!requests_.empty() || !port_.memory().available()) return no_stay;
    // One that needs more registers than there are has them all to itself.
    if (filling_ > 0 && filling_ + most > mshrs_) return no_stay;
    LineAccess access;
    access.address = address;
    access.sectors = sectors;
    access.known = reads ? 0 : ~0U;
    port_.cache().look_up(access);
    if (access.replaced) begin(access);
    const Stay number = stay_of_line_[access.line];
    State& stay = stays_[number];
    ++stay.quads;
    fills = access.filled != 0;
    if (!fills) return number;
    stay.filling |= access.filled;
    for_each_sector_run(access.filled, sectors_of_a_line_, [&](unsigned first, unsigned count) {
      request({number, first, count, Request::fill});
    });
    return number;
  }

  /// The second look, in the order of the first ones; false while the quad has to stop there.
  bool look_again(Stay number, std::uint32_t sectors, Visit visit) {
    State& stay = stays_[number];
    LineUses& uses = uses_[index(stay.address)];
    if (stay.is_new) stay.is_new = !uses.begin(stay.fetches_again ? LineVisits::whole_line : 0);
    is_stopped_ = stay.is_new || !uses.may_go(visit, sectors, half_);
    if (is_stopped_) return false;
    bool is_first = false;
    const std::uint32_t again = uses.go(sectors, LineVisits::whole_line, is_first);
    if (!stay.fetches_again || again == 0) return true;
    stay.waits_again = uses.comes_back();
    if (is_first) ++moves_.flits;
    stay.filling_again |= again;
    fetched_again_ += static_cast<unsigned>(__builtin_popcount(again));
    for_each_sector_run(again, sectors_of_a_line_, [&](unsigned first, unsigned count) {
      request({number, first, count, Request::fill_again});
    });
    return true;
  }

  /// Whether the last second look was, so that nothing is looked up for the first time.
  bool is_stopped() const { return is_stopped_; }

  /// Takes the sectors that have come, and sends what waits for the memory port; true if there were any.
  bool advance() {
    bool any = false;
    std::uint32_t tag = 0;
    while (port_.memory().next_completed(tag)) {
      any = true;
      if (tag == write_back_tag) continue;
      State& stay = stays_[tag >> 11U];
      const unsigned count = (tag >> 5U & 31U) + 1;
      const std::uint32_t came = sector_mask(tag & 31U, count);
      (((tag >> 10U) & 1U) != 0 ? stay.filling_again : stay.filling) &= ~came;
      filling_ -= count;
      free_if_done(tag >> 11U);
    }
    while (!requests_.empty() && port_.memory().available()) {
      const Request next = requests_.front();
      requests_.pop();
      send(next);
    }
    return any;
  }

  /// Whether a quad whose turn it is to be blended still waits for sectors.
  bool is_awaited(Stay number, std::uint32_t sectors) const {
    const State& stay = stays_[number];
    return ((stay.filling | (stay.waits_again ? stay.filling_again : 0)) & sectors) != 0;
  }

  /// A quad has been blended.
  void blended(Stay number, std::uint32_t sectors, bool changed, Visit visit) {
    State& stay = stays_[number];
    if (changed) stay.dirty |= sectors;
    uses_[index(stay.address)].used(visit, LineVisits::whole_line);
    if (--stay.quads == 0 && stay.left) end(number);
  }

  /// Since this was last called.
  CropTime::Moves take_moves() { return std::exchange(moves_, {}); }

 private:
  static constexpr std::uint32_t write_back_tag = ~0U;
  struct State {
    std::uint64_t address = 0;
    std::uint32_t filling = 0;        ///< sectors on their way
    std::uint32_t filling_again = 0;  ///< and of the second fetch
    std::uint32_t dirty = 0;
    std::uint32_t quads = 0;  ///< looked up and not blended
    bool left = false;        ///< the line has gone for another
    bool ended = false;
    bool is_new = true;          ///< nothing was looked up twice
    bool fetches_again = false;  ///< what it began with asked for sectors before the stay before it had ended
    bool waits_again = false;    ///< and comes back
  };
  struct Request {
    enum Kind : std::uint8_t { fill, fill_again, write_back };
    Stay stay = 0;  ///< of a write-back nothing: that has an address
    unsigned first = 0;
    unsigned count = 0;
    Kind kind = fill;
    std::uint64_t address = 0;
  };

  std::size_t index(std::uint64_t address) const { return static_cast<std::size_t>((address - base_) >> line_shift_); }
  void begin(const LineAccess& access) {
    if (const Stay before = stay_of_line_[access.line]; before != no_stay) {
      stays_[before].left = true;
      if (stays_[before].quads == 0) end(before);
    }
    if (free_.empty()) {
      free_.push_back(static_cast<Stay>(stays_.size()));
      stays_.emplace_back();
    }
    const Stay number = free_.back();
    free_.pop_back();
    State& stay = stays_[number];
    stay = {};
    stay.address = access.address;
    Stay& latest = latest_[index(access.address)];
    stay.fetches_again = access.filled != 0 && latest != no_stay;
    latest = number;
    stay_of_line_[access.line] = number;
  }
  /// The last quad of a line that has left has been blended.
  void end(Stay number) {
    State& stay = stays_[number];
    stay.ended = true;
    Stay& latest = latest_[index(stay.address)];
    if (latest == number) latest = no_stay;
    if (stay.dirty != 0) {
      const auto count = static_cast<unsigned>(__builtin_popcount(stay.dirty));
      statistics_.sectors_written_back += count;
      statistics_.bytes_written_back += count * sector_bytes_;
      moves_.write(count);
      for_each_sector_run(stay.dirty, sectors_of_a_line_, [&](unsigned first, unsigned sectors) {
        request({number, first, sectors, Request::write_back, stay.address});
      });
    }
    free_if_done(number);
  }
  void free_if_done(Stay number) {
    const State& stay = stays_[number];
    if (stay.ended && (stay.filling | stay.filling_again) == 0) free_.push_back(number);
  }

  void request(const Request& wanted) {
    if (wanted.kind != Request::write_back) {
      moves_.sectors += wanted.count;
      filling_ += wanted.count;
    }
    if (requests_.empty() && port_.memory().available()) {
      send(wanted);
    } else {
      requests_.push(wanted);
    }
  }
  void send(const Request& wanted) {
    const std::uint64_t line = wanted.kind == Request::write_back ? wanted.address : stays_[wanted.stay].address;
    const std::uint64_t address = line + std::uint64_t{wanted.first} * sector_bytes_;
    const auto bytes = static_cast<unsigned>(wanted.count * sector_bytes_);
    if (wanted.kind == Request::write_back) return port_.memory().write(address, bytes, write_back_tag);
    const std::uint32_t again = wanted.kind == Request::fill_again ? 1U << 10U : 0U;
    port_.memory().read(address, bytes, wanted.stay << 11U | again | (wanted.count - 1) << 5U | wanted.first);
  }

  CachePort& port_;
  SectoredCacheStatistics& statistics_;
  Counter& fetched_again_;
  const std::uint64_t base_;   ///< of the surface
  const unsigned line_shift_;  ///< log2 of the bytes of a line
  const std::uint64_t sector_bytes_;
  const unsigned sectors_of_a_line_;
  const unsigned half_;  ///< sectors of half a line
  const unsigned mshrs_;
  unsigned filling_ = 0;  ///< sectors
  std::vector<State> stays_;
  std::vector<Stay> free_;
  std::vector<Stay> stay_of_line_;  ///< by line of the cache
  std::vector<Stay> latest_;        ///< by line of the surface: of those that have not ended
  std::vector<LineUses> uses_;      ///< by line of the surface: of quads that were looked up twice
  Ring<Request> requests_;          ///< that the memory port has not taken yet
  CropTime::Moves moves_;
  bool is_stopped_ = false;
};

}  // namespace vrpipe
