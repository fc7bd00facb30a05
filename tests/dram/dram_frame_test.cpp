// A DRAM below the L2 of a GPU that draws a frame.

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/platforms/foreign_memory.h>
#include <vrpipe/platforms/wiring.h>

#include "dram/clocked_dram.h"
#include "jedec_checker.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

/// agx-orin-ideal-memory with a memory below its L2, which `add` adds as "dram".
Platform with_dram(const std::function<void(Netlist&)>& add) {
  Platform platform = platform_named("agx-orin-ideal-memory");
  platform.name = "with DRAM";
  platform.wire = [add](Netlist& netlist) {
    wire_pipeline(netlist);
    add(netlist);
    netlist.connect_memory("l2", "dram");
  };
  return platform;
}

RunRequest request_for(const Platform& platform, Fidelity fidelity, const std::string& implementation) {
  RunRequest request = request_of("baseline", fidelity, strictly);
  request.platform = &platform;
  request.units = {{"dram", implementation}};
  return request;
}

TEST(DramOfAFrame, IsReadForWhatTheL2HasNotSeen) {
  const Draw draw = random_draw(128, 128, 400, 21);
  const Platform platform = with_dram([](Netlist& netlist) { netlist.add("dram"); });
  for (const char* implementation : {"lpddr3-1600", "lpddr5-6400"}) {
    const RunResult expected = run(request_of("baseline", Fidelity::functional, strictly), draw);
    double cycle = 0;
    for (const Fidelity fidelity : {Fidelity::cycle, Fidelity::lt}) {
      const RunResult result = run(request_for(platform, fidelity, implementation), draw);
      EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color));
      EXPECT_EQ(result.counts.named(), expected.counts.named());
      EXPECT_GT(statistic(result, "dram.color_bytes_read"), 0U);
      EXPECT_EQ(statistic(result, "dram.color_bytes_read"), statistic(result, "l2.cache.bytes_filled"));
      EXPECT_EQ(32 * statistic(result, "dram.channels.reads"), statistic(result, "dram.color_bytes_read"));
      EXPECT_GT(statistic(result, "dram.channels.channel_cycles"), 16 * *result.cycles);
      const auto cycles = static_cast<double>(*result.cycles);
      if (fidelity == Fidelity::cycle) cycle = cycles;
      EXPECT_NEAR(cycles / cycle, 1.0, 0.1) << name_of(fidelity);
    }
  }
}

TEST(DramOfAFrame, DelaysItTheMoreTheSlowerItIs) {
  const Draw draw = random_draw(128, 128, 400, 21);
  const Platform platform = with_dram([](Netlist& netlist) { netlist.add("dram"); });
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    const auto cycles = [&](const std::vector<Setting>& settings) {
      RunRequest request = request_for(platform, fidelity, "lpddr3-1600");
      request.settings = settings;
      return *run(request, draw).cycles;
    };
    const Cycle all = cycles({});
    EXPECT_GT(all, *run(request_of("baseline", fidelity, strictly), draw).cycles) << "than without a DRAM";
    EXPECT_GT(cycles({{"dram", "channels", "1"},
                      {"dram", "channel_bits", "8"},
                      {"dram", "burst_length", "32"},
                      {"dram", "tccd_ps", "20000"},
                      {"dram", "tccd_l_ps", "20000"}}),
              all + all / 4);
  }
}

TEST(DramOfAFrame, DoesNotDependOnTheOrderOfTicks) {
  const Draw draw = random_draw(128, 128, 400, 21);
  const Platform platform = with_dram([](Netlist& netlist) { netlist.add("dram"); });
  const auto cycles = [&](std::uint64_t order) {
    RunRequest request = request_for(platform, Fidelity::cycle, "lpddr3-1600");
    request.tick_order_seed = order;
    request.settings = {{"dram", "read_queue", "2"}, {"dram", "port_requests", "2"}, {"dram", "channels", "2"}};
    return *run(request, draw).cycles;
  };
  const Cycle first = cycles(0);
  for (std::uint64_t order = 1; order < 5; ++order) EXPECT_EQ(cycles(order), first);
}

/// A DRAM whose commands are judged.
class JudgedDram : public ClockedDram {
 public:
  JudgedDram(const std::string& name, Dram& behaviour, const DramParameters& parameters,
             std::vector<std::unique_ptr<JedecChecker>>& checkers)
      : ClockedDram(name.c_str(), dynamic_cast<ClockDomain&>(*sc_core::sc_find_object("clock")), behaviour, 1) {
    for (unsigned index = 0; index < parameters.channels; ++index) {
      checkers.push_back(std::make_unique<JedecChecker>(parameters));
      channel(index).observe(*checkers.back());
    }
  }
};

TEST(DramOfAFrame, KeepsEveryDistanceOverItsTraffic) {
  const Draw draw = random_draw(256, 256, 1500, 5);
  for (const DramDevice* device : {&lpddr3_1600, &lpddr5_6400}) {
    DramParameters parameters(*device);
    parameters.set("dram", "channels", "2");
    Dram behaviour(parameters, RenderContext{});
    std::vector<std::unique_ptr<JedecChecker>> checkers;
    const Platform platform = with_dram([&](Netlist& netlist) {
      netlist.add_memory("dram", [&](const std::string& name, unsigned) {
        auto made = std::make_unique<JudgedDram>(name, behaviour, parameters, checkers);
        auto* const socket = &made->port(0);
        return ForeignMemory{std::move(made), {socket}};
      });
    });
    RunRequest request = request_of("baseline", Fidelity::cycle, strictly);
    request.platform = &platform;
    run(request, draw);
    ASSERT_EQ(checkers.size(), 2U);
    for (const auto& checker : checkers) {
      EXPECT_EQ(checker->report(), "");
      EXPECT_GT(checker->commands(), 2000U);
      EXPECT_GT(checker->refreshes(), 5U);
    }
  }
}

}  // namespace
}  // namespace vrpipe
