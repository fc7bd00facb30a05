#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/ring.h>

namespace vrpipe {

/// Visits to a line of a surface behind a cache whose tags run ahead of its data, and are looked at twice: a visit is what
/// a primitive does with the line in a screen tile. A first look asks for what the cache lacks, a second one, later and in
/// the same order, stops for lines that come back (measured on a GH100 graphics GPC, ZROP and CROP alike but for the parts):
///
/// * When a line has come into the cache again, its first visit stops until what the line held before has been used, in the
///   parts of the line that the visit needs: CROP's lines are one part, ZROP's have one for each half of an 8x8 block. If
///   it has to stop, the line comes back.
/// * What was asked for of a line that comes back was asked for in vain, and is asked for again at the second look; of colours also
///   what was asked for while an earlier use was still to come, but nothing waits for that (measured in sectors moved).
/// * A line that comes back takes no sectors side by side: a visit that lacks some, in a half of which an earlier one has
///   asked for others, stops until all earlier ones have used the line.
/// * While a second look stops there is no first one.
///
/// Sectors of a line are a bit each, at most 32, and so are its parts, at most `most_parts`; `half`: sectors of half a line.
class LineVisits {
 public:
  using Visit = std::uint32_t;
  static constexpr unsigned most_parts = 8;
  static constexpr std::uint32_t whole_line = 1;  ///< where a line is one part

  /// The line has come into the cache.
  void begin(bool comes_back) {
    *this = {};
    comes_back_ = comes_back;
  }
  bool comes_back() const { return comes_back_; }
  /// Something of a visit is next; true if that is its first.
  bool enter(Visit visit) {
    if (visit == visit_) return false;
    visit_ = visit;
    by_earlier_ |= std::exchange(by_visit_, 0);
    return true;
  }
  Visit visit() const { return visit_; }
  /// Of the sectors that it needs.
  std::uint32_t lacking(std::uint32_t sectors) const { return sectors & ~(by_earlier_ | by_visit_); }
  /// Whether it stops for the uses of earlier ones.
  bool stops(std::uint32_t sectors, unsigned half) const {
    return comes_back_ && (halves_of(lacking(sectors), half) & halves_of(by_earlier_, half)) != 0;
  }
  /// It asks; true for the first that it asks for.
  bool ask(std::uint32_t sectors) { return std::exchange(by_visit_, by_visit_ | sectors) == 0; }
  /// Those with some of the sectors, a bit each.
  static unsigned halves_of(std::uint32_t sectors, unsigned half) {
    const std::uint32_t first = (1U << half) - 1;
    return ((sectors & first) != 0 ? 1U : 0U) | ((sectors & ~first) != 0 ? 2U : 0U);
  }

 private:
  Visit visit_ = ~0U;
  std::uint32_t by_earlier_ = 0;  ///< sectors asked for
  std::uint32_t by_visit_ = 0;
  bool comes_back_ = false;
};

/// Numbers visits: quads of a primitive in a screen tile that come one after the other.
class VisitCounter {
 public:
  /// Of the next quad. @param tile  whatever tells screen tiles apart
  LineVisits::Visit of(std::uint64_t tile, std::uint32_t primitive) {
    if (tile != tile_ || primitive != primitive_) ++visit_;
    tile_ = tile;
    primitive_ = primitive;
    return visit_;
  }

 private:
  std::uint64_t tile_ = ~std::uint64_t{0};
  std::uint32_t primitive_ = 0;
  LineVisits::Visit visit_ = 0;
};

/// LineVisits at `cycle`, where it is not known when a line will be used.
class LineUses {
 public:
  using Visit = LineVisits::Visit;

  bool comes_back() const { return visits_.comes_back(); }
  /// Whether the first visit since the line came need not stop; it has come if so.
  bool begin(std::uint32_t parts) {
    bool is_held = false;
    for (std::uint32_t left = parts; left != 0; left &= left - 1)
      is_held |= of_part_[static_cast<unsigned>(__builtin_ctz(left))] > 0;
    stopped_ |= is_held;
    if (is_held) return false;
    visits_.begin(std::exchange(stopped_, false));
    return true;
  }
  /// The same of what is next of a visit.
  bool may_go(Visit visit, std::uint32_t sectors, unsigned half) {
    if (visits_.enter(visit)) of_visit_ = 0;
    return of_visit_ == all_ || !visits_.stops(sectors, half);
  }
  /// It goes, to use the line later. Returns what it lacks, and asks for; `is_first`: of its visit.
  std::uint32_t go(std::uint32_t sectors, std::uint32_t parts, bool& is_first) {
    count(parts, 1);
    ++of_visit_;
    const std::uint32_t lacking = visits_.lacking(sectors);
    if (lacking != 0) is_first = visits_.ask(lacking);
    return lacking;
  }
  void used(Visit visit, std::uint32_t parts) {
    count(parts, ~0U);
    if (visits_.visit() == visit) --of_visit_;
  }

 private:
  void count(std::uint32_t parts, std::uint32_t more) {
    all_ += more;
    for (; parts != 0; parts &= parts - 1) of_part_[static_cast<unsigned>(__builtin_ctz(parts))] += more;
  }

  LineVisits visits_;
  std::uint32_t all_ = 0;  ///< uses to come
  std::uint32_t of_visit_ = 0;
  std::array<std::uint32_t, LineVisits::most_parts> of_part_{};
  bool stopped_ = false;
};

/// LineVisits at `lt`, where a visit uses the line before the next one is looked at.
class TimedLineUses {
 public:
  /// A line comes into the cache with a first look in a cycle; nothing stops for it if it fills nothing there.
  void come(Cycle at, bool fills) {
    asked_at_ = fills ? at : never;
    is_new_ = true;
  }
  /// Of a second look.
  struct Look {
    std::uint32_t again = 0;  ///< sectors that were asked for while an earlier use was to come
    bool is_first = false;    ///< that its visit asks for again
    bool comes_back = false;  ///< so that it waits for them
  };
  /// What is next of a visit, whose second look may be in cycle `at`, which becomes that in which it is.
  Look look_again(LineVisits::Visit visit, std::uint32_t sectors, std::uint32_t parts, unsigned half, Cycle& at) {
    if (std::exchange(is_new_, false)) {
      asked_early_ = used_ > asked_at_;
      Cycle held = 0;
      for (; asked_early_ && parts != 0; parts &= parts - 1)
        held = std::max(held, used_by_part_[static_cast<unsigned>(__builtin_ctz(parts))]);
      visits_.begin(held > at);
      at = std::max(at, held);
    }
    if (visits_.enter(visit)) used_by_earlier_ = used_;
    if (visits_.stops(sectors, half)) at = std::max(at, used_by_earlier_);
    const std::uint32_t lacking = visits_.lacking(sectors);
    if (lacking == 0) return {};
    const bool is_first = visits_.ask(lacking);
    return {asked_early_ ? lacking : 0, is_first, visits_.comes_back()};
  }
  /// In cycle `at`, which does not go back.
  void used(std::uint32_t parts, Cycle at) {
    used_ = at;
    for (; parts != 0; parts &= parts - 1) used_by_part_[static_cast<unsigned>(__builtin_ctz(parts))] = at;
  }

 private:
  LineVisits visits_;
  std::array<Cycle, LineVisits::most_parts> used_by_part_{};  ///< last
  Cycle used_ = 0;
  Cycle used_by_earlier_ = 0;
  Cycle asked_at_ = 0;
  bool is_new_ = false;
  bool asked_early_ = false;
};

/// At `lt`: when second looks stop, so that there is no first one.
class SecondLookStops {
 public:
  /// A second look that could be in one cycle is in another, which is not before; in the order of time.
  void add(Cycle could_be, Cycle is) {
    if (is > could_be) stops_.push({could_be, is});
  }
  /// The cycle of a first look that could be in cycle `at`, which does not go back. A second look comes behind the first ones of
  /// its cycle, whether it stops or goes on.
  Cycle first_look_from(Cycle at) {
    for (; !stops_.empty() && at > stops_.front().could_be; stops_.pop()) at = std::max(at, stops_.front().is + 1);
    return at;
  }

 private:
  struct Stop {
    Cycle could_be = 0, is = 0;
  };
  Ring<Stop> stops_;
};

}  // namespace vrpipe
