#include <vrpipe/model/occupancy.h>
#include <vrpipe/model/untimed.h>

namespace vrpipe {

namespace {

/// The SM array without time. Ports as in sm_timed.cpp.
class UntimedSm : public UntimedUnit {
 public:
  UntimedSm(const std::string& name, std::unique_ptr<SmBehaviour> behaviour)
      : UntimedUnit(name),
        out_vertices_(*this, "out_vertices"),
        out_shaded_(*this, "out_shaded"),
        in_release_(input<WarpRelease>("in_release", [](const WarpRelease&) {})),
        in_warps_(input<Warp>("in_warps", [this](const Warp& warp) { shade(warp); })),
        in_vertices_(input<VertexWarp>("in_vertices", [this](const VertexWarp& warp) { shade_vertices(warp); })),
        behaviour_(std::move(behaviour)) {}

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  void shade(const Warp& warp) {
    shaded_.mark = warp.mark;
    shaded_.sequence = warp.sequence;
    shaded_.count = 0;
    if (warp.mark == Mark::none) behaviour_->shade(warp, shaded_);
    out_shaded_.send({&shaded_});
  }
  void shade_vertices(const VertexWarp& warp) {
    if (warp.mark == Mark::none) {
      did(SmWork::vertex, 1);
      behaviour_->shade_vertices(warp);
    }
    out_vertices_.send(warp);
  }

  UntimedOut<VertexWarp> out_vertices_;
  UntimedOut<ShadedWarpItem> out_shaded_;
  std::unique_ptr<UntimedIn<WarpRelease>> in_release_;
  std::unique_ptr<UntimedIn<Warp>> in_warps_;
  std::unique_ptr<UntimedIn<VertexWarp>> in_vertices_;
  std::unique_ptr<SmBehaviour> behaviour_;
  ShadedWarp shaded_;
};

[[maybe_unused]] const bool registered = [] {
  register_untimed_unit_maker("sm", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                       const RenderContext&, unsigned) {
    return std::make_unique<UntimedSm>(name, behaviour_as<SmBehaviour>(std::move(behaviour)));
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
