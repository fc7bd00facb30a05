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
      : UntimedUnit(name, VpoWork::kinds(behaviour->timing())),
        behaviour_(std::move(behaviour)),
        ends_batches_(gpcs > 1),
        out_(*this, "out_primitives"),
        in_(input<VertexWarp>("in_vertices", [this](const VertexWarp& warp) { assemble(warp); })) {}

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  void assemble(const VertexWarp& warp) {
    PrimitiveItem item;
    if (warp.mark != Mark::none) {
      item.mark = warp.mark;
      out_.send(item);
      return;
    }
    for (std::uint32_t splat = warp.first_splat; splat < warp.first_splat + warp.splats; ++splat) {
      std::array<Primitive, 2> primitives;
      const unsigned count = behaviour_->assemble(warp.draw, splat, primitives);
      did(VpoWork::triangles, std::max(count, 1U));  // culled ones take their turn as well
      for (unsigned i = 0; i < count; ++i) {
        item.primitive = primitives[i];
        out_.send(item);
      }
    }
    if (!ends_batches_) return;
    PrimitiveItem end;
    end.ends_batch = true;
    out_.send(end);
  }

  std::unique_ptr<VpoBehaviour> behaviour_;
  const bool ends_batches_;
  UntimedOut<PrimitiveItem> out_;
  std::unique_ptr<UntimedIn<VertexWarp>> in_;
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
