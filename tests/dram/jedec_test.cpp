// Every distance between the commands of a channel, over traffic of all sorts, judged by the independent checker; and
// what its reads see.

#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

#include "jedec_checker.h"
#include "traffic.h"

namespace vrpipe {
namespace {

using namespace testing;

constexpr Cycle end_of_traffic = 25000;

/// Feeds a channel, and checks all that it does.
void check_traffic(const DramParameters& parameters, const std::function<bool(Burst&)>& next, const std::string& what) {
  SCOPED_TRACE(what);
  ChannelBench bench(parameters);
  JedecChecker checker(parameters);
  DataOrder order;
  CommandFan fan({&checker, &order});
  bench.channel.observe(fan);
  std::vector<unsigned> answers;
  std::uint64_t asked_reads = 0;
  std::uint64_t asked_writes = 0;
  // Once nothing more is asked for, everything is served that has to be.
  const Cycle end = end_of_traffic + 10000;
  feed(
      bench.channel, next, end_of_traffic, end,
      [&](const Burst& burst, std::uint32_t tag) {
        if (burst.writes) {
          ++asked_writes;
          order.write(burst.place);
        } else {
          ++asked_reads;
          order.read(burst.place);
          answers.resize(tag + 1);
        }
      },
      [&](const DramChannel::Completion& done) { ++answers.at(done.tag); });
  checker.check_refreshes(end);
  EXPECT_EQ(checker.report(), "");
  EXPECT_EQ(order.unwanted, 0U);
  EXPECT_EQ(order.out_of_order, 0U) << "reads that see what was written too early or too late";
  EXPECT_EQ(order.unserved(), 0U);
  for (std::size_t tag = 0; tag < answers.size(); ++tag) ASSERT_EQ(answers[tag], 1U) << "of read " << tag;
  const DramStatistics& s = bench.statistics;
  EXPECT_EQ(s.reads.value() + s.reads_forwarded.value(), asked_reads);
  EXPECT_LE(asked_writes - s.writes.value() - s.writes_merged.value(), parameters.write_low) << "left in the queue";
  EXPECT_EQ(s.row_hits.value() + s.row_misses.value() + s.row_conflicts.value(), s.reads.value() + s.writes.value());
  EXPECT_EQ(s.refreshes.value(), checker.refreshes());
  EXPECT_EQ(s.activates.value() + s.reads.value() + s.writes.value() + s.precharges.value() + s.refreshes.value(),
            checker.commands());
}

/// Traffic of a kind, chosen by a seed: how much of it is written, over how many banks, rows and columns, how dense.
std::function<bool(Burst&)> random_traffic(const DramParameters& p, std::uint64_t seed) {
  const auto choose = [seed](std::uint64_t salt, std::vector<std::uint32_t> of) {
    return of[mix(seed * 977 + salt) % of.size()];
  };
  const std::uint32_t written_of_16 = choose(1, {0, 1, 4, 8, 15, 16});
  const std::uint32_t banks = std::min<std::uint32_t>(p.banks, choose(2, {1, 2, 4, 32}));
  const std::uint32_t rows = choose(3, {1, 2, 5, 1000});
  const std::uint32_t columns = choose(4, {1, 4, 32});
  const std::uint32_t gap = choose(5, {1, 1, 4, 16, 300});
  auto state = std::make_shared<std::pair<std::uint64_t, Cycle>>(mix(seed), 0);
  return [=](Burst& burst) {
    // Bindings are nothing that a lambda can capture in C++17.
    std::uint64_t& random = state->first;
    Cycle& from = state->second;
    const auto draw = [&random](std::uint32_t below) {
      random = mix(random);
      return static_cast<std::uint32_t>(random >> 33U) % below;
    };
    burst.place.bank = draw(banks);
    burst.place.row = draw(rows);
    burst.place.column = draw(columns);
    burst.writes = draw(16) < written_of_16;
    from += draw(gap);
    // A gap of one is as dense as the queues allow; the traffic ends by itself.
    if (gap == 1) from += draw(4) == 0 ? 1 : 0;
    burst.from = from;
    return true;
  };
}

void set(DramParameters& parameters, const std::string& name, const std::string& value) {
  parameters.set("dram", name, value);
}

TEST(Jedec, EveryDistanceIsKeptOverRandomTraffic) {
  const std::vector<std::function<void(DramParameters&)>> variants = {
      [](DramParameters&) {},
      [](DramParameters& p) { set(p, "page_policy", "closed"); },
      [](DramParameters& p) {
        set(p, "read_queue", "4");
        set(p, "write_queue", "4");
        set(p, "write_high", "2");
        set(p, "write_low", "0");
      },
      [](DramParameters& p) {
        set(p, "activate_cycles", "2");
        set(p, "age_cap_cycles", "20");
        set(p, "trefi_ps", "600000");
      },
      [](DramParameters& p) {
        set(p, "tck_ps", "1000");
        set(p, "twtr_ps", "0");
        set(p, "trtw_ps", "0");
        set(p, "tccd_l_ps", "9100");
        set(p, "tccd_ps", "6100");
        set(p, "trrd_l_ps", "12000");
        set(p, "bank_groups", "2");
        set(p, "twtr_l_ps", "14000");
        set(p, "trp_all_ps", "30000");
        set(p, "trc_ps", "90000");
      },
  };
  for (const DramDevice* device : {&lpddr3_1600, &lpddr5_6400}) {
    for (std::size_t variant = 0; variant < variants.size(); ++variant) {
      for (std::uint64_t seed = 0; seed < 8; ++seed) {
        DramParameters parameters(*device);
        variants[variant](parameters);
        check_traffic(parameters, random_traffic(parameters, seed + 100 * variant),
                      (device == &lpddr3_1600 ? "LPDDR3, variant " : "LPDDR5, variant ") + std::to_string(variant) +
                          ", seed " + std::to_string(seed));
        if (HasFailure()) return;
      }
    }
  }
}

TEST(Jedec, EveryDistanceIsKeptOverStreams) {
  for (const DramDevice* device : {&lpddr3_1600, &lpddr5_6400}) {
    for (const char* mapping :
         {"row-bank-column-channel", "row-column-bank-channel", "row-bank-column-group-channel"}) {
      for (const unsigned written_of_4 : {0U, 1U, 4U}) {
        DramParameters parameters(*device);
        set(parameters, "mapping", mapping);
        const DramAddressMap map(parameters);
        std::uint64_t address = 0;
        Cycle from = 0;
        check_traffic(
            parameters,
            [&](Burst& burst) {
              do address += 32;
              while (map.place_of(address).channel != 3);
              burst.place = map.place_of(address);
              burst.writes = address / 32 % 4 < written_of_4;
              burst.from = ++from;
              return true;
            },
            mapping);
      }
    }
  }
}

TEST(Jedec, WhatAChannelDoesDoesNotDependOnHowTimeIsCutUp) {
  const DramParameters parameters(lpddr3_1600);
  using Command = std::tuple<Cycle, DramCommand::Kind, unsigned>;
  const auto commands = [&](std::uint64_t seed, Cycle step, std::vector<Command>& found) {
    ChannelBench bench(parameters);
    CommandLog log;
    bench.channel.observe(log);
    const auto traffic = random_traffic(parameters, seed);
    Burst burst;
    for (Cycle now = 0; traffic(burst) && burst.from < 9000;) {
      for (; now < burst.from; now = std::min(now + step, burst.from)) bench.channel.advance(now);
      bench.channel.advance(now);
      if (!(burst.writes ? bench.channel.can_write() : bench.channel.can_read())) continue;
      if (burst.writes) {
        bench.channel.write(burst.place, now);
      } else {
        bench.channel.read(burst.place, 0, now);
      }
    }
    bench.channel.advance(20000);
    for (const DramCommand& command : log.commands) found.emplace_back(command.at, command.kind, command.bank);
  };
  std::vector<Command> at_once, by_cycle, by_sevens;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    commands(seed, 100000, at_once);
    commands(seed, 1, by_cycle);
    commands(seed, 7, by_sevens);
  }
  EXPECT_GT(at_once.size(), 5000U);
  EXPECT_EQ(by_cycle, at_once);
  EXPECT_EQ(by_sevens, at_once);
}

}  // namespace
}  // namespace vrpipe
