#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/slots/vpo.h>

namespace vrpipe {

namespace {

/// VPO at cycle fidelity. Takes the GPCs' vertex warps in turn, which is draw order, and sends each primitive to every
/// GPC that owns a screen tile of its bounding box.
/// Ports: in_vertices_<gpc> (VertexWarp), out_primitives_<gpc> (PrimitiveItem).
class VpoUnit : public Unit {
 public:
  VpoUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<VpoBehaviour> behaviour,
          unsigned gpcs)
      : Unit(name, domain, VpoWork::kinds(behaviour->timing())),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        gpcs_(gpcs) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      ins_.push_back(std::make_unique<StreamIn<VertexWarp>>(*this, "in_vertices_" + std::to_string(gpc)));
      outs_.push_back(std::make_unique<StreamOut<PrimitiveItem>>(*this, "out_primitives_" + std::to_string(gpc)));
      outs_.back()->set_pipeline(timing_.latency_cycles - 1, timing_.items_per_cycle);
    }
  }

  bool idle() const override { return at_ == count_ && ins_[turn_]->empty(); }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  /// Pushes to every GPC concerned, or to none.
  bool send(const PrimitiveItem& item) {
    for (unsigned gpc = 0; gpc < gpcs_; ++gpc) {
      if (wanted(item, gpc) && outs_[gpc]->credits() == 0) return false;
    }
    for (unsigned gpc = 0; gpc < gpcs_; ++gpc) {
      if (wanted(item, gpc)) outs_[gpc]->push(item);
    }
    return true;
  }
  bool wanted(const PrimitiveItem& item, unsigned gpc) const {
    return item.mark != Mark::none || concerns(item.primitive, gpcs_, gpc);
  }

  Cycle tick(Cycle now) override {
    unsigned budget = timing_.items_per_cycle;
    bool moved = false;
    while (budget > 0) {
      if (at_ < count_) {
        PrimitiveItem item;
        item.primitive = primitives_[at_];
        if (!send(item)) {
          enter(moved ? UnitState::busy : UnitState::blocked, now);
          return moved ? now + 1 : never;
        }
        ++at_;
        --budget;
        did(VpoWork::triangles, 1, now);
        moved = true;
        continue;
      }
      if (splat_ < last_splat_) {
        // Culled triangles take their turn as well.
        at_ = 0;
        count_ = behaviour_->assemble(draw_, splat_++, primitives_);
        if (count_ == 0) {
          --budget;
          did(VpoWork::triangles, 1, now);
        }
        moved = true;
        continue;
      }
      StreamIn<VertexWarp>& in = *ins_[turn_];
      if (!in.ready()) {
        enter(moved ? UnitState::busy : UnitState::starved, now);
        return moved ? now + 1 : in.next_ready();
      }
      const VertexWarp warp = in.front();
      if (warp.mark != Mark::none) {
        // The GPCs' ends follow one another; the first stands for all, since no warp comes after it.
        if (!ended_) {
          PrimitiveItem mark;
          mark.mark = warp.mark;
          if (!send(mark)) {
            enter(UnitState::blocked, now);
            return never;
          }
          ended_ = warp.mark == Mark::end_of_frame;
        }
        in.pop();
        turn_ = (turn_ + 1) % gpcs_;
        break;
      }
      in.pop();
      turn_ = (turn_ + 1) % gpcs_;
      draw_ = warp.draw;
      splat_ = warp.first_splat;
      last_splat_ = warp.first_splat + warp.splats;
    }
    enter(UnitState::busy, now);
    return now + 1;
  }

  std::unique_ptr<VpoBehaviour> behaviour_;
  const Throughput timing_;
  const unsigned gpcs_;
  std::vector<std::unique_ptr<StreamIn<VertexWarp>>> ins_;
  std::vector<std::unique_ptr<StreamOut<PrimitiveItem>>> outs_;
  std::array<Primitive, 2> primitives_;
  unsigned at_ = 0;
  unsigned count_ = 0;
  DrawIndex draw_ = 0;
  std::uint32_t splat_ = 0;
  std::uint32_t last_splat_ = 0;
  unsigned turn_ = 0;
  bool ended_ = false;
};

[[maybe_unused]] const bool vpo_unit_registered = [] {
  register_unit_maker("vpo", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                const RenderContext&, unsigned gpcs) {
    return std::make_unique<VpoUnit>(name.c_str(), domain, behaviour_as<VpoBehaviour>(std::move(behaviour)), gpcs);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
