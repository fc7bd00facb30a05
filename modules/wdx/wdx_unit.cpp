#include <algorithm>

#include <vrpipe/kernel/ring.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/slots/wdx.h>

namespace vrpipe {

namespace {

/// WDX at cycle fidelity. What a GPC assembles comes in order, batch by batch, and waits in a queue for each GPC that it
/// goes to; each of these takes the GPCs' batches in turn, which is draw order. A primitive enters the queues of all its
/// GPCs in the same cycle or waits. Ports: in_primitives_<gpc>, out_primitives_<gpc> (PrimitiveItem).
class WdxUnit : public Unit {
 public:
  WdxUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<WdxBehaviour> behaviour,
          const RenderContext& context, unsigned gpcs)
      : Unit(name, domain, WdxWork::kinds(behaviour->timing(), gpcs)),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        owners_(context.placement.owners),
        gpcs_(gpcs),
        queues_(std::size_t{gpcs} * gpcs),
        turn_(gpcs, 0),
        ended_(gpcs, false) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      ins_.push_back(std::make_unique<StreamIn<PrimitiveItem>>(*this, "in_primitives_" + std::to_string(gpc)));
      outs_.push_back(std::make_unique<StreamOut<PrimitiveItem>>(*this, "out_primitives_" + std::to_string(gpc)));
      outs_.back()->set_pipeline(WdxWork::pipeline(timing_));
    }
  }

  bool idle() const override {
    return waiting_ == 0 && std::all_of(ins_.begin(), ins_.end(), [](const auto& in) { return in->empty(); });
  }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  Ring<PrimitiveItem>& queue(unsigned from, unsigned to) { return queues_[std::size_t{from} * gpcs_ + to]; }
  static bool is_primitive(const PrimitiveItem& item) { return item.mark == Mark::none && !item.ends_batch; }

  /// Hands on what has its turn; false if the GPC takes none of it.
  bool hand_on(unsigned to, Cycle now, bool& moved) {
    for (unsigned budget = timing_.primitives_per_cycle; budget > 0;) {
      Ring<PrimitiveItem>& from = queue(turn_[to], to);
      if (from.empty()) return true;
      const PrimitiveItem item = from.front();
      // The GPCs' ends follow one another; the first stands for all.
      const bool goes_on = is_primitive(item) || (item.mark != Mark::none && !ended_[to]);
      if (goes_on) {
        if (outs_[to]->credits() == 0) return false;
        outs_[to]->push(item);
        --budget;
        did(WdxWork::handed_on, 1, now);
        if (is_primitive(item)) ++behaviour_->copies;
      }
      if (!is_primitive(item)) turn_[to] = turn_[to] + 1 == gpcs_ ? 0 : turn_[to] + 1;
      ended_[to] = ended_[to] || item.mark == Mark::end_of_frame;
      from.pop();
      --waiting_;
      moved = true;
    }
    return true;
  }

  /// Takes what a GPC has assembled, as far as there is place for it.
  void take(unsigned from, Cycle now, bool& moved) {
    StreamIn<PrimitiveItem>& in = *ins_[from];
    for (unsigned budget = timing_.primitives_per_cycle; budget > 0 && in.ready();) {
      const PrimitiveItem& item = in.front();
      const GpcSet to = receivers_of(item, *owners_);
      for (unsigned gpc = 0; gpc < gpcs_; ++gpc) {
        if (to[gpc] && queue(from, gpc).size() >= timing_.credits) return;
      }
      for (unsigned gpc = 0; gpc < gpcs_; ++gpc) {
        if (!to[gpc]) continue;
        queue(from, gpc).push(item);
        ++waiting_;
      }
      if (is_primitive(item)) ++behaviour_->primitives;
      if (!item.ends_batch) {
        --budget;
        did(WdxWork::taken, 1, now);
      }
      in.pop();
      moved = true;
    }
  }

  Cycle tick(Cycle now) override {
    bool moved = false;
    bool blocked = false;
    for (unsigned gpc = 0; gpc < gpcs_; ++gpc) blocked |= !hand_on(gpc, now, moved);
    for (unsigned gpc = 0; gpc < gpcs_; ++gpc) take(gpc, now, moved);
    if (moved) {
      enter(UnitState::busy, now);
      return now + 1;
    }
    enter(blocked ? UnitState::blocked : UnitState::starved, now);
    Cycle next = never;
    for (const auto& in : ins_) {
      if (!in->ready()) next = std::min(next, in->next_ready());
    }
    return next;
  }

  std::unique_ptr<WdxBehaviour> behaviour_;
  const WdxBehaviour::Timing timing_;
  const std::shared_ptr<const TileOwners> owners_;
  const unsigned gpcs_;
  std::vector<std::unique_ptr<StreamIn<PrimitiveItem>>> ins_;
  std::vector<std::unique_ptr<StreamOut<PrimitiveItem>>> outs_;
  std::vector<Ring<PrimitiveItem>> queues_;  ///< from each GPC to each
  std::vector<unsigned> turn_;               ///< of each receiving GPC: whose batch it takes
  std::vector<bool> ended_;                  ///< it has been handed an end of the frame
  std::size_t waiting_ = 0;                  ///< in all queues
};

[[maybe_unused]] const bool wdx_unit_registered = [] {
  register_unit_maker("wdx", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                const RenderContext& context, unsigned gpcs) {
    return std::make_unique<WdxUnit>(name.c_str(), domain, behaviour_as<WdxBehaviour>(std::move(behaviour)), context,
                                     gpcs);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
