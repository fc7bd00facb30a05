#include <algorithm>

#include "sm/active_cores.h"
#include "sm/fragment_programs.h"
#include "sm/hand_over.h"
#include "sm/timed_scheduler.h"
#include "sm/timed_sm_memory.h"
#include "sm/warp_slots.h"

#include <vrpipe/kernel/rate.h>
#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/slots/sm.h>

namespace vrpipe {

namespace {

/// The SM array at lt. Ports as in sm_unit.cpp. Fragment warps issue segment by segment, first come, first served,
/// and go to PROP as they are done. An array with room to spare has a scheduler for all of a warp's instructions at once
/// and waits for all its latencies after that, in launch order: nothing waits for what that makes late.
/// Calls nest, and what a vertex warp leads to runs far ahead of the next one: so it is handed on when it can go, or its slot
/// is needed, and no earlier; those behind it are shaded, and write, as the fragment warps come to their time.
/// With the memory port connected a warp fetches what it reads when it is launched, as in sm_unit.cpp.
class TimedSm : public TimedUnit {
 public:
  TimedSm(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<SmBehaviour> behaviour,
          const RenderContext& context)
      : TimedUnit(name, domain, behaviour->time().kinds()),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()),
        cycles_per_instruction_(time_.cycles_per_instruction()),
        roomy_(is_roomy(time_, *context.frame, no_program, 4)),
        has_room_for_pairs_(is_roomy(time_, *context.frame, time_.merge, most_with_pairs)),
        memory_(*this, context, time_, l1_statistics_),
        fetch_gate_(context, "sm.attribute_fetch"),
        vertex_(program(time_.vertex, {}, true).front()),
        fragment_(*context.frame,
                  [&](FragmentShader shader, bool merges) {
                    return program(time_.fragment_program(shader), merges ? time_.merge : no_program, false);
                  }),
        fragment_as_one_(*context.frame,
                         [&](FragmentShader shader, bool merges) {
                           return program(time_.fragment_program(shader), merges ? time_.merge : no_program, true);
                         }),
        out_vertices_(*this, "out_vertices"),
        out_shaded_(*this, "out_shaded"),
        in_release_(*this, "in_release",
                    [this](const WarpRelease& release, CycleInterval visible) { return free(release, visible.first); }),
        in_warps_(*this, "in_warps",
                  [this](const Warp& warp, CycleInterval visible) { return launch(warp, visible.first); }),
        in_vertices_(*this, "in_vertices",
                     [this](const VertexWarp& warp, CycleInterval visible) {
                       return launch_vertices(warp, visible.first);
                     }),
        hand_over_(time_, context),
        schedulers_(time_.schedulers()),
        slots_(time_),
        vertex_slots_(time_.vertex_warps),
        barriers_(context),
        vertices_wait_(context.placement.gpcs == 1) {
    fragment_.for_each([&](const Program& each) { waiting_.resize(std::max(waiting_.size(), each.size())); });
    if (!EffectGate(context, "cache.details").is_active()) l1_statistics_.leave_out_details();
    in_release_.set_comes_ahead();
    in_warps_.set_comes_ahead();
  }

  bool idle() const override { return next_event() == never && vertices_.empty(); }
  Behaviour& behaviour() override { return *behaviour_; }
  tlm::tlm_initiator_socket<32>* memory_socket() override { return &memory_.socket(); }
  unsigned memory_bytes_per_cycle() const override { return time_.memory_bytes_per_cycle(); }
  bool memory_is_optional() const override { return true; }
  MemoryBytes memory_bytes() const override { return memory_.moved(); }
  void close_account(Cycle end) override {
    for (; !releases_.empty(); releases_.pop())
      active_.released(slots_.core_of(releases_.front().slot), std::min(end, releases_.front().at));
    active_.close(end);
    TimedUnit::close_account(end);
  }

 private:
  void before_end_of_elaboration() override {
    no_memory_ = stub_unbound(memory_.socket(), *clock.domain);
    fetches_ = no_memory_ == nullptr && fetch_gate_.is_active();
    lacks_fetch_ = no_memory_ == nullptr && !fetches_;
    if (!fetches_) return;
    memory_.connect();
    // What memory says stands for the first stall.
    vertex_.stall_cycles -= time_.vertex.front().stall_cycles;
    for (FragmentPrograms<Program>* const programs : {&fragment_, &fragment_as_one_})
      programs->for_each([](Program& each) { each.front().stall_cycles -= each.front().fetch.stall_cycles; });
  }

  struct Segment {
    std::uint32_t instructions = 0;
    std::uint32_t merge_instructions = 0;  ///< after these
    std::uint32_t stall_cycles = 0;
    ShaderSegment fetch{0, 0};  ///< of a program's first: what fetches, and stands still for that
    std::uint32_t all() const { return instructions + merge_instructions; }
  };
  using Program = std::vector<Segment>;
  inline static const std::vector<ShaderSegment> no_program;

  /// A shader and what is appended to it, perhaps as a single segment.
  static Program program(const std::vector<ShaderSegment>& shader, const std::vector<ShaderSegment>& merge,
                         bool as_one) {
    Program program;
    for (const ShaderSegment& each : shader) program.push_back({each.instructions, 0, each.stall_cycles, {0, 0}});
    for (const ShaderSegment& each : merge) program.push_back({0, each.instructions, each.stall_cycles, {0, 0}});
    program.front().fetch = shader.front();
    if (!as_one) return program;
    Segment sum;
    sum.fetch = shader.front();
    for (const Segment& each : program) {
      sum.instructions += each.instructions;
      sum.merge_instructions += each.merge_instructions;
      sum.stall_cycles += each.stall_cycles;
    }
    return {sum};
  }

  /// Of warps with pairs in four cycles: their quads take longer before an SM array and behind it. In all frames that were tried 2.3
  /// are launched at most.
  static constexpr Cycle most_with_pairs = 3;
  /// Whether so many warps can be launched in four cycles after whose shader the instructions of `merge` come, beside all vertex
  /// warps, which are no longer, and consecutive ones find schedulers that differ.
  static bool is_roomy(const SmTime& time, const Frame& frame, const std::vector<ShaderSegment>& merge,
                       Cycle launches) {
    return has_room_for(FragmentShader::splat, time, merge, launches) &&
           std::all_of(frame.draws().begin(), frame.draws().end(),
                       [&](const DrawCall& call) { return has_room_for(call.state.shader, time, merge, launches); });
  }
  static bool has_room_for(FragmentShader shader, const SmTime& time, const std::vector<ShaderSegment>& merge,
                           Cycle launches) {
    const Cycle cycles_per_instruction = time.cycles_per_instruction();
    const Segment fragment = program(time.fragment_program(shader), merge, true).front();
    const Segment merged = program(time.fragment_program(shader), time.merge, true).front();
    const Segment vertex = program(time.vertex, {}, true).front();
    const Cycle vertex_issue = vertex.all() * cycles_per_instruction;
    const Cycle fragment_issue = fragment.all() * cycles_per_instruction;
    const Cycle of_vertices = time.vertex_warps * vertex_issue / (vertex_issue + vertex.stall_cycles);
    return vertex_issue <= fragment_issue && 4 * time.schedulers() >= launches * (fragment_issue + of_vertices) &&
           time.fragment_slots() >= 2 * (merged.all() * cycles_per_instruction + merged.stall_cycles) &&
           time.warps_to_one_core >= time.schedulers_per_core && 2 * time.warps_to_one_core <= time.warps_per_core;
  }

  bool has_slot() const { return has_slot_before(never); }
  bool has_slot_before(Cycle cycle) const {
    return slots_.any() || (!releases_.empty() && releases_.front().at <= cycle);
  }

  /// Until the first slot is released, by what is done before it, too.
  [[gnu::noinline]] void wait_for_slot(Cycle launch) {
    for (Cycle next = next_event(); !has_slot_before(next); next = next_event()) {
      in_release_.ask(next);
      if (has_slot_before(next) || next == never) break;
      hand_on_until(next);
    }
    // What PROP has sent to be tested late may be in a unit at cycle.
    clock.domain->wait_until([this] { return has_slot(); });
    if (!has_slot()) {
      throw SimulationFault("deadlock", launch, std::string(name()) + " has warps to launch, and no slot is released");
    }
  }

  /// The first cycle, from `at` on, in which a slot is free; those released till then are.
  Cycle release_until(Cycle at) {
    if (!slots_.any()) at = std::max(at, releases_.front().at);
    for (; !releases_.empty() && releases_.front().at <= at; releases_.pop()) {
      slots_.release(releases_.front().slot);
      active_.released(slots_.core_of(releases_.front().slot), releases_.front().at);
    }
    return at;
  }

  Cycle launch(const Warp& warp, Cycle visible) {
    Cycle launch = std::max(visible, next_launch_);
    if (warp.mark != Mark::none) {
      issue_until(never);
      done_.push_in_order({std::max(launch, last_done_), take_flight(warp)}, &Event::at);
      hand_on_until(never);
      return launch;
    }
    charge(UnitState::memory, std::min(launch, last_done_));
    charge(UnitState::starved, launch);
    if (warp.merge_pairs != 0 && !has_room_for_pairs_) roomy_ = false;
    if (!roomy_) {
      hand_on_until(launch);
      in_release_.ask(launch);
    }
    if (!has_slot_before(next_event())) wait_for_slot(launch);
    launch = release_until(hand_over_.is_on() ? hand_over_.free_from(launch) : launch);
    const std::uint32_t slot = slots_.take(warp.tile);
    const std::uint32_t core = slots_.core_of(slot);
    active_.launched(core, launch);
    charge(UnitState::blocked, launch);
    while (next_vertex_event() <= launch) do_vertex_event();
    Cycle there = 0;
    if (fetches_) {
      const TimedSmMemory::Fetch fetch = memory_.fetch_attributes(warp, core, launch);
      charge(UnitState::memory, fetch.looked_up);
      launch = fetch.looked_up;
      there = fetch.there;
    }
    next_launch_ = launch + 1;
    if (hand_over_.is_on()) {
      hand_over_.take(warp, launch, [this](unsigned kind, std::uint64_t thousandths, Cycle from, Cycle until) {
        did(kind, thousandths, from, until);
      });
    }

    if (roomy_) {
      const Cycle done = issue(fragment_as_one_.of(warp).front(), slots_.scheduler_of(slot), launch, there);
      last_done_ = std::max(last_done_, done);
      shade(warp, slot, done);
      return launch;
    }
    issue_until(launch);
    const std::uint32_t flight = take_flight(warp);
    flights_[flight].program = &fragment_.of(warp);
    flights_[flight].slot = slot;
    flights_[flight].there = there;
    issue({launch, flight}, 0);
    return launch;
  }

  /// A fragment warp from its launch to when it is shaded.
  struct Flight {
    Warp warp;
    const Program* program = nullptr;
    std::uint32_t slot = 0;
    Cycle there = 0;  ///< its attributes
  };
  std::uint32_t take_flight(const Warp& warp) {
    if (free_flights_.empty()) {
      free_flights_.push_back(static_cast<std::uint32_t>(flights_.size()));
      flights_.emplace_back();
    }
    const std::uint32_t index = free_flights_.back();
    free_flights_.pop_back();
    flights_[index].warp = warp;
    return index;
  }

  struct Event {
    Cycle at = 0;
    std::uint32_t flight = 0;
  };

  /// Issues a segment on a scheduler; returns when the next can issue. If it is the first, `there` is when its attributes
  /// are, for which what comes behind the fetching instructions waits.
  Cycle issue(const Segment& segment, std::size_t scheduler, Cycle from, Cycle there = 0) {
    const Cycle cycles = segment.all() * cycles_per_instruction_;
    TimedScheduler& issues = schedulers_[scheduler];
    const Cycle begin =
        roomy_ ? issues.append(from, cycles) : issues.put(from, cycles, std::min(from, next_vertex_launch_));
    const Cycle merge = begin + segment.instructions * cycles_per_instruction_;
    const Cycle end = begin + cycles;
    frame_lasts(end);  // the warp's quads end after that
    if (segment.instructions > 0) did(SmWork::fragment, segment.instructions, begin, merge);
    if (segment.merge_instructions > 0) did(SmWork::merge, segment.merge_instructions, merge, end);
    charge(UnitState::busy, end);
    const Cycle fetched = begin + segment.fetch.instructions * cycles_per_instruction_;
    return end + segment.stall_cycles + (std::max(fetched, there) - fetched);
  }
  /// The same for a warp that waits; those that waited for its scheduler before it have issued.
  void issue(const Event& warp, std::size_t segment) {
    const Flight& flight = flights_[warp.flight];
    const Cycle next =
        issue((*flight.program)[segment], slots_.scheduler_of(flight.slot), warp.at, segment == 0 ? flight.there : 0);
    if (++segment < flight.program->size()) {
      waiting_[segment].push_in_order({next, warp.flight}, &Event::at);
      next_issue_ = std::min(next_issue_, next);
    } else {
      done_.push_in_order({next, warp.flight}, &Event::at);
      last_done_ = std::max(last_done_, next);
    }
  }

  /// Issues what waits from cycles up to this one, in the order of waiting.
  void issue_until(Cycle until) {
    while (next_issue_ <= until && next_issue_ != never) {
      std::size_t segment = 1;
      while (waiting_[segment].empty() || waiting_[segment].front().at != next_issue_) ++segment;
      const Event warp = waiting_[segment].front();
      waiting_[segment].pop();
      next_issue_ = never;
      for (std::size_t i = 1; i < waiting_.size(); ++i) {
        if (!waiting_[i].empty()) next_issue_ = std::min(next_issue_, waiting_[i].front().at);
      }
      issue(warp, segment);
    }
  }

  /// The cycle in which the next warp waits for its scheduler or is done.
  Cycle next_event() const { return done_.empty() ? next_issue_ : std::min(next_issue_, done_.front().at); }

  /// Sends the warps that are done up to a cycle.
  void hand_on_until(Cycle until) {
    issue_until(until);
    for (; !done_.empty() && done_.front().at <= until; done_.pop()) {
      const Flight& flight = flights_[done_.front().flight];
      shade(flight.warp, flight.slot, done_.front().at);
      free_flights_.push_back(done_.front().flight);
    }
  }

  [[gnu::always_inline]] void shade(const Warp& warp, std::uint32_t slot, Cycle done) {
    ShadedWarp& shaded = pool_.take();
    if (warp.mark != Mark::none) {
      shaded.mark = warp.mark;
      shaded.sequence = warp.sequence;
      shaded.count = 0;
      shaded.slot = no_slot;
    } else {
      behaviour_->shade(warp, shaded);
      if (shaded.count < warp.count) quads_last(done + 1, warp.count, [&](unsigned i) { return warp.quads[i].draw; });
      shaded.slot = static_cast<std::uint16_t>(slot);
    }
    out_shaded_.send({&shaded}, done);
  }

  Cycle launch_vertices(const VertexWarp& warp, Cycle visible) {
    const Cycle now = clock.domain->now();
    while (next_vertex_event() <= now) do_vertex_event();
    if (vertices_.size() == time_.vertex_warps) hand_on_vertices();
    // Those that have not been handed on keep theirs.
    const auto places = static_cast<unsigned>(vertices_.size() + 1);
    const Cycle launch = vertex_slots_.free_from(std::max(visible, next_vertex_launch_), places);
    next_vertex_launch_ = warp.mark == Mark::end_of_frame ? never : launch + 1;
    vertices_.push({warp, launch, 0});
    while (!vertices_.empty() && (barriers_.is_barrier(warp.mark) || !vertices_wait_)) hand_on_vertices();
    if (vertices_.size() == 1) clock.domain->wake(clock.unit, std::max(launch, now + 1));
    return launch;
  }
  /// Hands vertex warps on when they can go.
  Cycle tick(Cycle now) override {
    while (!vertices_.empty()) {
      const Cycle due = std::max(vertices_.front().at, written_ > 0 ? out_vertices_.room_from() : 0);
      if (due > now) return due;
      if (written_ > 0) {
        hand_on_vertices();
      } else if (shaded_ > 0) {
        write_first_vertices();
      } else {
        do_vertex_event();
      }
    }
    return never;
  }

  /// A vertex warp from its launch until it is handed on.
  struct VertexFlight {
    VertexWarp warp;
    Cycle at = 0;         ///< it is launched, then shaded, then written
    unsigned unsent = 0;  ///< of its writes
  };
  /// The cycle in which one is shaded, or writes.
  Cycle next_vertex_event() const {
    const Cycle launch = shaded_ < vertices_.size() ? vertices_[shaded_].at : never;
    return fetches_ ? std::min(launch, memory_.next_write()) : launch;
  }
  [[gnu::noinline]] void do_vertex_event() {
    if (shaded_ < vertices_.size() && vertices_[shaded_].at <= next_vertex_event()) {
      shade_vertices(vertices_[shaded_++]);
    } else {
      VertexFlight& flight = vertices_[written_];
      flight.at = memory_.send_write();
      --flight.unsent;
    }
    while (written_ < shaded_ && vertices_[written_].unsent == 0) ++written_;
  }
  void shade_vertices(VertexFlight& flight) {
    if (flight.warp.mark != Mark::none) return;
    TimedScheduler& scheduler = schedulers_[vertex_scheduler_++ % schedulers_.size()];
    const Cycle cycles = vertex_.instructions * cycles_per_instruction_;
    const Cycle ready = fetches_ ? memory_.fetch_vertices(flight.warp, flight.at) : flight.at;
    const Cycle begin = roomy_ ? ready : scheduler.put_late(ready, cycles);
    did(SmWork::vertex, vertex_.instructions, begin, begin + cycles);
    flight.at = begin + cycles + vertex_.stall_cycles;
    if (lacks_fetch_) fetch_gate_.enter();
    behaviour_->shade_and_count(flight.warp);
    if (fetches_) flight.unsent = memory_.write_attributes(flight.warp, flight.at);
  }

  /// Until those of the first have been sent.
  void write_first_vertices() {
    while (written_ == 0) do_vertex_event();
  }
  void hand_on_vertices() {
    write_first_vertices();
    const VertexFlight flight = vertices_.front();
    vertices_.pop();
    --shaded_;
    --written_;
    vertices_done_ = std::max(vertices_done_, flight.at);
    vertex_slots_.take(1, out_vertices_.send(flight.warp, vertices_done_).first + 1);
  }

  Cycle free(const WarpRelease& release, Cycle visible) {
    if (release.slot != no_slot) releases_.push_in_order({visible, release.slot}, &Release::at);
    return visible;
  }

  std::unique_ptr<SmBehaviour> behaviour_;
  const SmTime time_;
  const Cycle cycles_per_instruction_;
  bool roomy_;  ///< until warps come for which it is not
  const bool has_room_for_pairs_;
  SectoredCacheStatistics l1_statistics_{*this, "l1"};
  ActiveCores active_{*this, time_.cores};
  TimedSmMemory memory_;
  std::unique_ptr<FixedLatencyMemory> no_memory_;
  bool fetches_ = false;      ///< the memory port is connected
  bool lacks_fetch_ = false;  ///< it is, and its traffic was left out
  EffectGate fetch_gate_;
  Segment vertex_;
  FragmentPrograms<Program> fragment_;
  FragmentPrograms<Program> fragment_as_one_;  ///< segments, where the array is roomy
  TimedOut<VertexWarp> out_vertices_;
  TimedOut<ShadedWarpItem> out_shaded_;
  TimedIn<WarpRelease> in_release_;
  TimedIn<Warp> in_warps_;
  TimedIn<VertexWarp> in_vertices_;
  HandOver hand_over_;
  std::vector<TimedScheduler> schedulers_;
  std::vector<Flight> flights_;
  std::vector<std::uint32_t> free_flights_;
  std::vector<Ring<Event>> waiting_;  ///< for a scheduler: by the segment that is to issue, each by cycle
  Ring<Event> done_;                  ///< by cycle
  Cycle next_issue_ = never;          ///< the first of those that wait
  struct Release {
    Cycle at = 0;
    std::uint32_t slot = 0;
  };
  Ring<Release> releases_;  ///< of slots for fragment warps, by cycle, that no launch has come after yet
  WarpSlots slots_;
  SlotPool vertex_slots_;        ///< of those that have been handed on
  Ring<VertexFlight> vertices_;  ///< that have not, in order
  std::size_t shaded_ = 0;       ///< of these, from the first on
  std::size_t written_ = 0;
  const BarrierPlan barriers_;  ///< DRAW waits for them
  const bool vertices_wait_;    ///< to be handed on; across GPCs what comes behind them follows the order of calls
  std::uint64_t vertex_scheduler_ = 0;
  Cycle next_vertex_launch_ = 0;  ///< or later; `never` behind the end of the frame
  Cycle vertices_done_ = 0;
  Cycle next_launch_ = 0;
  Cycle last_done_ = 0;
  ShadedWarpPool pool_;
};

[[maybe_unused]] const bool sm_timed_registered = [] {
  register_timed_unit_maker("sm", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                     const RenderContext& context, unsigned) {
    return std::make_unique<TimedSm>(name.c_str(), domain, behaviour_as<SmBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
