#include "tc/tc.h"

#include <vrpipe/model/untimed.h>

namespace vrpipe {

namespace {

/// TC without time: no time-out. Ports as in tc_timed.cpp.
class UntimedTc : public UntimedUnit {
 public:
  UntimedTc(const std::string& name, std::unique_ptr<TcBehaviour> behaviour, const RenderContext& context)
      : UntimedUnit(name, behaviour->time().kinds()),
        passing_(context),
        out_(*this, "out_bins"),
        in_(input<QuadBeat>("in_quads", [this](const QuadBeat& beat) { collect(beat); })),
        behaviour_(std::move(behaviour)),
        times_out_(behaviour_->time().timeout_in(context.termination) > 0) {}

  Behaviour& behaviour() override { return *behaviour_; }
  BoundTerms terms() const override { return {times_out_, times_out_, 0}; }

 private:
  void collect(const QuadBeat& beat) {
    if (beat.mark != Mark::none) return drain(beat.mark);
    did(TcWork::quads, beat.count);
    for (unsigned from = 0; from < beat.count;) {
      bool flushed = false;
      from += behaviour_->insert(beat, from, storage_.flush, flushed);
      if (flushed) send();
    }
  }

  void drain(Mark mark) {
    while (behaviour_->flush_oldest(TcBehaviour::FlushReason::end_of_draw, storage_.flush)) send();
    if (!passing_.has(mark)) return;
    BinItem item;
    item.mark = mark;
    out_.send(item);
  }

  void send() {
    BinItem item;
    item.storage = &storage_;
    item.tile = storage_.flush.tile;
    item.quads = static_cast<std::uint32_t>(storage_.flush.quads.size());
    did(TcWork::beats, (item.quads + QuadBeat::capacity - 1) / QuadBeat::capacity);
    out_.send(item);
  }

  const PassingMarks passing_;
  UntimedOut<BinItem> out_;
  std::unique_ptr<UntimedIn<QuadBeat>> in_;
  std::unique_ptr<TcBehaviour> behaviour_;
  const bool times_out_;  ///< where there is time
  BinStorage storage_;    ///< whose bin has passed by the time of the next
};

[[maybe_unused]] const bool tc_untimed_registered = [] {
  register_untimed_unit_maker("tc", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                       const RenderContext& context, unsigned) {
    return std::make_unique<UntimedTc>(name, behaviour_as<TcBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
