#include <algorithm>
#include <deque>

#include <vrpipe/unit.h>

namespace vrpipe {

namespace {

constexpr std::uint16_t no_slot = 0xffff;

constexpr std::uint32_t no_flight = ~0U;

/// Warps on one warp scheduler: those that can issue wait in order, chained through their flights; a segment's
/// instructions issue back to back.
struct Scheduler {
  std::uint32_t first_ready = no_flight;
  std::uint32_t last_ready = no_flight;
  Cycle free_at = 0;
  bool event_pending = false;
};

/// Events of the next cycles, in buckets by cycle.
class Wheel {
 public:
  explicit Wheel(std::uint32_t horizon) {
    std::size_t size = 1;
    while (size <= horizon) size *= 2;
    buckets_.resize(size);
  }
  void add(Cycle at, std::uint32_t event) {
    buckets_[at & (buckets_.size() - 1)].push_back(event);
    ++count_;
  }
  std::vector<std::uint32_t>& at(Cycle now) { return buckets_[now & (buckets_.size() - 1)]; }
  void clear(Cycle now) {
    count_ -= at(now).size();
    at(now).clear();
  }
  Cycle next_after(Cycle now) const {
    if (count_ == 0) return never;
    Cycle cycle = now + 1;
    while (buckets_[cycle & (buckets_.size() - 1)].empty()) ++cycle;
    return cycle;
  }

 private:
  std::vector<std::vector<std::uint32_t>> buckets_;
  std::size_t count_ = 0;
};

/// The SM array at cycle fidelity: warps issue on their scheduler segment by segment, oldest ready first, and hide one
/// another's latencies. A fragment warp keeps its slot until PROP releases it; vertex warps leave in order.
/// Ports: in_vertices, out_vertices (VertexWarp), in_warps (Warp), out_shaded (ShadedWarpItem), in_release (WarpRelease).
class SmUnit : public Unit {
 public:
  SmUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<SmBehaviour> behaviour)
      : Unit(name, domain),
        in_vertices_(*this, "in_vertices"),
        out_vertices_(*this, "out_vertices"),
        in_warps_(*this, "in_warps"),
        out_shaded_(*this, "out_shaded"),
        in_release_(*this, "in_release"),
        behaviour_(std::move(behaviour)),
        cost_(behaviour_->cost()),
        cycles_per_instruction_(32 / cost_.lanes_per_scheduler),
        wheel_(horizon()),
        schedulers_(std::size_t{cost_.cores} * cost_.schedulers_per_core) {
    fragment_slots_ = cost_.cores * cost_.warps_per_core;
    free_slots_ = fragment_slots_;
    flights_.resize(fragment_slots_ + cost_.vertex_warps);
    free_of_core_.resize(cost_.cores);
    for (std::uint32_t core = 0; core < cost_.cores; ++core) {
      for (std::uint32_t slot = cost_.warps_per_core; slot-- > 0;) {
        free_of_core_[core].push_back(core * cost_.warps_per_core + slot);
      }
    }
    merged_ = cost_.fragment;
    merged_.insert(merged_.end(), cost_.merge.begin(), cost_.merge.end());
  }

  bool idle() const override {
    return in_vertices_.empty() && in_warps_.empty() && in_flight_ == 0 && vertex_order_.empty() && completed_.empty();
  }
  std::uint64_t work() const override { return instructions_; }
  double peak_rate() const override {
    return static_cast<double>(schedulers_.size()) / static_cast<double>(cycles_per_instruction_);
  }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  struct Flight {
    const std::vector<ShaderSegment>* program = nullptr;
    std::uint32_t segment = 0;
    std::uint32_t scheduler = 0;
    std::uint32_t next_ready = no_flight;  ///< behind this one on its scheduler
    bool done = false;                     ///< vertex warps only
    Warp warp;
    VertexWarp vertices;
  };
  static constexpr std::uint32_t scheduler_event = 0x80000000U;

  std::uint32_t horizon() const {
    std::uint32_t longest = 1;
    for (const auto* program : {&cost_.vertex, &cost_.fragment, &cost_.merge}) {
      for (const ShaderSegment& segment : *program) {
        longest = std::max(longest, segment.instructions * cycles_per_instruction_ + segment.stall_cycles);
      }
    }
    return longest;
  }

  void issue(Scheduler& scheduler, Cycle now) {
    const std::uint32_t slot = scheduler.first_ready;
    Flight& flight = flights_[slot];
    scheduler.first_ready = flight.next_ready;
    const ShaderSegment& segment = (*flight.program)[flight.segment++];
    const Cycle busy = Cycle{segment.instructions} * cycles_per_instruction_;
    scheduler.free_at = now + busy;
    busy_until_ = std::max(busy_until_, scheduler.free_at);
    instructions_ += segment.instructions;
    wheel_.add(std::max(now + busy + segment.stall_cycles, now + 1), slot);
  }

  void arm(std::uint32_t index, Cycle now) {
    Scheduler& scheduler = schedulers_[index];
    if (scheduler.first_ready == no_flight || scheduler.event_pending) return;
    wheel_.add(std::max(scheduler.free_at, now + 1), scheduler_event | index);
    scheduler.event_pending = true;
  }

  void make_ready(std::uint32_t slot, Cycle now) {
    const std::uint32_t index = flights_[slot].scheduler;
    Scheduler& scheduler = schedulers_[index];
    (scheduler.first_ready == no_flight ? scheduler.first_ready : flights_[scheduler.last_ready].next_ready) = slot;
    scheduler.last_ready = slot;
    flights_[slot].next_ready = no_flight;
    if (scheduler.free_at <= now && !scheduler.event_pending) issue(scheduler, now);
    arm(index, now);
  }

  ShadedWarp* take_from_pool() {
    // Round robin: the entry after the last one is the likeliest to be free. A few that are held for long are not worth
    // a search.
    for (std::size_t tried = 0; tried < std::min<std::size_t>(pool_.size(), 8); ++tried) {
      pool_at_ = pool_at_ + 1 == pool_.size() ? 0 : pool_at_ + 1;
      if (pool_[pool_at_].holders == 0) return &pool_[pool_at_];
    }
    pool_.emplace_back();
    pool_at_ = pool_.size() - 1;
    return &pool_.back();
  }

  void complete(std::uint32_t slot) {
    Flight& flight = flights_[slot];
    if (slot >= fragment_slots_) {
      behaviour_->shade_vertices(flight.vertices);
      flight.done = true;
      return;
    }
    --running_;
    ShadedWarp* const shaded = take_from_pool();
    behaviour_->shade(flight.warp, *shaded);
    shaded->slot = static_cast<std::uint16_t>(slot);
    shaded->holders = 1;
    completed_.push_back(shaded);
  }

  void run_events(Cycle now) {
    std::vector<std::uint32_t>& events = wheel_.at(now);
    // Events are only ever added to later cycles, so the bucket does not change under the loop.
    for (const std::uint32_t event : events) {
      if ((event & scheduler_event) != 0) {
        const std::uint32_t index = event & ~scheduler_event;
        schedulers_[index].event_pending = false;
        issue(schedulers_[index], now);
        arm(index, now);
      } else if (flights_[event].segment == flights_[event].program->size()) {
        complete(event);
      } else {
        make_ready(event, now);
      }
    }
    wheel_.clear(now);
  }

  void release_slots() {
    for (; in_release_.ready(); in_release_.pop()) {
      const std::uint32_t slot = in_release_.front().slot;
      if (slot == no_slot) continue;
      free_of_core_[slot / cost_.warps_per_core].push_back(slot);
      ++free_slots_;
      --in_flight_;
    }
  }

  void send() {
    while (!completed_.empty() && out_shaded_.credits() > 0) {
      out_shaded_.push({completed_.front()});
      completed_.pop_front();
    }
    while (!vertex_order_.empty() && flights_[vertex_order_.front()].done && out_vertices_.credits() > 0) {
      out_vertices_.push(flights_[vertex_order_.front()].vertices);
      vertex_order_.pop_front();
    }
  }

  bool choose_core(TileId tile) {
    if (tile == last_tile_ && sent_to_core_ < cost_.warps_to_one_core && !free_of_core_[core_].empty()) return true;
    if (free_slots_ == 0) return false;
    do {
      core_ = core_ + 1 == cost_.cores ? 0 : core_ + 1;
    } while (free_of_core_[core_].empty());
    sent_to_core_ = 0;
    return true;
  }

  void launch_fragments(Cycle now) {
    slots_full_ = false;
    if (!in_warps_.ready()) return;
    const Warp& warp = in_warps_.front();
    if (warp.end_of_draw) {
      ShadedWarp* const end = take_from_pool();
      end->end_of_draw = true;
      end->sequence = warp.sequence;
      end->count = 0;
      end->slot = no_slot;
      end->holders = 1;
      completed_.push_back(end);
      in_warps_.pop();
      return;
    }
    if (!choose_core(warp.tile)) {
      slots_full_ = true;
      return;
    }
    last_tile_ = warp.tile;
    ++sent_to_core_;
    const std::uint32_t slot = free_of_core_[core_].back();
    free_of_core_[core_].pop_back();
    --free_slots_;
    Flight& flight = flights_[slot];
    flight.program = warp.merge_pairs != 0 ? &merged_ : &cost_.fragment;
    flight.segment = 0;
    flight.scheduler = core_ * cost_.schedulers_per_core + turn_of_scheduler_++ % cost_.schedulers_per_core;
    flight.warp = warp;
    in_warps_.pop();
    ++in_flight_;
    ++running_;
    make_ready(slot, now);
  }

  void launch_vertices(Cycle now) {
    if (!in_vertices_.ready() || vertex_order_.size() == cost_.vertex_warps) return;
    const std::uint32_t slot = fragment_slots_ + vertex_turn_;
    vertex_turn_ = vertex_turn_ + 1 == cost_.vertex_warps ? 0 : vertex_turn_ + 1;
    Flight& flight = flights_[slot];
    flight.vertices = in_vertices_.front();
    flight.done = flight.vertices.end_of_draw;
    in_vertices_.pop();
    vertex_order_.push_back(slot);
    if (flight.done) return;
    flight.program = &cost_.vertex;
    flight.segment = 0;
    flight.scheduler = static_cast<std::uint32_t>(vertex_scheduler_++ % schedulers_.size());
    make_ready(slot, now);
  }

  Cycle tick(Cycle now) override {
    release_slots();
    run_events(now);
    launch_fragments(now);
    launch_vertices(now);
    send();

    const Cycle next_event = wheel_.next_after(now);
    // Full of shaded warps that nobody takes is back-pressure, even if a scheduler issues; full of running ones is work.
    const bool held_up = slots_full_ && 2 * (in_flight_ - running_) > in_flight_;
    if (!held_up && busy_until_ > now) {
      enter(UnitState::busy, now);
    } else if (held_up || slots_full_ || !completed_.empty()) {
      enter(UnitState::blocked, now);
    } else if (next_event != never) {
      enter(UnitState::memory, now);
    } else {
      enter(UnitState::starved, now);
    }
    Cycle next = next_event;
    if (busy_until_ > now) next = std::min(next, busy_until_);
    // What could not be taken for want of a slot or a credit waits for the port that brings one.
    if (!slots_full_) next = std::min(next, std::max(in_warps_.next_ready(), now + 1));
    if (vertex_order_.size() < cost_.vertex_warps) next = std::min(next, std::max(in_vertices_.next_ready(), now + 1));
    return std::min({next, in_release_.next_ready(), out_shaded_.retry(), out_vertices_.retry()});
  }

  StreamIn<VertexWarp> in_vertices_;
  StreamOut<VertexWarp> out_vertices_;
  StreamIn<Warp> in_warps_;
  StreamOut<ShadedWarpItem> out_shaded_;
  StreamIn<WarpRelease> in_release_;
  std::unique_ptr<SmBehaviour> behaviour_;
  const SmBehaviour::Cost cost_;
  std::vector<ShaderSegment> merged_;  ///< the fragment program with the merge extension
  const std::uint32_t cycles_per_instruction_;
  Wheel wheel_;
  std::vector<Scheduler> schedulers_;
  std::uint32_t fragment_slots_ = 0;
  std::vector<Flight> flights_;  ///< fragment slots, core by core, then vertex slots
  std::vector<std::vector<std::uint32_t>> free_of_core_;
  std::uint32_t free_slots_ = 0;  ///< of all cores
  std::deque<std::uint32_t> vertex_order_;
  std::deque<const ShadedWarp*> completed_;
  std::deque<ShadedWarp> pool_;
  std::size_t pool_at_ = 0;
  TileId last_tile_;
  std::uint32_t core_ = 0;
  std::uint32_t sent_to_core_ = 0;
  std::uint32_t turn_of_scheduler_ = 0;
  std::uint64_t vertex_scheduler_ = 0;
  std::uint32_t vertex_turn_ = 0;
  std::uint32_t in_flight_ = 0;  ///< fragment warps, up to their release
  std::uint32_t running_ = 0;    ///< of these, not shaded yet
  bool slots_full_ = false;
  Cycle busy_until_ = 0;
  std::uint64_t instructions_ = 0;
};

[[maybe_unused]] const bool registered = [] {
  register_unit_maker("sm", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                               const RenderState&, unsigned) {
    return std::make_unique<SmUnit>(name.c_str(), domain, behaviour_as<SmBehaviour>(std::move(behaviour)));
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
