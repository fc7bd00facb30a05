// What results may not depend on: repetition, the order of ticks, stalls, the depth of queues.

#include <functional>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/netlist.h>

#include "support/refusals.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::request_of;
using testing::run;
using testing::same_image;
using testing::strictly;

// case T11
TEST(Determinism, RepeatedRunsHaveTheSameHash) {
  const Draw draw = testing::random_draw(64, 64, 300, 1);
  for (const Variant& variant : variants()) {
    const RunResult first = run(request_of(variant.name), draw);
    for (int i = 0; i < 3; ++i)
      EXPECT_EQ(run(request_of(variant.name), draw).result_hash, first.result_hash) << variant.name;
  }
}

TEST(Determinism, TheOrderInWhichUnitsTickChangesNoBit) {
  const Draw draw = testing::random_draw(64, 64, 300, 2);
  for (const Variant& variant : variants()) {
    for (const char* platform : {"agx-orin-ideal-memory", "desktop"}) {
      const auto on = [&](std::uint64_t seed) {
        return request_of(variant.name, Fidelity::cycle, [&](RunRequest& r) {
          r.platform = &platform_named(platform);
          r.tick_order_seed = seed;
        });
      };
      const std::string expected = run(on(0), draw).result_hash;
      for (std::uint64_t seed = 1; seed <= 6; ++seed)
        EXPECT_EQ(run(on(seed), draw).result_hash, expected) << variant.name << " " << platform << " " << seed;
    }
  }
}

TEST(Determinism, StrictlyStallsChangeNeitherImageNorCounts) {
  const Draw draw = testing::random_draw(48, 48, 120, 3);
  for (const Variant& variant : variants()) {
    const RunResult expected = run(request_of(variant.name, Fidelity::cycle, strictly), draw);
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
      const RunResult stalled = run(request_of(variant.name, Fidelity::cycle,
                                               [&](RunRequest& r) {
                                                 strictly(r);
                                                 r.stall_seed = seed;
                                                 r.stall_per_256 = static_cast<unsigned>(16 + seed % 100);
                                               }),
                                    draw);
      ASSERT_TRUE(same_image(stalled.framebuffer.color, expected.framebuffer.color)) << variant.name << " " << seed;
      ASSERT_EQ(stalled.counts.named(), expected.counts.named()) << variant.name << " " << seed;
      ASSERT_GT(*stalled.cycles, *expected.cycles);
    }
  }
}

TEST(Determinism, InPaperTerminationStallsKeepTheImageWithinItsBound) {
  const Draw draw = testing::random_draw(48, 48, 300, 4);
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    testing::expect_near_reference(run(request_of("het+qm", Fidelity::cycle,
                                                  [&](RunRequest& r) {
                                                    r.stall_seed = seed;
                                                    r.stall_per_256 = 80;
                                                  }),
                                       draw),
                                   draw, 0.004);
  }
}

// case M06
TEST(Determinism, TheLatenciesOfShadersChangeNoImage) {
  const Draw draw = testing::random_draw(64, 64, 300, 5);
  for (const char* variant : {"baseline", "qm"}) {
    RunResult expected;
    for (const char* latency : {"0", "75", "5000"}) {
      const RunResult result = run(
          request_of(
              variant, Fidelity::cycle,
              [&](RunRequest& r) {
                strictly(r);
                r.settings = {{"sm", "fragment_latency_cycles", latency}, {"sm", "attribute_latency_cycles", latency}};
              }),
          draw);
      if (std::string(latency) == "0") {
        expected = result;
      } else {
        EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color)) << latency;
        EXPECT_EQ(result.counts.named(), expected.counts.named());
      }
    }
  }
}

// case T10
TEST(QueuesOfOnePlace, CompleteWithTheSameImageAndAreNotFaster) {
  const Platform shallow = testing::edited("agx-orin-ideal-memory", [](Netlist& netlist) {
    for (const Link& link : netlist.links()) link.parameters->depth = 1;
  });
  const Draw draw = testing::random_draw(64, 64, 300, 6);
  for (const Variant& variant : variants()) {
    const auto on = [&](const Platform* platform) {
      return request_of(variant.name, Fidelity::cycle, [&](RunRequest& r) {
        strictly(r);
        r.platform = platform;
        r.settings = {{"l2", "latency_cycles", "1"}};
      });
    };
    const RunResult deep = run(on(&platform_named("agx-orin-ideal-memory")), draw);
    const RunResult one = run(on(&shallow), draw);
    EXPECT_TRUE(same_image(deep.framebuffer.color, one.framebuffer.color)) << variant.name;
    EXPECT_EQ(deep.counts.named(), one.counts.named()) << variant.name;
    EXPECT_GE(*one.cycles, *deep.cycles) << variant.name;
  }
}

/// Takes nothing.
class Wall : public Unit {
 public:
  Wall(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour)
      : Unit(name, domain, {}), in_(*this, "in_color"), behaviour_(std::move(behaviour)) {}
  bool idle() const override { return true; }
  Behaviour& behaviour() override { return *behaviour_; }
  bool ends_frame() const override { return true; }

 private:
  Cycle tick(Cycle) override { return never; }
  StreamIn<ColorBeat> in_;
  std::unique_ptr<Behaviour> behaviour_;
};

struct WallBehaviour : Behaviour {
  struct Parameters : ParameterSet {};
  WallBehaviour(const Parameters&, const RenderContext&) {}
};

void register_wall() {
  Registry::instance().add(Slot{"wall", 1000, "wall"});
  const Registrar<WallBehaviour, Behaviour> wall("wall", "wall", "takes nothing");
  register_unit_maker("wall",
                      [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                         const RenderContext&, unsigned) -> std::unique_ptr<Unit> {
                        return std::make_unique<Wall>(name.c_str(), domain, std::move(behaviour));
                      });
}

TEST(Deadlock, IsReportedWithTheUnitsThatWait) {
  register_wall();
  const Platform broken = testing::edited("agx-orin-ideal-memory", [](Netlist& netlist) {
    netlist.disconnect("gpc0.prop.out_color");
    netlist.add("gpc0.wall");
    netlist.connect("gpc0.prop.out_color", "gpc0.wall.in_color", 2);
  });
  const Draw draw = testing::random_draw(64, 64, 300, 7);
  try {
    run(request_of("baseline", Fidelity::cycle, [&](RunRequest& r) { r.platform = &broken; }), draw);
    FAIL() << "it came to an end";
  } catch (const SimulationFault& fault) {
    const std::string message = fault.what();
    EXPECT_NE(message.find("deadlock"), std::string::npos) << message;
    EXPECT_NE(message.find("gpc0.prop"), std::string::npos) << message;
    EXPECT_NE(message.find("gpc0.sm"), std::string::npos) << message;
    EXPECT_EQ(message.find("gpc0.crop"), std::string::npos) << message << ": CROP has nothing to do";
  }
}

std::string refusal_of_wiring(std::function<void(Netlist&)> wire, Fidelity fidelity) {
  Platform wrong = platform_named("agx-orin-ideal-memory");
  wrong.name = "wrong";
  wrong.wire = std::move(wire);
  const RunRequest request = request_of("baseline", fidelity, [&](RunRequest& r) { r.platform = &wrong; });
  return testing::refusal_of([&] { run(request, testing::draw_of(16, 16)); });
}

TEST(Wiring, APortLeftOpenIsNamed) {
  for (const Fidelity fidelity : fidelities()) {
    const std::string error = refusal_of_wiring([](Netlist& netlist) { netlist.add("draw"); }, fidelity);
    EXPECT_NE(error.find("draw.out_vertices_0"), std::string::npos) << error;
  }
}

TEST(Wiring, UnknownUnitsAndPortsGetTheNearestName) {
  for (const Fidelity fidelity : fidelities()) {
    const auto expect = [&](const std::string& text, std::function<void(Netlist&)> wire) {
      const std::string error = refusal_of_wiring(std::move(wire), fidelity);
      EXPECT_NE(error.find(text), std::string::npos) << error << " at " << name_of(fidelity);
    };
    expect("did you mean draw", [](Netlist& netlist) {
      netlist.add("draw");
      netlist.add("gpc0.sm");
      netlist.connect("drow.out_vertices_0", "gpc0.sm.in_vertices");
    });
    expect("out_vertices_0", [](Netlist& netlist) {
      netlist.add("draw");
      netlist.add("gpc0.sm");
      netlist.connect("draw.out_vertexes_0", "gpc0.sm.in_vertices");
    });
    expect("different items", [](Netlist& netlist) {
      netlist.add("draw");
      netlist.add("gpc0.tc");
      netlist.connect("draw.out_vertices_0", "gpc0.tc.in_quads");
    });
    expect("adds no unit", [](Netlist&) {});
    expect("unknown slot 'tcc'", [](Netlist& netlist) { netlist.add("gpc0.tcc"); });
    expect("has 1 GPCs", [](Netlist& netlist) { netlist.add("gpc1.tc"); });
  }
}

// What ran ahead is repeated by warps that reach the SMs before the last of their bin is tested.
TEST(StrictTermination, DoesNotDependOnHowFastBinsAreTested) {
  const Draw draw = testing::random_draw(64, 64, 300, 8);
  for (const char* variant : {"het", "het+qm"}) {
    const RunResult expected = run(request_of(variant, Fidelity::functional, strictly), draw);
    for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
      for (const char* quads : {"1", "2", "5"}) {
        const RunResult result = run(request_of(variant, fidelity,
                                                [&](RunRequest& r) {
                                                  strictly(r);
                                                  r.settings = {{"zrop", "quads_per_cycle", quads}};
                                                }),
                                     draw);
        EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color))
            << variant << " " << name_of(fidelity) << " " << quads;
        EXPECT_EQ(result.counts.named(), expected.counts.named())
            << variant << " " << name_of(fidelity) << " " << quads;
      }
    }
  }
}

TEST(Requests, UnknownNamesAndValuesAreRefusedBeforeAnythingRuns) {
  const auto refused = [](const std::function<void(RunRequest&)>& change) {
    RunRequest request = request_of("het+qm", Fidelity::cycle, change);
    EXPECT_THROW(check_configuration(request), UserError);
  };
  refused([](RunRequest& r) { r.settings = {{"tcc", "bins", "3"}}; });
  refused([](RunRequest& r) { r.settings = {{"tc", "binz", "3"}}; });
  refused([](RunRequest& r) { r.settings = {{"tc", "bins", "0"}}; });
  refused([](RunRequest& r) { r.settings = {{"l2", "latency", "0"}}; });
  refused([](RunRequest& r) { r.units = {{"qru", "pear"}}; });
  refused([](RunRequest& r) { r.units = {{"quru", "pairing"}}; });
  EXPECT_NO_THROW(check_configuration(request_of("baseline", Fidelity::cycle, [](RunRequest& r) {
    r.settings = {{"qru", "quads_per_cycle", "4"}};
  })));
  EXPECT_THROW(platform_named("agx-orni"), UserError);
  EXPECT_THROW(variant_named("hat"), UserError);
}

TEST(Requests, ImagesOfUnusableSizeAreRefused) {
  for (const auto& [width, height] : {std::pair{0U, 16U}, {16U, 0U}, {16385U, 16U}, {16U, 16448U}}) {
    EXPECT_THROW(run(request_of("baseline"), testing::draw_of(width, height)), UserError);
  }
}

}  // namespace
}  // namespace vrpipe
