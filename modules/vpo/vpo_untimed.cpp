#include <algorithm>
#include <array>

#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/slots/vpo.h>

namespace vrpipe {

namespace {

/// VPO without time. Ports as in vpo_unit.cpp.
class UntimedVpo : public UntimedUnit {
 public:
  UntimedVpo(const std::string& name, std::unique_ptr<VpoBehaviour> behaviour, unsigned gpcs)
      : UntimedUnit(name, VpoWork::kinds(behaviour->timing())), behaviour_(std::move(behaviour)), gpcs_(gpcs) {
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      const std::string index = std::to_string(gpc);
      outs_.push_back(std::make_unique<UntimedOut<PrimitiveItem>>(*this, "out_primitives_" + index));
      ins_.push_back(input<VertexWarp>("in_vertices_" + index, [this](const VertexWarp& warp) { assemble(warp); }));
    }
  }

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  void assemble(const VertexWarp& warp) {
    PrimitiveItem item;
    if (warp.mark != Mark::none) {
      // One end for each GPC; no warp comes after the first.
      if (ended_) return;
      ended_ = warp.mark == Mark::end_of_frame;
      item.mark = warp.mark;
      for (const auto& out : outs_) out->send(item);
      return;
    }
    for (std::uint32_t splat = warp.first_splat; splat < warp.first_splat + warp.splats; ++splat) {
      std::array<Primitive, 2> primitives;
      const unsigned count = behaviour_->assemble(warp.draw, splat, primitives);
      did(VpoWork::triangles, std::max(count, 1U));  // culled ones take their turn as well
      for (unsigned i = 0; i < count; ++i) {
        item.primitive = primitives[i];
        for (unsigned gpc = 0; gpc < gpcs_; ++gpc) {
          if (concerns(item.primitive, gpcs_, gpc)) outs_[gpc]->send(item);
        }
      }
    }
  }

  std::unique_ptr<VpoBehaviour> behaviour_;
  const unsigned gpcs_;
  std::vector<std::unique_ptr<UntimedOut<PrimitiveItem>>> outs_;
  std::vector<std::unique_ptr<UntimedIn<VertexWarp>>> ins_;
  bool ended_ = false;
};

[[maybe_unused]] const bool vpo_untimed_registered = [] {
  register_untimed_unit_maker("vpo", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                        const RenderContext&, unsigned gpcs) {
    return std::make_unique<UntimedVpo>(name, behaviour_as<VpoBehaviour>(std::move(behaviour)), gpcs);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
