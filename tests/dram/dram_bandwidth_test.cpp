// What a channel sustains, against the arithmetic of its distances.

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

#include "dram_bench.h"
#include "traffic.h"

namespace vrpipe {
namespace {

using namespace testing;

constexpr Cycle long_run = 100000;

/// Cycles for a burst, in the long run, of reads or writes as dense as the queues allow.
double cycles_per_burst(const DramParameters& parameters, const std::function<DramAddress(std::uint64_t)>& place,
                        const std::function<bool(std::uint64_t)>& writes) {
  ChannelBench bench(parameters);
  std::uint64_t count = 0;
  feed(
      bench.channel,
      [&](Burst& burst) {
        burst.place = place(count);
        burst.writes = writes(count);
        ++count;
        return true;
      },
      long_run, long_run);
  return static_cast<double>(long_run) /
         static_cast<double>(bench.statistics.reads.value() + bench.statistics.writes.value());
}

bool never_writes(std::uint64_t) { return false; }
bool always_writes(std::uint64_t) { return true; }

/// The part of the time that refreshes leave: tRFC of every tREFI.
double left_by_refreshes(const DramParameters& p) {
  return 1.0 - static_cast<double>(p.trfc_ps) / static_cast<double>(p.trefi_ps);
}

struct Device {
  const DramDevice& device;
  double burst, row_cycle, activates_apart, commands;  ///< cycles, worked out by hand
};

class DramBandwidthTest : public ::testing::TestWithParam<Device> {
 protected:
  DramParameters parameters{GetParam().device};
};

// LPDDR3: tRC 60 / 1.25, but 34 + 15 cycles of tRAS and tRP; tRRD 8, tFAW 40 / 4, tRC / 8 banks.
// LPDDR5: likewise; tRRD 4, tFAW 16 / 4, tRC / 16. An activate, a read and a precharge take 3 cycles of the command
// bus.
INSTANTIATE_TEST_SUITE_P(Of, DramBandwidthTest,
                         ::testing::Values(Device{lpddr3_1600, 4, 49, 10, 3}, Device{lpddr5_6400, 2, 49, 4, 3}),
                         [](const auto& device) {
                           return std::string(&device.param.device == &lpddr3_1600 ? "LPDDR3" : "LPDDR5");
                         });

TEST_P(DramBandwidthTest, AStreamMovesABurstAfterTheOther) {
  const DramAddressMap map(parameters);
  std::uint64_t address = 0;
  const auto next = [&](std::uint64_t) {
    while (map.place_of(address += 32).channel != 0) {}
    return map.place_of(address);
  };
  const double limit = GetParam().burst / left_by_refreshes(parameters);
  for (const auto& kind : {never_writes, always_writes}) {
    const double found = cycles_per_burst(parameters, next, kind);
    EXPECT_GE(found, limit * 0.9999);
    EXPECT_LE(found, limit / 0.95);
  }
}

TEST_P(DramBandwidthTest, RandomRowsOfABankTakeARowCycleEach) {
  const auto next = [](std::uint64_t i) {
    DramAddress place;
    place.row = i;
    return place;
  };
  const double limit = GetParam().row_cycle / left_by_refreshes(parameters);
  const double found = cycles_per_burst(parameters, next, never_writes);
  EXPECT_GE(found, limit * 0.99);
  EXPECT_LE(found, limit * 1.02);
}

TEST_P(DramBandwidthTest, RandomRowsOfAllBanksAreHeldUpByActivates) {
  const auto next = [&](std::uint64_t i) {
    DramAddress place;
    place.bank = static_cast<unsigned>(mix(i) % parameters.banks);
    place.row = mix(i + 1000000);
    return place;
  };
  const double limit = GetParam().activates_apart / left_by_refreshes(parameters);
  const double found = cycles_per_burst(parameters, next, never_writes);
  EXPECT_GE(found, limit * 0.9999);
  EXPECT_LE(found, limit * 1.1);
}

TEST_P(DramBandwidthTest, WithoutALimitOfActivatesTheBanksOrABusAre) {
  const auto next = [&](std::uint64_t i) {
    DramAddress place;
    place.bank = static_cast<unsigned>(i % parameters.banks);
    place.row = i;
    return place;
  };
  parameters.set("dram", "tfaw_ps", "1250");
  parameters.set("dram", "trrd_ps", "1250");
  parameters.set("dram", "trrd_l_ps", "1250");
  parameters.set("dram", "refresh", "off");
  const double limit =
      std::max({GetParam().burst, GetParam().row_cycle / static_cast<double>(parameters.banks), GetParam().commands});
  const double found = cycles_per_burst(parameters, next, never_writes);
  EXPECT_GE(found, limit * 0.9999);
  EXPECT_LE(found, limit * 1.05);
}

TEST_P(DramBandwidthTest, ReadsAndWritesByTurnsLoseTheTurnsOfTheBus) {
  const auto next = [&](std::uint64_t i) {
    DramAddress place;
    place.bank = static_cast<unsigned>(i % parameters.banks);
    place.column = static_cast<std::uint32_t>(i / parameters.banks % 64);
    place.row = 5;
    return place;
  };
  const auto half = [](std::uint64_t i) { return i % 2 == 1; };
  const double streaming = GetParam().burst / left_by_refreshes(parameters);
  const double found = cycles_per_burst(parameters, next, half);
  EXPECT_GT(found, 1.03 * streaming);
  // A drain writes 22 bursts, and the bus turns twice for them, in less than 60 cycles.
  EXPECT_LT(found, streaming * (44 * GetParam().burst + 60) / (44 * GetParam().burst));
}

TEST(DramPeak, IsThatOfTheDataBusesLessRefreshes) {
  DramParameters lpddr3(lpddr3_1600);
  constexpr double second = 1e12;
  EXPECT_NEAR(peak_bytes(lpddr3, second), 102.4e9 * (1 - 130.0 / 3900), 1e6);
  lpddr3.set("dram", "refresh", "off");
  EXPECT_DOUBLE_EQ(peak_bytes(lpddr3, second), 102.4e9);
  lpddr3.set("dram", "channel_bits", "64");
  EXPECT_DOUBLE_EQ(peak_bytes(lpddr3, second), 204.8e9);
  lpddr3.set("dram", "channels", "12");
  EXPECT_DOUBLE_EQ(peak_bytes(lpddr3, second), 12 * 204.8e9 / 16);
  DramParameters lpddr5(lpddr5_6400);
  lpddr5.set("dram", "refresh", "off");
  EXPECT_DOUBLE_EQ(peak_bytes(lpddr5, second), 204.8e9);
  lpddr5.set("dram", "bank_groups", "1");
  EXPECT_DOUBLE_EQ(peak_bytes(lpddr5, second), 102.4e9) << "within a group bursts are twice as far apart";
}

// A burst of 4 cycles of 1.25 ns in each channel, less refreshes: 5 ns / channels a burst, in cycles of 1 ns.
TEST(DramStream, TakesAsLongAsItsShareOfAnyNumberOfChannels) {
  std::map<unsigned, double> cycles, annotated;
  for (const unsigned channels : {1U, 3U, 5U, 10U, 12U, 16U, 40U, 48U}) {
    for (const char* hash : {"on", "off"}) {
      DramBench bench("lpddr3-1600", {{"channels", std::to_string(channels)}, {"hash", hash}});
      std::vector<Access> stream;
      const std::uint64_t bursts = std::uint64_t{1500} * channels;
      for (std::uint64_t i = 0; i < bursts; ++i) stream.push_back(read(0, i * 32));
      const auto last = [](const std::vector<Cycle>& answered) {
        return static_cast<double>(*std::max_element(answered.begin(), answered.end()));
      };
      cycles[channels] = last(bench.answered(stream));
      annotated[channels] = last(bench.annotated_answers(stream));
      constexpr double share = 1500 * 5 / (1 - 130.0 / 3900);
      EXPECT_GE(cycles[channels], 1500 * 5) << channels;
      EXPECT_LE(cycles[channels], share * 1.05) << channels;
      EXPECT_NEAR(annotated[channels] / cycles[channels], 1, 0.03) << channels;
      for (const Access& access : stream) bench.behaviour->access(access.request);
      EXPECT_LE(bench.behaviour->least_occupancy(1000).front().cycles, cycles[channels]);
      EXPECT_GE(bench.behaviour->least_occupancy(1000).front().cycles, 0.9 * cycles[channels]);
    }
  }
  // As many bytes a channel take as long: of the same bytes, 12 move 12/16 of what 16 do.
  EXPECT_NEAR(cycles[12] / cycles[16], 1, 0.01);
  EXPECT_NEAR(annotated[12] / annotated[16], 1, 0.01);
}

}  // namespace
}  // namespace vrpipe
