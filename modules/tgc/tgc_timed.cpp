#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/slots/tgc.h>

namespace vrpipe {

namespace {

/// TGC at lt. Ports as in tgc_unit.cpp.
class TimedTgc : public TimedUnit {
 public:
  TimedTgc(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<TgcBehaviour> behaviour)
      : TimedUnit(name, domain, TgcWork::kinds(behaviour->timing())),
        out_(*this, "out_jobs"),
        in_(*this, "in_primitives",
            [this](const PrimitiveItem& item, CycleInterval visible) {
              return item.mark != Mark::none ? drain(item.mark, visible.first) : enter_bins(item, visible.first);
            }),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        entries_(timing_.items_per_cycle) {
    out_.set_pipeline(TgcWork::pipeline(timing_));
  }

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  Cycle enter_bins(const PrimitiveItem& item, Cycle visible) {
    charge(UnitState::blocked, out_.last());
    behaviour_->begin(item.primitive);
    if (!behaviour_->entering()) return visible;
    const Cycle first = step(visible);
    while (behaviour_->entering()) step(first);
    return first;
  }

  Cycle step(Cycle earliest) {
    const Cycle at = entries_.take(earliest);
    charge(UnitState::starved, at);
    charge(UnitState::busy, at + 1);
    did(TgcWork::entries, 1, at);
    if (behaviour_->step(flush_)) read_out(at);
    return at;
  }

  /// Hands on the flush of a cycle, one primitive a cycle. Bins fill on meanwhile, up to the next flush.
  void read_out(Cycle flushed) {
    Cycle at = std::max({flushed + 1, read_, out_.last() + 1});
    entries_.hold(at);
    RasterJob job;
    job.clip = flush_.clip;
    for (const Primitive& primitive : flush_.primitives) {
      job.primitive = primitive;
      const Cycle taken = out_.send(job, at).first;
      charge(UnitState::blocked, taken);
      charge(UnitState::busy, taken + 1);
      did(TgcWork::primitives, 1, taken);
      at = taken + 1;
    }
    read_ = at;
  }

  Cycle drain(Mark mark, Cycle visible) {
    const Cycle left = entries_.take(visible);
    entries_.hold(left + 1);
    while (behaviour_->drain(flush_)) read_out(entries_.take(left));
    RasterJob job;
    job.mark = mark;
    out_.send(job, std::max(read_, left + 1));
    return left;
  }

  TimedOut<RasterJob> out_;
  TimedIn<PrimitiveItem> in_;
  std::unique_ptr<TgcBehaviour> behaviour_;
  const Throughput timing_;
  TgcBehaviour::Flush flush_;
  IssuePort entries_;
  Cycle read_ = 0;  ///< the last flush has been read out
};

[[maybe_unused]] const bool tgc_timed_registered = [] {
  register_timed_unit_maker("tgc", [](const std::string& name, ClockDomain& domain,
                                      std::unique_ptr<Behaviour> behaviour, const RenderContext&, unsigned) {
    return std::make_unique<TimedTgc>(name.c_str(), domain, behaviour_as<TgcBehaviour>(std::move(behaviour)));
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
