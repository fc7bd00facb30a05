#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/slots/wdx.h>

namespace vrpipe {

namespace {

/// WDX without time: what comes is in draw order. Ports as in wdx_unit.cpp.
class UntimedWdx : public UntimedUnit {
 public:
  UntimedWdx(const std::string& name, std::unique_ptr<WdxBehaviour> behaviour, const RenderContext& context,
             unsigned gpcs)
      : UntimedUnit(name, WdxWork::kinds(behaviour->timing(), gpcs)),
        behaviour_(std::move(behaviour)),
        owners_(context.placement.owners) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      outs_.push_back(std::make_unique<UntimedOut<PrimitiveItem>>(*this, "out_primitives_" + std::to_string(gpc)));
      ins_.push_back(input<PrimitiveItem>("in_primitives_" + std::to_string(gpc),
                                          [this](const PrimitiveItem& item) { take(item); }));
    }
  }

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  void take(const PrimitiveItem& item) {
    if (item.ends_batch) return;
    const bool is_mark = item.mark != Mark::none;
    // The GPCs' ends follow one another; the first stands for all.
    if (is_mark && ended_) return;
    ended_ = item.mark == Mark::end_of_frame;
    const GpcSet to = receivers_of(item, *owners_);
    did(WdxWork::taken, 1);
    if (!is_mark) ++behaviour_->primitives;
    for (std::size_t gpc = 0; gpc < outs_.size(); ++gpc) {
      if (!to[gpc]) continue;
      did(WdxWork::handed_on, 1);
      if (!is_mark) ++behaviour_->copies;
      outs_[gpc]->send(item);
    }
  }

  std::unique_ptr<WdxBehaviour> behaviour_;
  const std::shared_ptr<const TileOwners> owners_;
  std::vector<std::unique_ptr<UntimedOut<PrimitiveItem>>> outs_;
  std::vector<std::unique_ptr<UntimedIn<PrimitiveItem>>> ins_;
  bool ended_ = false;
};

[[maybe_unused]] const bool wdx_untimed_registered = [] {
  register_untimed_unit_maker("wdx", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                        const RenderContext& context, unsigned gpcs) {
    return std::make_unique<UntimedWdx>(name, behaviour_as<WdxBehaviour>(std::move(behaviour)), context, gpcs);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
