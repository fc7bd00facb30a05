#pragma once

#include <array>
#include <cstdint>

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

/// Charges cycles to states; a state holds until the next one is entered.
class StateAccount {
 public:
  void enter(UnitState state, Cycle now) {
    if (state == state_) return;
    cycles_[static_cast<unsigned>(state_)] += now - since_;
    history_[changes_++ % history_.size()] = {state_, since_};
    state_ = state;
    since_ = now;
  }

  /// Charges exactly the `end` cycles of the run. A unit may change state after the last blend, on signals that nothing
  /// waits for; what lies beyond `end` is taken back.
  void close(Cycle end) {
    for (unsigned kept = 0; since_ > end && kept < history_.size() && changes_ > 0; ++kept) {
      const Change& earlier = history_[--changes_ % history_.size()];
      cycles_[static_cast<unsigned>(earlier.state)] -= since_ - earlier.since;
      state_ = earlier.state;
      since_ = earlier.since;
    }
    cycles_[static_cast<unsigned>(state_)] += end - since_;
    since_ = end;
  }

  UnitState state() const { return state_; }
  std::uint64_t cycles(UnitState state) const { return cycles_[static_cast<unsigned>(state)]; }

 private:
  struct Change {
    UnitState state;
    Cycle since;
  };
  UnitState state_ = UnitState::starved;
  Cycle since_ = 0;
  std::array<std::uint64_t, unit_states> cycles_{};
  std::array<Change, 64> history_{};
  std::uint64_t changes_ = 0;
};

}  // namespace vrpipe
