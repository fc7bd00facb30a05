// A slot of one's own counts for the frame, is given its surfaces, and is in the bound, in occupancy and in the account of
// cycles like any other.
#include <algorithm>

#include <gtest/gtest.h>

#include <vrpipe/model/timed.h>
#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/netlist.h>

#include "support/builders.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

/// Takes every third quad away, and counts it as terminated, if it is honest.
class Sieve : public Behaviour {
 public:
  struct Parameters : ParameterSet {
    Switch honest{*this, "honest", true, "of this test", "counts what it takes away"};
    Integer beat_cycles{*this, "beat_cycles", 1, 1, 1000, "cycles", "of this test", "of a beat"};
  };
  Sieve(const Parameters& parameters, const RenderContext&)
      : honest_(parameters.honest), kinds_{{"beats", 0, static_cast<double>(parameters.beat_cycles), true}} {}
  void use_surfaces(Framebuffer& framebuffer) override { width_ = framebuffer.color.width(); }
  void add_to(Counts& counts, const CountOf& of) const override {
    counts.quads_terminated += of(quads);
    counts.fragments_terminated += of(fragments);
  }
  QuadBeat pass(const QuadBeat& beat) {
    EXPECT_GT(width_, 0U) << "it was given the surfaces";
    QuadBeat left = beat;
    left.count = 0;
    for (unsigned i = 0; i < beat.count; ++i) {
      if (++seen_ % 3 != 0) {
        left.quads[left.count++] = beat.quads[i];
      } else if (honest_) {
        quads.add(beat.quads[i].draw, 1);
        fragments.add(beat.quads[i].draw, popcount(beat.quads[i].coverage));
      }
    }
    return left;
  }
  const std::vector<WorkKind>& kinds() const { return kinds_; }
  Cycle beat_cycles() const { return static_cast<Cycle>(kinds_[0].cycles_per_item); }

  DrawCounter quads{*this, "quads", "quads", "taken away"};
  DrawCounter fragments{*this, "fragments", "fragments", "of these"};

 private:
  const bool honest_;
  const std::vector<WorkKind> kinds_;
  std::uint64_t seen_ = 0;
  std::uint32_t width_ = 0;
};

class UntimedSieve : public UntimedUnit {
 public:
  UntimedSieve(const std::string& name, std::unique_ptr<Sieve> sieve)
      : UntimedUnit(name, sieve->kinds()),
        out_(*this, "out_quads"),
        in_(input<QuadBeat>("in_quads",
                            [this](const QuadBeat& beat) {
                              did(0, 1);
                              out_.send(sieve_->pass(beat));
                            })),
        sieve_(std::move(sieve)) {}
  Behaviour& behaviour() override { return *sieve_; }

 private:
  UntimedOut<QuadBeat> out_;
  std::unique_ptr<UntimedIn<QuadBeat>> in_;
  std::unique_ptr<Sieve> sieve_;
};

class TimedSieve : public TimedUnit {
 public:
  TimedSieve(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<Sieve> sieve)
      : TimedUnit(name, domain, sieve->kinds()),
        out_(*this, "out_quads"),
        in_(*this, "in_quads",
            [this](const QuadBeat& beat, CycleInterval visible) { return pass(beat, visible.first); }),
        sieve_(std::move(sieve)) {}
  Behaviour& behaviour() override { return *sieve_; }

 private:
  Cycle pass(const QuadBeat& beat, Cycle visible) {
    const Cycle at = std::max({visible, free_, out_.last()});
    did(0, 1, at, at + sieve_->beat_cycles());
    charge(UnitState::starved, at);
    const Cycle taken = out_.send(sieve_->pass(beat), at).first;
    charge(UnitState::blocked, taken);
    free_ = taken + sieve_->beat_cycles();
    charge(UnitState::busy, free_);
    return taken;
  }
  TimedOut<QuadBeat> out_;
  TimedIn<QuadBeat> in_;
  std::unique_ptr<Sieve> sieve_;
  Cycle free_ = 0;
};

class SieveUnit : public Unit {
 public:
  SieveUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<Sieve> sieve)
      : Unit(name, domain, sieve->kinds()),
        in_(*this, "in_quads"),
        out_(*this, "out_quads"),
        sieve_(std::move(sieve)) {}
  bool idle() const override { return in_.empty(); }
  Behaviour& behaviour() override { return *sieve_; }

 private:
  Cycle tick(Cycle now) override {
    if (now < free_) return free_;
    if (in_.ready() && out_.credits() > 0) {
      out_.push(sieve_->pass(in_.front()));
      in_.pop();
      free_ = now + sieve_->beat_cycles();
      did(0, 1, now, free_);
      enter(UnitState::busy, now);
      return free_;
    }
    enter(in_.ready() ? UnitState::blocked : UnitState::starved, now);
    return in_.ready() ? never : in_.next_ready();
  }
  StreamIn<QuadBeat> in_;
  StreamOut<QuadBeat> out_;
  std::unique_ptr<Sieve> sieve_;
  Cycle free_ = 0;
};

const SlotRegistrar slot({"sieve", 46, "sieve"}, {{"beat_cycles", 1, 100}});
const SlotRegistrar clocked_slot({"clocked-sieve", 47, "sieve"}, {{"beat_cycles", 1, 100}});
const Registrar<Sieve, Behaviour> clocked_sieve("clocked-sieve", "sieve", "has no timing model of lt");
[[maybe_unused]] const bool clocked_sieve_registered = [] {
  register_unit_maker("clocked-sieve", [](const std::string& name, ClockDomain& domain,
                                          std::unique_ptr<Behaviour> behaviour, const RenderContext&, unsigned) {
    return std::make_unique<SieveUnit>(name.c_str(), domain, behaviour_as<Sieve>(std::move(behaviour)));
  });
  return true;
}();
const Registrar<Sieve, Behaviour> sieve("sieve", "sieve", "takes every third quad away");
[[maybe_unused]] const bool sieve_registered = [] {
  register_untimed_unit_maker("sieve", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                          const RenderContext&, unsigned) {
    return std::make_unique<UntimedSieve>(name, behaviour_as<Sieve>(std::move(behaviour)));
  });
  register_timed_unit_maker("sieve", [](const std::string& name, ClockDomain& domain,
                                        std::unique_ptr<Behaviour> behaviour, const RenderContext&, unsigned) {
    return std::make_unique<TimedSieve>(name.c_str(), domain, behaviour_as<Sieve>(std::move(behaviour)));
  });
  register_unit_maker("sieve", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                  const RenderContext&, unsigned) {
    return std::make_unique<SieveUnit>(name.c_str(), domain, behaviour_as<Sieve>(std::move(behaviour)));
  });
  return true;
}();

RunResult sieved(Fidelity fidelity, std::vector<Setting> settings = {}, const std::string& in_slot = "sieve",
                 std::vector<std::string> units_at_cycle = {}) {
  const Platform platform = testing::edited("agx-orin-ideal-memory", [&](Netlist& netlist) {
    netlist.insert("gpc0.raster.out_quads", "gpc0.sieve", in_slot, "in_quads", "out_quads");
  });
  static const Draw draw = testing::random_draw(96, 96, 2000, 3);
  RunRequest request = testing::request_of("baseline", fidelity, [&](RunRequest& r) {
    r.platform = &platform;
    r.termination = Termination::strict;  // no time-out: the bound counts what the slot's place in the draw allows
    r.settings = std::move(settings);
    r.units_at_cycle = std::move(units_at_cycle);
  });
  return testing::run(request, draw);
}

TEST(OwnSlot, CountsForTheFrameWhatItTakesAway) {
  for (const Fidelity fidelity : fidelities()) {
    const RunResult result = sieved(fidelity);  // whose quads are conserved, or it throws
    EXPECT_EQ(result.counts.quads_terminated, result.counts.quads_rasterized / 3) << name_of(fidelity);
    EXPECT_EQ(result.counts.quads_shaded + result.counts.quads_terminated, result.counts.quads_rasterized);
    EXPECT_THROW(sieved(fidelity, {{"sieve", "honest", "off"}}), SimulationFault) << name_of(fidelity);
  }
}

TEST(OwnSlot, IsInTheBoundInOccupancyAndInTheAccountOfCycles) {
  const std::vector<Setting> slow{{"sieve", "beat_cycles", "7"}};
  const RunResult exact = sieved(Fidelity::cycle, slow);
  for (const Fidelity fidelity : {Fidelity::bound, Fidelity::lt, Fidelity::cycle}) {
    const RunResult result = sieved(fidelity, slow);
    const auto sieve_of = [](const UnitReport& unit) { return unit.name == "gpc0.sieve"; };
    const auto report = std::find_if(result.units.begin(), result.units.end(), sieve_of);
    ASSERT_NE(report, result.units.end()) << name_of(fidelity);
    EXPECT_GT(report->occupancy, 0.9) << name_of(fidelity);
    std::uint64_t sum = 0;
    for (const std::uint64_t cycles : report->cycles) sum += cycles;
    EXPECT_EQ(sum, *result.cycles) << name_of(fidelity);
    ASSERT_TRUE(result.bottleneck.has_value()) << name_of(fidelity);
    EXPECT_EQ(result.bottleneck->unit, "gpc0.sieve") << name_of(fidelity);
    const auto off = static_cast<double>(*result.cycles) / static_cast<double>(*exact.cycles) - 1;
    EXPECT_LE(off, fidelity == Fidelity::bound ? 0 : 0.01) << name_of(fidelity);
    EXPECT_GE(off, -0.02) << name_of(fidelity);
  }
}

TEST(OwnSlot, CanBeAtCycleAmongOthersAtLt) {
  const std::vector<Setting> slow{{"gpc0.sieve", "beat_cycles", "7"}};
  const RunResult exact = sieved(Fidelity::cycle, slow);
  const RunResult asked = sieved(Fidelity::lt, slow, "sieve", {"sieve"});
  EXPECT_EQ(asked.counts.quads_terminated, asked.counts.quads_rasterized / 3);
  EXPECT_NEAR(static_cast<double>(*asked.cycles) / static_cast<double>(*exact.cycles), 1, 0.01);
  // One without a timing model of lt is.
  const RunResult alone = sieved(Fidelity::lt, slow, "clocked-sieve");
  EXPECT_EQ(alone.cycles, asked.cycles);
}

TEST(OwnSlot, SaysForWhichParametersItWasValidated) {
  const auto mentions = [](const RunResult& result, const std::string& text) {
    return std::any_of(result.outside_validated_range.begin(), result.outside_validated_range.end(),
                       [&](const std::string& reason) { return reason.find(text) != std::string::npos; });
  };
  EXPECT_FALSE(mentions(sieved(Fidelity::lt, {{"sieve", "beat_cycles", "100"}}), "sieve.beat_cycles"));
  EXPECT_TRUE(mentions(sieved(Fidelity::lt, {{"sieve", "beat_cycles", "101"}}), "sieve.beat_cycles=101 is above 100"));
}

}  // namespace
}  // namespace vrpipe
