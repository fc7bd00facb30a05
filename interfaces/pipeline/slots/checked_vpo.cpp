#include <array>

#include <vrpipe/pipeline/slots/checks.h>

#include <vrpipe/pipeline/slots/vpo.h>

namespace vrpipe {

namespace {

class CheckedVpo final : public CheckedSlot<VpoBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  unsigned assemble(DrawIndex draw, std::uint32_t splat, std::array<Primitive, 2>& out) override {
    const unsigned count = ask("assemble", [&] { return checked_->assemble(draw, splat, out); });
    if (count > out.size()) fault("assemble", "{} triangles of splat {}", count, splat);
    for (unsigned i = 0; i < count; ++i) {
      check_primitive("assemble", out[i]);
      if (out[i].splat != splat || out[i].draw != draw) {
        fault("assemble", "a triangle of splat {} of draw {} for splat {} of draw {}", out[i].splat, out[i].draw, splat,
              draw);
      }
    }
    assembled_.add(draw, count);
    return count;
  }
  Throughput timing() const override {
    const Throughput timing = ask("timing", [&] { return checked_->timing(); });
    check_throughput(timing);
    return timing;
  }
  void check_timing() const override { timing(); }
  void check_counters() const override { check_by_draw("primitives", {&checked_->primitives}, assembled_, "came out"); }

 private:
  Seen assembled_;
};

}  // namespace

std::unique_ptr<Behaviour> check_vpo(const std::string& name, const RenderContext& context,
                                     std::unique_ptr<Behaviour> behaviour) {
  return make_checked<CheckedVpo, VpoBehaviour>(name, context, std::move(behaviour));
}

}  // namespace vrpipe
