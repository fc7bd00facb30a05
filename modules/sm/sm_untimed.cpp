#include "sm/attribute_traffic.h"
#include "sm/hand_over.h"
#include "sm/warp_slots.h"

#include <vrpipe/memory/sectored_cache.h>
#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

namespace {

/// The SM array without time. Ports as in sm_timed.cpp. Where its memory wants to know, warps go to cores in turn, as if
/// each had a slot, and what they read of attributes goes through its L1, if it has one.
class UntimedSm : public UntimedUnit {
 public:
  UntimedSm(const std::string& name, std::unique_ptr<SmBehaviour> behaviour, const RenderContext& context)
      : UntimedUnit(name, work(behaviour->time())),
        out_vertices_(*this, "out_vertices"),
        out_shaded_(*this, "out_shaded"),
        in_release_(input<WarpRelease>("in_release", [](const WarpRelease&) {})),
        in_warps_(input<Warp>("in_warps", [this](const Warp& warp) { shade(warp); })),
        in_vertices_(input<VertexWarp>("in_vertices", [this](const VertexWarp& warp) { shade_vertices(warp); })),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()),
        traffic_(context, time_.fetch),
        memory_(traffic_.origin(MemoryTraffic::attribute)),
        fetch_gate_(context, "sm.attribute_fetch"),
        hand_over_(time_, context),
        tiling_(context.frame->width(), context.frame->height()),
        visits_(hand_over_.is_on() && context.termination == Termination::paper ? tiling_.tiles() : 0) {
    if (!EffectGate(context, "cache.details").is_active()) l1_statistics_.leave_out_details();
  }

  Behaviour& behaviour() override { return *behaviour_; }
  UntimedMemoryPort* memory_port() override { return &memory_; }
  std::vector<OccupancyPart> least_parts(const Items& items, bool to_last) const override {
    Items needed = items;
    if (to_last) {
      const HandOver::Price left = hand_over_.most_left();
      needed[SmWork::launches] -= std::min(needed[SmWork::launches], left.warp);
      needed[SmWork::visits] -= std::min(needed[SmWork::visits], left.visits);
    }
    return UntimedUnit::least_parts(needed, false);  // of warps, which schedulers share
  }
  double idle_after_last() const override {
    const HandOver::Price left = hand_over_.most_left();
    return hand_over_.is_on() ? static_cast<double>(std::max(left.warp, left.visits)) / 1000 : 0;
  }
  std::uint64_t room_in_warps() const override { return std::uint64_t{time_.cores} * time_.warps_per_core; }

 private:
  /// Vertices and merging are counted in warps, fragments in instructions.
  static std::vector<WorkKind> work(const SmTime& time) {
    std::vector<WorkKind> kinds = time.kinds();
    kinds[SmWork::vertex].cycles_per_item *= static_cast<double>(instructions_in(time.vertex));
    kinds[SmWork::merge].cycles_per_item *= static_cast<double>(instructions_in(time.merge));
    return kinds;
  }
  void shade(const Warp& warp) {
    shaded_.mark = warp.mark;
    shaded_.sequence = warp.sequence;
    shaded_.count = 0;
    if (warp.mark == Mark::none) {
      if (follows_memory()) read(warp);
      if (hand_over_.is_on()) {
        const HandOver::Price price = launch(warp);
        did(SmWork::launches, price.warp);
        did(SmWork::visits, price.visits);
      }
      behaviour_->shade(warp, shaded_);
    }
    out_shaded_.send({&shaded_});
  }
  /// In bins that time out a primitive's quads may be together that are not so here.
  HandOver::Price launch(const Warp& warp) {
    return visits_.empty() ? hand_over_.of(warp) : hand_over_.least_of(warp, visits_[tiling_.index(warp.tile)]);
  }
  void shade_vertices(const VertexWarp& warp) {
    if (warp.mark == Mark::none) {
      did(SmWork::vertex, 1);
      const auto access = [this](const MemoryRequest& request) { memory_.access(request); };
      if (follows_memory()) traffic_.read_vertices(warp, access);
      behaviour_->shade_and_count(warp);
      if (follows_memory()) {
        traffic_.write_attributes(warp, [this](const MemoryRequest& request) {
          memory_.access(traffic_.in_buffer(request));
        });
      }
    }
    out_vertices_.send(warp);
  }

  bool follows_memory() { return memory_.connected() && fetch_gate_.enter(); }
  [[gnu::noinline]] void read(const Warp& warp) {
    traffic_.find_reads(warp, reads_);
    if (!time_.fetch.has_l1() || reads_.traffic != MemoryTraffic::attribute) {
      for (unsigned i = 0; i < reads_.count; ++i) ask(reads_.lines[i].address, reads_.lines[i].sectors);
      return;
    }
    if (l1s_.empty()) {
      for (std::uint32_t core = 0; core < time_.cores; ++core) l1s_.emplace_back(time_.fetch.l1, l1_statistics_);
    }
    const std::uint32_t slot = slots_.take(warp.tile);
    slots_.release(slot);
    SectoredCache& l1 = l1s_[slots_.core_of(slot)];
    unsigned sectors = 0;
    for (unsigned i = 0; i < reads_.count; ++i) {
      LineAccess access;
      access.address = reads_.lines[i].address;
      access.sectors = reads_.lines[i].sectors;
      l1.look_up(access);
      sectors += static_cast<unsigned>(__builtin_popcount(access.sectors));
      ask(access.address, access.filled);
    }
    l1.accessed(reads_.count, sectors);
  }
  /// For sectors of a line, in as few accesses as their alignment allows.
  void ask(std::uint64_t line_address, std::uint32_t sectors) {
    while (sectors != 0) {
      const SectorRun run = take_sector_run(sectors, AttributeTraffic::line_bytes / AttributeTraffic::sector_bytes);
      memory_.access(traffic_.read(reads_.traffic, line_address, run));
    }
  }

  UntimedOut<VertexWarp> out_vertices_;
  UntimedOut<ShadedWarpItem> out_shaded_;
  std::unique_ptr<UntimedIn<WarpRelease>> in_release_;
  std::unique_ptr<UntimedIn<Warp>> in_warps_;
  std::unique_ptr<UntimedIn<VertexWarp>> in_vertices_;
  std::unique_ptr<SmBehaviour> behaviour_;
  const SmTime time_;
  const AttributeTraffic traffic_;
  UntimedMemoryPort memory_;
  EffectGate fetch_gate_;
  SectoredCacheStatistics l1_statistics_{*this, "l1"};
  std::vector<SectoredCache> l1s_;  ///< by core; none before the first warp
  AttributeTraffic::FragmentReads reads_;
  WarpSlots slots_{time_};  ///< all free: who needs no time holds none
  ShadedWarp shaded_;
  HandOver hand_over_;
  const ScreenTiling tiling_;
  std::vector<HandOver::Visit> visits_;  ///< the last, by screen tile; empty where no bin times out
};

[[maybe_unused]] const bool sm_untimed_registered = [] {
  register_untimed_unit_maker("sm", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                       const RenderContext& context, unsigned) {
    return std::make_unique<UntimedSm>(name, behaviour_as<SmBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
