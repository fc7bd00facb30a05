// Platforms as lists of units and links: edited, left incomplete, with instances that differ, with foreign memories.

#include <algorithm>
#include <functional>
#include <memory>
#include <string>

#include <gtest/gtest.h>
#include <systemc>
#include <tlm>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/slots/crop.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/platforms/foreign_memory.h>
#include <vrpipe/platforms/wiring.h>

#include "crop/crop_time.h"
#include "support/refusals.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::edited;
using testing::random_draw;
using testing::request_of;
using testing::run;
using testing::same_image;
using testing::strictly;

std::string refusal_of_run(const Platform& platform, Fidelity fidelity, const std::vector<Setting>& settings = {}) {
  RunRequest request = request_of("het+qm", fidelity, strictly);
  request.platform = &platform;
  request.settings = settings;
  return testing::refusal_of([&] { run(request, random_draw(32, 32, 10, 1)); });
}

/// 100 ns for any access; a refresh that never stops, if it is asked for.
class OtherMemory : public sc_core::sc_module, private tlm::tlm_fw_transport_if<> {
 public:
  OtherMemory(const sc_core::sc_module_name& name, unsigned units) : sc_module(name) {
    for (unsigned unit = 0; unit < units; ++unit) {
      sockets.push_back(std::make_unique<tlm::tlm_target_socket<32>>(("port" + std::to_string(unit)).c_str()));
      sockets.back()->bind(*this);
    }
    SC_HAS_PROCESS(OtherMemory);
    SC_METHOD(refresh);
  }
  std::vector<std::unique_ptr<tlm::tlm_target_socket<32>>> sockets;

 private:
  void refresh() { next_trigger(3900, sc_core::SC_NS); }
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) override {
    delay += sc_core::sc_time(100, sc_core::SC_NS);
    payload.set_response_status(tlm::TLM_OK_RESPONSE);
  }
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override {
    if (phase == tlm::BEGIN_REQ) b_transport(payload, delay);
    return tlm::TLM_COMPLETED;
  }
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }
};

ForeignMemory make_other(const std::string& name, unsigned units) {
  auto memory = std::make_unique<OtherMemory>(name.c_str(), units);
  ForeignMemory made;
  for (const auto& socket : memory->sockets) made.sockets.push_back(socket.get());
  made.module = std::move(memory);
  return made;
}

TEST(Netlist, IsWhatThePlatformsWire) {
  Netlist netlist(4);
  platform_named("desktop").wire(netlist);
  EXPECT_EQ(netlist.instances().size(), 3U + 4 * 9);
  EXPECT_EQ(netlist.links().size(), 4U * 19);
  ASSERT_NE(netlist.find("gpc3.tc"), nullptr);
  EXPECT_EQ(netlist.find("gpc3.tc")->slot, "tc");
  EXPECT_EQ(netlist.find("gpc3.tc")->gpc, 3U);
  EXPECT_FALSE(netlist.find("gpc3.tc")->in_front_end);
  EXPECT_TRUE(netlist.find("wdx")->in_front_end);
  EXPECT_EQ(netlist.link_from("gpc3.tc.out_bins")->to, "gpc3.prop.in_bins");
  EXPECT_EQ(netlist.link_from("gpc3.tc.out_bins")->name(), "gpc3.tc.bins");
  EXPECT_EQ(netlist.bound_to("l2").size(), 4U);
}

TEST(Netlist, NamesOfAPathAreThePathAndThatOfAllGpcs) {
  EXPECT_EQ(without_gpc("gpc12.tc"), "tc");
  EXPECT_EQ(without_gpc("wdx.primitives_3"), "wdx.primitives");
  EXPECT_EQ(without_gpc("gpcx.tc"), "gpcx.tc");
  EXPECT_TRUE(names_path("tc", "gpc1.tc"));
  EXPECT_TRUE(names_path("gpc1.tc", "gpc1.tc"));
  EXPECT_FALSE(names_path("gpc0.tc", "gpc1.tc"));
}

TEST(Netlist, EditsThatCannotBeAreRefused) {
  const auto refused = [](const std::function<void(Netlist&)>& edit) {
    Netlist netlist(1);
    wire_pipeline(netlist);
    EXPECT_THROW(edit(netlist), UserError);
  };
  refused([](Netlist& n) { n.add("gpc0.tc"); });
  refused([](Netlist& n) { n.add("gpc1.tc"); });
  refused([](Netlist& n) { n.add("gpc0.render"); });
  refused([](Netlist& n) { n.connect("gpc0.tc.out_bins", "gpc0.qru.in_quads"); });
  refused([](Netlist& n) { n.connect("nodot", "gpc0.qru.in_quads"); });
  refused([](Netlist& n) { n.remove("gpc0.tcc"); });
  refused([](Netlist& n) { n.replace("gpc0.tcc", "tile-coalescing"); });
  refused([](Netlist& n) { n.disconnect("gpc0.tc.out_bin"); });
  refused([](Netlist& n) { n.insert("gpc0.tc.out_bin", "gpc0.x", "tc", "in_quads", "out_bins"); });
  refused([](Netlist& n) { n.connect_memory("gpc0.crop", "l3"); });
  refused([](Netlist& n) { n.add_memory("l2", make_other); });
  refused([](Netlist& n) { n.replace_memory("l3", nullptr); });
  refused([](Netlist& n) { n.connect_memory("l2", "l2"); });
  refused([](Netlist& n) { n.connect_memory("gpc0.crop", "gpc0.zrop"); });
  refused([](Netlist& n) { n.remove("l2"); });
  refused([](Netlist& n) {
    n.add("far", "l2");
    n.connect_memory("l2", "far");
    n.connect_memory("far", "l2");
  });
  refused([](Netlist& n) {
    n.add_memory("dram", make_other);
    n.connect_memory("dram", "l2");
  });
}

// A platform that leaves the colour ROPs out draws nothing, whoever asks.
TEST(Netlist, WhatAPlatformLeavesOutIsMissingAtEveryFidelity) {
  const Platform half = edited("agx-orin-ideal-memory", [](Netlist& netlist) { netlist.remove("gpc0.raster"); });
  const Draw draw = random_draw(64, 64, 100, 3);
  for (const Fidelity fidelity : {Fidelity::functional, Fidelity::bound}) {
    RunRequest request = request_of("baseline", fidelity);
    request.platform = &half;
    const RunResult result = run(request, draw);
    EXPECT_EQ(result.counts.quads_rasterized, 0U) << name_of(fidelity);
    EXPECT_EQ(result.counts.quads_blended, 0U) << name_of(fidelity);
    EXPECT_GT(result.counts.primitives, 0U) << name_of(fidelity);
    EXPECT_TRUE(std::none_of(result.units.begin(), result.units.end(),
                             [](const UnitReport& unit) { return unit.name == "gpc0.raster"; }));
  }
  // With time the end of the frame never comes to CROP.
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    RunRequest request = request_of("baseline", fidelity);
    request.platform = &half;
    EXPECT_THROW(run(request, draw), SimulationFault) << name_of(fidelity);
  }
}

TEST(Netlist, AFrontEndAloneRunsAtEveryFidelity) {
  Platform front = platform_named("agx-orin-ideal-memory");
  front.name = "front-end";
  front.wire = [](Netlist& netlist) {
    wire_pipeline(netlist);
    for (const char* unit : {"tgc", "raster", "tc", "prop", "zrop", "qru", "crop"}) {
      netlist.remove(std::string("gpc0.") + unit);
    }
  };
  const Draw draw = random_draw(64, 64, 100, 3);
  for (const Fidelity fidelity : fidelities()) {
    RunRequest request = request_of("baseline", fidelity);
    request.platform = &front;
    const RunResult result = run(request, draw);
    EXPECT_GT(result.counts.primitives, 0U) << name_of(fidelity);
    EXPECT_EQ(result.counts.quads_blended, 0U) << name_of(fidelity);
    const bool has_time = fidelity != Fidelity::functional;
    EXPECT_EQ(result.units.size(), has_time ? 3U : 0U) << name_of(fidelity);
  }
}

TEST(Netlist, StrictTerminationWithoutAWayToCropIsRefused) {
  const Platform broken =
      edited("agx-orin-ideal-memory", [](Netlist& netlist) { netlist.disconnect("gpc0.prop.out_survivors"); });
  EXPECT_NE(refusal_of_run(broken, Fidelity::cycle).find("no survivors leave PROP"), std::string::npos);
}

TEST(Instances, ParametersNameAnInstanceOrAllOfAKind) {
  const Draw draw = random_draw(64, 64, 50, 4);
  RunRequest request = request_of("qm", Fidelity::functional);
  request.platform = &platform_named("desktop");
  request.settings = {{"crop", "cache_bytes", "8192"},
                      {"gpc1.crop", "cache_bytes", "4096"},
                      {"link.tc.bins", "depth", "3"},
                      {"link.gpc2.tc.bins", "depth", "5"}};
  const Configuration configuration(request, *Frame::of(draw));
  const auto bytes = [&](const std::string& path) {
    return configuration.make_as<CropBehaviour>(*configuration.netlist().find(path))->time().cache.bytes;
  };
  EXPECT_EQ(bytes("gpc0.crop"), 8192U);
  EXPECT_EQ(bytes("gpc1.crop"), 4096U);
  EXPECT_EQ(bytes("gpc2.crop"), 8192U);
  const auto depth = [&](const std::string& port) {
    return std::uint32_t{configuration.netlist().link_from(port)->parameters->depth};
  };
  EXPECT_EQ(depth("gpc0.tc.out_bins"), 3U);
  EXPECT_EQ(depth("gpc2.tc.out_bins"), 5U);

  const auto listed = configuration.parameters();
  const auto value = [&](const std::string& name) {
    for (const auto& [key, text] : listed) {
      if (key == name) return text;
    }
    return std::string("absent");
  };
  EXPECT_EQ(value("crop.cache_bytes"), "8192");
  EXPECT_EQ(value("gpc1.crop.cache_bytes"), "4096");
  EXPECT_EQ(value("gpc2.crop.cache_bytes"), "absent");
  EXPECT_EQ(value("link.tc.bins.depth"), "3");
  EXPECT_EQ(value("link.gpc2.tc.bins.depth"), "5");
}

TEST(Instances, UnknownPathsAndLinksGetTheNearestName) {
  const Platform& desktop = platform_named("desktop");
  const auto text = [&](const Setting& setting) { return refusal_of_run(desktop, Fidelity::functional, {setting}); };
  EXPECT_NE(text({"gpc9.crop", "cache_bytes", "4096"}).find("did you mean gpc"), std::string::npos);
  EXPECT_NE(text({"link.tc.bin", "depth", "4"}).find("link.tc.bins"), std::string::npos);
  EXPECT_NE(text({"link.tc.bins", "deepth", "4"}).find("did you mean link.tc.bins.depth"), std::string::npos);
  EXPECT_NE(text({"link.tc.bins", "depth", "0"}).find("1 to 65536"), std::string::npos);
  const Platform none = edited("agx-orin-ideal-memory", [](Netlist& netlist) { netlist.remove("gpc0.tgc"); });
  EXPECT_NE(refusal_of_run(none, Fidelity::functional, {{"tgc", "bins", "4"}}).find("has none"), std::string::npos);
}

// A unit's choice by path: one GPC merges quads, the other does not.
TEST(Instances, MayHaveImplementationsOfTheirOwn) {
  const Draw draw = random_draw(96, 96, 400, 5);
  const auto merged = [&](const std::vector<UnitChoice>& units) {
    RunRequest request = request_of("qm", Fidelity::functional);
    request.platform = &platform_named("desktop");
    request.units = units;
    return run(request, draw).counts.quads_merged;
  };
  const std::uint64_t all = merged({});
  const std::uint64_t some = merged({{"gpc0.qru", "pass-through"}});
  EXPECT_EQ(merged({{"qru", "pass-through"}}), 0U);
  EXPECT_GT(some, 0U);
  EXPECT_LT(some, all);
}

TEST(Links, TheirParametersDecideAtEveryFidelityWithTime) {
  const Draw draw = random_draw(96, 96, 300, 6);
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    const auto cycles = [&](const Setting& setting) {
      RunRequest request = request_of("baseline", fidelity);
      request.settings = {setting};
      return *run(request, draw).cycles;
    };
    const Cycle plain = cycles({"link.tc.bins", "depth", "8"});
    EXPECT_GT(cycles({"link.tc.bins", "latency_cycles", "200"}), plain) << name_of(fidelity);
    // One beat of RASTER a cycle is a bottleneck.
    EXPECT_GE(cycles({"link.raster.quads", "items_per_cycle", "1"}), plain) << name_of(fidelity);
    // A warp in eight cycles is worse than what CROP needs for it.
    EXPECT_GT(cycles({"link.prop.color", "depth", "1"}), plain) << name_of(fidelity);
  }
}

// Its time goes on after the draw, and the run ends all the same.
TEST(ForeignMemories, TakeThePlaceOfTheL2) {
  const Draw draw = random_draw(96, 96, 200, 7);
  for (const char* base : {"agx-orin-ideal-memory", "desktop", "mobile"}) {
    const Platform platform = edited(base, [](Netlist& netlist) { netlist.replace_memory("l2", make_other); });
    for (const Fidelity fidelity : fidelities()) {
      RunRequest request = request_of("het+qm", fidelity, strictly);
      request.platform = &platform_named(base);
      const RunResult own = run(request, draw);
      request.platform = &platform;
      const RunResult other = run(request, draw);
      EXPECT_EQ(own.counts.named(), other.counts.named()) << base << " " << name_of(fidelity);
      EXPECT_TRUE(same_image(own.framebuffer.color, other.framebuffer.color)) << base << " " << name_of(fidelity);
    }
    EXPECT_NE(refusal_of_run(platform, Fidelity::lt, {{"l2", "latency_cycles", "9"}}).find("has none"),
              std::string::npos);
  }
}

// The L2 that nobody uses any more is not there.
TEST(ForeignMemories, MayStandBesideTheL2) {
  const Draw draw = random_draw(64, 64, 100, 7);
  const Platform platform = edited("agx-orin-ideal-memory", [](Netlist& netlist) {
    netlist.add_memory("other", make_other);
    netlist.connect_memory("gpc0.crop", "other");
  });
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    RunRequest request = request_of("baseline", fidelity);
    request.platform = &platform;
    const RunResult result = run(request, draw);
    EXPECT_GT(*result.cycles, 0U);
    for (const auto& [unit, share] : result.utilization) EXPECT_LE(share, 1.0) << unit;
  }
}

// However the wiring goes about it.
TEST(ForeignMemories, MayLieBelowTheL2) {
  const Draw draw = random_draw(64, 64, 100, 7);
  const Platform after = edited("desktop", [](Netlist& netlist) {
    netlist.add_memory("dram", make_other);
    netlist.connect_memory("l2", "dram");
  });
  Platform before = after;
  before.wire = [](Netlist& netlist) {
    netlist.add("draw");
    netlist.add("wdx");
    netlist.add_memory("dram", make_other);
    netlist.add("l2");
    netlist.connect_memory("l2", "dram");
    for (unsigned gpc = 0; gpc < netlist.gpcs(); ++gpc) wire_gpc(netlist, gpc);
  };
  for (const Fidelity fidelity : fidelities()) {
    RunRequest request = request_of("het+qm", fidelity, strictly);
    request.platform = &platform_named("desktop");
    const RunResult own = run(request, draw);
    request.platform = &after;
    const RunResult result = run(request, draw);
    EXPECT_EQ(own.counts.named(), result.counts.named()) << name_of(fidelity);
    EXPECT_TRUE(same_image(own.framebuffer.color, result.framebuffer.color)) << name_of(fidelity);
    const bool has_memory_timing = fidelity != Fidelity::functional && fidelity != Fidelity::bound;
    EXPECT_EQ(result.cycles > own.cycles, has_memory_timing) << name_of(fidelity);
    request.platform = &before;
    EXPECT_EQ(run(request, draw).result_hash, result.result_hash) << name_of(fidelity);
  }
}

TEST(ForeignMemories, BelowAnL2ThatIsReplacedAreNotMade) {
  const Platform platform = edited("agx-orin-ideal-memory", [](Netlist& netlist) {
    netlist.add_memory("dram", [](const std::string&, unsigned) -> ForeignMemory { throw std::logic_error("made"); });
    netlist.connect_memory("l2", "dram");
    netlist.replace_memory("l2", make_other);
  });
  RunRequest request = request_of("baseline", Fidelity::lt);
  request.platform = &platform;
  EXPECT_GT(*run(request, random_draw(64, 64, 100, 7)).cycles, 0U);
}

TEST(ForeignMemories, BelowAnL2ThatNoUnitUsesAreNotMade) {
  const Platform platform = edited("agx-orin-ideal-memory", [](Netlist& netlist) {
    netlist.add_memory("dram", [](const std::string&, unsigned) -> ForeignMemory { throw std::logic_error("made"); });
    netlist.connect_memory("l2", "dram");
    netlist.add_memory("other", make_other);
    netlist.connect_memory("gpc0.crop", "other");
  });
  RunRequest request = request_of("baseline", Fidelity::lt);
  request.platform = &platform;
  EXPECT_GT(*run(request, random_draw(64, 64, 100, 7)).cycles, 0U);
}

TEST(ForeignMemories, WithoutEnoughSocketsAreRefused) {
  const Platform platform = edited("desktop", [](Netlist& netlist) {
    netlist.replace_memory("l2", [](const std::string& name, unsigned) { return make_other(name, 2); });
  });
  EXPECT_NE(refusal_of_run(platform, Fidelity::lt).find("4 units are connected to 2 sockets"), std::string::npos);
}

}  // namespace
}  // namespace vrpipe
