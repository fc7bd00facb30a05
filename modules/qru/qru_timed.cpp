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
        in_(*this, "in_quads", [this](const BinItem& item, CycleInterval visible) { return examine(item, visible); }),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        numbering_(context, *behaviour_),
        budget_(timing_.items_per_cycle) {
    out_.set_pipeline(timing_.latency_cycles - 1, 1);
  }

  Behaviour& behaviour() override { return *behaviour_; }

 private:
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

  CycleInterval examine(const BinItem& item, CycleInterval visible) {
    go_to(std::max(visible.first, out_.last() + 1));
    charge(UnitState::blocked, out_.last());
    charge(UnitState::starved, cycle_);
    const Cycle begin = cycle_;
    left_ = cycle_;
    if (item.mark != Mark::none) {
      Warp mark;
      mark.mark = item.mark;
      numbering_.number_mark(mark);
      launch(mark);
      return {begin, left_};
    }
    const std::vector<Quad>& quads = item.storage->flush.quads;
    for (unsigned from = 0; from < item.quads;) {
      go_to(visible.of_part(from, item.quads));
      if (budget_ == 0) go_to(cycle_ + 1);
      const unsigned end = from + std::min(item.quads - from, budget_);
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
    if (item.last_part) {
      go_to(visible.last);
      while (behaviour_->finish_bin(warp_)) {
        numbering_.number(warp_);
        launch(warp_);
      }
    }
    item.storage->in_use = false;
    return {begin, std::max(left_, begin)};
  }

  TimedOut<Warp> out_;
  TimedIn<BinItem> in_;
  std::unique_ptr<QruBehaviour> behaviour_;
  const Throughput timing_;
  WarpNumbering numbering_;
  Warp warp_;
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
