#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/arithmetic/lanes.h>
#include <vrpipe/component/error.h>
#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/rate.h>
#include <vrpipe/pipeline/checked_behaviours.h>
#include <vrpipe/pipeline/screen_tiling.h>
#include <vrpipe/pipeline/slots/behaviour.h>

/// What the checks of all slots have in common.

namespace vrpipe {

class ClockDomain;

// Beyond these a shell would allocate without bounds or overrun a beat.
inline constexpr std::uint32_t longest_latency = 1'000'000;
inline constexpr std::uint32_t largest_rate = 65536;

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

inline std::string words_of(TileId tile) { return fmt::format("screen tile {},{}", tile.x, tile.y); }

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

  /// Counts for a unit what it has not counted itself.
  static void count_up_to(Counter& counter, std::uint64_t value) {
    if (counter.value() < value) counter += value - counter.value();
  }
  void follow(const ClockDomain& clock) { clock_ = &clock; }
  /// Asks for all costs, which are checked: what cannot be is told before anything runs, at every fidelity.
  virtual void check_timing() const = 0;
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
    if (value == 0 || value > largest) fault("timing", "{} is {}, and must be 1 to {}", what, value, largest);
  }
  void check_rate(const char* what, Rate rate, std::uint32_t most_in_a_cycle) const {
    check_rate(what, rate.items);
    check_rate(what, rate.cycles);
    check_rate(what, rate.most_in_a_cycle(), most_in_a_cycle);
  }
  void check_latency(const char* what, std::uint32_t value) const { check_rate(what, value, longest_latency); }
  void check_throughput(const Throughput& timing) const {
    check_rate("items_per_cycle", timing.items_per_cycle);
    check_latency("latency_cycles", timing.latency_cycles);
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
  Cycle cycle() const;

  const std::string name_;  ///< slot=implementation
  const Frame& frame_;
  const ScreenTiling grid_;
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
  void hold_as(const Behaviour& other) override {
    ask("hold_as", [&] { checked_->hold_as(other.unit()); });
  }

 protected:
  const std::unique_ptr<SlotBehaviour> checked_;
};

/// Makes the checked unit of a slot around one that is to be of that slot.
template <class Checked, class SlotBehaviour>
std::unique_ptr<Behaviour> make_checked(const std::string& name, const RenderContext& context,
                                        std::unique_ptr<Behaviour> behaviour) {
  auto* const typed = dynamic_cast<SlotBehaviour*>(behaviour.get());
  if (typed == nullptr) throw SimulationFault(name, 0, "make_behaviour makes a unit of another slot");
  static_cast<void>(behaviour.release());
  auto checked = std::make_unique<Checked>(name, context, std::unique_ptr<SlotBehaviour>(typed));
  checked->check_timing();
  return checked;
}

}  // namespace vrpipe
