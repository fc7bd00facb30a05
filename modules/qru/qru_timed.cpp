#include <algorithm>
#include <utility>

#include "qru/warp_numbering.h"

#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/slots/qru.h>
#include <vrpipe/pipeline/slots/tc.h>

namespace vrpipe {

namespace {

/// QRU at lt. Ports: in_quads (BinItem), out_warps (Warp).
class TimedQru : public TimedUnit {
 public:
  TimedQru(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<QruBehaviour> behaviour,
           const RenderContext& context)
      : TimedUnit(name, domain, QruWork::kinds(behaviour->timing())),
        out_(*this, "out_warps"),
        in_(*this, "in_quads",
            TimedIn<BinItem>::ByParts([this](const BinItem& item, Parts& beats) { examine(item, beats); })),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        numbering_(context, *behaviour_),
        budget_(timing_.items_per_cycle) {
    out_.set_pipeline(QruWork::pipeline(timing_));
  }

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  using Parts = TimedIn<BinItem>::Parts;

  void go_to(Cycle cycle) {
    if (cycle <= cycle_) return;
    if (examined_ > 0) did(QruWork::quads, std::exchange(examined_, 0), cycle_);
    cycle_ = cycle;
    budget_ = timing_.items_per_cycle;
  }

  /// A launch ends the cycle.
  void launch(const Warp& warp) {
    const Cycle taken = out_.send(warp, cycle_).first;
    charge(UnitState::blocked, taken);
    charge(UnitState::busy, taken + 1);
    left_ = taken;
    did(QruWork::launches, 1, taken);
    examined_ = 0;
    go_to(taken + 1);
  }

  void examine(const BinItem& item, Parts& beats) {
    if (item.mark != Mark::none) {
      come(beats.visible(0));
      Warp mark;
      mark.mark = item.mark;
      numbering_.number_mark(mark);
      launch(mark);
      return beats.leave(left_);
    }
    const unsigned count = beats.count();
    const unsigned width = width_.of(item.quads, count);
    // Of what a test has left of a bin nobody knows in which of its beats it is.
    const bool are_full = (item.quads + width - 1) / width == count;
    for (unsigned beat = 0, from = 0, to = 0; beat < count; ++beat, from = to) {
      const bool is_last = beat + 1 == count;
      to = is_last ? item.quads : are_full ? from + width : item.quads * (beat + 1) / count;
      come(beats.visible(beat));
      examine(item, from, to);
      while (is_last && item.last_part && behaviour_->finish_bin(warp_)) {
        numbering_.number(warp_);
        launch(warp_);
      }
      beats.leave(left_);
    }
    item.storage->in_use = false;
  }
  /// The next beat becomes visible in a cycle.
  void come(Cycle visible) {
    go_to(std::max(visible, out_.last() + 1));
    charge(UnitState::blocked, out_.last());
    charge(UnitState::starved, cycle_);
    left_ = cycle_;
  }
  void examine(const BinItem& item, unsigned from, unsigned to) {
    const std::vector<Quad>& quads = item.storage->flush.quads;
    while (from < to) {
      if (budget_ == 0) go_to(cycle_ + 1);
      const unsigned end = from + std::min(to - from, budget_);
      while (from < end) {
        bool launched = false;
        const unsigned taken = behaviour_->examine(item.tile, &quads[from], end - from, warp_, launched);
        from += taken;
        if (budget_ == 0) go_to(cycle_ + 1);
        budget_ -= std::min(taken, budget_);
        examined_ += taken;
        left_ = cycle_;
        if (!launched) continue;
        numbering_.number(warp_);
        launch(warp_);
      }
    }
    charge(UnitState::busy, left_ + 1);
  }

  TimedOut<Warp> out_;
  TimedIn<BinItem> in_;
  std::unique_ptr<QruBehaviour> behaviour_;
  const Throughput timing_;
  WarpNumbering numbering_;
  Warp warp_;
  BeatWidth width_;
  Cycle cycle_ = 0;
  Cycle left_ = 0;         ///< when the last quads were examined or the last warp was taken
  unsigned budget_;        ///< quads that can still be examined in the cycle
  unsigned examined_ = 0;  ///< quads, in the cycle so far
};

[[maybe_unused]] const bool qru_timed_registered = [] {
  register_timed_unit_maker("qru", [](const std::string& name, ClockDomain& domain,
                                      std::unique_ptr<Behaviour> behaviour, const RenderContext& context, unsigned) {
    return std::make_unique<TimedQru>(name.c_str(), domain, behaviour_as<QruBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
