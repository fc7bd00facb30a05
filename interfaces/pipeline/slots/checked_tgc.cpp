#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/pipeline/slots/tgc.h>

namespace vrpipe {

namespace {

class CheckedTgc final : public CheckedSlot<TgcBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  void begin(const Primitive& primitive) override {
    steps_of_primitive_ = 0;
    ask("begin", [&] { checked_->begin(primitive); });
  }
  bool entering() const override {
    return ask("entering", [&] { return checked_->entering(); });
  }
  bool step(Flush& out) override {
    // A bin for each screen tile, each of which evicts another first.
    if (++steps_of_primitive_ > 2 * tiles() + 2)
      fault("step", "a primitive is still entering after {} steps", steps_of_primitive_);
    ++entered_;
    return flushed("step", out, ask("step", [&] { return checked_->step(out); }));
  }
  bool drain(Flush& out) override {
    return flushed("drain", out, ask("drain", [&] { return checked_->drain(out); }));
  }
  Throughput timing() const override {
    const Throughput timing = ask("timing", [&] { return checked_->timing(); });
    check_throughput(timing);
    return timing;
  }
  std::uint32_t largest_flush() const override {
    const std::uint32_t largest = ask("largest_flush", [&] { return checked_->largest_flush(); });
    check_rate("largest_flush", largest, ~0U);
    return largest;
  }
  std::uint64_t storage_bytes() const override {
    return ask("storage_bytes", [&] { return checked_->storage_bytes(); });
  }
  void check_timing() const override {
    timing();
    largest_flush();
  }
  void check_counters() const override {
    // One that passes primitives through has no bins.
    if (checked_->flushes.value() == 0 && largest_flush() <= 1) return;
    check_counter("flushes", checked_->flushes.value(), flushes_, "bins came out");
  }

 private:
  bool flushed(const char* call, const Flush& out, bool is_flushed) {
    if (!is_flushed) return false;
    if (out.primitives.empty()) fault(call, "a flush without primitives");
    if (out.primitives.size() > largest_flush()) {
      fault(call, "a flush of {} primitives, largest_flush is {}", out.primitives.size(), largest_flush());
    }
    if (out.clip.empty()) fault(call, "a flush with an empty clip");
    for (const Primitive& primitive : out.primitives) check_primitive(call, primitive);
    ++flushes_;
    left_ += out.primitives.size();
    if (out.primitives.size() > 1 || largest_flush() > 1) count_up_to(checked_->entries, left_);
    if (left_ > entered_) fault(call, "{} primitives came out, {} were entered", left_, entered_);
    return true;
  }

  std::uint64_t steps_of_primitive_ = 0;
  std::uint64_t entered_ = 0;
  std::uint64_t left_ = 0;
  std::uint64_t flushes_ = 0;
};

}  // namespace

std::unique_ptr<Behaviour> check_tgc(const std::string& name, const RenderContext& context,
                                     std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedTgc, TgcBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
