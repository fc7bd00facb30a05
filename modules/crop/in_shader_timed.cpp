#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "crop/in_shader.h"

#include <vrpipe/kernel/ring.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/order_monitor.h>

namespace vrpipe {

namespace {

/// Blending in the shader at lt: as in_shader_unit.cpp, but a warp takes the lock, loads and stores when it arrives, at
/// cycles that may lie ahead.
/// Ports: in_color (ShadedWarpItem), in_reads (PortReads; optional), out_terminations (TerminationBeat; nothing is sent),
/// out_done (BlendsDone; optional), memory (TLM-2.0 base protocol).
class TimedInShader : public TimedUnit {
 public:
  TimedInShader(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<CropBehaviour> behaviour,
                const RenderContext& context)
      : TimedUnit(name, domain, InShaderTime::kinds()),
        context_(context),
        out_(*this, "out_terminations"),
        out_done_(*this, "out_done"),
        in_(*this, "in_color",
            [this](const ShadedWarpItem& item, CycleInterval visible) { return take(*item.warp, visible); }),
        in_reads_(*this, "in_reads", [](const PortReads&, CycleInterval visible) -> CycleInterval { return visible; }),
        behaviour_(std::move(behaviour)),
        shader_(dynamic_cast<InShaderBlending&>(behaviour_->unit())),
        time_(shader_.shader_time()),
        barriers_(context),
        memory_(*this, "memory", {MemoryTraffic::color, static_cast<std::uint16_t>(context.placement.gpc)}) {
    out_done_.set_optional();
    in_reads_.set_optional();
    in_reads_.set_comes_ahead();
  }

  Behaviour& behaviour() override { return *behaviour_; }
  tlm::tlm_initiator_socket<32>* memory_socket() override { return &memory_.socket; }
  unsigned memory_bytes_per_cycle() const override { return time_.memory_bytes_per_cycle; }
  MemoryBytes memory_bytes() const override { return memory_.moved(); }
  bool ends_frame() const override { return true; }
  Cycle end_of_frame() const override { return end_; }

 private:
  using OfPixels = std::array<Cycle, 4>;

  void end_of_elaboration() override {
    const ColorSurface* const surface = behaviour_->surface();
    if (surface == nullptr) throw SimulationFault(this->name(), 0, "no colour surface is attached");
    if (!time_.locks) return;
    monitor_.emplace(surface->width(), surface->height());
    tiles_.emplace(surface->grid());
    tile_is_open_until_.resize(surface->grid().tiles());
    free_from_.resize(surface->grid().quads());
  }

  CycleInterval take(const ShadedWarp& warp, CycleInterval visible) {
    if (warp.mark != Mark::none) return pass(warp, visible);
    Cycle in = std::max(visible.last, from_);
    if (ends_of_warps_.size() == time_.warps) {
      in = std::max(in, ends_of_warps_.top());
      ends_of_warps_.pop();
    }
    charge(UnitState::starved, in);
    Cycle done = 0;
    for (unsigned from = 0; from < warp.count;) {
      const unsigned to = time_.locks ? lock_part(warp, from, in, done) : race(warp, in, done);
      did(InShaderWork::blend, to - from, in);
      from = to;
    }
    ends_of_warps_.push(done);
    last_done_ = std::max(last_done_, done);
    quads_last(done, warp.count, [&](unsigned i) { return warp.draw[i]; });
    if (time_.locks) warp.release();
    return {std::max(visible.first, in - (visible.last - visible.first)), in};
  }

  CycleInterval pass(const ShadedWarp& warp, CycleInterval visible) {
    store_until(never);
    const Cycle at = std::max({visible.first, from_, last_done_});
    from_ = at;
    charge(UnitState::memory, at);
    if (warp.mark == Mark::end_of_frame) {
      end_ = last_done_ > 0 ? last_done_ : at;
    } else {
      behaviour_->pass(warp.mark);
      if (barriers_.is_barrier(warp.mark)) out_done_.send({warp.mark}, at);
    }
    warp.release();
    return at;
  }

  /// Quads that take the lock together, from cycle `in` on; returns the first that does not.
  unsigned lock_part(const ShadedWarp& warp, unsigned from, Cycle in, Cycle& done) {
    const ScreenTiling& grid = behaviour_->surface()->grid();
    const std::size_t tile = grid.index(warp.tile), place = grid.place(warp.tile, 0);
    const PixelsOfQuads& locked_pixels = pixels_of(warp, context_);
    const Cycle at = lock_.free_from(in);
    const CoverageTiles::Part part = tiles_->take(warp, locked_pixels, from, place, tile_is_open_until_[tile] > at);
    const std::uint64_t price = time_.price_of(part.opens);
    const Cycle locked = std::max(lock_.take(at, price), at + 1);
    did(InShaderWork::lock, price, at, locked);
    charge(UnitState::busy, locked);
    Cycle enters = at;
    for (unsigned i = from; i < part.end; ++i) {
      const OfPixels& pixels = free_from_[place + warp.position[i]];
      for (unsigned lane = 0; lane < 4; ++lane)
        if ((locked_pixels[i] >> lane & 1U) != 0) enters = std::max(enters, pixels[lane]);
    }
    const Cycle stored = move(warp, from, part.end, enters).second;
    for (unsigned i = from; i < part.end; ++i) {
      OfPixels& pixels = free_from_[place + warp.position[i]];
      for (unsigned lane = 0; lane < 4; ++lane)
        if ((locked_pixels[i] >> lane & 1U) != 0) pixels[lane] = stored + time_.hand_over_cycles;
    }
    tile_is_open_until_[tile] = std::max(tile_is_open_until_[tile], stored);
    monitor_->blended(warp, from, part.end, stored);
    CropBehaviour::Outcomes outcomes;
    behaviour_->blend_quads(warp, from, part.end, outcomes);
    done = std::max(done, stored);
    return part.end;
  }
  /// A warp's quads without a lock.
  unsigned race(const ShadedWarp& warp, Cycle in, Cycle& done) {
    store_until(in);
    Loaded loaded;
    loaded.warp = &warp;
    std::tie(loaded.at, done) = move(warp, 0, warp.count, in);
    loaded.colors = colors_.load(*behaviour_->surface(), warp, 0, warp.count);
    loaded_.push_in_order(loaded, &Loaded::at);
    return warp.count;
  }
  /// Stores what has been loaded, up to a cycle.
  void store_until(Cycle until) {
    for (; !loaded_.empty() && loaded_.front().at <= until; loaded_.pop()) {
      const Loaded& next = loaded_.front();
      colors_.store(next.colors, shader_, *next.warp, 0, next.warp->count);
      next.warp->release();
    }
  }

  /// Loads and stores quads; returns when the stores begin, and when they are done.
  std::pair<Cycle, Cycle> move(const ShadedWarp& warp, unsigned from, unsigned to, Cycle at) {
    const ColorSurface& surface = *behaviour_->surface();
    Cycle there = at;
    if (context_.state(warp.draw[from]).blend) {  // all are of one state
      for_each_shader_access(surface, warp, pixels_of(warp, context_), from, to,
                             [&](std::uint64_t address, unsigned bytes) {
                               there = std::max(there, memory_.read(address, bytes, at));
                             });
    }
    const Cycle stores = there + time_.blend_cycles;
    Cycle done = stores;
    for_each_shader_access(surface, warp, warp.live, from, to, [&](std::uint64_t address, unsigned bytes) {
      done = std::max(done, memory_.write(address, bytes, stores));
    });
    return {stores, done};
  }

  const RenderContext& context_;
  TimedOut<TerminationBeat> out_;
  TimedOut<BlendsDone> out_done_;
  TimedIn<ShadedWarpItem> in_;
  TimedIn<PortReads> in_reads_;
  std::unique_ptr<CropBehaviour> behaviour_;
  InShaderBlending& shader_;
  const InShaderTime& time_;
  const BarrierPlan barriers_;
  TimedMemoryPort memory_;
  ThousandthsPort lock_;
  // With a lock:
  std::optional<PixelOrderMonitor> monitor_;
  std::optional<CoverageTiles> tiles_;
  std::vector<Cycle> tile_is_open_until_;
  std::vector<OfPixels> free_from_;  ///< by quad of the surface
  // Without:
  struct Loaded {
    Cycle at = 0;  ///< to be stored
    const ShadedWarp* warp = nullptr;
    std::uint32_t colors = 0;
  };
  Ring<Loaded> loaded_;
  LoadedColors colors_;

  std::priority_queue<Cycle, std::vector<Cycle>, std::greater<>> ends_of_warps_;
  Cycle from_ = 0;  ///< after a mark, which all before it are done for
  Cycle last_done_ = 0;
  Cycle end_ = never;
};

}  // namespace

std::unique_ptr<Unit> make_timed_in_shader_unit(const std::string& name, ClockDomain& domain,
                                                std::unique_ptr<Behaviour> behaviour, const RenderContext& context) {
  return std::make_unique<TimedInShader>(name.c_str(), domain, behaviour_as<CropBehaviour>(std::move(behaviour)),
                                         context);
}

}  // namespace vrpipe
