// Effects of clocks, links and memories.
#include <algorithm>

#include <vrpipe/pipeline/batch.h>
#include <vrpipe/platforms/foreign_memory.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/wiring.h>

#include "effects/effect_case.h"
#include "support/foreign_memory.h"

namespace vrpipe::testing {

namespace {

/// agx-orin-ideal-memory with a memory of another make, and times of its own, in place of its L2.
Scene on_foreign_memory(Scene scene) {
  auto platform = std::make_shared<Platform>(platform_named("agx-orin-ideal-memory"));
  platform->wire = [](Netlist& netlist) {
    netlist.add("draw");
    netlist.add_memory("dram", [](const std::string& name, unsigned) {
      const auto ns = [](double time) { return sc_core::sc_time(time, sc_core::SC_NS); };
      auto module = std::make_unique<foreign::Dram>(name.c_str(), ns(1), ns(40), ns(70));
      tlm::tlm_base_target_socket_b<32>& socket = module->socket;
      return ForeignMemory{std::move(module), {&socket}};
    });
    wire_gpc(netlist, 0, "dram");
  };
  scene.request.platform = platform.get();
  scene.platform = std::move(platform);
  scene.request.settings = {{"crop", "cache_bytes", "2048"}};
  return scene;
}

/// Links in which items wait for places.
Scene short_links(Scene scene) {
  scene.request.settings = {{"tc", "bin_quads", "1"}, {"link.prop.release", "depth", "1"}};
  return scene;
}

/// Bins, seen by an observer.
Scene observed(Scene scene) {
  auto seen = std::make_shared<std::uint64_t>(0);
  scene.request.observers = std::make_shared<Observers>();
  if (scene.request.fidelity == Fidelity::cycle) {
    scene.request.observers->on_link<QuadBeat>("tc.bins", [=](const auto&) { ++*seen; });
  } else {
    scene.request.observers->on_link<BinItem>("tc.bins", [=](const auto&) { ++*seen; });
  }
  scene.looked_at = [=](const RunResult&) { return std::to_string(*seen); };
  return scene;
}

Scene on(Scene scene, const char* platform) {
  scene.request.platform = &platform_named(platform);
  return scene;
}

/// A refresh falls due within the frame, or only long after it.
Scene refreshed(Fidelity fidelity, const char* every_ps) {
  Scene scene = on(plain_splats(fidelity), "agx-orin");
  scene.request.settings = {{"dram", "trefi_ps", every_ps}};
  return scene;
}

/// A frame of whose statistics somebody reads the causes of misses, or nobody.
Scene read(Scene scene, bool statistics) {
  scene.request.reads_statistics = statistics;
  scene.looked_at = [](const RunResult& result) {
    const auto is_cause = [](const StatisticReport& report) {
      return report.name.find("sector_misses_compulsory") != std::string::npos;
    };
    return std::to_string(std::count_if(result.statistics.begin(), result.statistics.end(), is_cause));
  };
  return scene;
}

Scene with_l1(Scene scene) {
  scene.request.settings = {{"sm", "l1_bytes", "0"}};
  return on_platform(std::move(scene), "agx-orin-ideal-memory", [](Netlist& netlist) {
    connect_attribute_traffic(netlist);
    insert_l1(netlist);
  });
}

}  // namespace

std::vector<EffectCase> time_cases() {
  const auto plain = [](Fidelity f) { return plain_splats(f); };
  const auto on_dram = [](Fidelity f) { return on(plain_splats(f), "agx-orin"); };
  // Layers over all of the screen, which has 256 lines in RGBA16F: bins of two come tile by tile, again and again.
  const auto on_cache = [](Fidelity f, const char* bytes) {
    Scene scene = scene_of("baseline", f);
    scene.request.settings = {{"crop", "cache_bytes", bytes}};
    return draw(scene, boxes(12, 0, 0, scene_side, scene_side, 0.1F));
  };
  return {
      {"crop.cache_order",
       [=](Fidelity f) { return on_cache(f, "32768"); },
       {Fidelity::functional, Fidelity::lt, Fidelity::cycle},
       [=](Fidelity f) { return on_cache(f, "30720"); },
       with_time},
      {"clock.kernel_time",
       plain,
       everywhere,
       [](Fidelity f) { return on_foreign_memory(plain_splats(f)); },
       {Fidelity::cycle},
       {},
       true},
      {"link.sockets", plain, everywhere, [](Fidelity f) { return observed(plain_splats(f)); }, with_time},
      {"link.sockets", [](Fidelity f) { return short_links(plain_splats(f)); }, everywhere,
       [](Fidelity f) { return observed(short_links(plain_splats(f))); }, with_time},
      {"l1.contents",
       [](Fidelity f) { return with_l1(plain_splats(f)); },
       {Fidelity::functional},
       [](Fidelity f) { return with_l1(plain_splats(f)); },
       with_time},
      {"l2.contents", on_dram, {Fidelity::functional}, on_dram, with_time, "its memory port is not connected"},
      {"cache.details",
       [=](Fidelity f) { return read(on_dram(f), false); },
       {Fidelity::functional, Fidelity::lt, Fidelity::cycle},
       [=](Fidelity f) { return read(on_dram(f), true); },
       with_cycles},
      {"dram.accesses", on_dram, {Fidelity::functional}, on_dram, with_time, "no memory is below it"},
      {"dram.refresh",
       [](Fidelity f) { return refreshed(f, "100000000"); },
       {Fidelity::functional, Fidelity::lt, Fidelity::cycle},
       [](Fidelity f) { return refreshed(f, "500000"); },
       with_time},
  };
}

}  // namespace vrpipe::testing
