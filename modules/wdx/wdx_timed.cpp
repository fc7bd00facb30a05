#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/slots/wdx.h>

namespace vrpipe {

namespace {

/// WDX at lt: calls come in draw order, so nothing waits for its turn but in time. Ports as in wdx_unit.cpp.
class TimedWdx : public TimedUnit {
 public:
  TimedWdx(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<WdxBehaviour> behaviour,
           const RenderContext& context, unsigned gpcs)
      : TimedUnit(name, domain, WdxWork::kinds(behaviour->timing(), gpcs)),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        owners_(context.placement.owners),
        gpcs_(gpcs),
        in_lanes_(gpcs, IssuePort(timing_.primitives_per_cycle)),
        out_lanes_(gpcs, IssuePort(timing_.primitives_per_cycle)),
        queues_(std::size_t{gpcs} * gpcs, SlotPool(timing_.credits)) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      outs_.push_back(std::make_unique<TimedOut<PrimitiveItem>>(*this, "out_primitives_" + std::to_string(gpc)));
      outs_.back()->set_pipeline(WdxWork::pipeline(timing_));
    }
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      ins_.push_back(
          std::make_unique<TimedIn<PrimitiveItem>>(*this, "in_primitives_" + std::to_string(gpc),
                                                   [this, gpc](const PrimitiveItem& item, CycleInterval visible) {
                                                     return take(gpc, item, visible.first);
                                                   }));
    }
  }

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  /// Into the queues of all its GPCs, and out of each when it has its turn; returns when it is taken.
  Cycle take(unsigned from, const PrimitiveItem& item, Cycle visible) {
    if (item.ends_batch) return visible;
    const bool is_mark = item.mark != Mark::none;
    // The GPCs' ends follow one another; the first stands for all.
    if (is_mark && ended_) return visible;
    ended_ = item.mark == Mark::end_of_frame;
    const GpcSet to = receivers_of(item, *owners_);
    Cycle at = visible;
    for (unsigned gpc = 0; gpc < gpcs_; ++gpc) {
      if (to[gpc]) at = queues_[std::size_t{from} * gpcs_ + gpc].free_from(at, 1);
    }
    at = in_lanes_[from].take(at);
    did(WdxWork::taken, 1, at);
    charge(UnitState::starved, at);
    charge(UnitState::busy, at + 1);
    if (!is_mark) ++behaviour_->primitives;
    for (unsigned gpc = 0; gpc < gpcs_; ++gpc) {
      if (!to[gpc]) continue;
      const Cycle turn = out_lanes_[gpc].take(at + 1);
      const Cycle taken = outs_[gpc]->send(item, turn).first;
      out_lanes_[gpc].hold(taken);
      queues_[std::size_t{from} * gpcs_ + gpc].take(1, taken);
      did(WdxWork::handed_on, 1, taken);
      if (!is_mark) ++behaviour_->copies;
    }
    return at;
  }

  std::unique_ptr<WdxBehaviour> behaviour_;
  const WdxBehaviour::Timing timing_;
  const std::shared_ptr<const TileOwners> owners_;
  const unsigned gpcs_;
  std::vector<std::unique_ptr<TimedOut<PrimitiveItem>>> outs_;
  std::vector<std::unique_ptr<TimedIn<PrimitiveItem>>> ins_;
  std::vector<IssuePort> in_lanes_;   ///< of each GPC
  std::vector<IssuePort> out_lanes_;  ///< to each
  std::vector<SlotPool> queues_;      ///< from each to each
  bool ended_ = false;
};

[[maybe_unused]] const bool wdx_timed_registered = [] {
  register_timed_unit_maker("wdx", [](const std::string& name, ClockDomain& domain,
                                      std::unique_ptr<Behaviour> behaviour, const RenderContext& context,
                                      unsigned gpcs) {
    return std::make_unique<TimedWdx>(name.c_str(), domain, behaviour_as<WdxBehaviour>(std::move(behaviour)), context,
                                      gpcs);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
