#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/slots/tgc.h>

namespace vrpipe {

namespace {

/// TGC without time. Ports as in tgc_unit.cpp.
class UntimedTgc : public UntimedUnit {
 public:
  UntimedTgc(const std::string& name, std::unique_ptr<TgcBehaviour> behaviour)
      : UntimedUnit(name, TgcWork::kinds(behaviour->timing())),
        out_(*this, "out_jobs"),
        in_(input<PrimitiveItem>("in_primitives", [this](const PrimitiveItem& item) { enter_bins(item); })),
        behaviour_(std::move(behaviour)) {}

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  void enter_bins(const PrimitiveItem& item) {
    if (item.mark != Mark::none) return drain(item.mark);
    behaviour_->begin(item.primitive);
    while (behaviour_->entering()) {
      did(TgcWork::entries, 1);
      if (behaviour_->step(flush_)) read_out();
    }
  }

  void drain(Mark mark) {
    while (behaviour_->drain(flush_)) read_out();
    RasterJob job;
    job.mark = mark;
    out_.send(job);
  }

  void read_out() {
    RasterJob job;
    job.clip = flush_.clip;
    for (const Primitive& primitive : flush_.primitives) {
      job.primitive = primitive;
      out_.send(job);
    }
    did(TgcWork::primitives, flush_.primitives.size());
  }

  UntimedOut<RasterJob> out_;
  std::unique_ptr<UntimedIn<PrimitiveItem>> in_;
  std::unique_ptr<TgcBehaviour> behaviour_;
  TgcBehaviour::Flush flush_;
};

[[maybe_unused]] const bool tgc_untimed_registered = [] {
  register_untimed_unit_maker("tgc", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                        const RenderContext&, unsigned) {
    return std::make_unique<UntimedTgc>(name, behaviour_as<TgcBehaviour>(std::move(behaviour)));
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
