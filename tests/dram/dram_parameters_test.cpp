#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>

#include "dram/address_map.h"
#include "dram/dram_parameters.h"

namespace vrpipe {
namespace {

using Settings = std::vector<std::pair<std::string, std::string>>;

void set(DramParameters& parameters, const Settings& settings) {
  for (const auto& [name, value] : settings) parameters.set("dram", name, value);
}

TEST(DramParameters, TheDefaultsCanBe) {
  for (const DramDevice* device : {&lpddr3_1600, &lpddr5_6400}) EXPECT_NO_THROW(check(DramParameters(*device)));
}

TEST(DramParameters, DistancesBecomeCyclesByRoundingUp) {
  DramParameters parameters(lpddr3_1600);
  EXPECT_EQ(timing_of(parameters).rcd, 15U) << "18 ns are 14.4 cycles";
  EXPECT_EQ(timing_of(parameters).cl, 12U) << "15 ns are 12 cycles";
  EXPECT_EQ(timing_of(parameters).refi, 3120U);
  set(parameters, {{"trefi_ps", "3901000"}});
  EXPECT_EQ(timing_of(parameters).refi, 3120U) << "refreshes do not come too late";
}

TEST(DramParameters, WhatCannotBeIsRefusedWithItsRule) {
  const std::vector<std::pair<Settings, std::string>> cases = {
      {{{"tras_ps", "20000"}}, "a row is read before it is closed"},
      {{{"trc_ps", "59999"}}, "a row is open and then closed before the next is opened"},
      {{{"trp_all_ps", "17000"}}, "precharging all banks takes no less than one of them"},
      {{{"trrd_ps", "51000"}, {"trrd_l_ps", "51000"}}, "four activates take longer than one"},
      {{{"trrd_l_ps", "9000"}}, "no shorter within a group"},
      {{{"tccd_l_ps", "4000"}}, "no shorter within a group"},
      {{{"twtr_l_ps", "7000"}}, "no shorter within a group"},
      {{{"tccd_ps", "4999"}}, "bursts would overlap on the data bus"},
      {{{"tcwl_ps", "20001"}}, "data written would come after"},
      {{{"trefi_ps", "200000"}}, "nothing but refresh"},
      {{{"banks", "6"}},
       "6 is no power of two; use a power of two, as every DRAM standard has it; channels may be any"},
      {{{"row_bytes", "3000"}}, "3000 is no power of two"},
      {{{"interleave_bytes", "96"}}, "96 is no power of two"},
      {{{"channel_bits", "24"}}, "24 is no power of two; use a power of two, as every DRAM standard has it"},
      {{{"burst_length", "12"}}, "12 is no power of two"},
      {{{"bank_groups", "8"}, {"banks", "4"}}, "a group has a bank"},
      {{{"channel_bits", "8"}, {"burst_length", "4"}}, "too narrow: a burst moves 4 bytes"},
      {{{"burst_length", "1"}, {"channel_bits", "64"}}, "less than a cycle"},
      {{{"channel_bits", "256"}}, "more than a cache line"},
      {{{"channel_bits", "128"}, {"row_bytes", "64"}}, "does not fit into a row of 64"},
      {{{"channel_bits", "64"}, {"interleave_bytes", "32"}}, "more than one channel"},
      {{{"interleave_bytes", "8192"}}, "an interleaved piece is in one row"},
      {{{"write_high", "65"}}, "writes drain before their queue is full"},
      {{{"write_low", "54"}}, "ends at 54 and begins at 54"},
  };
  for (const auto& [settings, rule] : cases) {
    DramParameters parameters(lpddr3_1600);
    set(parameters, settings);
    try {
      timing_of(parameters);
      ADD_FAILURE() << "taken: " << settings.front().first << "=" << settings.front().second;
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find(rule), std::string::npos) << error.what();
    }
  }
}

TEST(DramParameters, WhatIsJustPossibleIsTaken) {
  const std::vector<Settings> cases = {
      {{"tras_ps", "25500"}},         {{"tccd_ps", "5000"}},
      {{"tcwl_ps", "20000"}},         {{"write_low", "53"}},
      {{"interleave_bytes", "4096"}}, {{"channels", "1"}, {"banks", "1"}},
      {{"channels", "12"}},           {{"trefi_ps", "5000"}, {"refresh", "off"}},
  };
  for (const Settings& settings : cases) {
    DramParameters parameters(lpddr3_1600);
    set(parameters, settings);
    EXPECT_NO_THROW(check(parameters)) << settings.front().first;
  }
}

class AddressMapTest : public ::testing::Test {
 protected:
  DramAddress place_of(std::uint64_t address) { return DramAddressMap(parameters).place_of(address); }
  DramParameters parameters{lpddr3_1600};
};

TEST_F(AddressMapTest, PutsTheFieldsInTheirOrder) {
  // 32 bytes a burst, 256 in a piece, 16 channels, 8 banks, 4096 in a row.
  const auto expect = [&](std::uint64_t address, unsigned channel, unsigned bank, std::uint64_t row,
                          std::uint32_t column) {
    const DramAddress place = place_of(address);
    EXPECT_EQ(std::make_tuple(place.channel, place.bank, place.row, place.column),
              std::make_tuple(channel, bank, row, column))
        << address;
  };
  set(parameters, {{"hash", "off"}});
  expect(31, 0, 0, 0, 0);
  expect(3 * 32, 0, 0, 0, 3);
  expect(5 * 256, 5, 0, 0, 0);
  expect(16 * 256 + 32, 0, 0, 0, 8 + 1);
  expect(16 * 4096, 0, 1, 0, 0);
  expect(8 * 16 * 4096 + 7, 0, 0, 1, 0);
  set(parameters, {{"mapping", "row-column-bank-channel"}});
  expect(5 * 256, 5, 0, 0, 0);
  expect(16 * 256, 0, 1, 0, 0);
  expect(8 * 16 * 256, 0, 0, 0, 8);
  expect(8 * 16 * 4096, 0, 0, 1, 0);
  set(parameters, {{"mapping", "row-bank-column-group-channel"}, {"bank_groups", "4"}});
  expect(3 * 16 * 256, 0, 3, 0, 0);
  expect(4 * 16 * 256, 0, 0, 0, 8);
  expect(4 * 16 * 4096, 0, 4, 0, 0);
  expect(8 * 16 * 4096, 0, 0, 1, 0);
}

TEST_F(AddressMapTest, NoTwoBurstsShareAPlace) {
  for (const char* mapping : {"row-bank-column-channel", "row-column-bank-channel", "row-bank-column-group-channel"}) {
    for (const char* hash : {"on", "off"}) {
      set(parameters,
          {{"mapping", mapping}, {"hash", hash}, {"channels", "4"}, {"row_bytes", "512"}, {"bank_groups", "2"}});
      std::set<std::tuple<unsigned, unsigned, std::uint64_t, std::uint32_t>> places;
      constexpr std::uint64_t bursts = 16 * 4 * 8 * 16;  // rows, channels, banks, columns
      for (std::uint64_t burst = 0; burst < bursts; ++burst) {
        const DramAddress place = place_of(burst * 32);
        ASSERT_TRUE(place.channel < 4 && place.bank < 8 && place.column < 16 && place.row < 16);
        places.emplace(place.channel, place.bank, place.row, place.column);
      }
      EXPECT_EQ(places.size(), bursts) << mapping;
    }
  }
}

TEST_F(AddressMapTest, OfAnyNumberOfChannelsNoTwoBurstsShareAPlaceAndNeighboursGoRoundThemAll) {
  for (const unsigned channels : {1U, 3U, 5U, 10U, 12U, 40U, 48U}) {
    for (const char* mapping :
         {"row-bank-column-channel", "row-column-bank-channel", "row-bank-column-group-channel"}) {
      for (const char* hash : {"on", "off"}) {
        set(parameters, {{"mapping", mapping},
                         {"hash", hash},
                         {"channels", std::to_string(channels)},
                         {"row_bytes", "512"},
                         {"bank_groups", "2"}});
        const DramAddressMap map(parameters);
        std::set<std::tuple<unsigned, unsigned, std::uint64_t, std::uint32_t>> places;
        const std::uint64_t bursts = 6 * channels * 8 * 16;  // rows, channels, banks, columns
        for (std::uint64_t first = 0; first < bursts; first += 8 * channels) {
          std::set<unsigned> found;
          for (std::uint64_t burst = first; burst < first + 8 * channels; ++burst) {  // eight in a piece
            const DramAddress place = map.place_of(burst * 32);
            ASSERT_TRUE(place.channel < channels && place.bank < 8 && place.column < 16 && place.row < 6);
            places.emplace(place.channel, place.bank, place.row, place.column);
            found.insert(place.channel);
            ASSERT_TRUE(hash == std::string("on") || place.channel == burst / 8 % channels);
          }
          ASSERT_EQ(found.size(), channels);
        }
        EXPECT_EQ(places.size(), bursts) << mapping << " of " << channels;
      }
    }
  }
}

TEST_F(AddressMapTest, WhatLiesAboveAChannelDoesNotDependOnHowManyThereAre) {
  // 256 bytes in a piece: piece r * channels + c is where piece r is of a DRAM of one channel.
  set(parameters, {{"hash", "off"}, {"channels", "1"}});
  const DramAddressMap one(parameters);
  set(parameters, {{"channels", "12"}});
  const DramAddressMap twelve(parameters);
  for (std::uint64_t i = 0; i < 10'000; ++i) {
    const std::uint64_t round = mix(i) >> (20 + mix(i + 1) % 20);
    const std::uint64_t byte = mix(i + 2) % 256;
    const DramAddress expected = one.place_of(round * 256 + byte);
    const DramAddress place = twelve.place_of((12 * round + i % 12) * 256 + byte);
    ASSERT_EQ(place.channel, i % 12);
    ASSERT_EQ(std::tie(place.bank, place.row, place.column), std::tie(expected.bank, expected.row, expected.column));
  }
}

TEST_F(AddressMapTest, HashingSpreadsStridesOverChannelsAndBanks) {
  const auto used = [&](std::uint64_t stride) {
    std::set<unsigned> channels, banks;
    for (std::uint64_t i = 0; i < 256; ++i) {
      channels.insert(place_of(i * stride).channel);
      banks.insert(place_of(i * stride).bank);
    }
    return std::make_pair(channels.size(), banks.size());
  };
  constexpr std::uint64_t rows = 8 * 16 * 4096;
  set(parameters, {{"hash", "off"}});
  EXPECT_EQ(used(rows), std::make_pair(std::size_t{1}, std::size_t{1}));
  set(parameters, {{"hash", "on"}});
  EXPECT_EQ(used(rows), std::make_pair(std::size_t{16}, std::size_t{8}));
  for (const std::size_t channels : {3U, 5U, 10U, 12U, 40U, 48U}) {
    set(parameters, {{"channels", std::to_string(channels)}, {"hash", "off"}});
    EXPECT_EQ(used(channels * rows).first, 1U);
    set(parameters, {{"hash", "on"}});
    EXPECT_GE(10 * used(channels * rows).first, 9 * channels);
    EXPECT_GE(10 * used(rows).first, 9 * channels) << "of 256 strides";
  }
}

TEST_F(AddressMapTest, ALineIsInOneRowOfOneChannelUnlessPiecesAreSmaller) {
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const std::uint64_t line = mix(i) & ~std::uint64_t{127};
    for (std::uint64_t sector = 1; sector < 4; ++sector) {
      EXPECT_EQ(place_of(line + 32 * sector).channel, place_of(line).channel);
      EXPECT_EQ(place_of(line + 32 * sector).row, place_of(line).row);
      EXPECT_EQ(place_of(line + 32 * sector).column, place_of(line).column + sector);
    }
  }
}

}  // namespace
}  // namespace vrpipe
