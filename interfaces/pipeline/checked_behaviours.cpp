#include <vrpipe/pipeline/checked_behaviours.h>

#include <initializer_list>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/arithmetic/lanes.h>
#include <vrpipe/component/error.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/pipeline/tile_grid.h>

namespace vrpipe {

namespace {

ForeignCode running;

// Beyond these a shell would allocate without bounds or overrun a beat.
constexpr std::uint32_t longest_latency = 1'000'000;
constexpr std::uint32_t largest_rate = 65536;

/// Calls code of an implementation: what it throws is its fault.
template <class Call>
decltype(auto) call_foreign(const std::string& name, const char* what, Cycle cycle, Call&& call) {
  const ForeignCall marked(name.c_str(), what);
  return call_with_fault(std::forward<Call>(call), [&](const char* text) {
    throw SimulationFault(name, cycle,
                          text != nullptr ? fmt::format("{} throws: {}", what, text)
                                          : fmt::format("{} throws an exception of unknown type", what));
  });
}

std::string words_of(TileId tile) { return fmt::format("screen tile {},{}", tile.x, tile.y); }

/// What a unit saw, by draw.
class Seen {
 public:
  void add(DrawIndex draw, std::uint64_t amount) {
    if (draw >= of_draw_.size()) of_draw_.resize(draw + std::size_t{1});
    of_draw_[draw] += amount;
    all_ += amount;
  }
  /// What came in, and came out after all.
  void take_back(DrawIndex draw, std::uint64_t amount) { add(draw, ~amount + 1); }
  std::uint64_t of(std::size_t draw) const { return draw < of_draw_.size() ? of_draw_[draw] : 0; }
  std::uint64_t all() const { return all_; }

 private:
  std::vector<std::uint64_t> of_draw_;
  std::uint64_t all_ = 0;
};

/// What the checked behaviours of all slots share.
class Checks {
 public:
  Checks(std::string name, const RenderContext& context)
      : name_(std::move(name)),
        frame_(*context.frame),
        grid_(frame_.width(), frame_.height()),
        tiles_x_((frame_.width() + screen_tile_pixels - 1) / screen_tile_pixels),
        width_(static_cast<std::int32_t>(frame_.width())),
        height_(static_cast<std::int32_t>(frame_.height())),
        placement_(context.placement) {}
  virtual ~Checks() = default;
  Checks(const Checks&) = delete;
  Checks& operator=(const Checks&) = delete;

  void follow(const ClockDomain& clock) { clock_ = &clock; }
  /// Asks for all costs, which are checked: what cannot be is told before anything runs, at every fidelity.
  virtual void check_costs() const = 0;
  virtual void check_counters() const = 0;
  /// What is counted by draw has to be counted for a draw.
  void check_draws(const StatisticSet& counted) const {
    for (const DrawCounter* counter : counted.draw_counters()) {
      if (counter->of_draw().empty()) continue;
      std::uint64_t sum = 0;
      for (const std::uint64_t of_draw : counter->of_draw()) sum += of_draw;
      check_counter(counter->name(), counter->value(), sum, "are counted for draws");
    }
  }

 protected:
  template <class... Arguments>
  [[noreturn]] void fault(const char* call, fmt::format_string<Arguments...> text, Arguments&&... arguments) const {
    throw SimulationFault(name_, cycle(),
                          fmt::format("{}: {}", call, fmt::format(text, std::forward<Arguments>(arguments)...)));
  }
  template <class Call>
  decltype(auto) ask(const char* what, Call&& call) const {
    return call_foreign(name_, what, cycle(), std::forward<Call>(call));
  }

  void check_rate(const char* what, std::uint32_t value, std::uint32_t largest = largest_rate) const {
    if (value == 0 || value > largest) fault("cost", "{} is {}, and must be 1 to {}", what, value, largest);
  }
  void check_rate(const char* what, Rate rate, std::uint32_t most_in_a_cycle) const {
    check_rate(what, rate.items);
    check_rate(what, rate.cycles);
    check_rate(what, rate.most_in_a_cycle(), most_in_a_cycle);
  }
  void check_latency(const char* what, std::uint32_t value) const { check_rate(what, value, longest_latency); }
  void check_throughput(const Throughput& cost) const {
    check_rate("items_per_cycle", cost.items_per_cycle);
    check_latency("latency_cycles", cost.latency_cycles);
  }
  void check_tile(const char* call, TileId tile) const {
    if (tile.x >= tiles_x_ || grid_.index(tile) >= grid_.tiles()) {
      fault(call, "{} lies outside the frame", words_of(tile));
    }
    if (!placement_.owns(tile)) fault(call, "{} belongs to another GPC", words_of(tile));
  }
  void check_quads(const char* call, TileId tile, const Quad* quads, std::size_t count) const {
    for (std::size_t i = 0; i < count; ++i) {
      const Quad& quad = quads[i];
      const auto wrong = [&](const char* field, std::uint64_t value, const std::string& why) {
        fault(call, "quad {} of {} in {}: {} {}, {}", i, count, words_of(tile), field, value, why);
      };
      if (quad.position >= positions_per_tile) wrong("position", quad.position, "a tile has 64");
      if (quad.coverage == 0 || quad.coverage > 0xf) wrong("coverage", quad.coverage, "1 to 15 are live samples");
      check_splat(call, quad.draw, quad.splat);
    }
  }
  /// That a splat is one of a draw's. The quads of a testbench need no splats behind them.
  void check_splat(const char* call, DrawIndex draw, std::uint32_t splat) const {
    if (frame_.splats() == 0) return;
    if (draw >= frame_.draws().size()) fault(call, "draw {} of a frame of {}", draw, frame_.draws().size());
    const DrawCall& drawn = frame_.draw_call(draw);
    if (splat - drawn.base < drawn.splats) return;
    fault(call, "splat {} for draw {}, which has {} from {} on", splat, draw, drawn.splats, drawn.base);
  }
  void check_primitive(const char* call, const Primitive& primitive) const {
    check_splat(call, primitive.draw, primitive.splat);
    if (primitive.triangle > 1) fault(call, "triangle {} of splat {}", primitive.triangle, primitive.splat);
    const PixelRect& bounds = primitive.bounds;
    if (bounds.empty() || bounds.x0 < 0 || bounds.y0 < 0 || bounds.x1 > width_ || bounds.y1 > height_) {
      fault(call, "splat {} in [{}, {}) x [{}, {}), in a frame of {}x{}", primitive.splat, bounds.x0, bounds.x1,
            bounds.y0, bounds.y1, width_, height_);
    }
  }
  void check_counter(const char* counters, std::uint64_t counted, std::uint64_t seen, const char* of) const {
    if (counted == seen) return;
    throw SimulationFault(name_, cycle(), fmt::format("{} counts {}, but {} {}", counters, counted, seen, of));
  }
  /// In all, and for each draw.
  void check_by_draw(const char* names, std::initializer_list<const DrawCounter*> counters, const Seen& seen,
                     const char* of) const {
    std::uint64_t counted = 0;
    for (const DrawCounter* counter : counters) counted += counter->value();
    check_counter(names, counted, seen.all(), of);
    for (std::size_t draw = 0; draw < (*counters.begin())->of_draw().size(); ++draw) {
      counted = 0;
      for (const DrawCounter* counter : counters) counted += counter->of_draw()[draw];
      if (counted != seen.of(draw)) {
        throw SimulationFault(name_, cycle(),
                              fmt::format("{} counts {} for draw {}, but {} {}", names, counted, draw, seen.of(draw),
                                          of));
      }
    }
  }
  std::size_t tiles() const { return grid_.tiles(); }
  const Frame& frame() const { return frame_; }

 private:
  Cycle cycle() const { return clock_ == nullptr ? 0 : clock_->now(); }

  const std::string name_;  ///< slot=implementation
  const Frame& frame_;
  const TileGrid grid_;
  const std::uint32_t tiles_x_;
  const std::int32_t width_;
  const std::int32_t height_;
  const Placement placement_;
  const ClockDomain* clock_ = nullptr;
};

/// A behaviour of a slot behind checks; a class for each slot adds what it asks of its calls.
template <class SlotBehaviour>
class CheckedSlot : public SlotBehaviour, public Checks {
 public:
  CheckedSlot(std::string name, const RenderContext& context, std::unique_ptr<SlotBehaviour> checked)
      : Checks(std::move(name), context), checked_(std::move(checked)) {}
  const Behaviour& unit() const override { return *checked_; }

 protected:
  const std::unique_ptr<SlotBehaviour> checked_;
};

template <class SlotBehaviour>
class CheckedUnit;

template <>
class CheckedUnit<DrawBehaviour> final : public CheckedSlot<DrawBehaviour> {
 public:
  CheckedUnit(std::string name, const RenderContext& context, std::unique_ptr<DrawBehaviour> checked)
      : CheckedSlot(std::move(name), context, std::move(checked)) {
    for (std::size_t command = 0; command < frame().commands().size(); ++command) {
      if (frame().commands()[command].is_draw) command_of_draw_.push_back(command);
    }
  }

  bool next(VertexWarp& out) override {
    if (!ask("next", [&] { return checked_->next(out); })) {
      pass(frame().commands().size());
      return false;
    }
    if (out.mark != Mark::none) {
      const std::size_t command = static_cast<std::size_t>(out.mark) - 1;
      if (command < passed_ || command >= frame().commands().size()) {
        fault("next", "a mark of command {}, of which {} of {} have passed", command, passed_,
              frame().commands().size());
      }
      pass(command);
      return true;
    }
    if (out.splats == 0 || out.splats > splats_per_vertex_warp) fault("next", "a warp of {} splats", out.splats);
    const std::uint64_t end = out.first_splat + std::uint64_t{out.splats};
    if (out.first_splat < issued_ || end > frame().splats()) {
      fault("next", "a warp of splats {} to {}, after {} of {}", out.first_splat, end - 1, issued_, frame().splats());
    }
    check_splat("next", out.draw, out.first_splat);
    check_splat("next", out.draw, static_cast<std::uint32_t>(end - 1));
    issued_ = out.first_splat + out.splats;
    const std::size_t command = command_of_draw_[out.draw];
    if (command + 1 < passed_) {
      fault("next", "a warp of draw {}, command {}, behind the mark of command {}", out.draw, command, passed_ - 1);
    }
    if (command + 1 > passed_) {
      if (needs_mark(command)) fault("next", "a warp of draw {} without the mark of command {}", out.draw, command);
      pass(command);
    }
    return true;
  }
  std::uint32_t warps_per_1024_cycles() const override {
    const std::uint32_t rate = ask("warps_per_1024_cycles", [&] { return checked_->warps_per_1024_cycles(); });
    check_rate("warps_per_1024_cycles", rate);
    return rate;
  }
  void check_costs() const override { warps_per_1024_cycles(); }
  void check_counters() const override {}

 private:
  bool needs_mark(std::size_t command) const {
    const Frame::Command& of = frame().commands()[command];
    return !of.is_draw || of.changes_state;
  }
  /// A command and those before it, whose marks have to have come.
  void pass(std::size_t command) {
    for (; passed_ < command; ++passed_) {
      if (needs_mark(passed_)) fault("next", "no mark of command {}", passed_);
    }
    passed_ = command + 1;
  }

  std::uint32_t issued_ = 0;  ///< up to this splat
  std::size_t passed_ = 0;    ///< commands
  std::vector<std::size_t> command_of_draw_;
};

template <>
class CheckedUnit<VpoBehaviour> final : public CheckedSlot<VpoBehaviour> {
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
  Throughput cost() const override {
    const Throughput cost = ask("cost", [&] { return checked_->cost(); });
    check_throughput(cost);
    return cost;
  }
  void check_costs() const override { cost(); }
  void check_counters() const override { check_by_draw("primitives", {&checked_->primitives}, assembled_, "came out"); }

 private:
  Seen assembled_;
};

template <>
class CheckedUnit<TgcBehaviour> final : public CheckedSlot<TgcBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  void begin(const Primitive& primitive) override {
    steps_of_primitive_ = 0;
    ask("begin", [&] { checked_->begin(primitive); });
  }
  bool entering() const override {
    return ask("entering", [&] { return checked_->entering(); });
  }
  bool step(Flush& out) override {
    // A bin for each screen tile, each of which evicts another first.
    if (++steps_of_primitive_ > 2 * tiles() + 2)
      fault("step", "a primitive is still entering after {} steps", steps_of_primitive_);
    ++entered_;
    return flushed("step", out, ask("step", [&] { return checked_->step(out); }));
  }
  bool drain(Flush& out) override {
    return flushed("drain", out, ask("drain", [&] { return checked_->drain(out); }));
  }
  Throughput cost() const override {
    const Throughput cost = ask("cost", [&] { return checked_->cost(); });
    check_throughput(cost);
    return cost;
  }
  std::uint32_t largest_flush() const override {
    const std::uint32_t largest = ask("largest_flush", [&] { return checked_->largest_flush(); });
    check_rate("largest_flush", largest, ~0U);
    return largest;
  }
  std::uint64_t storage_bytes() const override {
    return ask("storage_bytes", [&] { return checked_->storage_bytes(); });
  }
  void check_costs() const override {
    cost();
    largest_flush();
  }
  void check_counters() const override {
    // One that passes primitives through has no bins.
    if (checked_->flushes.value() == 0 && largest_flush() <= 1) return;
    check_counter("flushes", checked_->flushes.value(), flushes_, "bins came out");
  }

 private:
  bool flushed(const char* call, const Flush& out, bool is_flushed) {
    if (!is_flushed) return false;
    if (out.primitives.empty()) fault(call, "a flush without primitives");
    if (out.primitives.size() > largest_flush()) {
      fault(call, "a flush of {} primitives, largest_flush is {}", out.primitives.size(), largest_flush());
    }
    if (out.clip.empty()) fault(call, "a flush with an empty clip");
    for (const Primitive& primitive : out.primitives) check_primitive(call, primitive);
    ++flushes_;
    left_ += out.primitives.size();
    if (left_ > entered_) fault(call, "{} primitives came out, {} were entered", left_, entered_);
    return true;
  }

  std::uint64_t steps_of_primitive_ = 0;
  std::uint64_t entered_ = 0;
  std::uint64_t left_ = 0;
  std::uint64_t flushes_ = 0;
};

template <>
class CheckedUnit<RasterBehaviour> final : public CheckedSlot<RasterBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  void begin(const Primitive& primitive, const PixelRect& clip) override {
    primitive_ = primitive;
    kept_ = 0;
    ask("begin", [&] { checked_->begin(primitive, clip); });
  }
  bool next(QuadBeat& out, unsigned& coarse_tests, bool& new_screen_tile) override {
    const bool more = ask("next", [&] { return checked_->next(out, coarse_tests, new_screen_tile); });
    if (coarse_tests > raster_tiles())
      fault("next", "{} raster tiles tested, the frame has {}", coarse_tests, raster_tiles());
    if (!more) return false;
    if (++kept_ > raster_tiles())
      fault("next", "splat {} covers more raster tiles than the frame has", primitive_.splat);
    if (out.count > QuadBeat::capacity) fault("next", "{} quads in a raster tile", out.count);
    if (out.mark != Mark::none || out.last_of_bin) fault("next", "a raster tile with marks that are not its own");
    check_tile("next", out.tile);
    check_quads("next", out.tile, out.quads.data(), out.count);
    for (unsigned i = 0; i < out.count; ++i) {
      const Quad& quad = out.quads[i];
      if (quad.splat != primitive_.splat || quad.triangle != primitive_.triangle || quad.draw != primitive_.draw) {
        fault("next", "a quad of splat {}.{} for splat {}.{}", quad.splat, quad.triangle, primitive_.splat,
              primitive_.triangle);
      }
      fragments_.add(primitive_.draw, popcount(quad.coverage));
    }
    quads_.add(primitive_.draw, out.count);
    return true;
  }
  Cost cost() const override {
    const Cost cost = ask("cost", [&] { return checked_->cost(); });
    check_latency("setup_latency_cycles", cost.setup_latency_cycles);
    check_latency("setup_interval_cycles", cost.setup_interval_cycles);
    check_rate("coarse_tiles_per_cycle", cost.coarse_tiles_per_cycle);
    check_rate("fine_tiles_per_cycle", cost.fine_tiles_per_cycle);
    check_latency("screen_tile_interval_cycles", cost.screen_tile_interval_cycles);
    check_rate("quads_per_cycle", cost.quads_per_cycle);
    return cost;
  }
  void check_costs() const override { cost(); }
  void check_counters() const override {
    check_by_draw("quads_rasterized", {&checked_->quads_rasterized}, quads_, "quads came out");
    check_by_draw("fragments_rasterized", {&checked_->fragments_rasterized}, fragments_, "fragments came out");
  }

 private:
  std::uint64_t raster_tiles() const { return 4 * tiles(); }

  Primitive primitive_;
  std::uint64_t kept_ = 0;  ///< raster tiles of the primitive
  Seen quads_;
  Seen fragments_;
};

template <>
class CheckedUnit<TcBehaviour> final : public CheckedSlot<TcBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  unsigned insert(const QuadBeat& beat, unsigned from, Flush& out, bool& flushed) override {
    const unsigned taken = ask("insert", [&] { return checked_->insert(beat, from, out, flushed); });
    const unsigned offered = beat.count - from;
    if (taken > offered) fault("insert", "{} quads taken of {} in {}", taken, offered, words_of(beat.tile));
    if (taken < offered && !flushed) {
      fault("insert", "{} quads taken of {} in {}, and no bin flushed", taken, offered, words_of(beat.tile));
    }
    taken_ += taken;
    if (flushed) check_flush("insert", out);
    return taken;
  }
  bool flush_oldest(FlushReason reason, Flush& out) override {
    if (!ask("flush_oldest", [&] { return checked_->flush_oldest(reason, out); })) {
      if (reason == FlushReason::end_of_draw && left_ != taken_) {
        fault("flush_oldest", "all bins are empty, but of {} quads {} came out", taken_, left_);
      }
      return false;
    }
    check_flush("flush_oldest", out);
    return true;
  }
  Cost cost() const override {
    const Cost cost = ask("cost", [&] { return checked_->cost(); });
    check_rate("quads_per_cycle", cost.quads_per_cycle, QuadBeat::capacity);
    check_latency("latency_cycles", cost.latency_cycles);
    check_rate("flush_queue_bins", cost.flush_queue_bins);
    return cost;
  }
  void check_costs() const override { cost(); }
  void check_counters() const override {
    check_counter("quads", checked_->quads.value(), taken_, "quads came in");
    check_counter("flushes", checked_->flushes.value(), flushes_, "bins came out");
  }

 private:
  void check_flush(const char* call, const Flush& out) {
    check_tile(call, out.tile);
    if (out.quads.empty()) fault(call, "a flush of {} without quads", words_of(out.tile));
    check_quads(call, out.tile, out.quads.data(), out.quads.size());
    ++flushes_;
    left_ += out.quads.size();
    if (left_ > taken_) fault(call, "{} quads came out, {} were taken", left_, taken_);
  }

  std::uint64_t taken_ = 0;
  std::uint64_t left_ = 0;
  std::uint64_t flushes_ = 0;
};

template <>
class CheckedUnit<PropBehaviour> final : public CheckedSlot<PropBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  Cost cost() const override {
    const Cost cost = ask("cost", [&] { return checked_->cost(); });
    check_rate("quads_per_cycle", cost.quads_per_cycle);
    check_rate("color_rate", cost.color_rate, ColorBeat::capacity);
    check_latency("latency_cycles", cost.latency_cycles);
    if (cost.order > Order::tile) fault("cost", "order {} is neither draw nor tile", static_cast<unsigned>(cost.order));
    return cost;
  }
  void check_costs() const override { cost(); }
  void check_counters() const override {}
};

template <>
class CheckedUnit<ZropBehaviour> final : public CheckedSlot<ZropBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  void test(QuadBeat& beat) override {
    const TileId tile = beat.tile;
    const unsigned count = beat.count;
    const bool last_of_bin = beat.last_of_bin;
    const bool tests =
        count > 0 && !frame().draws().empty() && frame().draw_call(beat.quads[0].draw).state.early_termination;
    for (unsigned i = 0; i < count; ++i) {
      const Quad& quad = beat.quads[i];
      if (tests) tested_.add(quad.draw, 1);
      lost_quads_.add(quad.draw, 1);
      lost_fragments_.add(quad.draw, popcount(quad.coverage));
    }
    ask("test", [&] { checked_->test(beat); });
    if (beat.count > count) fault("test", "{} quads of {} in {} passed", beat.count, count, words_of(tile));
    if (beat.tile != tile || beat.last_of_bin != last_of_bin || beat.mark != Mark::none) {
      fault("test", "a beat of {} with a tile or marks that are not its own", words_of(tile));
    }
    check_quads("test", tile, beat.quads.data(), beat.count);
    for (unsigned i = 0; i < beat.count; ++i) {
      const Quad& quad = beat.quads[i];
      lost_quads_.take_back(quad.draw, 1);
      lost_fragments_.take_back(quad.draw, popcount(quad.coverage));
    }
  }
  void attach(DepthStencilSurface& surface) override {
    ZropBehaviour::attach(surface);
    ask("attach", [&] { checked_->attach(surface); });
  }
  void pass(Mark mark) override {
    ask("pass", [&] { checked_->pass(mark); });
  }
  void update(const TerminationSignal& signal) override {
    ++updates_;
    ask("update", [&] { checked_->update(signal); });
  }
  void follow(FunctionalRunAhead& run_ahead) override {
    ask("follow", [&] { checked_->follow(run_ahead); });
  }
  Cost cost() const override {
    const Cost cost = ask("cost", [&] { return checked_->cost(); });
    check_rate("quads_per_cycle", cost.quads_per_cycle);
    check_latency("latency_cycles", cost.latency_cycles);
    check_rate("updates_per_cycle", cost.updates_per_cycle);
    return cost;
  }
  void check_costs() const override { cost(); }
  void check_counters() const override {
    check_by_draw("quads_tested", {&checked_->quads_tested}, tested_, "quads came in");
    check_by_draw("quads_terminated + quads_depth_stencil_failed",
                  {&checked_->quads_terminated, &checked_->quads_depth_stencil_failed}, lost_quads_,
                  "quads did not come out");
    check_by_draw("fragments_terminated + fragments_depth_stencil_failed",
                  {&checked_->fragments_terminated, &checked_->fragments_depth_stencil_failed}, lost_fragments_,
                  "fragments did not come out");
    check_counter("termination_updates", checked_->termination_updates.value(), updates_, "signals came in");
  }

 private:
  Seen tested_;
  Seen lost_quads_;
  Seen lost_fragments_;
  std::uint64_t updates_ = 0;
};

template <>
class CheckedUnit<QruBehaviour> final : public CheckedSlot<QruBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  unsigned examine(TileId tile, const Quad* quads, unsigned count, Warp& out, bool& launched) override {
    tile_ = tile;
    const unsigned examined = ask("examine", [&] { return checked_->examine(tile, quads, count, out, launched); });
    if (examined > count) fault("examine", "{} quads examined of {} in {}", examined, count, words_of(tile));
    if (examined < count && !launched) {
      fault("examine", "{} quads examined of {} in {}, and no warp launched", examined, count, words_of(tile));
    }
    held_ += examined;
    if (launched) check_warp("examine", out);
    return examined;
  }
  bool finish_bin(Warp& out) override {
    if (!ask("finish_bin", [&] { return checked_->finish_bin(out); })) {
      if (held_ != 0) fault("finish_bin", "{} quads of {} are in no warp", held_, words_of(tile_));
      return false;
    }
    check_warp("finish_bin", out);
    return true;
  }
  Throughput cost() const override {
    const Throughput cost = ask("cost", [&] { return checked_->cost(); });
    check_throughput(cost);
    return cost;
  }
  std::uint64_t storage_bytes() const override {
    return ask("storage_bytes", [&] { return checked_->storage_bytes(); });
  }
  void check_costs() const override { cost(); }
  void check_counters() const override {}

 private:
  void check_warp(const char* call, const Warp& warp) {
    if (warp.tile != tile_) fault(call, "a warp of {} in the bin of {}", words_of(warp.tile), words_of(tile_));
    if (warp.count == 0 || warp.count > quads_per_warp) {
      fault(call, "a warp of {} quads in {}, and it has 1 to {}", warp.count, words_of(tile_), quads_per_warp);
    }
    if (warp.mark != Mark::none) fault(call, "a warp of {} that is a mark", words_of(tile_));
    check_quads(call, tile_, warp.quads.data(), warp.count);
    for (unsigned pair = 0; 2 * pair < 8; ++pair) {
      if ((warp.merge_pairs >> pair & 1U) == 0) continue;
      if (pair >= quads_per_warp / 2 || 2 * pair + 1 >= warp.count ||
          warp.quads[2 * pair].position != warp.quads[2 * pair + 1].position) {
        fault(call, "pair {} of a warp of {} quads in {} is no two quads of a position", pair, warp.count,
              words_of(tile_));
      }
    }
    if (warp.count > held_)
      fault(call, "a warp of {} quads in {}, where {} were left", warp.count, words_of(tile_), held_);
    held_ -= warp.count;
  }

  TileId tile_;
  std::uint64_t held_ = 0;  ///< quads examined that are in no warp yet
};

template <>
class CheckedUnit<SmBehaviour> final : public CheckedSlot<SmBehaviour> {
 public:
  using CheckedSlot::CheckedSlot;

  void shade(const Warp& warp, ShadedWarp& out) override {
    ShadedWarpPool* const pool = out.pool;
    ask("shade", [&] { checked_->shade(warp, out); });
    out.pool = pool;
    if (out.count > warp.count) fault("shade", "{} quads of {} in {} left", out.count, warp.count, words_of(warp.tile));
    if (out.tile != warp.tile || out.sequence != warp.sequence || out.tile_sequence != warp.tile_sequence ||
        out.mark != Mark::none) {
      fault("shade", "a warp of {} with a tile, numbers or a mark that are not its own", words_of(warp.tile));
    }
    ++warps_;
    for (unsigned i = 0; i < warp.count; ++i) {
      const Quad& quad = warp.quads[i];
      shaded_.add(quad.draw, 1);
      shaded_fragments_.add(quad.draw, popcount(quad.coverage));
      lost_quads_.add(quad.draw, 1);
      lost_fragments_ += popcount(quad.coverage);
    }
    for (unsigned i = 0; i < out.count; ++i) {
      if (out.position[i] >= positions_per_tile || out.live[i] == 0 || out.live[i] > 0xf) {
        fault("shade", "quad {} of a warp of {}: position {} and live samples {}", i, words_of(warp.tile),
              out.position[i], out.live[i]);
      }
      lost_fragments_ -= popcount(out.live[i]);
      if (frame().splats() > 0) check_splat("shade", out.draw[i], out.first_primitive[i] / 2);
      lost_quads_.take_back(out.draw[i], 1);
    }
  }
  void shade_vertices(const VertexWarp& warp) override {
    ask("shade_vertices", [&] { checked_->shade_vertices(warp); });
  }
  Cost cost() const override {
    Cost cost = ask("cost", [&] { return checked_->cost(); });
    check_rate("cores", cost.cores);
    check_rate("schedulers_per_core", cost.schedulers_per_core);
    check_rate("lanes_per_scheduler", cost.lanes_per_scheduler, 32);
    if (32 % cost.lanes_per_scheduler != 0) {
      fault("cost", "lanes_per_scheduler is {}, no divisor of 32", cost.lanes_per_scheduler);
    }
    check_rate("warps_per_core", cost.warps_per_core);
    check_rate("vertex_warps", cost.vertex_warps);
    check_rate("warps_to_one_core", cost.warps_to_one_core, ~0U);
    if (cost.vertex.empty() || cost.fragment.empty()) fault("cost", "a shader program without a segment");
    for (const auto* program : {&cost.vertex, &cost.fragment, &cost.merge}) {
      for (const ShaderSegment& segment : *program) {
        if (segment.instructions > longest_latency || segment.stall_cycles > longest_latency) {
          fault("cost", "a segment of {} instructions and {} cycles", segment.instructions, segment.stall_cycles);
        }
      }
    }
    return cost;
  }
  void check_costs() const override { cost(); }
  void check_counters() const override {
    check_counter("fragment_warps", checked_->fragment_warps.value(), warps_, "warps came in");
    check_by_draw("quads_shaded", {&checked_->quads_shaded}, shaded_, "quads came in");
    check_by_draw("fragments_shaded", {&checked_->fragments_shaded}, shaded_fragments_, "fragments came in");
    check_by_draw("quads_pruned + quads_merged", {&checked_->quads_pruned, &checked_->quads_merged}, lost_quads_,
                  "quads did not come out");
    check_counter("fragments_pruned + fragments_merged",
                  checked_->fragments_pruned.value() + checked_->fragments_merged.value(), lost_fragments_,
                  "fragments did not come out");
  }

 private:
  std::uint64_t warps_ = 0;
  Seen shaded_;
  Seen shaded_fragments_;
  Seen lost_quads_;
  std::uint64_t lost_fragments_ = 0;  ///< a merged quad has fragments of two draws
};

template <>
class CheckedUnit<CropBehaviour> final : public CheckedSlot<CropBehaviour> {
 public:
  CheckedUnit(std::string name, const RenderContext& context, std::unique_ptr<CropBehaviour> checked)
      : CheckedSlot(std::move(name), context, std::move(checked)), format_(context.format) {}

  void attach(ColorSurface& surface) override {
    CropBehaviour::attach(surface);
    ask("attach", [&] { checked_->attach(surface); });
  }
  void pass(Mark mark) override {
    ask("pass", [&] { checked_->pass(mark); });
  }
  Outcome blend(DrawIndex draw, std::size_t place, LaneMask live, const QuadColor& color) override {
    const Outcome outcome = ask("blend", [&] { return checked_->blend(draw, place, live, color); });
    take(draw, static_cast<unsigned>(place % positions_per_tile), live, outcome);
    return outcome;
  }
  Outcome blend_quad(std::size_t place, const ShadedWarp& warp, unsigned index) override {
    const Outcome outcome = ask("blend_quad", [&] { return checked_->blend_quad(place, warp, index); });
    take(warp.draw[index], warp.position[index], warp.live[index], outcome);
    return outcome;
  }
  void blend_quads(const ShadedWarp& warp, unsigned from, unsigned to, Outcomes& outcomes) override {
    ask("blend_quads", [&] { checked_->blend_quads(warp, from, to, outcomes); });
    for (unsigned i = from; i < to; ++i) take(warp.draw[i], warp.position[i], warp.live[i], outcomes[i]);
  }
  void look_up(const ShadedWarp& warp, unsigned from, unsigned to, CacheLookUp& out) override {
    ask("look_up", [&] { checked_->look_up(warp, from, to, out); });
    if (out.count > to - from)
      fault("look_up", "{} lines for {} quads in {}", out.count, to - from, words_of(warp.tile));
    const Cost shape = cost();
    for (unsigned i = 0; i < out.count; ++i) {
      if (out.lines[i].line >= shape.cache_bytes / shape.line_bytes) {
        fault("look_up", "line {} of a cache of {}", out.lines[i].line, shape.cache_bytes / shape.line_bytes);
      }
    }
    for (unsigned i = from; out.count > 0 && i < to; ++i) {
      if (out.line_of[i] >= out.count) fault("look_up", "quad {} needs line {} of {}", i, out.line_of[i], out.count);
      ++line_accesses_;
      sector_accesses_ += bits(out.sectors_of[i]);
    }
    for (unsigned i = 0; i < out.count; ++i) {
      line_misses_ += out.lines[i].replaced ? 1 : 0;
      sector_misses_ += bits(out.lines[i].filled);
      written_back_ += bits(out.lines[i].written_back);
    }
  }
  void make_dirty(std::uint32_t line, std::uint32_t sectors) override {
    ask("make_dirty", [&] { checked_->make_dirty(line, sectors); });
  }
  Cost cost() const override {
    const Cost cost = ask("cost", [&] { return checked_->cost(); });
    check_rate("blend_rate", cost.blend_rate, TerminationBeat::capacity);
    check_rate("input_quads", cost.input_quads);
    check_latency("latency_cycles", cost.latency_cycles);
    check_rate("mshrs", cost.mshrs);
    check_rate("sectors_per_cycle", cost.sectors_per_cycle);
    cost.check_cache(format_);
    return cost;
  }
  void check_costs() const override { cost(); }
  void check_counters() const override {
    check_by_draw("quads_blended + quads_dropped_late + quads_late_failed",
                  {&checked_->quads_blended, &checked_->quads_dropped_late, &checked_->quads_late_failed}, quads_,
                  "quads came in");
    check_by_draw("fragments_blended + fragments_dropped_late + fragments_late_failed",
                  {&checked_->fragments_blended, &checked_->fragments_dropped_late, &checked_->fragments_late_failed},
                  fragments_, "fragments came in");
    check_by_draw("termination_signals", {&checked_->termination_signals}, signalled_, "signals went out");
    if (line_accesses_ == 0) return;  // no cache, or one of the timing model's
    const SectoredCacheStatistics& cache = checked_->cache_statistics;
    check_counter("cache.line_accesses", cache.line_accesses.value(), line_accesses_, "quads needed a line");
    check_counter("cache.line_hits", cache.line_hits.value(), line_accesses_ - line_misses_, "lines were held");
    check_counter("cache.line_misses", cache.line_misses.value(), line_misses_, "lines were replaced");
    check_counter("cache.sector_accesses", cache.sector_accesses.value(), sector_accesses_, "sectors were needed");
    check_counter("cache.sector_hits", cache.sector_hits.value(), sector_accesses_ - sector_misses_,
                  "sectors were there");
    check_counter("cache.sector_misses", cache.sector_misses.value(), sector_misses_, "sectors were filled");
    check_counter("cache.sectors_written_back", cache.sectors_written_back.value(), written_back_,
                  "sectors were written back");
    const std::uint64_t sector_bytes = cost().sector_bytes;
    check_counter("cache.bytes_filled", cache.bytes_filled.value(), sector_bytes * sector_misses_, "bytes were filled");
    check_counter("cache.bytes_written_back", cache.bytes_written_back.value(), sector_bytes * written_back_,
                  "bytes were written back");
  }

 private:
  void take(DrawIndex draw, unsigned position, LaneMask live, const Outcome& outcome) {
    quads_.add(draw, 1);
    fragments_.add(draw, popcount(live));
    if (outcome.terminated == 0) return;
    signalled_.add(draw, 1);
    if (!frame().draw_call(draw).state.early_termination)
      fault("blend", "position {} of a tile is signalled without early termination", position);
    if ((outcome.terminated & ~live) != 0) {
      fault("blend", "position {} of a tile: pixels {:#x} terminated by fragments {:#x}", position, outcome.terminated,
            live);
    }
  }

  static unsigned bits(std::uint32_t sectors) { return static_cast<unsigned>(__builtin_popcount(sectors)); }

  const ColorFormat format_;
  std::uint64_t line_accesses_ = 0;
  std::uint64_t line_misses_ = 0;
  std::uint64_t sector_accesses_ = 0;
  std::uint64_t sector_misses_ = 0;
  std::uint64_t written_back_ = 0;
  Seen quads_;
  Seen fragments_;
  Seen signalled_;
};

template <class SlotBehaviour>
std::unique_ptr<Behaviour> check(const std::string& name, const RenderContext& context,
                                 std::unique_ptr<Behaviour> behaviour) {
  auto* const typed = dynamic_cast<SlotBehaviour*>(behaviour.get());
  if (typed == nullptr) throw SimulationFault(name, 0, "make_behaviour makes a unit of another slot");
  static_cast<void>(behaviour.release());
  auto checked = std::make_unique<CheckedUnit<SlotBehaviour>>(name, context, std::unique_ptr<SlotBehaviour>(typed));
  checked->check_costs();
  return checked;
}

using Check = std::unique_ptr<Behaviour> (*)(const std::string&, const RenderContext&, std::unique_ptr<Behaviour>);

Check check_of_slot(const std::string& slot) {
  if (slot == "draw") return check<DrawBehaviour>;
  if (slot == "vpo") return check<VpoBehaviour>;
  if (slot == "tgc") return check<TgcBehaviour>;
  if (slot == "raster") return check<RasterBehaviour>;
  if (slot == "tc") return check<TcBehaviour>;
  if (slot == "prop") return check<PropBehaviour>;
  if (slot == "zrop") return check<ZropBehaviour>;
  if (slot == "qru") return check<QruBehaviour>;
  if (slot == "sm") return check<SmBehaviour>;
  if (slot == "crop") return check<CropBehaviour>;
  // What a slot of a plugin's returns, only that plugin knows.
  return [](const std::string&, const RenderContext&, std::unique_ptr<Behaviour> behaviour) { return behaviour; };
}

}  // namespace

void check_calls(Implementation& implementation) {
  const std::string name = implementation.slot + "=" + implementation.name;
  implementation.make_parameters = [name, make = std::move(implementation.make_parameters)] {
    auto parameters = call_foreign(name, "make_parameters", 0, [&] { return make(); });
    if (parameters == nullptr) throw SimulationFault(name, 0, "make_parameters makes nothing");
    return parameters;
  };
  implementation.make_behaviour = [name, make = std::move(implementation.make_behaviour),
                                   check = check_of_slot(implementation.slot)](const ParameterSet& parameters,
                                                                               const RenderContext& context) {
    auto behaviour = call_foreign(name, "make_behaviour", 0, [&] { return make(parameters, context); });
    if (behaviour == nullptr) throw SimulationFault(name, 0, "make_behaviour makes nothing");
    return check(name, context, std::move(behaviour));
  };
}

void follow_clock(Behaviour& unit, const ClockDomain& clock) {
  if (auto* const checks = dynamic_cast<Checks*>(&unit)) checks->follow(clock);
}

void check_counters(const Behaviour& unit) {
  if (const auto* const checks = dynamic_cast<const Checks*>(&unit)) {
    checks->check_counters();
    checks->check_draws(unit.unit());
  }
}

ForeignCode foreign_code_running() { return running; }

ForeignCall::ForeignCall(const char* owner, const char* call) : before_(running) { running = {owner, call}; }
ForeignCall::~ForeignCall() { running = before_; }

}  // namespace vrpipe
