#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "crop/in_shader.h"

#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/memory_port.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/order_monitor.h>

namespace vrpipe {

namespace {

/// Blending in the shader at cycle fidelity. Warps come in draw order of each screen tile. With a lock, quads of a warp take it
/// in this order, when it is free, wait until their pixels are handed over, load, blend and store; without, they load at
/// once, and what a warp stores follows from what it has loaded.
/// Ports: in_color (ColorBeat), in_reads (PortReads; optional), out_terminations (TerminationBeat; nothing is sent), out_done
/// (BlendsDone; optional), memory (TLM-2.0 base protocol).
class InShaderUnit : public Unit {
 public:
  InShaderUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<CropBehaviour> behaviour,
               const RenderContext& context)
      : Unit(name, domain, InShaderTime::kinds()),
        context_(context),
        in_(*this, "in_color"),
        in_reads_(*this, "in_reads"),
        out_(*this, "out_terminations"),
        out_done_(*this, "out_done"),
        behaviour_(std::move(behaviour)),
        shader_(dynamic_cast<InShaderBlending&>(behaviour_->unit())),
        time_(shader_.shader_time()),
        barriers_(context),
        memory_(*this, "memory", most_accesses,
                {MemoryTraffic::color, static_cast<std::uint16_t>(context.placement.gpc)}) {
    out_done_.set_optional();
    in_reads_.set_optional();
    in_reads_.set_comes_ahead();
  }

  bool idle() const override { return in_.empty() && in_reads_.empty() && warps_in_ == 0 && done_marks_.empty(); }
  Behaviour& behaviour() override { return *behaviour_; }
  tlm::tlm_initiator_socket<32>* memory_socket() override { return &memory_.socket; }
  unsigned memory_bytes_per_cycle() const override { return time_.memory_bytes_per_cycle; }
  MemoryBytes memory_bytes() const override { return memory_.moved(); }
  bool ends_frame() const override { return true; }
  Cycle end_of_frame() const override { return end_; }

 private:
  static constexpr unsigned most_accesses = 1U << 16U;
  static constexpr unsigned pixels_per_warp = 4 * quads_per_warp;
  using OfPixels = std::array<std::uint32_t, 4>;

  /// One that blends, or waits for it.
  struct WarpInside {
    const ShadedWarp* warp = nullptr;
    unsigned parts = 0;  ///< that have begun, and are not done
    bool begun = false;  ///< all of it
  };
  /// A pixel for which a part waits.
  struct Wait {
    std::uint32_t part = 0;
    std::uint32_t pixel = pixels_per_warp;  ///< its, or none
  };
  /// Quads of a warp that take the lock together, in the order of `parts_`, from which they go when others need not wait
  /// for them any more.
  struct Part {
    std::uint32_t warp = 0;  ///< of `warps_`
    std::uint8_t from = 0, to = 0;
    std::uint8_t accesses = 0, issued = 0, under_way = 0;
    bool loads = true;
    bool started = false;  ///< to load, or to store
    Cycle enters = 0;
    Cycle done = never;
    unsigned waits = 0;   ///< pixels that others have, which are not done
    Wait waits_for_this;  ///< the first who does
    std::uint32_t colors = 0;
    std::array<Wait, pixels_per_warp> next;  ///< behind each of its own waits
    std::array<std::pair<std::uint64_t, unsigned>, quads_per_warp> access;
  };
  struct Turn {
    Cycle at = 0;
    std::uint32_t part = 0;
  };

  void end_of_elaboration() override {
    surface_ = behaviour_->surface();
    if (surface_ == nullptr) throw SimulationFault(this->name(), 0, "no colour surface is attached");
    if (!time_.locks) return;
    monitor_.emplace(surface_->width(), surface_->height());
    tiles_.emplace(surface_->grid());
    parts_of_tile_.resize(surface_->grid().tiles());
    last_of_pixel_.resize(surface_->grid().quads());
  }

  Part& part(std::uint32_t number) { return parts_[number - first_part_]; }
  bool is_known(std::uint32_t number) const { return number - first_part_ < parts_.size(); }

  bool accept() {
    bool moved = false;
    for (; in_.ready(); in_.pop()) {
      const ColorBeat& beat = in_.front();
      if (beat.mark != Mark::none) {
        if (warps_in_ > 0) return moved;
        pass(beat.mark);
      }
      for (; at_ < beat.count; ++at_) {
        const ColorQuad& quad = beat.quads[at_];
        if (quad.index == 0) {
          if (warps_in_ == time_.warps) return moved;
          ++warps_in_;
        }
        if (quad.is_last()) arrived_.push(warp_inside(*quad.warp));
      }
      at_ = 0;
      moved = true;
    }
    return moved;
  }
  std::uint32_t warp_inside(const ShadedWarp& warp) {
    if (free_warps_.empty()) {
      free_warps_.push_back(static_cast<std::uint32_t>(warps_.size()));
      warps_.emplace_back();
    }
    const std::uint32_t index = free_warps_.back();
    free_warps_.pop_back();
    warps_[index] = {&warp, 0, false};
    return index;
  }
  [[gnu::noinline]] void pass(Mark mark) {
    if (mark == Mark::end_of_frame) {
      end_ = last_done_ > 0 ? last_done_ : now();
      return;
    }
    behaviour_->pass(mark);
    if (barriers_.is_barrier(mark)) done_marks_.push({mark});
  }
  void send_done() {
    for (; !done_marks_.empty() && out_done_.credits() > 0; done_marks_.pop()) out_done_.push(done_marks_.front());
  }

  bool begin(Cycle now) {
    bool any = false;
    for (; !arrived_.empty() && (!time_.locks || lock_.is_free(now)); any = true) {
      const std::uint32_t index = arrived_.front();
      const ShadedWarp& warp = *warps_[index].warp;
      CoverageTiles::Part taken{warp.count, true};
      if (time_.locks) {
        const std::size_t tile = surface_->grid().index(warp.tile);
        taken = tiles_->take(warp, pixels_of(warp, context_), next_quad_, tile * positions_per_tile,
                             parts_of_tile_[tile]++ > 0);
        const std::uint64_t price = time_.price_of(taken.opens);
        did(InShaderWork::lock, price, now, std::max(lock_.take(now, price), now + 1));
      }
      did(InShaderWork::blend, taken.end - next_quad_, now);
      begin_part(index, next_quad_, taken.end, now);
      ++warps_[index].parts;
      next_quad_ = taken.end;
      if (next_quad_ < warp.count) continue;
      warps_[index].begun = true;
      next_quad_ = 0;
      arrived_.pop();
    }
    return any;
  }
  void begin_part(std::uint32_t index, unsigned from, unsigned to, Cycle now) {
    const std::uint32_t number = first_part_ + static_cast<std::uint32_t>(parts_.size());
    Part& made = parts_.push();
    made.warp = index;
    made.from = static_cast<std::uint8_t>(from);
    made.to = static_cast<std::uint8_t>(to);
    made.accesses = made.issued = made.under_way = 0;
    made.started = false;
    made.enters = now;
    made.done = never;
    made.waits = 0;
    made.waits_for_this = {};
    const ShadedWarp& warp = *warps_[index].warp;
    made.loads = context_.state(warp.draw[from]).blend;  // all are of one state
    set_accesses(made, warp, pixels_of(warp, context_));
    if (time_.locks) wait_for_pixels(warp, number, made);
    if (made.waits == 0) entering_.push_in_order({made.enters, number}, &Turn::at);
  }
  void set_accesses(Part& part, const ShadedWarp& warp, const PixelsOfQuads& pixels) {
    part.accesses = part.issued = 0;
    for_each_shader_access(*surface_, warp, pixels, part.from, part.to, [&](std::uint64_t address, unsigned bytes) {
      part.access[part.accesses++] = {address, bytes};
    });
  }
  /// Takes its place behind those that have its pixels.
  void wait_for_pixels(const ShadedWarp& warp, std::uint32_t number, Part& made) {
    const std::size_t place = surface_->grid().place(warp.tile, 0);
    const PixelsOfQuads& pixels = pixels_of(warp, context_);
    unsigned pixel = 0;
    for (unsigned i = made.from; i < made.to; ++i) {
      for (unsigned lane = 0; lane < 4; ++lane, ++pixel) {
        if ((pixels[i] >> lane & 1U) == 0) continue;
        std::uint32_t& last = last_of_pixel_[place + warp.position[i]][lane];
        if (const std::uint32_t before = last - 1; last != 0 && is_known(before) && before != number) {
          Part& holder = part(before);
          if (holder.done == never) {
            ++made.waits;
            made.next[pixel] = std::exchange(holder.waits_for_this, {number, pixel});
          } else {
            made.enters = std::max(made.enters, holder.done + time_.hand_over_cycles);
          }
        }
        last = number + 1;
      }
    }
  }

  /// Issues accesses of parts whose turn has come; true if there were any.
  bool issue(Ring<Turn>& turns, bool stores, Cycle now) {
    bool any = false;
    for (; !turns.empty() && turns.front().at <= now; turns.pop(), any = true) {
      const std::uint32_t number = turns.front().part;
      Part& next = part(number);
      if (!std::exchange(next.started, true)) {
        if (stores) store(next, now);
        if (stores && next.accesses == 0) {
          finish(next, now);
          continue;
        }
        if (!stores && !time_.locks) next.colors = colors_.load(*surface_, *warps_[next.warp].warp, next.from, next.to);
        if (!stores && !next.loads) {
          next.started = false;
          stores_.push_in_order({now + time_.blend_cycles, number}, &Turn::at);
          continue;
        }
      }
      for (; next.issued < next.accesses; ++next.issued) {
        if (!memory_.available()) return any;
        const auto [address, bytes] = next.access[next.issued];
        const std::uint32_t tag = number << 1U | (stores ? 1U : 0U);
        ++next.under_way;
        if (stores) {
          memory_.write(address, bytes, tag);
        } else {
          memory_.read(address, bytes, tag);
        }
      }
    }
    return any;
  }
  void store(Part& part, Cycle now) {
    const ShadedWarp& warp = *warps_[part.warp].warp;
    set_accesses(part, warp, warp.live);
    if (time_.locks) {
      monitor_->blended(warp, part.from, part.to, now);
      CropBehaviour::Outcomes outcomes;
      behaviour_->blend_quads(warp, part.from, part.to, outcomes);
      return;
    }
    colors_.store(part.colors, shader_, warp, part.from, part.to);
  }

  bool finish_accesses(Cycle now) {
    bool any = false;
    for (std::uint32_t tag = 0; memory_.next_completed(tag); any = true) {
      const std::uint32_t number = first_part_ + (((tag >> 1U) - first_part_) & (~0U >> 1U));
      Part& of = part(number);
      if (--of.under_way > 0 || of.issued < of.accesses) continue;
      if ((tag & 1U) == 0) {
        of.started = false;
        stores_.push_in_order({now + time_.blend_cycles, number}, &Turn::at);
      } else {
        finish(of, now);
      }
    }
    const Cycle kept = time_.locks ? time_.hand_over_cycles : 0;
    for (; !parts_.empty() && parts_.front().done != never && parts_.front().done + kept <= now; parts_.pop())
      ++first_part_;
    return any;
  }
  void finish(Part& part_done, Cycle now) {
    part_done.done = last_done_ = now;
    WarpInside& inside = warps_[part_done.warp];
    const ShadedWarp& warp = *inside.warp;
    quads_last(now, part_done.to - part_done.from, [&](unsigned i) { return warp.draw[part_done.from + i]; });
    if (time_.locks) --parts_of_tile_[surface_->grid().index(warp.tile)];
    for (Wait wait = part_done.waits_for_this; wait.pixel < pixels_per_warp;) {
      Part& waiting = part(wait.part);
      waiting.enters = std::max(waiting.enters, now + time_.hand_over_cycles);
      if (--waiting.waits == 0) entering_.push_in_order({waiting.enters, wait.part}, &Turn::at);
      wait = waiting.next[wait.pixel];
    }
    if (--inside.parts > 0 || !inside.begun) return;
    inside.warp->release();
    free_warps_.push_back(part_done.warp);
    --warps_in_;
  }

  Cycle tick(Cycle now) override {
    bool moved = finish_accesses(now);
    moved |= issue(stores_, true, now);
    for (; in_reads_.ready(); in_reads_.pop()) {}
    moved |= accept();
    moved |= begin(now);
    moved |= issue(entering_, false, now);
    if (!done_marks_.empty()) send_done();
    const bool is_busy = moved || (time_.locks && !lock_.is_free(now));
    enter(is_busy                              ? UnitState::busy
          : warps_in_ == 0                     ? UnitState::starved
          : memory_.next_completion() == never ? UnitState::latency
                                               : UnitState::memory,
          now);
    Cycle next = moved ? now + 1 : memory_.next_completion();
    if (time_.locks && !lock_.is_free(now)) next = std::min(next, lock_.free_from(now + 1));
    for (const Ring<Turn>* const turns : {&stores_, &entering_}) {
      if (!turns->empty() && turns->front().at > now) next = std::min(next, turns->front().at);
    }
    for (const Cycle at : {in_.next_ready(), in_reads_.next_ready()}) {
      if (at > now) next = std::min(next, at);
    }
    return next;
  }

  const RenderContext& context_;
  StreamIn<ColorBeat> in_;
  StreamIn<PortReads> in_reads_;
  StreamOut<TerminationBeat> out_;
  StreamOut<BlendsDone> out_done_;
  std::unique_ptr<CropBehaviour> behaviour_;
  InShaderBlending& shader_;
  const InShaderTime& time_;
  const BarrierPlan barriers_;
  MemoryPort memory_;
  const ColorSurface* surface_ = nullptr;
  unsigned at_ = 0;        ///< quads taken of the beat at the link
  unsigned warps_in_ = 0;  ///< of which at least a quad has come, and not all is done
  std::vector<WarpInside> warps_;
  std::vector<std::uint32_t> free_warps_;
  Ring<std::uint32_t> arrived_;  ///< warps that have not begun, or of which some quads have not
  unsigned next_quad_ = 0;       ///< of the first of them
  Ring<Part> parts_;
  std::uint32_t first_part_ = 0;  ///< number of the first
  Ring<Turn> entering_;           ///< to load
  Ring<Turn> stores_;             ///< that have loaded
  ThousandthsPort lock_;
  // With a lock:
  std::optional<PixelOrderMonitor> monitor_;
  std::optional<CoverageTiles> tiles_;
  std::vector<std::uint32_t> parts_of_tile_;  ///< under way
  std::vector<OfPixels> last_of_pixel_;       ///< by quad: number of the last part that has it, plus 1; 0: none yet
  LoadedColors colors_;                       ///< without

  Ring<BlendsDone> done_marks_;
  Cycle last_done_ = 0;
  Cycle end_ = never;
};

}  // namespace

std::unique_ptr<Unit> make_in_shader_unit(const std::string& name, ClockDomain& domain,
                                          std::unique_ptr<Behaviour> behaviour, const RenderContext& context) {
  return std::make_unique<InShaderUnit>(name.c_str(), domain, behaviour_as<CropBehaviour>(std::move(behaviour)),
                                        context);
}

}  // namespace vrpipe
