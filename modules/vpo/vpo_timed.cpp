#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/slots/vpo.h>

namespace vrpipe {

namespace {

/// VPO at lt. Ports as in vpo_unit.cpp.
class TimedVpo : public TimedUnit {
 public:
  TimedVpo(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<VpoBehaviour> behaviour,
           unsigned gpcs)
      : TimedUnit(name, domain, VpoWork::kinds(behaviour->timing())),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        gpcs_(gpcs),
        lane_(timing_.items_per_cycle) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      outs_.push_back(std::make_unique<TimedOut<PrimitiveItem>>(*this, "out_primitives_" + std::to_string(gpc)));
      outs_.back()->set_pipeline(timing_.latency_cycles - 1, timing_.items_per_cycle);
    }
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      ins_.push_back(std::make_unique<TimedIn<VertexWarp>>(*this, "in_vertices_" + std::to_string(gpc),
                                                           [this](const VertexWarp& warp, CycleInterval visible) {
                                                             return assemble(warp, visible.first);
                                                           }));
    }
  }

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  /// To every GPC concerned; returns the cycle in which the last has taken it.
  Cycle send(const PrimitiveItem& item, Cycle at) {
    Cycle taken = at;
    for (unsigned gpc = 0; gpc < gpcs_; ++gpc) {
      if (item.mark != Mark::none || concerns(item.primitive, gpcs_, gpc))
        taken = std::max(taken, outs_[gpc]->send(item, at).first);
    }
    return taken;
  }

  Cycle assemble(const VertexWarp& warp, Cycle visible) {
    for (const auto& out : outs_) {
      lane_.hold(out->last());
      charge(UnitState::blocked, out->last());
    }
    if (warp.mark != Mark::none) {
      // The GPCs' ends follow one another; the first stands for all, since no warp comes after it.
      const Cycle at = lane_.take(visible);
      if (!ended_) {
        PrimitiveItem mark;
        mark.mark = warp.mark;
        send(mark, at);
        ended_ = warp.mark == Mark::end_of_frame;
      }
      return at;
    }
    Cycle left = never;
    for (std::uint32_t splat = warp.first_splat; splat < warp.first_splat + warp.splats; ++splat) {
      std::array<Primitive, 2> primitives;
      const unsigned count = behaviour_->assemble(warp.draw, splat, primitives);
      // Culled triangles take their turn as well.
      for (unsigned i = 0; i < std::max(count, 1U); ++i) {
        const Cycle at = lane_.take(visible);
        did(VpoWork::triangles, 1, at);
        left = std::min(left, at);
        charge(UnitState::starved, at);
        if (i < count) {
          PrimitiveItem item;
          item.primitive = primitives[i];
          const Cycle taken = send(item, at);
          charge(UnitState::blocked, taken);
          lane_.hold(taken);
        }
        charge(UnitState::busy, at + 1);
      }
    }
    return left;
  }

  std::unique_ptr<VpoBehaviour> behaviour_;
  const Throughput timing_;
  const unsigned gpcs_;
  std::vector<std::unique_ptr<TimedOut<PrimitiveItem>>> outs_;
  std::vector<std::unique_ptr<TimedIn<VertexWarp>>> ins_;
  IssuePort lane_;
  bool ended_ = false;
};

[[maybe_unused]] const bool vpo_timed_registered = [] {
  register_timed_unit_maker("vpo", [](const std::string& name, ClockDomain& domain,
                                      std::unique_ptr<Behaviour> behaviour, const RenderContext&, unsigned gpcs) {
    return std::make_unique<TimedVpo>(name.c_str(), domain, behaviour_as<VpoBehaviour>(std::move(behaviour)), gpcs);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
