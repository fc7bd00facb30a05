// What SystemC's own tools see of a platform: modules with parents and children.

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <systemc>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/platforms/foreign_memory.h>
#include <vrpipe/platforms/gpu.h>
#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/wiring.h>

#include "support/fidelities.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::edited;
using testing::fidelities_with_time;
using testing::random_draw;
using testing::request_of;
using testing::run;

/// A platform, elaborated.
class Elaborated {
 public:
  explicit Elaborated(const RunRequest& request)
      : draw_(random_draw(32, 32, 10, 1)),
        frame_(Frame::of(draw_)),
        configuration_(request, *frame_),
        framebuffer_(*frame_, request.format) {
    fresh_simulation();
    gpu_ = std::make_unique<Gpu>(configuration_, framebuffer_);
  }
  const Gpu& gpu() const { return *gpu_; }

 private:
  const Draw draw_;
  const std::shared_ptr<const Frame> frame_;
  const Configuration configuration_;
  Framebuffer framebuffer_;
  std::unique_ptr<Gpu> gpu_;
};

std::vector<std::string> names_of(const std::vector<sc_core::sc_object*>& objects) {
  std::vector<std::string> names;
  for (const sc_core::sc_object* object : objects) names.emplace_back(object->name());
  return names;
}

std::string parent_of(const std::string& path) {
  const sc_core::sc_object* const object = sc_core::sc_find_object(path.c_str());
  if (object == nullptr) return "there is no " + path;
  const sc_core::sc_object* const parent = object->get_parent_object();
  return parent == nullptr ? "" : parent->name();
}

/// While it lives, a name that is taken is an error, where SystemC would warn and choose another.
class NoNameIsTaken {
 public:
  NoNameIsTaken() { sc_core::sc_report_handler::set_actions(sc_core::SC_ID_INSTANCE_EXISTS_, sc_core::SC_THROW); }
  ~NoNameIsTaken() {
    sc_core::sc_report_handler::set_actions(sc_core::SC_ID_INSTANCE_EXISTS_, sc_core::SC_DEFAULT_WARNING_ACTIONS);
  }
};

TEST(Hierarchy, EveryInstanceIsFoundByItsPathInItsGpc) {
  const NoNameIsTaken check;
  for (const Fidelity fidelity : fidelities_with_time()) {
    const Platform platform = edited("desktop", [](Netlist& netlist) {
      wire_dram(netlist, "lpddr3-1600");
      connect_attribute_traffic(netlist);
      insert_l1(netlist);
      connect_depth_stencil_traffic(netlist);
    });
    const Elaborated of(request_of("het+qm", fidelity, [&](RunRequest& r) {
      r.platform = &platform;
      r.effects = EffectChoice::everything();
    }));
    EXPECT_EQ(names_of(sc_core::sc_get_top_level_objects()),
              (std::vector<std::string>{"clock", "draw", "wdx", "gpc0", "gpc1", "gpc2", "gpc3", "l2", "dram"}));
    for (const Gpu::Placed& placed : of.gpu().units()) {
      const std::string& path = placed.instance->path;
      EXPECT_EQ(sc_core::sc_find_object(path.c_str()), placed.unit.get()) << path;
      EXPECT_EQ(parent_of(path), placed.instance->in_front_end ? "" : "gpc" + std::to_string(placed.instance->gpc));
    }
    for (const Gpu::PlacedMemory& placed : of.gpu().memories()) {
      const std::string& path = placed.instance->path;
      EXPECT_EQ(parent_of(path), placed.instance->in_front_end ? "" : "gpc" + std::to_string(placed.instance->gpc));
    }
    EXPECT_EQ(names_of(sc_core::sc_find_object("gpc2")->get_child_objects()),
              (std::vector<std::string>{"gpc2.vpo", "gpc2.tgc", "gpc2.raster", "gpc2.tc", "gpc2.prop", "gpc2.zrop",
                                        "gpc2.qru", "gpc2.sm", "gpc2.crop", "gpc2.l1"}));
    EXPECT_EQ(parent_of("gpc3.crop.memory"), "gpc3.crop") << "a memory port";
  }
}

TEST(Hierarchy, IsTheSameInEverySimulationOfAProcess) {
  const NoNameIsTaken check;
  const RunRequest request =
      request_of("het", Fidelity::cycle, [](RunRequest& r) { r.platform = &platform_named("desktop"); });
  const std::string hash = run(request, random_draw(48, 48, 50, 2)).result_hash;
  for (unsigned i = 0; i < 2; ++i) {
    const Elaborated of(request);
    EXPECT_EQ(parent_of("gpc3.crop"), "gpc3");
  }
  EXPECT_EQ(sc_core::sc_find_object("gpc3"), nullptr) << "nothing is left of one";
  EXPECT_EQ(run(request, random_draw(48, 48, 50, 2)).result_hash, hash);
}

TEST(Hierarchy, WhatIsPutOnALinkOrAPortIsAChildOfTheUnitThatHasIt) {
  RunRequest request = request_of("het");
  const Platform platform = edited("desktop", [](Netlist& netlist) { netlist.disconnect("gpc1.prop.out_color"); });
  request.platform = &platform;
  request.observers = std::make_shared<Observers>();
  request.observers->on_link<QuadBeat>("gpc2.raster.quads", [](const auto&) {});
  const Elaborated of(request);
  EXPECT_EQ(parent_of("gpc2.raster.tap_0"), "gpc2.raster");
  EXPECT_EQ(parent_of("gpc1.prop.stub_0"), "gpc1.prop");
  EXPECT_EQ(parent_of("gpc1.crop.stub_0"), "gpc1.crop");
}

/// Of a slot of one's own, with a module in it.
class Bystander : public Unit {
 public:
  Bystander(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour)
      : Unit(name, domain, {}), part_("part", 1000), behaviour_(std::move(behaviour)) {}
  bool idle() const override { return true; }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  Cycle tick(Cycle) override { return never; }
  ClockDomain part_;
  std::unique_ptr<Behaviour> behaviour_;
};

struct BystanderBehaviour : Behaviour {
  struct Parameters : ParameterSet {};
  BystanderBehaviour(const Parameters&, const RenderContext&) {}
};

std::unique_ptr<Unit> make_bystander(const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                     const RenderContext&, unsigned) {
  return std::make_unique<Bystander>(name.c_str(), domain, std::move(behaviour));
}

TEST(Hierarchy, HoldsUnitsInSlotsOfOnesOwnAndMemoriesOfOtherMakes) {
  Registry::instance().add(Slot{"bystander", 1001, "bystander"});
  const Registrar<BystanderBehaviour, Behaviour> bystander("bystander", "bystander", "does nothing");
  register_unit_maker("bystander", make_bystander);
  register_timed_unit_maker("bystander", make_bystander);
  const NoNameIsTaken check;
  for (const Fidelity fidelity : fidelities_with_time()) {
    std::string given;
    const Platform platform = edited("desktop", [&](Netlist& netlist) {
      netlist.add("gpc1.bystander");
      netlist.add("gpc1.cluster0.bystander");
      netlist.add("gpc1.cluster1.bystander");
      netlist.add("gpc1.crop.bystander");
      netlist.add_memory("gpc2.ram", [&](const std::string& name, unsigned) -> ForeignMemory {
        given = name;
        auto& clock = dynamic_cast<ClockDomain&>(*sc_core::sc_find_object("clock"));
        auto memory = std::make_unique<FixedLatencyMemory>(name.c_str(), clock, 100, 32, 1);
        tlm::tlm_base_target_socket_b<32>& socket = memory->port(0);
        return {std::move(memory), {&socket}};
      });
      netlist.connect_memory("gpc2.crop", "gpc2.ram");
    });
    const Elaborated of(request_of("het", fidelity, [&](RunRequest& r) { r.platform = &platform; }));
    EXPECT_EQ(parent_of("gpc1.bystander"), "gpc1");
    EXPECT_EQ(parent_of("gpc1.bystander.part"), "gpc1.bystander");
    EXPECT_EQ(parent_of("gpc1.cluster0.bystander"), "gpc1.cluster0");
    EXPECT_EQ(parent_of("gpc1.cluster1.bystander"), "gpc1.cluster1");
    EXPECT_EQ(parent_of("gpc1.cluster1"), "gpc1");
    EXPECT_EQ(parent_of("gpc1.crop_bystander"), "gpc1") << "what is in an instance lies beside it";
    EXPECT_EQ(given, "ram");
    EXPECT_EQ(parent_of("gpc2.ram"), "gpc2");
    EXPECT_EQ(parent_of("gpc2.ram.port_0"), "gpc2.ram");
  }
}

TEST(Hierarchy, IsInWhatAUnitSaysOfItself) {
  const Elaborated of(
      request_of("het", Fidelity::cycle, [](RunRequest& r) { r.platform = &platform_named("desktop"); }));
  for (const Gpu::Placed& placed : of.gpu().units()) {
    EXPECT_EQ(placed.unit->label(), placed.instance->path);
    try {
      placed.unit->in("nothing");
      ADD_FAILURE() << "there is no such port";
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find("unit " + placed.instance->path), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace vrpipe
