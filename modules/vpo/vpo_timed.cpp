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
        ends_batches_(gpcs > 1),
        out_(*this, "out_primitives"),
        in_(*this, "in_vertices",
            [this](const VertexWarp& warp, CycleInterval visible) { return assemble(warp, visible.first); }),
        lane_(timing_.items_per_cycle) {
    out_.set_pipeline(VpoWork::pipeline(timing_));
  }

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  Cycle assemble(const VertexWarp& warp, Cycle visible) {
    lane_.hold(out_.last());
    charge(UnitState::blocked, out_.last());
    PrimitiveItem item;
    if (warp.mark != Mark::none) {
      const Cycle at = lane_.take(visible);
      item.mark = warp.mark;
      out_.send(item, at);
      return at;
    }
    Cycle left = never;
    Cycle last = visible;
    for (std::uint32_t splat = warp.first_splat; splat < warp.first_splat + warp.splats; ++splat) {
      std::array<Primitive, 2> primitives;
      const unsigned count = behaviour_->assemble(warp.draw, splat, primitives);
      // Culled triangles take their turn as well.
      for (unsigned i = 0; i < std::max(count, 1U); ++i) {
        const Cycle at = last = lane_.take(visible);
        did(VpoWork::triangles, 1, at);
        left = std::min(left, at);
        charge(UnitState::starved, at);
        if (i < count) {
          item.primitive = primitives[i];
          const Cycle taken = out_.send(item, at).first;
          charge(UnitState::blocked, taken);
          lane_.hold(taken);
        }
        charge(UnitState::busy, at + 1);
      }
    }
    if (ends_batches_) {
      PrimitiveItem end;
      end.ends_batch = true;
      out_.send(end, std::max(last, out_.last()));
    }
    return left;
  }

  std::unique_ptr<VpoBehaviour> behaviour_;
  const Throughput timing_;
  const bool ends_batches_;
  TimedOut<PrimitiveItem> out_;
  TimedIn<VertexWarp> in_;
  IssuePort lane_;
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
