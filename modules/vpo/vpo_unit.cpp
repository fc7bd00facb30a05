#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/slots/vpo.h>

namespace vrpipe {

namespace {

/// VPO at cycle fidelity: of a GPC, whose vertex warps it takes in order. Where there are several GPCs, the crossbar is
/// told where the primitives of each end. Ports: in_vertices (VertexWarp), out_primitives (PrimitiveItem).
class VpoUnit : public Unit {
 public:
  VpoUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<VpoBehaviour> behaviour,
          unsigned gpcs)
      : Unit(name, domain, VpoWork::kinds(behaviour->timing())),
        in_(*this, "in_vertices"),
        out_(*this, "out_primitives"),
        behaviour_(std::move(behaviour)),
        timing_(behaviour_->timing()),
        ends_batches_(gpcs > 1) {
    out_.set_pipeline(VpoWork::pipeline(timing_));
  }

  bool idle() const override { return at_ == count_ && !has_end_ && in_.empty(); }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  bool send(const PrimitiveItem& item) {
    if (out_.credits() == 0) return false;
    out_.push(item);
    return true;
  }
  Cycle blocked(bool moved, Cycle now) {
    enter(moved ? UnitState::busy : UnitState::blocked, now);
    return moved ? now + 1 : never;
  }

  Cycle tick(Cycle now) override {
    unsigned budget = timing_.items_per_cycle;
    bool moved = false;
    while (budget > 0) {
      if (at_ < count_) {
        PrimitiveItem item;
        item.primitive = primitives_[at_];
        if (!send(item)) return blocked(moved, now);
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
      if (has_end_) {
        PrimitiveItem end;
        end.ends_batch = true;
        if (!send(end)) return blocked(moved, now);
        has_end_ = false;
        moved = true;
      }
      if (!in_.ready()) {
        enter(moved ? UnitState::busy : UnitState::starved, now);
        return moved ? now + 1 : in_.next_ready();
      }
      const VertexWarp warp = in_.front();
      if (warp.mark != Mark::none) {
        PrimitiveItem mark;
        mark.mark = warp.mark;
        if (!send(mark)) return blocked(moved, now);
        in_.pop();
        break;
      }
      in_.pop();
      draw_ = warp.draw;
      splat_ = warp.first_splat;
      last_splat_ = warp.first_splat + warp.splats;
      has_end_ = ends_batches_;
    }
    enter(UnitState::busy, now);
    return now + 1;
  }

  StreamIn<VertexWarp> in_;
  StreamOut<PrimitiveItem> out_;
  std::unique_ptr<VpoBehaviour> behaviour_;
  const Throughput timing_;
  const bool ends_batches_;
  std::array<Primitive, 2> primitives_;
  unsigned at_ = 0;
  unsigned count_ = 0;
  DrawIndex draw_ = 0;
  std::uint32_t splat_ = 0;
  std::uint32_t last_splat_ = 0;
  bool has_end_ = false;  ///< of a batch, to be sent
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
