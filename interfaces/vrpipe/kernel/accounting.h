#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <vrpipe/kernel/ring.h>

namespace vrpipe {

using Cycle = std::uint64_t;
constexpr Cycle never = ~Cycle{0};

/// What a unit does with a cycle; each cycle of a run is charged to exactly one.
enum class UnitState : std::uint8_t {
  busy,     ///< moved at least one item
  starved,  ///< has nothing to work on
  blocked,  ///< has work, but the next unit takes none
  memory,   ///< waits for memory
  latency,  ///< waits for its own pipeline or a hazard
};
constexpr unsigned unit_states = 5;
const char* name_of(UnitState state);

/// A kind of work that takes a unit's time.
struct WorkKind {
  const char* name;        ///< one word for reports, e.g. "blend"
  unsigned resource;       ///< of the unit, from 0: kinds of one resource take turns, resources work side by side
  double cycles_per_item;  ///< that an item keeps the resource
  bool is_throughput;      ///< utilization, work over peak rate, counts this kind
};

/// Kinds that a unit may have.
constexpr unsigned most_work_kinds = 10;
/// Throws SimulationFault: a unit did work of a kind that it has not declared.
[[noreturn]] void refuse_work_kind(const std::string& unit, unsigned kind);

/// How long a kind of work kept its resource.
struct OccupancyPart {
  const char* name;
  unsigned resource;
  double cycles;
  bool is_throughput;
};

/// Cycles of the resource that has most.
double busiest(const std::vector<OccupancyPart>& parts);

/// Where a frame ends, and in one of several each draw: in the cycle after the last of its quads has been blended, or dropped
/// by a test, by pruning or by a merge. Known only once all of the frame has passed; until then units say what it cannot be
/// earlier than.
class FrameEnd {
 public:
  /// A quad ends in the cycle before `cycle`, or later.
  void not_before(Cycle cycle) { so_far_ = std::max(so_far_, cycle); }
  /// The end, as far as it is known: it is this or later. 0 before the first quad.
  Cycle so_far() const { return so_far_; }

  /// Before units are made: draws are told apart.
  void tell_draws(std::size_t draws) { of_draw_.resize(draws); }
  bool tells_draws() const { return !of_draw_.empty(); }
  /// A quad of the draw ends in the cycle before `cycle`, or later.
  void draw_not_before(std::size_t draw, Cycle cycle) { of_draw_[draw] = std::max(of_draw_[draw], cycle); }
  /// By draw, once all of the frame has passed; 0 for one without quads. Empty where they are not told apart.
  const std::vector<Cycle>& of_draws() const { return of_draw_; }

 private:
  Cycle so_far_ = 0;
  std::vector<Cycle> of_draw_;
};

/// Sees the states of a unit, from outside.
class StateObserver {
 public:
  virtual ~StateObserver() = default;
  /// The unit is in a state from a cycle on; before the first call it is starved. At `lt` the cycle may be ahead of the clock.
  virtual void entered(UnitState state, Cycle from) = 0;
};

/// Charges cycles to states; a state holds until the next one is entered. What a unit does after the end of the frame is
/// not charged, so changes are kept until the draw is known to last as long.
class StateAccount {
 public:
  /// `frame_end` outlives the account.
  explicit StateAccount(const FrameEnd& frame_end) : frame_end_(&frame_end) {}

  /// `now` is not before that of the call before.
  [[gnu::always_inline]] void enter(UnitState state, Cycle now) {
    if (state != state_) change(state, now);
  }

  /// Charges exactly the `end` cycles of the run; not before `frame_end.so_far()`.
  void close(Cycle end);

  /// The observer outlives the account.
  void observe(StateObserver& observer) { observer_ = &observer; }

  UnitState state() const { return state_; }
  std::uint64_t cycles(UnitState state) const { return cycles_[static_cast<unsigned>(state)]; }

 private:
  struct Change {
    UnitState state;  ///< which held until
    Cycle until;
  };
  void change(UnitState state, Cycle now) {
    if (!changes_.empty() || now > frame_end_->so_far()) return keep_change(state, now);
    charge(state_, now);
    begin(state, now);
  }
  /// Until the draw is known to last as long.
  void keep_change(UnitState state, Cycle now);
  void begin(UnitState state, Cycle now) {
    state_ = state;
    if (observer_ != nullptr) observer_->entered(state, now);
  }
  void settle();
  void charge(UnitState state, Cycle until) {
    cycles_[static_cast<unsigned>(state)] += until - charged_;
    charged_ = until;
  }

  static constexpr std::size_t fewest_changes = 64;
  const FrameEnd* frame_end_;
  StateObserver* observer_ = nullptr;
  UnitState state_ = UnitState::starved;
  Ring<Change> changes_;  ///< not charged yet
  std::size_t most_changes_ = fewest_changes;
  Cycle charged_ = 0;  ///< cycles charged so far
  std::array<std::uint64_t, unit_states> cycles_{};
};

/// Work of one kind, in items. What is done after the end of the frame is not counted.
class WorkTally {
 public:
  /// `frame_end` outlives the tally.
  explicit WorkTally(const FrameEnd& frame_end) : frame_end_(&frame_end) {}

  /// Items that keep the unit from cycle `from` to `until` - 1.
  void add(std::uint64_t items, Cycle from, Cycle until) {
    items_ += items;
    if (until > frame_end_->so_far()) note(items, from, until);
  }
  /// Items that keep it for a cycle.
  void add(std::uint64_t items, Cycle at) { add(items, at, at + 1); }

  /// Those done before cycle `end`, and of those under way then the share that is done; `end` is not before
  /// `frame_end.so_far()`. Without an end, all.
  double items(Cycle end = never) const;

 private:
  struct CycleInterval {
    std::uint64_t items;
    Cycle from, until;
  };
  void note(std::uint64_t items, Cycle from, Cycle until);

  static constexpr std::size_t fewest_spans = 64;
  const FrameEnd* frame_end_;
  std::uint64_t items_ = 0;
  Ring<CycleInterval> late_;  ///< of `items_`, those that may be after the end
  std::size_t most_spans_ = fewest_spans;
};

}  // namespace vrpipe
