#include <algorithm>
#include <utility>

#include "sm/active_cores.h"
#include "sm/fragment_programs.h"
#include "sm/hand_over.h"
#include "sm/sm_memory.h"
#include "sm/warp_slots.h"

#include <vrpipe/kernel/rate.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

namespace {

constexpr std::uint32_t nobody = ~0U;

/// Warps, by slot, and schedulers, numbered after them, wait in lists that are chained through one array, since each is
/// in one list at most.
struct Chain {
  std::uint32_t first = nobody;
  std::uint32_t last = nobody;
  bool empty() const { return first == nobody; }
  void push(std::uint32_t who, std::vector<std::uint32_t>& next) {
    (first == nobody ? first : next[last]) = who;
    last = who;
    next[who] = nobody;
  }
};

/// A warp scheduler. A segment's instructions issue back to back.
struct Scheduler {
  Chain ready;  ///< warps that can issue, in order
  Cycle free_at = 0;
  bool event_pending = false;
};

/// Who has an event in one of the next cycles, in buckets by cycle.
class Wheel {
 public:
  explicit Wheel(std::uint32_t horizon) {
    std::size_t size = 64;
    while (size <= horizon) size *= 2;
    mask_ = size - 1;
    buckets_.resize(size);
    occupied_.resize(size / 64);
  }
  void add(Cycle at, std::uint32_t who, std::vector<std::uint32_t>& next) {
    const std::size_t bucket = at & mask_;
    buckets_[bucket].push(who, next);
    occupied_[bucket / 64] |= std::uint64_t{1} << (bucket % 64);
  }
  /// The first of those with an event in this cycle, and so of the chain of them, which is taken out.
  std::uint32_t take(Cycle now) {
    const std::size_t bucket = now & mask_;
    occupied_[bucket / 64] &= ~(std::uint64_t{1} << (bucket % 64));
    return std::exchange(buckets_[bucket], Chain{}).first;
  }
  std::uint32_t first_at(Cycle cycle) const { return buckets_[cycle & mask_].first; }
  Cycle next_after(Cycle now) const {
    const std::size_t from = (now + 1) & mask_;
    std::size_t word = from / 64;
    const std::uint64_t ahead = occupied_[word] >> (from % 64);
    if (ahead != 0) return now + 1 + static_cast<unsigned>(__builtin_ctzll(ahead));
    Cycle cycle = now + 1 + 64 - from % 64;
    for (std::size_t words = occupied_.size(); words > 0; --words, cycle += 64) {
      word = word + 1 == occupied_.size() ? 0 : word + 1;
      if (occupied_[word] != 0) return cycle + static_cast<unsigned>(__builtin_ctzll(occupied_[word]));
    }
    return never;
  }

 private:
  std::size_t mask_ = 0;
  std::vector<Chain> buckets_;
  std::vector<std::uint64_t> occupied_;  ///< a bit a bucket
};

/// The SM array at cycle fidelity: warps issue on their scheduler segment by segment, oldest ready first, and hide one
/// another's latencies. A fragment warp keeps its slot until PROP releases it; vertex warps leave in order.
///
/// With its memory port connected, a vertex warp fetches its vertices when it is launched, begins when they are there,
/// and leaves when its attributes have been sent; a fragment warp is launched when its attributes have been looked up,
/// and waits for them behind its first segment.
/// Ports: in_vertices, out_vertices (VertexWarp), in_warps (Warp), out_shaded (ShadedWarpItem), in_release (WarpRelease),
/// memory (TLM-2.0 base protocol; optional).
class SmUnit : public Unit {
 public:
  SmUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<SmBehaviour> behaviour,
         const RenderContext& context)
      : Unit(name, domain, behaviour->time().kinds()),
        in_vertices_(*this, "in_vertices"),
        out_vertices_(*this, "out_vertices"),
        in_warps_(*this, "in_warps"),
        out_shaded_(*this, "out_shaded"),
        in_release_(*this, "in_release"),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()),
        cycles_per_instruction_(time_.cycles_per_instruction()),
        slots_(time_),
        memory_(*this, context, time_, l1_statistics_),
        fetch_gate_(context, "sm.attribute_fetch"),
        hand_over_(time_, context),
        vertex_{time_.vertex, time_.vertex.size()},
        fragment_(*context.frame, [&](FragmentShader shader, bool merges) { return program(shader, merges); }),
        wheel_(horizon()),
        schedulers_(time_.schedulers()) {
    in_vertices_.set_passes_to(out_vertices_, time_.vertex_warps);
    in_warps_.set_follows(out_vertices_);
    in_release_.set_answers();
    if (!EffectGate(context, "cache.details").is_active()) l1_statistics_.leave_out_details();
    fragment_slots_ = time_.fragment_slots();
    first_scheduler_ = fragment_slots_ + time_.vertex_warps;
    flights_.resize(first_scheduler_);
    next_.resize(first_scheduler_ + schedulers_.size());
    warps_.resize(fragment_slots_);
    vertices_.resize(time_.vertex_warps);
  }

  bool idle() const override {
    return in_vertices_.empty() && in_warps_.empty() && in_flight_ == 0 && vertex_count_ == 0 && completed_.empty();
  }
  Behaviour& behaviour() override { return *behaviour_; }
  tlm::tlm_initiator_socket<32>* memory_socket() override { return &memory_.socket(); }
  unsigned memory_bytes_per_cycle() const override { return time_.memory_bytes_per_cycle(); }
  bool memory_is_optional() const override { return true; }
  MemoryBytes memory_bytes() const override { return memory_.moved(); }
  void close_account(Cycle end) override {
    active_.close(end);
    Unit::close_account(end);
  }

 private:
  struct Program {
    std::vector<ShaderSegment> segments;
    std::size_t shading;  ///< of these; the others merge
  };
  /// A warp on its way through a program; what it shades is kept apart, being needed at the ends alone.
  struct Flight {
    const Program* program = nullptr;
    std::uint16_t segment = 0;
    std::uint16_t scheduler = 0;
    bool done = false;   ///< vertex warps only
    bool waits = false;  ///< fragment warps only: has issued its first segment and has no attributes
  };

  void before_end_of_elaboration() override {
    no_memory_ = stub_unbound(memory_.socket(), *clock.domain);
    fetches_ = no_memory_ == nullptr && fetch_gate_.is_active();
    lacks_fetch_ = no_memory_ == nullptr && !fetches_;
    if (!fetches_) return;
    memory_.connect();
    there_.resize(fragment_slots_);
    vertex_.segments.front().stall_cycles = 0;
    fragment_.for_each([](Program& program) { program.segments.front().stall_cycles = 0; });
  }
  Program program(FragmentShader shader, bool merges) const {
    Program program{time_.fragment_program(shader), 0};
    program.shading = program.segments.size();
    if (merges) program.segments.insert(program.segments.end(), time_.merge.begin(), time_.merge.end());
    return program;
  }

  std::uint32_t horizon() const {
    std::uint32_t longest = time_.fetch.l1_latency_cycles + 1;
    for (const auto* program : {&time_.vertex, &time_.fragment, &time_.mesh, &time_.alpha_threshold, &time_.merge}) {
      for (const ShaderSegment& segment : *program) {
        longest = std::max(longest, segment.instructions * cycles_per_instruction_ + segment.stall_cycles);
      }
    }
    return longest;
  }

  void issue(Scheduler& scheduler, Cycle now) {
    const std::uint32_t slot = scheduler.ready.first;
    scheduler.ready.first = next_[slot];
    Flight& flight = flights_[slot];
    const ShaderSegment& segment = flight.program->segments[flight.segment++];
    const Cycle busy = Cycle{segment.instructions} * cycles_per_instruction_;
    scheduler.free_at = now + busy;
    busy_until_ = std::max(busy_until_, scheduler.free_at);
    if (slot < fragment_slots_) frame_lasts(now + busy);  // its quads end after that
    if (segment.instructions > 0) did(kind_of_work(slot, flight), segment.instructions, now, now + busy);
    wheel_.add(std::max(now + busy + segment.stall_cycles, now + 1), slot, next_);
  }

  /// Of the segment that a flight has just issued.
  unsigned kind_of_work(std::uint32_t slot, const Flight& flight) const {
    if (slot >= fragment_slots_) return SmWork::vertex;
    return flight.segment > flight.program->shading ? SmWork::merge : SmWork::fragment;
  }

  void arm(std::uint32_t index, Cycle now) {
    Scheduler& scheduler = schedulers_[index];
    if (scheduler.ready.empty() || scheduler.event_pending) return;
    wheel_.add(std::max(scheduler.free_at, now + 1), first_scheduler_ + index, next_);
    scheduler.event_pending = true;
  }

  void make_ready(std::uint32_t slot, Cycle now) {
    const std::uint32_t index = flights_[slot].scheduler;
    Scheduler& scheduler = schedulers_[index];
    scheduler.ready.push(slot, next_);
    if (scheduler.free_at <= now && !scheduler.event_pending) issue(scheduler, now);
    arm(index, now);
  }

  void complete(std::uint32_t slot, Cycle now) {
    if (slot >= fragment_slots_) {
      const std::uint32_t turn = slot - fragment_slots_;
      if (lacks_fetch_) fetch_gate_.enter();
      behaviour_->shade_and_count(vertices_[turn]);
      if (!fetches_ || !memory_.write_attributes(turn, vertices_[turn])) finish_vertex_warp(turn);
      return;
    }
    --running_;
    ShadedWarp& shaded = pool_.take();
    behaviour_->shade(warps_[slot], shaded);
    if (const Warp& warp = warps_[slot]; shaded.count < warp.count)
      quads_last(now + 1, warp.count, [&](unsigned i) { return warp.quads[i].draw; });
    shaded.slot = static_cast<std::uint16_t>(slot);
    completed_.push(&shaded);
  }

  void run_events(Cycle now) {
    // Events are only ever added to later cycles.
    for (std::uint32_t who = wheel_.take(now), following = nobody; who != nobody; who = following) {
      following = next_[who];
      if (who >= first_scheduler_) {
        const std::uint32_t index = who - first_scheduler_;
        schedulers_[index].event_pending = false;
        issue(schedulers_[index], now);
        arm(index, now);
      } else if (!fetches_ || who >= fragment_slots_ || flights_[who].segment != 1 || has_attributes(who, now)) {
        go_on(who, now);
      }
    }
    // What was launched long ago is no longer in the host's first cache.
    const std::uint32_t soon = wheel_.first_at(now + 1);
    if (soon < fragment_slots_) {
      __builtin_prefetch(&warps_[soon]);
      __builtin_prefetch(&warps_[soon].quads[quads_per_warp - 1]);
    }
  }

  /// With what follows the segment that a warp has issued.
  void go_on(std::uint32_t slot, Cycle now) {
    if (flights_[slot].segment == flights_[slot].program->segments.size()) {
      complete(slot, now);
    } else {
      make_ready(slot, now);
    }
  }

  /// Whether a fragment warp that has issued its first segment can go on; if not, it will.
  bool has_attributes(std::uint32_t slot, Cycle now) {
    if (memory_.fills_awaited(slot) > 0) {
      flights_[slot].waits = true;
      ++waiting_;
      return false;
    }
    if (there_[slot] > now) wheel_.add(there_[slot], slot, next_);
    return there_[slot] <= now;
  }

  [[gnu::noinline]] void take_answers(Cycle now) {
    memory_.finish(
        now,
        [&](std::uint32_t turn) {
          --waiting_;
          make_ready(fragment_slots_ + turn, now);
        },
        [&](std::uint32_t slot) {
          if (!flights_[slot].waits) return;
          flights_[slot].waits = false;
          --waiting_;
          if (has_attributes(slot, now)) go_on(slot, now);
        });
  }

  void release_slots(Cycle now) {
    for (; in_release_.ready(); in_release_.pop()) {
      const std::uint32_t slot = in_release_.front().slot;
      if (slot == no_slot) continue;
      slots_.release(slot);
      --in_flight_;
      active_.released(slots_.core_of(slot), now);
    }
  }

  void send() {
    while (!completed_.empty() && out_shaded_.credits() > 0) {
      __builtin_prefetch(completed_.front());  // PROP reads it soon
      out_shaded_.push({completed_.front()});
      completed_.pop();
    }
    while (first_vertex_warp_done_ && out_vertices_.credits() > 0) send_vertex_warp();
  }

  // Vertex warps are few, so what they need is kept out of the way of the others.
  [[gnu::noinline]] void send_vertex_warp() {
    out_vertices_.push(vertices_[vertex_first_]);
    vertex_first_ = vertex_first_ + 1 == time_.vertex_warps ? 0 : vertex_first_ + 1;
    --vertex_count_;
    first_vertex_warp_done_ = vertex_count_ > 0 && flights_[fragment_slots_ + vertex_first_].done;
  }
  void finish_vertex_warp(std::uint32_t turn) {
    flights_[fragment_slots_ + turn].done = true;
    first_vertex_warp_done_ |= turn == vertex_first_;
  }

  [[gnu::noinline]] void pass_mark() {
    ShadedWarp& mark = pool_.take();
    mark.mark = in_warps_.front().mark;
    mark.sequence = in_warps_.front().sequence;
    mark.count = 0;
    mark.slot = no_slot;
    completed_.push(&mark);
    in_warps_.pop();
  }

  void launch_fragments(Cycle now) {
    slots_full_ = false;
    if (!in_warps_.ready()) return;
    const Warp& warp = in_warps_.front();
    if (warp.mark != Mark::none) return pass_mark();
    if (hand_over_.is_on() && !hand_over_.is_free(now)) return;
    if (!looks_up_) {
      slots_full_ = !slots_.any();
      if (slots_full_) return;
      slot_ = slots_.take(warp.tile);
    }
    const std::uint32_t slot = slot_;
    if (fetches_ && !look_up(slot, warp, now)) return;
    Flight& flight = flights_[slot];
    flight.program = &fragment_.of(warp);
    flight.segment = 0;
    flight.scheduler = static_cast<std::uint16_t>(slots_.scheduler_of(slot));
    warps_[slot] = warp;
    if (hand_over_.is_on()) pay_for_launch(warp, now);
    in_warps_.pop();
    ++in_flight_;
    ++running_;
    active_.launched(slots_.core_of(slot), now);
    make_ready(slot, now);
  }

  [[gnu::noinline]] void pay_for_launch(const Warp& warp, Cycle now) {
    hand_over_.take(warp, now, [this](unsigned kind, std::uint64_t thousandths, Cycle from, Cycle until) {
      did(kind, thousandths, from, until);
    });
  }

  /// Looks a warp's attributes up; false if that takes longer than this cycle.
  [[gnu::noinline]] bool look_up(std::uint32_t slot, const Warp& warp, Cycle now) {
    if (!looks_up_) memory_.begin_look_up(slot, slots_.core_of(slot), warp);
    looks_up_ = !memory_.look_up(now);
    there_[slot] = time_.fetch.has_l1() ? now + time_.fetch.l1_latency_cycles : now;
    return !looks_up_;
  }

  [[gnu::noinline]] void launch_vertex_warp(Cycle now) {
    std::uint32_t turn = vertex_first_ + vertex_count_++;
    if (turn >= time_.vertex_warps) turn -= time_.vertex_warps;
    const std::uint32_t slot = fragment_slots_ + turn;
    vertices_[turn] = in_vertices_.front();
    in_vertices_.pop();
    Flight& flight = flights_[slot];
    flight.done = false;
    if (vertices_[turn].mark != Mark::none) return finish_vertex_warp(turn);
    flight.program = &vertex_;
    flight.segment = 0;
    flight.scheduler = static_cast<std::uint16_t>(vertex_scheduler_++ % schedulers_.size());
    if (!fetches_) return make_ready(slot, now);
    memory_.fetch_vertices(turn, vertices_[turn]);
    ++waiting_;
  }

  Cycle tick(Cycle now) override {
    if (fetches_ && memory_.next_completion() <= now) take_answers(now);
    release_slots(now);
    run_events(now);
    launch_fragments(now);
    if (vertex_count_ < time_.vertex_warps && in_vertices_.ready()) launch_vertex_warp(now);
    if (fetches_) memory_.send([this](std::uint32_t turn) { finish_vertex_warp(turn); });
    send();

    const Cycle next_event = wheel_.next_after(now);
    // Full of shaded warps that nobody takes is back-pressure, even if a scheduler issues; full of running ones is work.
    const bool held_up = slots_full_ && 2 * (in_flight_ - running_) > in_flight_;
    if (!held_up && busy_until_ > now) {
      enter(UnitState::busy, now);
    } else if (held_up || slots_full_ || !completed_.empty()) {
      enter(UnitState::blocked, now);
    } else if (next_event != never || waiting_ > 0 || looks_up_ || (fetches_ && memory_.holds_writes())) {
      enter(UnitState::memory, now);
    } else {
      enter(UnitState::starved, now);
    }
    if (next_event == now + 1) return next_event;
    Cycle next = next_event;
    if (busy_until_ > now) next = std::min(next, busy_until_);
    if (fetches_) next = std::min(next, memory_.next_completion());
    // What could not be taken for want of a slot, a credit or an answer waits for the port that brings one.
    if (!slots_full_ && !(looks_up_ && in_warps_.ready())) {
      next = std::min(next, std::max(in_warps_.next_ready(), hand_over_.free_from(now + 1)));
    }
    if (vertex_count_ < time_.vertex_warps) next = std::min(next, std::max(in_vertices_.next_ready(), now + 1));
    return std::min(next, in_release_.next_ready());
  }

  StreamIn<VertexWarp> in_vertices_;
  StreamOut<VertexWarp> out_vertices_;
  StreamIn<Warp> in_warps_;
  StreamOut<ShadedWarpItem> out_shaded_;
  StreamIn<WarpRelease> in_release_;
  std::unique_ptr<SmBehaviour> behaviour_;
  const SmTime time_;
  const std::uint32_t cycles_per_instruction_;
  WarpSlots slots_;
  SectoredCacheStatistics l1_statistics_{*this, "l1"};
  ActiveCores active_{*this, time_.cores};
  SmMemory memory_;
  std::unique_ptr<FixedLatencyMemory> no_memory_;
  bool fetches_ = false;      ///< the memory port is connected
  bool lacks_fetch_ = false;  ///< it is, and its traffic was left out
  EffectGate fetch_gate_;
  HandOver hand_over_;
  // The programs, in whose first segments nothing stands for memory where that is connected.
  Program vertex_;
  FragmentPrograms<Program> fragment_;
  Wheel wheel_;
  std::vector<Scheduler> schedulers_;
  std::uint32_t fragment_slots_ = 0;
  std::uint32_t first_scheduler_ = 0;  ///< in a chain
  std::vector<Flight> flights_;        ///< fragment slots, core by core, then vertex slots
  std::vector<Cycle> there_;           ///< by fragment slot: before it no attributes are there
  std::vector<std::uint32_t> next_;    ///< in a chain, of slots and then of schedulers
  std::vector<Warp> warps_;            ///< of fragment slots
  std::vector<VertexWarp> vertices_;   ///< of vertex slots
  std::uint32_t vertex_first_ = 0;     ///< of the vertex warps in flight, in order
  std::uint32_t vertex_count_ = 0;
  bool first_vertex_warp_done_ = false;
  Ring<const ShadedWarp*> completed_;
  ShadedWarpPool pool_;
  std::uint32_t slot_ = 0;
  std::uint64_t vertex_scheduler_ = 0;
  std::uint32_t in_flight_ = 0;  ///< fragment warps, up to their release
  std::uint32_t running_ = 0;    ///< of these, not shaded yet
  std::uint32_t waiting_ = 0;    ///< warps that can do nothing before memory answers
  bool looks_up_ = false;        ///< the warp at the link, for which `slot_` is taken
  bool slots_full_ = false;
  Cycle busy_until_ = 0;
};

[[maybe_unused]] const bool sm_unit_registered = [] {
  register_unit_maker("sm", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                               const RenderContext& context, unsigned) {
    return std::make_unique<SmUnit>(name.c_str(), domain, behaviour_as<SmBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
