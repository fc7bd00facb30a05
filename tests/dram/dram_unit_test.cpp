// The DRAM as a module at `cycle`: a clock of its own, ports with back-pressure, answers out of order.

#include <algorithm>
#include <map>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <tlm_utils/simple_initiator_socket.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>

#include <vrpipe/model/memory_unit.h>
#include <vrpipe/pipeline/slots/memory.h>

#include "dram_bench.h"

namespace vrpipe {
namespace {

using namespace testing;
using Settings = std::vector<std::pair<std::string, std::string>>;

constexpr const char* lpddr3_make = "lpddr3-1600";

TEST(DramUnit, CountsCyclesOfItsOwn) {
  // The GPU has cycles of 1 ns, the DRAM of 1.25 ns. A read in cycle 10 is seen at the first edge from cycle 11 on, the
  // ninth, at 11.25 ns. Row and data take 15 + 12 + 4 cycles: until the 40th edge, at 50 ns.
  DramBench without(lpddr3_make, {{"controller_ps", "0"}});
  EXPECT_EQ(without.answered({read(10, 0)}), (std::vector<Cycle>{50}));
  DramBench bench(lpddr3_make);
  EXPECT_EQ(bench.answered({read(10, 0)}), (std::vector<Cycle>{70})) << "20 ns in the controller";
  // 700 ps: cycle 11 is at 7.7 ns, before the 7th edge; the 38th is at 47.5 ns, before cycle 68.
  DramBench faster(lpddr3_make, {{"controller_ps", "0"}}, 700);
  EXPECT_EQ(faster.answered({read(10, 0)}), (std::vector<Cycle>{68}));
  // 3 ns: cycle 11 is at 33 ns, before the 27th edge; the 58th is at 72.5 ns, before cycle 25.
  DramBench slower(lpddr3_make, {{"controller_ps", "0"}}, 3000);
  EXPECT_EQ(slower.answered({read(10, 0)}), (std::vector<Cycle>{25}));
}

TEST(DramUnit, AnswersAWriteOnceItIsQueued) {
  DramBench bench(lpddr3_make, {{"controller_ps", "0"}});
  EXPECT_EQ(bench.answered({write(10, 0)}), (std::vector<Cycle>{12})) << "the ninth edge is at 11.25 ns";
}

TEST(DramUnit, AnswersARequestWithTheLastOfItsBursts) {
  DramBench bench(lpddr3_make, {{"controller_ps", "0"}});
  // Four bursts, one after the other: 12 cycles of 1.25 ns more.
  EXPECT_EQ(bench.answered({read(10, 0, 128)}), (std::vector<Cycle>{50 + 15}));
  EXPECT_EQ(bench.clocked->statistics.channels.reads.value(), 4U);
  // In channels of their own, at once.
  DramBench spread(lpddr3_make, {{"controller_ps", "0"}, {"interleave_bytes", "32"}});
  EXPECT_EQ(spread.answered({read(10, 0, 128)}), (std::vector<Cycle>{50}));
  // Half of a burst of 64 bytes takes as long as all of it.
  DramBench wide(lpddr3_make, {{"controller_ps", "0"}, {"channel_bits", "64"}});
  EXPECT_EQ(wide.answered({read(10, 32, 32)}), (std::vector<Cycle>{50}));
  EXPECT_EQ(wide.clocked->statistics.channels.reads.value(), 1U);
}

TEST(DramUnit, AnswersOutOfOrder) {
  // Two rows of a bank; the third access hits the first row.
  DramBench bench(lpddr3_make, {{"channels", "1"}, {"hash", "off"}, {"controller_ps", "0"}});
  const std::uint64_t next_row = 8 * 4096;
  const std::vector<Cycle> answered = bench.answered({read(10, 0), read(10, next_row), read(10, 32)});
  EXPECT_EQ(answered[2], answered[0] + 5);
  EXPECT_GT(answered[1], answered[2]);
}

TEST(DramUnit, AFullQueueHoldsItsPortUp) {
  // A place in the queue and one at the port. The first read enters in cycle 11, at the ninth edge; the second, held up
  // behind it, is let in in cycle 12, so that in 13 the third may be asked for, which is held up in turn. The command
  // of the first is at the 24th edge; cycle 31 is the first with a later one. Then the second enters, and the third is
  // let in in cycle 32.
  DramBench bench(lpddr3_make, {{"channels", "1"}, {"read_queue", "1"}, {"port_requests", "1"}});
  bench.answered({read(10, 0), read(10, 32), read(10, 64), read(10, 96)});
  EXPECT_EQ(bench.issued, (std::vector<Cycle>{10, 10, 13, 33}));
}

TEST(DramUnit, RequestsForOtherChannelsOvertakeThoseForAFullOne) {
  const Settings settings = {{"channels", "2"}, {"hash", "off"}, {"read_queue", "1"}, {"controller_ps", "0"}};
  DramBench bench(lpddr3_make, settings);
  const std::vector<Cycle> answered = bench.answered({read(10, 0), read(10, 32), read(10, 64), read(10, 256)});
  EXPECT_EQ(answered[3], answered[0]);
  EXPECT_LT(answered[0], answered[1]);
  EXPECT_LT(answered[1], answered[2]);
}

TEST(DramUnit, RequestsForAChannelDoNotOvertakeOneAnother) {
  // The second read waits for a place; the write of the same bytes behind it has one.
  DramBench bench(lpddr3_make, {{"channels", "1"}, {"read_queue", "1"}});
  bench.answered({read(10, 0), read(10, 64), write(10, 64)});
  EXPECT_EQ(bench.clocked->statistics.channels.reads_forwarded.value(), 0U) << "it would see what is written later";
}

TEST(DramUnit, PortsTakeTurns) {
  DramBench bench(lpddr3_make, {{"channels", "1"}, {"read_queue", "1"}});
  ClockedDram dram("dram", *bench.clock, *bench.behaviour, 2);
  const std::vector<Access> accesses(200, read(0, 0));
  ClockedInitiator one("one", *bench.clock, accesses);
  ClockedInitiator other("other", *bench.clock, accesses);
  one.memory.socket.bind(dram.port(0));
  other.memory.socket.bind(dram.port(1));
  while (!bench.clock->run_to_rest(bench.cycles(1000))) {}
  const auto last_of_one = static_cast<double>(one.answered.back());
  EXPECT_NEAR(static_cast<double>(other.answered.back()), last_of_one, 0.1 * last_of_one);
}

TEST(DramUnit, AnswersEveryRequestOnce) {
  for (const Settings& settings : {Settings{}, Settings{{"read_queue", "2"},
                                                        {"write_queue", "2"},
                                                        {"write_high", "1"},
                                                        {"write_low", "0"},
                                                        {"port_requests", "1"}}}) {
    std::vector<Access> accesses;
    for (std::uint64_t i = 0; i < 3000; ++i) {
      const unsigned bytes = 32U << mix(i) % 3;
      const std::uint64_t address = mix(i + 5000) % (1U << 16U) / bytes * bytes;
      accesses.push_back(mix(i + 9000) % 3 == 0 ? write(i / 8, address, bytes) : read(i / 8, address, bytes));
    }
    DramBench bench(lpddr3_make, settings);
    const std::vector<Cycle> answered = bench.answered(accesses);
    EXPECT_EQ(std::count(answered.begin(), answered.end(), never), 0);
    for (std::size_t i = 0; i < accesses.size(); ++i) ASSERT_GT(answered[i], bench.issued[i]);
    std::uint64_t asked = 0;
    std::uint64_t written = 0;
    for (const Access& access : accesses) {
      (access.request.command == tlm::TLM_WRITE_COMMAND ? written : asked) += access.request.bytes;
    }
    EXPECT_EQ(bench.behaviour->traffic().bytes(MemoryTraffic::color, false), asked);
    EXPECT_EQ(bench.behaviour->traffic().bytes(MemoryTraffic::color, true), written);
    const DramStatistics& s = bench.clocked->statistics.channels;
    EXPECT_EQ(32 * (s.reads.value() + s.reads_forwarded.value()), asked);
  }
}

TEST(DramUnit, TheOrderOfTicksDoesNotMatter) {
  const auto answers = [](const Settings& settings, const std::vector<unsigned>& order) {
    DramBench bench(lpddr3_make, settings);
    std::vector<std::unique_ptr<ClockedInitiator>> units;
    std::unique_ptr<ClockedDram> dram;
    for (unsigned unit = 0; unit < 3; ++unit) {
      if (unit == 1) dram = std::make_unique<ClockedDram>("dram", *bench.clock, *bench.behaviour, 3);
      std::vector<Access> accesses;
      for (std::uint64_t i = 0; i < 400; ++i)
        accesses.push_back(read(mix(i + unit * 1000) % 2 + i, mix(i * 3 + unit) % 4096 * 32));
      std::sort(accesses.begin(), accesses.end(), [](const Access& a, const Access& b) { return a.at < b.at; });
      units.push_back(
          std::make_unique<ClockedInitiator>(("unit" + std::to_string(unit)).c_str(), *bench.clock, accesses));
    }
    for (unsigned unit = 0; unit < 3; ++unit) units[unit]->memory.socket.bind(dram->port(unit));
    if (!order.empty()) bench.clock->set_tick_order(order);
    while (!bench.clock->run_to_rest(bench.cycles(1000))) {}
    std::vector<Cycle> found;
    for (const auto& unit : units) found.insert(found.end(), unit->answered.begin(), unit->answered.end());
    EXPECT_GT(dram->statistics.requests_held.value(), 100U);
    return found;
  };
  // Queues are full, or ports alone.
  for (const Settings& settings :
       {Settings{{"channels", "2"}, {"read_queue", "4"}, {"port_requests", "2"}}, Settings{{"port_requests", "1"}}}) {
    const std::vector<Cycle> first = answers(settings, {});
    EXPECT_EQ(answers(settings, {3, 2, 1, 0}), first);
    EXPECT_EQ(answers(settings, {1, 0, 3, 2}), first);
    EXPECT_EQ(answers(settings, {2, 3, 0, 1}), first);
  }
}

TEST(DramUnit, ComesToRestThoughItRefreshesForEver) {
  DramBench bench(lpddr3_make);
  bench.answered({read(10, 0), write(20, 4096)});
  EXPECT_TRUE(bench.clock->at_rest());
  EXPECT_LT(bench.clock->now(), 100U);
  bench.clocked->close(39000);
  const DramStatistics& s = bench.clocked->statistics.channels;
  EXPECT_EQ(s.refreshes.value(), 16U * 9U) << "at 3.9 us, 7.8 us, … of each channel; the tenth after 39 us";
  EXPECT_EQ(s.channel_cycles.value(), 16U * 31200U);
}

TEST(DramUnit, ItsDataBusIsBusyForNoLongerThanTheFrame) {
  std::vector<Access> accesses;
  for (std::uint64_t i = 0; i < 100; ++i) accesses.push_back(write(10, 32 * i));
  accesses.push_back(read(1000, 0));
  DramBench bench(lpddr3_make, {{"channels", "1"}, {"write_high", "1"}, {"write_low", "0"}});
  const auto expect = [](const DramStatistics& s, Cycle end) {
    EXPECT_EQ(s.channel_cycles.value(), end * 4 / 5);
    EXPECT_LE(s.data_cycles.value(), s.channel_cycles.value());
    EXPECT_GE(s.data_cycles.value(), end == 200 ? 100U : 404U) << "4 of each burst that is moved by then";
  };
  for (const Cycle end : {200U, 2000U}) {
    bench.answered(accesses);
    bench.clocked->close(end);
    expect(bench.clocked->statistics.channels, end);
    bench.annotated_answers(accesses);
    bench.annotated->close(end);
    expect(bench.annotated->statistics.channels, end);
  }
}

/// An initiator of another make: one request, and an END_RESP of its own time for each response.
class SlowInitiator : public sc_core::sc_module {
 public:
  SC_HAS_PROCESS(SlowInitiator);
  explicit SlowInitiator(const sc_core::sc_module_name& name) : sc_module(name), socket("socket") {
    socket.register_nb_transport_bw(this, &SlowInitiator::nb_transport_bw);
    SC_THREAD(ask);
    SC_THREAD(finish);
  }
  tlm_utils::simple_initiator_socket<SlowInitiator> socket;
  std::vector<sc_core::sc_time> responses;
  unsigned under_way = 0, most_under_way = 0;

 private:
  void ask() {
    for (unsigned i = 0; i < 4; ++i) {
      tlm::tlm_generic_payload& payload = payloads_[i];
      payload.set_address(4096 * i);
      payload.set_data_length(32);
      payload.set_read();
      tlm::tlm_phase phase = tlm::BEGIN_REQ;
      sc_core::sc_time delay = sc_core::SC_ZERO_TIME;
      payload.set_mm(&memory_);
      payload.acquire();
      if (socket->nb_transport_fw(payload, phase, delay) == tlm::TLM_ACCEPTED) wait(end_of_request_);
    }
  }
  void finish() {
    while (true) {
      wait(response_);
      wait(30, sc_core::SC_NS);
      --under_way;
      tlm::tlm_phase phase = tlm::END_RESP;
      sc_core::sc_time delay = sc_core::SC_ZERO_TIME;
      socket->nb_transport_fw(*responding_, phase, delay);
    }
  }
  tlm::tlm_sync_enum nb_transport_bw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) {
    if (phase == tlm::END_REQ) end_of_request_.notify(delay);
    if (phase == tlm::BEGIN_RESP) {
      EXPECT_TRUE(payload.is_response_ok());
      responses.push_back(sc_core::sc_time_stamp() + delay);
      most_under_way = std::max(most_under_way, ++under_way);
      responding_ = &payload;
      response_.notify(delay);
    }
    return tlm::TLM_ACCEPTED;
  }
  struct Memory : tlm::tlm_mm_interface {
    void free(tlm::tlm_generic_payload*) override {}
  };
  Memory memory_;
  std::array<tlm::tlm_generic_payload, 4> payloads_;
  tlm::tlm_generic_payload* responding_ = nullptr;
  sc_core::sc_event end_of_request_, response_;
};

TEST(DramUnit, AnswersAnInitiatorOfAnotherMakeOneByOne) {
  DramBench bench(lpddr3_make, {{"port_requests", "1"}});
  ClockedDram dram("dram", *bench.clock, *bench.behaviour, 1);
  SlowInitiator initiator("initiator");
  initiator.socket.bind(dram.port(0));
  bench.clock->run(bench.cycles(1000));
  ASSERT_EQ(initiator.responses.size(), 4U);
  EXPECT_EQ(initiator.most_under_way, 1U);
  for (std::size_t i = 1; i < 4; ++i) {
    EXPECT_GE(initiator.responses[i], initiator.responses[i - 1] + sc_core::sc_time(30, sc_core::SC_NS));
  }
}

/// An initiator of another make whose only request is annotated ahead.
class EarlyInitiator : public sc_core::sc_module {
 public:
  SC_HAS_PROCESS(EarlyInitiator);
  EarlyInitiator(const sc_core::sc_module_name& name, const sc_core::sc_time& ahead)
      : sc_module(name), socket("socket"), ahead_(ahead) {
    socket.register_nb_transport_bw(this, &EarlyInitiator::nb_transport_bw);
    SC_THREAD(ask);
  }
  tlm_utils::simple_initiator_socket<EarlyInitiator> socket;
  sc_core::sc_time answered;

 private:
  void ask() {
    wait(5, sc_core::SC_NS);
    payload_.set_address(4096);
    payload_.set_data_length(32);
    payload_.set_read();
    payload_.set_mm(&memory_);
    payload_.acquire();
    tlm::tlm_phase phase = tlm::BEGIN_REQ;
    socket->nb_transport_fw(payload_, phase, ahead_);
  }
  tlm::tlm_sync_enum nb_transport_bw(tlm::tlm_generic_payload&, tlm::tlm_phase& phase, sc_core::sc_time& delay) {
    if (phase != tlm::BEGIN_RESP) return tlm::TLM_ACCEPTED;
    answered = sc_core::sc_time_stamp() + delay;
    return tlm::TLM_COMPLETED;
  }
  struct Memory : tlm::tlm_mm_interface {
    void free(tlm::tlm_generic_payload*) override {}
  };
  Memory memory_;
  tlm::tlm_generic_payload payload_;
  sc_core::sc_time ahead_;
};

TEST(DramUnit, ARequestThatIsAnnotatedAheadComesThen) {
  DramBench bench(lpddr3_make, {{"controller_ps", "0"}});
  ClockedDram dram("dram", *bench.clock, *bench.behaviour, 2);
  ClockedInitiator busy("busy", *bench.clock, {read(6, 0), read(20, 32), read(60, 64)});
  EarlyInitiator early("early", bench.cycles(200));
  busy.memory.socket.bind(dram.port(0));
  early.socket.bind(dram.port(1));
  bench.clock->run(bench.cycles(1000));
  // Cycle 205, seen from 206 on, at the 165th edge; there 31 cycles later, at 245 ns.
  EXPECT_EQ(early.answered, sc_core::sc_time(245, sc_core::SC_NS));
}

TEST(DramUnit, WithoutTimeCountsWhatEveryOrderHasToMove) {
  // A channel, whose queue of 64 writes may keep the last; bursts of 5 ns, in cycles of 1 ns. Written twice and read
  // back, a burst may be moved once.
  DramBench bench(lpddr3_make, {{"channels", "1"}, {"refresh", "off"}});
  const auto cycles = [&] { return bench.behaviour->least_occupancy(1000).front().cycles; };
  EXPECT_EQ(cycles(), 0);
  for (std::uint64_t i = 0; i < 100; ++i) bench.behaviour->access(read(0, i * 64, 64).request);
  EXPECT_EQ(cycles(), (200 - 64) * 5);
  for (std::uint64_t i = 0; i < 10; ++i) bench.behaviour->access(write(0, 0).request);
  bench.behaviour->access(read(0, 0).request);
  EXPECT_EQ(cycles(), (201 - 64) * 5);
  DramBench refreshed(lpddr3_make, {{"channels", "1"}});
  for (std::uint64_t i = 0; i < 2000 + 64; ++i) refreshed.behaviour->access(read(0, i * 32).request);
  EXPECT_EQ(refreshed.behaviour->least_occupancy(1000).front().cycles, 2000 * 5 + 2 * 130) << "two in 10 us";
}

TEST(DramUnit, IsMadeByItsSlot) {
  DramBench bench(lpddr3_make);
  const Implementation& implementation = Registry::instance().find("dram", "lpddr5-6400");
  const auto parameters = implementation.make_parameters();
  RenderContext context;
  context.clock_ps = 2000;
  auto behaviour = implementation.make_behaviour(*parameters, context);
  auto& memory = dynamic_cast<MemoryBehaviour&>(*behaviour);
  // 204.8 GB/s less refreshes, in 2 ns; 19 cycles of 1.25 ns and 20 ns.
  EXPECT_EQ(memory.timing().bytes_per_cycle, 388U);
  EXPECT_EQ(memory.timing().latency_cycles, 21U);
  memory.access({64, 32, tlm::TLM_WRITE_COMMAND, {MemoryTraffic::depth_stencil, 0}});
  EXPECT_EQ(dynamic_cast<Dram&>(memory).traffic().bytes(MemoryTraffic::depth_stencil, true), 32U);
  EXPECT_EQ(memory.delivered().written, 32U);
  EXPECT_EQ(memory.delivered().read, 0U);
  EXPECT_THROW(memory_unit_maker("dram")("below", *bench.clock, std::move(behaviour), {{0}, true, true}), UserError);
}

}  // namespace
}  // namespace vrpipe
