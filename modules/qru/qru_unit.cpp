#include <algorithm>

#include "qru/warp_numbering.h"

#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/slots/qru.h>

namespace vrpipe {

namespace {

/// QRU at cycle fidelity: examines quads at its rate, launches at most one warp a cycle; one buffer, so the left-over
/// warps of a bin go before the next bin. Ports: in_quads (QuadBeat), out_warps (Warp).
class QruUnit : public Unit {
 public:
  QruUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<QruBehaviour> behaviour,
          const RenderContext& context)
      : Unit(name, domain, QruWork::kinds(behaviour->timing())),
        in_(*this, "in_quads"),
        out_(*this, "out_warps"),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        numbering_(context, *behaviour_) {
    out_.set_pipeline(QruWork::pipeline(timing_));
  }

  bool idle() const override { return in_.empty(); }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  Cycle tick(Cycle now) override {
    unsigned budget = timing_.items_per_cycle;
    bool moved = false;
    bool blocked = false;
    unsigned examined = 0;
    while (budget > 0 && in_.ready()) {
      const QuadBeat& beat = in_.front();
      if (out_.credits() == 0) {
        blocked = true;
        break;
      }
      if (beat.mark != Mark::none) {
        pass_mark();
        moved = true;
        break;
      }
      Warp warp;
      bool launched = false;
      if (from_ < beat.count) {
        const unsigned taken = behaviour_->examine(beat.tile, &beat.quads[from_],
                                                   std::min<unsigned>(beat.count - from_, budget), warp, launched);
        from_ += taken;
        examined += taken;
        budget -= taken;
        moved = true;
      } else if (beat.last_of_bin) {
        launched = behaviour_->finish_bin(warp);
        moved = moved || launched;
        if (!launched) done_ = true;
      } else {
        done_ = true;
      }
      if (launched) {
        numbering_.number(warp);
        out_.push(warp);
        did(QruWork::launches, 1, now);
        examined = 0;
      }
      if (done_ || (from_ == beat.count && !beat.last_of_bin)) {
        in_.pop();
        from_ = 0;
        done_ = false;
        moved = true;
      }
      if (launched) break;
    }
    if (examined > 0) did(QruWork::quads, examined, now);
    if (moved) {
      enter(UnitState::busy, now);
      return now + 1;
    }
    enter(blocked ? UnitState::blocked : UnitState::starved, now);
    return blocked ? never : in_.next_ready();
  }

  [[gnu::noinline]] void pass_mark() {
    Warp mark;
    mark.mark = in_.front().mark;
    numbering_.number_mark(mark);
    out_.push(mark);
    in_.pop();
  }

  StreamIn<QuadBeat> in_;
  StreamOut<Warp> out_;
  std::unique_ptr<QruBehaviour> behaviour_;
  const Throughput timing_;
  unsigned from_ = 0;
  bool done_ = false;
  WarpNumbering numbering_;
};

[[maybe_unused]] const bool qru_unit_registered = [] {
  register_unit_maker("qru", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                const RenderContext& context, unsigned) {
    return std::make_unique<QruUnit>(name.c_str(), domain, behaviour_as<QruBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
