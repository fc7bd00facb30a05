#include <algorithm>

#include <vrpipe/timed.h>

namespace vrpipe {

namespace {

/// The SM array at lt and at. Ports as in sm_unit.cpp. A warp has its scheduler for all its instructions at once, then
/// waits for all its latencies: with several warps that is what issuing segment by segment comes to. Vertex warps take
/// issue slots from fragment warps but do not wait for them; they are few. Shaded warps go to PROP as they are done, at
/// lt in launch order.
class TimedSm : public TimedUnit {
 public:
  TimedSm(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<SmBehaviour> behaviour,
          Transport transport)
      : TimedUnit(name, domain, SmWork::kinds(behaviour->cost()), transport),
        behaviour_(std::move(behaviour)),
        cost_(behaviour_->cost()),
        cycles_per_instruction_(cost_.cycles_per_instruction()),
        vertex_(program({&cost_.vertex})),
        fragment_(program({&cost_.fragment})),
        merged_(program({&cost_.fragment, &cost_.merge})),
        out_vertices_(*this, "out_vertices"),
        out_shaded_(*this, "out_shaded"),
        in_release_(*this, "in_release",
                    [this](const WarpRelease& release, Span visible) { return free(release, visible.first); }),
        in_warps_(*this, "in_warps", [this](const Warp& warp, Span visible) { return shade(warp, visible.first); }),
        in_vertices_(*this, "in_vertices",
                     [this](const VertexWarp& warp, Span visible) { return shade_vertices(warp, visible.first); },
                     {&out_vertices_}),
        scheduler_free_at_(std::size_t{cost_.cores} * cost_.schedulers_per_core, 0),
        vertex_slots_(cost_.vertex_warps, 0) {
    for (std::uint32_t left = cost_.fragment_slots(); left > 0; --left) slots_.push(0);
    in_warps_.set_gate([this] { return !slots_.empty(); });
  }

  bool idle() const override { return TimedUnit::idle() && running_.empty(); }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  struct Program {
    std::uint64_t instructions = 0;
    Cycle issue = 0;    ///< cycles that it has the scheduler
    Cycle latency = 0;  ///< of its stalls
  };

  Program program(std::initializer_list<const std::vector<ShaderSegment>*> parts) const {
    Program sum;
    for (const auto* part : parts) {
      for (const ShaderSegment& segment : *part) {
        sum.instructions += segment.instructions;
        sum.latency += segment.stall_cycles;
      }
    }
    sum.issue = sum.instructions * cycles_per_instruction_;
    return sum;
  }

  std::size_t choose_scheduler(TileId tile) {
    if (!(tile == last_tile_) || sent_to_core_ == cost_.warps_to_one_core) {
      core_ = core_ + 1 == cost_.cores ? 0 : core_ + 1;
      sent_to_core_ = 0;
    }
    last_tile_ = tile;
    ++sent_to_core_;
    const std::size_t chosen = std::size_t{core_} * cost_.schedulers_per_core + turn_of_scheduler_;
    turn_of_scheduler_ = turn_of_scheduler_ + 1 == cost_.schedulers_per_core ? 0 : turn_of_scheduler_ + 1;
    return chosen;
  }

  Cycle shade(const Warp& warp, Cycle visible) {
    Cycle launch = std::max(visible, next_launch_);
    ShadedWarp& shaded = pool_.take();
    if (warp.end_of_draw) {
      shaded.end_of_draw = true;
      shaded.sequence = warp.sequence;
      shaded.count = 0;
      shaded.slot = no_slot;
      hand_on(shaded, std::max(launch, last_done_));
      return launch;
    }
    charge(UnitState::memory, std::min(launch, last_done_));
    charge(UnitState::starved, launch);
    if (slots_.empty()) {
      // At lt all that leads to a release has happened by now.
      throw SimulationFault("deadlock", launch, std::string(name()) + " has warps to launch, and no slot is released");
    }
    launch = std::max(launch, slots_.front());
    slots_.pop();
    charge(UnitState::blocked, launch);
    next_launch_ = launch + 1;

    const Program& needed = warp.merge_pairs != 0 ? merged_ : fragment_;
    Cycle& free_at = scheduler_free_at_[choose_scheduler(warp.tile)];
    free_at = std::max(free_at, launch) + needed.issue;
    const Cycle begin = free_at - needed.issue;
    did(SmWork::fragment, fragment_.instructions, begin, begin + fragment_.issue);
    if (needed.instructions > fragment_.instructions) {
      did(SmWork::merge, needed.instructions - fragment_.instructions, begin + fragment_.issue, free_at);
    }
    const Cycle done = free_at + needed.latency;
    last_done_ = std::max(last_done_, done);
    charge(UnitState::busy, free_at);

    behaviour_->shade(warp, shaded);
    if (shaded.count < warp.count) draw_lasts(done + 1);
    shaded.slot = 0;
    hand_on(shaded, done);
    return launch;
  }

  /// Sends a warp that is shaded in a cycle to come.
  void hand_on(const ShadedWarp& shaded, Cycle done) {
    if (blocking()) {
      out_shaded_.send({&shaded}, done);
      return;
    }
    running_.push_in_order({&shaded, done}, &Running::done);
  }

  Cycle advance(Cycle until) override {
    for (; !running_.empty() && running_.front().done <= until && out_shaded_.clear(); running_.pop()) {
      out_shaded_.send({running_.front().shaded}, running_.front().done);
    }
    return running_.empty() || !out_shaded_.clear() ? never : running_.front().done;
  }

  Cycle shade_vertices(const VertexWarp& warp, Cycle visible) {
    Cycle launch = std::max(visible, next_vertex_launch_);
    if (!warp.end_of_draw) {
      launch = std::max(launch, vertex_slots_[vertex_turn_]);
      Cycle& free_at = scheduler_free_at_[vertex_scheduler_++ % scheduler_free_at_.size()];
      free_at = std::max(free_at, launch) + vertex_.issue;
      did(SmWork::vertex, vertex_.instructions, free_at - vertex_.issue, free_at);
      behaviour_->shade_vertices(warp);
      vertices_done_ = std::max(vertices_done_, launch + vertex_.issue + vertex_.latency);
    }
    next_vertex_launch_ = launch + 1;
    // Vertex warps leave in order.
    const Cycle taken = out_vertices_.send(warp, std::max(vertices_done_, launch)).first;
    vertex_slots_[vertex_turn_] = taken + 1;
    vertex_turn_ = vertex_turn_ + 1 == cost_.vertex_warps ? 0 : vertex_turn_ + 1;
    return launch;
  }

  Cycle free(const WarpRelease& release, Cycle visible) {
    if (release.slot != no_slot) slots_.push(visible);
    return visible;
  }

  std::unique_ptr<SmBehaviour> behaviour_;
  const SmBehaviour::Cost cost_;
  const Cycle cycles_per_instruction_;
  const Program vertex_;
  const Program fragment_;
  const Program merged_;
  TimedOut<VertexWarp> out_vertices_;
  TimedOut<ShadedWarpItem> out_shaded_;
  TimedIn<WarpRelease> in_release_;
  TimedIn<Warp> in_warps_;
  TimedIn<VertexWarp> in_vertices_;
  std::vector<Cycle> scheduler_free_at_;
  struct Running {
    const ShadedWarp* shaded = nullptr;
    Cycle done = 0;
  };
  Ring<Running> running_;            ///< by cycle; non-blocking
  Ring<Cycle> slots_;                ///< for fragment warps: when each that is free, or known to become so, is
  std::vector<Cycle> vertex_slots_;  ///< a ring
  std::uint32_t vertex_turn_ = 0;
  std::uint64_t vertex_scheduler_ = 0;
  Cycle next_vertex_launch_ = 0;
  Cycle vertices_done_ = 0;
  Cycle next_launch_ = 0;
  Cycle last_done_ = 0;
  TileId last_tile_;
  std::uint32_t core_ = 0;
  std::uint32_t sent_to_core_ = 0;
  std::uint32_t turn_of_scheduler_ = 0;
  ShadedWarpPool pool_;
};

[[maybe_unused]] const bool registered = [] {
  register_timed_unit_maker("sm", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                     const RenderState&, unsigned, Transport transport) {
    return std::make_unique<TimedSm>(name.c_str(), domain, behaviour_as<SmBehaviour>(std::move(behaviour)), transport);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
