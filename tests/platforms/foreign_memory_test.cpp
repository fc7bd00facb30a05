// A memory of another make in place of the L2 or below it, with times and timers of its own.

#include <stdexcept>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/memory/memory_port.h>
#include <vrpipe/platforms/foreign_memory.h>
#include <vrpipe/platforms/wiring.h>

#include "support/fidelities.h"
#include "support/foreign_memory.h"
#include "support/refusals.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::fidelities_with_time;
using testing::request_of;
using testing::run;
using testing::same_image;
using testing::statistic;
using testing::strictly;

using Socket = tlm::tlm_base_target_socket_b<32>;

/// agx-orin-ideal-memory with a memory of another make in place of its L2.
Platform with_memory(MemoryMaker make) {
  Platform platform = platform_named("agx-orin-ideal-memory");
  platform.name = "foreign";
  platform.wire = [make = std::move(make)](Netlist& netlist) {
    netlist.add("draw");
    netlist.add_memory("dram", make);
    wire_gpc(netlist, 0, "dram");
  };
  return platform;
}

/// agx-orin-ideal-memory with a memory of another make below its L2.
Platform with_memory_below(MemoryMaker make) {
  Platform platform = platform_named("agx-orin-ideal-memory");
  platform.name = "foreign";
  platform.wire = [make = std::move(make)](Netlist& netlist) {
    wire_pipeline(netlist);
    netlist.add_memory("dram", make);
    netlist.connect_memory("l2", "dram");
  };
  return platform;
}

/// The clock of the units, for what is not of another make.
ClockDomain& clock_of_units() { return dynamic_cast<ClockDomain&>(*sc_core::sc_find_object("clock")); }

sc_core::sc_time ns(double nanoseconds) { return sc_core::sc_time(nanoseconds, sc_core::SC_NS); }

/// What a DRAM did, beyond its life, which ends with the run.
struct DramCounts {
  std::uint64_t requests = 0, responses = 0, out_of_order = 0, refreshes = 0;
};

class CountedDram : public foreign::Dram {
 public:
  CountedDram(const std::string& name, DramCounts& counts)
      : Dram(name.c_str(), ns(1), ns(40), ns(70)), counts_(counts) {}
  ~CountedDram() override { counts_ = {requests, responses, out_of_order, refreshes}; }

 private:
  DramCounts& counts_;
};

template <class Module>
ForeignMemory as_memory(std::unique_ptr<Module> module) {
  Socket& socket = module->socket;
  return {std::move(module), {&socket}};
}

std::string fault_of(const RunRequest& request, const Draw& draw) {
  return testing::refusal_of<SimulationFault>([&] { run(request, draw); });
}

TEST(ForeignMemory, TakesThePlaceOfTheL2ThoughItsRefreshNeverEnds) {
  const Draw draw = testing::random_draw(96, 96, 600, 21);
  DramCounts dram;
  const Platform platform = with_memory(
      [&](const std::string& name, unsigned) { return as_memory(std::make_unique<CountedDram>(name, dram)); });
  for (const char* variant : {"baseline", "het+qm"}) {
    const RunResult expected = run(request_of(variant, Fidelity::functional, strictly), draw);
    for (const Fidelity fidelity : fidelities_with_time()) {
      const RunResult result = run(request_of(variant, fidelity,
                                              [&](RunRequest& r) {
                                                strictly(r);
                                                r.platform = &platform;
                                                r.settings = {{"crop", "cache_bytes", "2048"}};
                                              }),
                                   draw);
      EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color))
          << variant << " " << name_of(fidelity);
      EXPECT_EQ(result.counts.named(), expected.counts.named()) << variant << " " << name_of(fidelity);
      EXPECT_GT(dram.requests, 100U) << variant << " " << name_of(fidelity);
      EXPECT_EQ(dram.responses, dram.requests) << variant << " " << name_of(fidelity);
      // At lt what a warp leads to is annotated ahead of the kernel's time, which hardly passes.
      EXPECT_GT(dram.refreshes, fidelity == Fidelity::lt ? 0U : 1U) << variant << " " << name_of(fidelity);
    }
  }
}

// As DRAMSys up to 5.1: a response ends with END_RESP alone, and a request is taken after the one before.
TEST(ForeignMemory, IsNotSampled) {
  const Platform platform = with_memory(
      [](const std::string&, unsigned) -> ForeignMemory { throw std::logic_error("nothing is to be elaborated"); });
  RunRequest request = request_of("baseline");
  request.platform = &platform;
  request.sampling.emplace();
  EXPECT_NE(testing::refusal_of([&] {
              run(request, testing::random_draw(40, 30, 20, 1));
            }).find("would be empty at the beginning of each window"),
            std::string::npos);
}

TEST(ForeignMemory, MayWaitForEndRespAndTakeOneRequestAtATime) {
  const Draw draw = testing::random_draw(96, 96, 600, 21);
  const RunResult expected = run(request_of("het+qm", Fidelity::functional, strictly), draw);
  for (const bool waits : {false, true}) {
    for (const bool one_at_a_time : {false, true}) {
      SCOPED_TRACE(std::string(waits ? "waits" : "does not wait") + (one_at_a_time ? ", one at a time" : ""));
      DramCounts dram;
      const MemoryMaker make = [&](const std::string& name, unsigned) {
        auto module = std::make_unique<CountedDram>(name, dram);
        if (waits) module->wait_for_end_resp();
        if (one_at_a_time) module->take_one_at_a_time();
        return as_memory(std::move(module));
      };
      for (const Platform& platform : {with_memory(make), with_memory_below(make)}) {
        RunRequest request = request_of("het+qm", Fidelity::cycle, strictly);
        request.platform = &platform;
        request.settings = {{"crop", "cache_bytes", "2048"}};
        const RunResult result = run(request, draw);
        EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color));
        EXPECT_EQ(dram.responses, dram.requests);
        EXPECT_EQ(dram.out_of_order == 0, one_at_a_time);
      }
    }
  }
}

// What its b_transport says may have little to do with the times that it has at cycle.
TEST(ForeignMemory, IsNamedWhereOnlyItsBTransportIsAsked) {
  const Draw draw = testing::random_draw(32, 32, 20, 1);
  DramCounts dram;
  const Platform platform = with_memory_below(
      [&](const std::string& name, unsigned) { return as_memory(std::make_unique<CountedDram>(name, dram)); });
  for (const Fidelity fidelity : fidelities_with_time()) {
    RunRequest request = request_of("baseline", fidelity);
    EXPECT_TRUE(run(request, draw).outside_validated_range.empty()) << name_of(fidelity);
    request.platform = &platform;
    const std::vector<std::string> reasons = run(request, draw).outside_validated_range;
    ASSERT_EQ(reasons.size(), fidelity == Fidelity::cycle ? 0U : 1U) << name_of(fidelity);
    for (const std::string& reason : reasons) EXPECT_NE(reason.find("memory dram"), std::string::npos) << reason;
  }
}

// An L2 of 64 lines, so that it reads again what it had, and writes back.
TEST(ForeignMemory, LiesBelowAnL2ThatMisses) {
  const Draw draw = testing::random_draw(96, 96, 600, 21);
  DramCounts dram;
  Platform platform = with_memory_below(
      [&](const std::string& name, unsigned) { return as_memory(std::make_unique<CountedDram>(name, dram)); });
  platform.wire = [wire = platform.wire](Netlist& netlist) {
    wire(netlist);
    netlist.replace("l2", "sectored-cache");
  };
  for (const char* variant : {"baseline", "het+qm"}) {
    const RunResult expected = run(request_of(variant, Fidelity::functional, strictly), draw);
    for (const Fidelity fidelity : fidelities_with_time()) {
      const std::string what = std::string(variant) + " " + name_of(fidelity);
      const RunResult result = run(request_of(variant, fidelity,
                                              [&](RunRequest& r) {
                                                strictly(r);
                                                r.platform = &platform;
                                                r.settings = {{"crop", "cache_bytes", "2048"},
                                                              {"l2", "bytes", "8192"},
                                                              {"l2", "ways", "4"},
                                                              {"l2", "banks", "4"}};
                                              }),
                                   draw);
      EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color)) << what;
      EXPECT_EQ(result.counts.named(), expected.counts.named()) << what;
      EXPECT_EQ(dram.responses, dram.requests) << what;
      EXPECT_EQ(dram.out_of_order > 0, fidelity == Fidelity::cycle) << what;
      EXPECT_GT(statistic(result, "l2.cache.sector_misses_capacity"), 1000U) << what;
      EXPECT_GT(statistic(result, "l2.cache.bytes_written_back"), 32000U) << what;
      // A line at most in a request, and a sector at least.
      const std::uint64_t bytes =
          statistic(result, "l2.cache.bytes_filled") + statistic(result, "l2.cache.bytes_written_back");
      EXPECT_LE(dram.requests, bytes / 32) << what;
      EXPECT_GE(dram.requests, bytes / 128) << what;
    }
  }
}

TEST(ForeignMemory, BelowTheL2DelaysARunAndChangesNothingElse) {
  const Draw draw = testing::random_draw(96, 96, 600, 21);
  DramCounts dram;
  const Platform platform = with_memory_below(
      [&](const std::string& name, unsigned) { return as_memory(std::make_unique<CountedDram>(name, dram)); });
  for (const char* variant : {"baseline", "het+qm"}) {
    for (const Fidelity fidelity : fidelities_with_time()) {
      RunRequest request = request_of(variant, fidelity, strictly);
      request.settings = {{"crop", "cache_bytes", "2048"}};
      const RunResult without = run(request, draw);
      request.platform = &platform;
      const RunResult with = run(request, draw);
      const std::string what = std::string(variant) + " " + name_of(fidelity);
      EXPECT_TRUE(same_image(with.framebuffer.color, without.framebuffer.color)) << what;
      EXPECT_EQ(with.counts.named(), without.counts.named()) << what;
      EXPECT_GT(*with.cycles, *without.cycles) << what;

      // CROP reads a sector before it writes it; each of the picture is fetched once, however often CROP comes back.
      EXPECT_EQ(dram.requests, statistic(with, "l2.cache.sector_misses")) << what;
      EXPECT_LE(dram.requests, 96U * 96U * 8U / 32U) << what;
      EXPECT_GT(dram.requests, 1000U) << what;
      EXPECT_GT(statistic(with, "l2.cache.sector_hits"), 1000U) << what;
      EXPECT_EQ(statistic(with, "l2.cache.bytes_filled"), 32 * dram.requests) << what;
      EXPECT_EQ(32 * statistic(with, "l2.cache.sector_accesses"),
                statistic(with, "l2.color_bytes_read") + statistic(with, "l2.color_bytes_written"))
          << what;
      EXPECT_EQ(dram.responses, dram.requests) << what;
      EXPECT_EQ(dram.out_of_order > 0, fidelity == Fidelity::cycle) << what;
      EXPECT_GT(dram.refreshes, fidelity == Fidelity::lt ? 0U : 1U) << what;
    }
  }
}

TEST(ForeignMemory, WithoutOneBelowTheL2HasNoStatisticsOfACache) {
  const RunResult result = run(request_of("baseline", Fidelity::lt), testing::random_draw(64, 64, 100, 7));
  for (const StatisticReport& report : result.statistics) EXPECT_EQ(report.name.find("l2.cache"), std::string::npos);
}

/// Random stalls and another order of ticks change no decision, and the run ends.
TEST(ForeignMemory, BelowTheL2ChangesNothingUnderStallsEither) {
  const Draw draw = testing::random_draw(96, 96, 300, 23);
  DramCounts dram;
  const Platform platform = with_memory_below(
      [&](const std::string& name, unsigned) { return as_memory(std::make_unique<CountedDram>(name, dram)); });
  RunRequest request = request_of("het+qm", Fidelity::cycle, strictly);
  request.platform = &platform;
  const RunResult expected = run(request, draw);
  request.tick_order_seed = 5;
  EXPECT_EQ(run(request, draw).result_hash, expected.result_hash);
  request.stall_seed = 3;
  request.stall_per_256 = 60;
  const RunResult stalled = run(request, draw);
  EXPECT_TRUE(same_image(stalled.framebuffer.color, expected.framebuffer.color));
  EXPECT_EQ(stalled.counts.named(), expected.counts.named());
}

/// Declares what it counts, as a unit does.
class CountingMemory : public sc_core::sc_module, public StatisticSet {
 public:
  explicit CountingMemory(const sc_core::sc_module_name& name) : sc_module(name), socket("socket") {
    socket.register_b_transport(this, &CountingMemory::access);
    socket.register_nb_transport_fw(this, &CountingMemory::request);
  }
  tlm_utils::simple_target_socket<CountingMemory> socket;

 private:
  void access(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) {
    ++accesses;
    largest.see(payload.get_data_length());
    delay += ns(100);
    payload.set_response_status(tlm::TLM_OK_RESPONSE);
  }
  tlm::tlm_sync_enum request(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase, sc_core::sc_time& delay) {
    if (phase == tlm::BEGIN_REQ) access(payload, delay);
    return tlm::TLM_COMPLETED;
  }
  Counter accesses{*this, "accesses", "accesses", "taken"};
  MinMax largest{*this, MinMax::Of::largest, "largest", "bytes", "of an access"};
};

TEST(ForeignMemory, ShowsItsStatisticsUnderItsPath) {
  const Draw draw = testing::random_draw(64, 64, 300, 10);
  const MemoryMaker make = [](const std::string& name, unsigned) {
    return as_memory(std::make_unique<CountingMemory>(name.c_str()));
  };
  for (const Fidelity fidelity : fidelities_with_time()) {
    const Platform below = with_memory_below(make);
    RunRequest request = request_of("baseline", fidelity);
    request.platform = &below;
    const RunResult with_l2 = run(request, draw);
    EXPECT_EQ(32 * statistic(with_l2, "dram.accesses"), statistic(with_l2, "l2.cache.bytes_filled"));
    EXPECT_EQ(statistic(with_l2, "dram.largest"), 32U);

    const Platform instead = with_memory(make);
    request.platform = &instead;
    EXPECT_GT(statistic(run(request, draw), "dram.accesses"), 0U) << name_of(fidelity);
  }
}

/// Passes the base protocol on, so that what is behind it cannot be asked directly.
class Proxy : public sc_core::sc_module, private tlm::tlm_fw_transport_if<>, private tlm::tlm_bw_transport_if<> {
 public:
  explicit Proxy(const sc_core::sc_module_name& name) : sc_module(name), socket("socket"), out("out") {
    socket.bind(*static_cast<tlm::tlm_fw_transport_if<>*>(this));
    out.bind(*static_cast<tlm::tlm_bw_transport_if<>*>(this));
  }
  tlm::tlm_target_socket<32> socket;
  tlm::tlm_initiator_socket<32> out;
  std::unique_ptr<sc_core::sc_module> behind;

 private:
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override {
    return out->nb_transport_fw(payload, phase, delay);
  }
  tlm::tlm_sync_enum nb_transport_bw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override {
    return socket->nb_transport_bw(payload, phase, delay);
  }
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) override {
    out->b_transport(payload, delay);
  }
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }
  void invalidate_direct_mem_ptr(sc_dt::uint64, sc_dt::uint64) override {}
};

/// Leaves its counters behind.
class CountedMemory : public FixedLatencyMemory {
 public:
  CountedMemory(const sc_core::sc_module_name& name, std::vector<std::uint64_t>& counts)
      : FixedLatencyMemory(name, clock_of_units(), 100, 32, 1), socket(port(0)), counts_(counts) {}
  ~CountedMemory() override {
    EXPECT_GT(traffic().accesses(MemoryTraffic::color, false), 100U);
    EXPECT_GT(traffic().bytes(MemoryTraffic::color, true), 3200U);
    for (const Counter* counter : counters()) counts_.push_back(counter->value());
  }
  Socket& socket;

 private:
  std::vector<std::uint64_t>& counts_;
};

TEST(ForeignMemory, ThroughSocketsAloneARunIsTheSameAsWithDirectCalls) {
  const Draw draw = testing::random_draw(128, 96, 800, 22);
  for (const Fidelity fidelity : fidelities_with_time()) {
    for (const char* variant : {"baseline", "het+qm"}) {
      std::string hashes[2];
      std::vector<std::uint64_t> traffic[2];
      for (const bool proxied : {false, true}) {
        const Platform platform = with_memory([&](const std::string& name, unsigned) {
          auto memory = std::make_unique<CountedMemory>("memory", traffic[proxied]);
          if (!proxied) return as_memory(std::move(memory));
          auto proxy = std::make_unique<Proxy>(name.c_str());
          proxy->out.bind(memory->socket);
          proxy->behind = std::move(memory);
          return as_memory(std::move(proxy));
        });
        hashes[proxied] = run(request_of(variant, fidelity,
                                         [&](RunRequest& r) {
                                           r.platform = &platform;
                                           r.settings = {{"crop", "cache_bytes", "2048"}};
                                         }),
                              draw)
                              .result_hash;
      }
      EXPECT_EQ(hashes[0], hashes[1]) << variant << " " << name_of(fidelity);
      EXPECT_EQ(traffic[0], traffic[1]) << variant << " " << name_of(fidelity);
    }
  }
}

TEST(ForeignMemory, ADeadlockIsFoundAndNamedThoughATimerGoesOn) {
  const Draw draw = testing::random_draw(64, 64, 300, 7);
  for (Platform (*const place)(MemoryMaker) : {with_memory, with_memory_below}) {
    DramCounts dram;
    Platform platform =
        place([&](const std::string& name, unsigned) { return as_memory(std::make_unique<CountedDram>(name, dram)); });
    platform.wire = [wire = platform.wire](Netlist& netlist) {
      wire(netlist);
      netlist.disconnect("gpc0.prop.out_release");  // the SMs run out of room for warps
    };
    const std::string message = fault_of(request_of("het", Fidelity::cycle,
                                                    [&](RunRequest& r) {
                                                      r.platform = &platform;
                                                      r.settings = {{"sm", "cores", "1"}};
                                                    }),
                                         draw);
    EXPECT_NE(message.find("deadlock"), std::string::npos) << message;
    EXPECT_NE(message.find("gpc0.sm"), std::string::npos) << message;
    EXPECT_GT(dram.refreshes, 0U);
  }
}

TEST(ForeignMemory, ThatFallsSilentIsNamedWithItsPortAndTheOldestRequest) {
  const Draw draw = testing::random_draw(64, 64, 300, 8);
  for (const bool refreshes : {true, false}) {
    DramCounts counts;
    const MemoryMaker make = [&](const std::string& name, unsigned) {
      auto dram = std::make_unique<CountedDram>(name, counts);
      dram->fall_silent_after(20);
      if (!refreshes) dram->never_refresh();
      return as_memory(std::move(dram));
    };
    const std::pair<Platform, const char*> places[] = {{with_memory(make), "gpc0.crop.memory"},
                                                       {with_memory_below(make), "l2.below"}};
    for (const auto& [platform, port] : places) {
      RunRequest request = request_of("baseline", Fidelity::cycle);
      request.platform = &platform;
      const std::string message = fault_of(request, draw);
      EXPECT_NE(message.find(port), std::string::npos) << message;
      EXPECT_NE(message.find("no answer to the read of 32 bytes at address"), std::string::npos) << message;
    }
  }
}

/// A memory with a refresh that is counted in cycles of the units' clock, which then never comes to rest.
class TickingMemory : public FixedLatencyMemory, public Clocked {
 public:
  TickingMemory(const std::string& name, ClockDomain& clock, bool ticks)
      : FixedLatencyMemory(name.c_str(), clock, 100, 128, 1), socket(port(0)) {
    if (ticks) clock.attach(*this);
  }
  Socket& socket;

 private:
  Cycle tick(Cycle now) override { return now + 1000; }
};

TEST(ForeignMemory, ATimerInTheClockOfTheUnitsDoesNotKeepARunUp) {
  const Draw draw = testing::random_draw(64, 64, 300, 9);
  for (const Fidelity fidelity : fidelities_with_time()) {
    std::string hashes[2];
    for (const bool ticks : {false, true}) {
      const Platform platform = with_memory([&](const std::string& name, unsigned) {
        return as_memory(std::make_unique<TickingMemory>(name, clock_of_units(), ticks));
      });
      hashes[ticks] =
          run(request_of("het", fidelity, [&](RunRequest& r) { r.platform = &platform; }), draw).result_hash;
    }
    EXPECT_EQ(hashes[0], hashes[1]) << name_of(fidelity);
  }
}

}  // namespace
}  // namespace vrpipe
