#include <optional>
#include <utility>

#include "crop/in_shader.h"

#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/order_monitor.h>

namespace vrpipe {

namespace {

/// Blending in the shader without time: nothing races, so that the image is the one of an ordered lock. Ports as in
/// in_shader_timed.cpp.
class UntimedInShader : public UntimedUnit {
 public:
  UntimedInShader(const std::string& name, std::unique_ptr<CropBehaviour> behaviour, const RenderContext& context)
      : UntimedUnit(name, InShaderTime::kinds()),
        context_(context),
        out_(*this, "out_terminations"),
        out_done_(*this, "out_done"),
        in_(input<ShadedWarpItem>("in_color", [this](const ShadedWarpItem& item) { take(*item.warp); })),
        in_reads_(input<PortReads>("in_reads", [](const PortReads&) {})),
        behaviour_(std::move(behaviour)),
        time_(dynamic_cast<InShaderBlending&>(behaviour_->unit()).shader_time()),
        barriers_(context),
        memory_({MemoryTraffic::color, static_cast<std::uint16_t>(context.placement.gpc)}) {
    out_done_.set_optional();
    in_reads_->set_optional();
  }

  Behaviour& behaviour() override { return *behaviour_; }
  UntimedMemoryPort* memory_port() override { return &memory_; }
  void count_least(const BoundTerms&) override { counts_ = true; }
  double least_cycles(const Items& items) const override {
    return time_.locks ? static_cast<double>(items[InShaderWork::lock]) / 1000 : 0;
  }
  std::uint64_t room_in_warps() const override { return time_.warps; }

 private:
  void take(const ShadedWarp& warp) {
    if (warp.mark != Mark::none) {
      behaviour_->pass(warp.mark);
      if (barriers_.is_barrier(warp.mark)) out_done_.send({warp.mark});
      return warp.release();
    }
    const ColorSurface& surface = *behaviour_->surface();
    if (!monitor_) monitor_.emplace(surface.width(), surface.height());
    monitor_->blended(warp, 0, warp.count, 0);
    if (memory_.connected()) {
      const bool loads = warp.count > 0 && context_.state(warp.draw[0]).blend;  // all are of one state
      if (loads) {
        for_each_shader_access(surface, warp, pixels_of(warp, context_), 0, warp.count,
                               [&](std::uint64_t address, unsigned bytes) { memory_.read(address, bytes); });
      }
      for_each_shader_access(surface, warp, warp.live, 0, warp.count,
                             [&](std::uint64_t address, unsigned bytes) { memory_.write(address, bytes); });
    }
    CropBehaviour::Outcomes outcomes;
    behaviour_->blend_quads(warp, 0, warp.count, outcomes);
    if (counts_) {
      did(InShaderWork::blend, warp.count);
      did(InShaderWork::lock, time_.locks ? time_.least_of(warp.count) : 0);
    }
    warp.release();
  }

  const RenderContext& context_;
  UntimedOut<TerminationBeat> out_;
  UntimedOut<BlendsDone> out_done_;
  std::unique_ptr<UntimedIn<ShadedWarpItem>> in_;
  std::unique_ptr<UntimedIn<PortReads>> in_reads_;
  std::unique_ptr<CropBehaviour> behaviour_;
  const InShaderTime& time_;
  const BarrierPlan barriers_;
  std::optional<BlendOrderMonitor> monitor_;
  UntimedMemoryPort memory_;
  bool counts_ = false;
};

}  // namespace

std::unique_ptr<UntimedUnit> make_untimed_in_shader_unit(const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                                         const RenderContext& context) {
  return std::make_unique<UntimedInShader>(name, behaviour_as<CropBehaviour>(std::move(behaviour)), context);
}

}  // namespace vrpipe
