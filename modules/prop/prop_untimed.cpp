#include "prop/prop.h"

#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/early_tests.h>
#include <vrpipe/pipeline/late_plan.h>
#include <vrpipe/pipeline/slots/prop.h>

namespace vrpipe {

namespace {

/// PROP without time: warps come and go in launch order. Ports as in prop_timed.cpp; slots are not released.
class UntimedProp : public UntimedUnit {
 public:
  UntimedProp(const std::string& name, std::unique_ptr<PropBehaviour> behaviour, const RenderContext& context)
      : UntimedUnit(name, behaviour->time().kinds()),
        out_test_(*this, "out_test"),
        out_survivors_(*this, "out_survivors"),
        out_release_(*this, "out_release"),
        out_color_(*this, "out_color"),
        out_late_(*this, "out_late"),
        in_late_(input<ShadedWarpItem>("in_late", [this](const ShadedWarpItem& item) { hand_on(item); })),
        in_tested_(input<BinItem>("in_tested", [this](const BinItem& item) { forward(item); })),
        in_bins_(input<BinItem>("in_bins", [this, tests = tests_before_shading(context)](
                                               const BinItem& item) { tests ? out_test_.send(item) : forward(item); })),
        in_shaded_(input<ShadedWarpItem>("in_shaded", [this](const ShadedWarpItem& item) { leave(item); })),
        plan_(context),
        behaviour_(std::move(behaviour)) {
    out_late_.set_optional();
    in_late_->set_optional();
  }

  Behaviour& behaviour() override { return *behaviour_; }
  /// Tiles may overtake each other.
  BoundTerms terms() const override { return {false, behaviour_->time().order == PropTime::Order::tile, 0}; }

 private:
  void forward(const BinItem& item) { out_survivors_.send(item); }
  void leave(const ShadedWarpItem& item) {
    if (item.warp->count > 0 && plan_.is_late(item.warp->draw[0])) return out_late_.send(item);
    hand_on(item);
  }
  void hand_on(const ShadedWarpItem& item) {
    if (item.warp->count == 0 && item.warp->mark == Mark::none) return item.warp->release();
    out_color_.send(item);
  }

  UntimedOut<BinItem> out_test_;
  UntimedOut<BinItem> out_survivors_;
  UntimedOut<WarpRelease> out_release_;
  UntimedOut<ShadedWarpItem> out_color_;
  UntimedOut<ShadedWarpItem> out_late_;
  std::unique_ptr<UntimedIn<ShadedWarpItem>> in_late_;
  std::unique_ptr<UntimedIn<BinItem>> in_tested_;
  std::unique_ptr<UntimedIn<BinItem>> in_bins_;
  std::unique_ptr<UntimedIn<ShadedWarpItem>> in_shaded_;
  const LatePlan plan_;
  std::unique_ptr<PropBehaviour> behaviour_;
};

[[maybe_unused]] const bool prop_untimed_registered = [] {
  register_untimed_unit_maker("prop", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                         const RenderContext& context, unsigned) {
    return std::make_unique<UntimedProp>(name, behaviour_as<PropBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
