#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/pipeline/slots/tc.h>

namespace vrpipe {

namespace {

class CheckedTc final : public CheckedSlot<TcBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  unsigned insert(const QuadBeat& beat, unsigned from, Flush& out, bool& flushed) override {
    const unsigned taken = ask("insert", [&] { return checked_->insert(beat, from, out, flushed); });
    const unsigned offered = beat.count - from;
    if (taken > offered) fault("insert", "{} quads taken of {} in {}", taken, offered, words_of(beat.tile));
    if (taken < offered && !flushed) {
      fault("insert", "{} quads taken of {} in {}, and no bin flushed", taken, offered, words_of(beat.tile));
    }
    taken_ += taken;
    if (flushed) check_flush("insert", out);
    return taken;
  }
  bool flush_oldest(FlushReason reason, Flush& out) override {
    if (!ask("flush_oldest", [&] { return checked_->flush_oldest(reason, out); })) {
      if (reason == FlushReason::end_of_draw && left_ != taken_) {
        fault("flush_oldest", "all bins are empty, but of {} quads {} came out", taken_, left_);
      }
      return false;
    }
    check_flush("flush_oldest", out);
    return true;
  }
  const TcTime& time() const override {
    return ask("time", [&]() -> const TcTime& { return checked_->time(); });
  }
  void check_timing() const override { time(); }
  void check_counters() const override {
    check_counter("quads", checked_->quads.value(), taken_, "quads came in");
    check_counter("flushes", checked_->flushes.value(), flushes_, "bins came out");
  }

 private:
  void check_flush(const char* call, const Flush& out) {
    check_tile(call, out.tile);
    if (out.quads.empty()) fault(call, "a flush of {} without quads", words_of(out.tile));
    check_quads(call, out.tile, out.quads.data(), out.quads.size());
    ++flushes_;
    left_ += out.quads.size();
    if (left_ > taken_) fault(call, "{} quads came out, {} were taken", left_, taken_);
  }

  std::uint64_t taken_ = 0;
  std::uint64_t left_ = 0;
  std::uint64_t flushes_ = 0;
};

}  // namespace

std::unique_ptr<Behaviour> check_tc(const std::string& name, const RenderContext& context,
                                    std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedTc, TcBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
