#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/slots/tgc.h>

namespace vrpipe {

namespace {

/// TGC at cycle fidelity: enters bins at its rate, and reads a flushed bin out one primitive a cycle; a further flush
/// waits for the read-out. Ports: in_primitives (PrimitiveItem), out_jobs (RasterJob).
class TgcUnit : public Unit {
 public:
  TgcUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<TgcBehaviour> behaviour)
      : Unit(name, domain, TgcWork::kinds(behaviour->timing())),
        in_(*this, "in_primitives"),
        out_(*this, "out_jobs"),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()) {
    out_.set_pipeline(TgcWork::pipeline(timing_));
  }

  bool idle() const override {
    return in_.empty() && !behaviour_->entering() && !reading_out() && !waiting_ && mark_ == Mark::none;
  }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  bool reading_out() const { return at_ < current_.primitives.size(); }

  /// Enters bins; true when something moved.
  bool collect(Cycle now) {
    bool moved = false;
    for (unsigned budget = timing_.items_per_cycle; budget > 0 && !waiting_; --budget) {
      if (!behaviour_->entering()) {
        if (mark_ != Mark::none || !in_.ready()) break;
        if (in_.front().mark != Mark::none) {
          mark_ = in_.front().mark;
        } else {
          behaviour_->begin(in_.front().primitive);
        }
        in_.pop();
        moved = true;
      }
      if (behaviour_->entering()) {
        waiting_ = behaviour_->step(next_);
        did(TgcWork::entries, 1, now);
        moved = true;
      }
    }
    if (mark_ != Mark::none && !drained_ && !waiting_ && !behaviour_->entering()) {
      waiting_ = behaviour_->drain(next_);
      drained_ = !waiting_;
      moved = true;
    }
    return moved;
  }

  /// Hands on one primitive, or a mark; true when something moved.
  bool read_out(Cycle now) {
    if (!reading_out() && waiting_) {
      std::swap(current_, next_);
      at_ = 0;
      waiting_ = false;
    }
    const bool marks = drained_ && !reading_out();
    if (!(reading_out() || marks) || out_.credits() == 0) return false;
    RasterJob job;
    if (marks) {
      job.mark = mark_;
      mark_ = Mark::none;
      drained_ = false;
    } else {
      job.primitive = current_.primitives[at_++];
      job.clip = current_.clip;
      did(TgcWork::primitives, 1, now);
    }
    out_.push(job);
    return true;
  }

  Cycle tick(Cycle now) override {
    const bool sent = read_out(now);
    const bool collected = collect(now);
    if (sent || collected) {
      enter(UnitState::busy, now);
      return now + 1;
    }
    const bool blocked = reading_out() || drained_;
    enter(blocked ? UnitState::blocked : UnitState::starved, now);
    return blocked ? never : in_.next_ready();
  }

  StreamIn<PrimitiveItem> in_;
  StreamOut<RasterJob> out_;
  std::unique_ptr<TgcBehaviour> behaviour_;
  const Throughput timing_;
  TgcBehaviour::Flush current_;  ///< being read out, from `at_` on
  TgcBehaviour::Flush next_;     ///< flushed and waiting for the read-out, if `waiting_`
  std::size_t at_ = 0;
  bool waiting_ = false;
  Mark mark_ = Mark::none;  ///< that has arrived
  bool drained_ = false;    ///< and all bins before it are flushed
};

[[maybe_unused]] const bool tgc_unit_registered = [] {
  register_unit_maker("tgc", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                const RenderContext&, unsigned) {
    return std::make_unique<TgcUnit>(name.c_str(), domain, behaviour_as<TgcBehaviour>(std::move(behaviour)));
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
