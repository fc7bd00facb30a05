#include <algorithm>
#include <deque>

#include <vrpipe/order_monitor.h>
#include <vrpipe/timed.h>

namespace vrpipe {

namespace {

/// CROP at lt and at. Ports as in crop_unit.cpp.
class TimedCrop : public TimedUnit {
 public:
  TimedCrop(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<CropBehaviour> behaviour,
            const RenderState& state, Transport transport)
      : TimedUnit(name, domain, transport),
        out_(*this, "out_terminations"),
        in_(*this, "in_color", [this](const ColorBeat& beat, Cycle visible) { return take(beat, visible); }, {&out_}),
        behaviour_(std::move(behaviour)),
        cost_(behaviour_->cost()),
        signals_(state.early_termination),
        memory_(*this, "memory"),
        look_ups_(cost_.quads_per_cycle),
        blended_at_(cost_.input_quads, 0),
        filled_at_(cost_.mshrs, 0),
        blending_(cost_.quads_per_cycle * cost_.sectors_per_cycle),
        lines_(std::max(cost_.cache_bytes / cost_.line_bytes, 1U)),
        sectors_per_line_(cost_.line_bytes / cost_.sector_bytes),
        sector_there_at_(lines_.size() * sectors_per_line_, 0),
        sector_shift_(static_cast<unsigned>(__builtin_ctz(cost_.sector_bytes))) {
    out_.set_pipeline(cost_.latency_cycles - 1, 1);
  }

  std::uint64_t work() const override { return blended_; }
  double peak_rate() const override { return cost_.quads_per_cycle; }
  Behaviour& behaviour() override { return *behaviour_; }
  tlm::tlm_initiator_socket<32>* memory_socket() override { return &memory_.socket; }
  Cycle end_of_draw() const override { return end_; }

 private:
  void end_of_elaboration() override {
    const ColorSurface* const surface = behaviour_->surface();
    if (surface == nullptr) throw SimulationFault(this->name(), 0, "no colour surface is attached");
    monitor_ = std::make_unique<BlendOrderMonitor>(surface->width(), surface->height());
  }

  Cycle take(const ColorBeat& beat, Cycle visible) {
    if (beat.end_of_draw) {
      end_ = blended_ == 0 ? visible : last_blend_ + cost_.latency_cycles;
      return visible;
    }
    Cycle left = visible;
    for (unsigned i = 0; i < beat.count; ++i) left = pass(beat.quads[i], left);
    return left;
  }

  /// Looks a quad up and blends it; returns the cycle of the look-up.
  Cycle pass(const ColorQuad& quad, Cycle visible) {
    const CropBehaviour::CacheAccess access = behaviour_->look_up(quad.tile, quad.position);
    // A place in the queue, and a line that no queued quad needs.
    Cycle looked_up = std::max(visible, blended_at_[place_]);
    if (access.replaced) looked_up = std::max(looked_up, lines_[access.line]);
    looked_up = look_ups_.take(looked_up);
    if (access.written_back != 0) write_back(access, looked_up);
    Cycle there = looked_up + 1;
    for (std::uint32_t left = access.sectors; left != 0; left &= left - 1) {
      const auto sector = static_cast<unsigned>(__builtin_ctz(left));
      Cycle& sector_there = sector_there_at_[access.line * sectors_per_line_ + sector];
      if (((access.filled >> sector) & 1U) != 0) {
        looked_up = std::max(looked_up, filled_at_[fill_]);
        sector_there =
            memory_.read(access.address + (std::uint64_t{sector} << sector_shift_), cost_.sector_bytes, looked_up);
        filled_at_[fill_] = sector_there;
        fill_ = fill_ + 1 == filled_at_.size() ? 0 : fill_ + 1;
        move_sectors(1, looked_up);
      }
      there = std::max(there, sector_there);
    }
    look_ups_.hold(looked_up);
    charge(UnitState::starved, looked_up + 1);
    const Cycle blended = blend(quad, access, there);
    lines_[access.line] = blended;
    blended_at_[place_] = blended;
    place_ = place_ + 1 == blended_at_.size() ? 0 : place_ + 1;
    return looked_up;
  }

  void write_back(const CropBehaviour::CacheAccess& access, Cycle at) {
    for (std::uint32_t left = access.written_back; left != 0;) {
      const auto sector = static_cast<unsigned>(__builtin_ctz(left));
      // Neighbours go in one access where they are naturally aligned.
      unsigned sectors = 1;
      while (sector % (2 * sectors) == 0 && 2 * sectors <= sectors_per_line_ &&
             ((left >> sector) & run_of(2 * sectors)) == run_of(2 * sectors)) {
        sectors *= 2;
      }
      left &= ~(run_of(sectors) << sector);
      memory_.write(access.old_address + (std::uint64_t{sector} << sector_shift_), sectors << sector_shift_, at);
      move_sectors(sectors, at);
    }
  }
  static constexpr std::uint32_t run_of(unsigned sectors) { return sectors == 32 ? ~0U : (1U << sectors) - 1; }

  /// Moving a sector takes time from blending.
  void move_sectors(unsigned sectors, Cycle at) { blending_.take(at, sectors * cost_.quads_per_cycle); }

  Cycle blend(const ColorQuad& quad, const CropBehaviour::CacheAccess& access, Cycle there) {
    if (!cost_.forwards) there = std::max(there, hazard_until(quad));
    const Cycle at = blending_.take(std::max(there, out_.last()), cost_.sectors_per_cycle);
    monitor_->blended(*quad.warp, quad.index, at);
    const CropBehaviour::Outcome outcome = behaviour_->blend(quad.tile, quad.position, quad.live, quad.color());
    --quad.warp->holders;
    if (outcome.changed || cost_.writes_unchanged) behaviour_->make_dirty(access);
    if (!cost_.forwards) recent_.push_back({quad.tile, quad.position, at});
    charge(UnitState::memory, at);
    charge(UnitState::busy, at + 1);
    ++blended_;
    last_blend_ = at;
    if (outcome.terminated != 0) {
      TerminationBeat signal;
      signal.count = 1;
      signal.signals[0] = {quad.tile, quad.position, outcome.terminated};
      out_.send(signal, at);
    }
    return at;
  }

  /// The cycle in which a quad of the same position has left the blending pipeline.
  Cycle hazard_until(const ColorQuad& quad) {
    while (!recent_.empty() && recent_.front().at + cost_.latency_cycles <= last_blend_) recent_.pop_front();
    Cycle until = 0;
    for (const Recent& blend : recent_) {
      if (blend.tile == quad.tile && blend.position == quad.position) until = blend.at + cost_.latency_cycles;
    }
    return until;
  }

  struct Recent {
    TileId tile;
    std::uint8_t position;
    Cycle at;
  };

  TimedOut<TerminationBeat> out_;
  TimedIn<ColorBeat> in_;
  std::unique_ptr<CropBehaviour> behaviour_;
  const CropBehaviour::Cost cost_;
  const bool signals_;
  TimedMemoryPort memory_;
  std::unique_ptr<BlendOrderMonitor> monitor_;
  Lane look_ups_;
  std::vector<Cycle> blended_at_;  ///< the quads of the queue, a ring
  std::size_t place_ = 0;
  std::vector<Cycle> filled_at_;  ///< the fills in flight, a ring
  std::size_t fill_ = 0;
  Flow blending_;             ///< in parts of a cycle that both a quad and a sector are whole numbers of
  std::vector<Cycle> lines_;  ///< of the cache: the last blend of a quad that needed it
  const unsigned sectors_per_line_;
  std::vector<Cycle> sector_there_at_;
  const unsigned sector_shift_;
  std::deque<Recent> recent_;  ///< blends in the pipeline, without forwarding
  Cycle last_blend_ = 0;
  Cycle end_ = never;
  std::uint64_t blended_ = 0;
};

[[maybe_unused]] const bool registered = [] {
  register_timed_unit_maker("crop", [](const std::string& name, ClockDomain& domain,
                                       std::unique_ptr<Behaviour> behaviour, const RenderState& state, unsigned,
                                       Transport transport) {
    return std::make_unique<TimedCrop>(name.c_str(), domain, behaviour_as<CropBehaviour>(std::move(behaviour)), state,
                                       transport);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
