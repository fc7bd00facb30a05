#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/pipeline/slots/prop.h>

namespace vrpipe {

namespace {

class CheckedProp final : public CheckedSlot<PropBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  const PropTime& time() const override {
    return ask("time", [&]() -> const PropTime& { return checked_->time(); });
  }
  void check_timing() const override { time(); }
  void check_counters() const override {}
};

}  // namespace

std::unique_ptr<Behaviour> check_prop(const std::string& name, const RenderContext& context,
                                      std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedProp, PropBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
