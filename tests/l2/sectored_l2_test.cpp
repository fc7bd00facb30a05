#include "l2/sectored_l2.h"

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/slots/memory.h>

#include "support/builders.h"
#include "support/reference_cache.h"

namespace vrpipe {
namespace {

using testing::ReferenceCache;

/// A memory that keeps what it was asked.
class Recorder final : public MemoryBehaviour {
 public:
  void access(const MemoryRequest& request) override {
    requests.push_back(request);
    bytes.count(request);
  }
  TimingParameters timing() const override { return {1, 32}; }

  std::vector<MemoryRequest> requests;
  MemoryBytes bytes;
};

using Settings = std::vector<std::pair<std::string, std::string>>;

class L2 {
 public:
  explicit L2(const Settings& settings = {}) : draw_(testing::draw_of(16, 16)), context_(testing::context_of(draw_)) {
    SectoredL2Parameters parameters;
    for (const auto& [name, value] : settings) parameters.set("l2", name, value);
    behaviour = std::make_unique<SectoredL2>(parameters, context_);
    behaviour->set_below(below);
    behaviour->count_least();
  }
  void read(std::uint64_t address, std::uint32_t bytes, MemoryOrigin origin = {}) {
    behaviour->access({address, bytes, tlm::TLM_READ_COMMAND, origin});
  }
  void write(std::uint64_t address, std::uint32_t bytes, MemoryOrigin origin = {}) {
    behaviour->access({address, bytes, tlm::TLM_WRITE_COMMAND, origin});
  }
  std::uint64_t count(const std::string& name) const {
    const std::size_t dot = name.find('.');
    const StatisticSet* set = behaviour.get();
    if (dot != std::string::npos) {
      for (const StatisticSet* part : behaviour->parts()) {
        if (name.substr(0, dot) == part->part_name()) set = part;
      }
    }
    for (const Counter* counter : set->counters()) {
      if (name.substr(dot + 1) == counter->name()) return counter->value();
    }
    ADD_FAILURE() << "no counter " << name;
    return 0;
  }

  std::unique_ptr<SectoredL2> behaviour;
  Recorder below;

 private:
  Draw draw_;
  RenderContext context_;
};

constexpr MemoryOrigin color_origin{MemoryTraffic::color, 1};
constexpr MemoryOrigin attribute_origin{MemoryTraffic::attribute, 2};

TEST(SectoredL2, AMissFetchesItsSectorsInOneRequestOfItsOriginAndAHitNothing) {
  L2 l2;
  l2.read(0x1000'0000'0080, 64, color_origin);
  ASSERT_EQ(l2.below.requests.size(), 1U);
  const MemoryRequest& fill = l2.below.requests.front();
  EXPECT_EQ(fill.address, 0x1000'0000'0080U);
  EXPECT_EQ(fill.bytes, 64U);
  EXPECT_EQ(fill.command, tlm::TLM_READ_COMMAND);
  EXPECT_EQ(fill.origin.traffic, MemoryTraffic::color);
  EXPECT_EQ(fill.origin.gpc, 1U);
  l2.read(0x1000'0000'0080, 32, attribute_origin);
  EXPECT_EQ(l2.below.requests.size(), 1U);
  l2.read(0x1000'0000'0080, 128, attribute_origin);
  EXPECT_EQ(l2.below.requests.size(), 2U);
  EXPECT_EQ(l2.count("color_sectors"), 2U);
  EXPECT_EQ(l2.count("color_sector_misses"), 2U);
  EXPECT_EQ(l2.count("attribute_sectors"), 5U);
  EXPECT_EQ(l2.count("attribute_sector_misses"), 2U);
  EXPECT_EQ(l2.count("color_bytes_read"), 64U);
  EXPECT_EQ(l2.below.requests.back().origin.traffic, MemoryTraffic::attribute);
}

TEST(SectoredL2, WhatWasWrittenGoesBelowWithTheOriginOfItsLineWhenThatGoes) {
  L2 l2(Settings{{"bytes", "1024"}, {"ways", "0"}, {"banks", "1"}, {"hold_attributes", "off"}});  // 8 lines
  l2.write(0, 128, attribute_origin);
  l2.write(128 + 32, 32, color_origin);
  for (std::uint64_t line = 2; line < 9; ++line) l2.read(128 * line, 32, color_origin);
  ASSERT_EQ(l2.below.bytes.written, 128U) << "the first line alone";
  MemoryRequest written;
  for (const MemoryRequest& request : l2.below.requests) {
    if (request.command == tlm::TLM_WRITE_COMMAND) written = request;
  }
  EXPECT_EQ(written.address, 0U);
  EXPECT_EQ(written.bytes, 128U);
  EXPECT_EQ(written.origin.traffic, MemoryTraffic::attribute);
  EXPECT_EQ(written.origin.gpc, 2U);
}

TEST(SectoredL2, WritingThroughItPassesOnEveryWriteAndReadsWhatItWouldWithoutThem) {
  L2 through(Settings{{"write_policy", "write-through"}, {"bytes", "4096"}, {"ways", "2"}, {"banks", "1"}});
  L2 reads(Settings{{"bytes", "4096"}, {"ways", "2"}, {"banks", "1"}});
  std::uint64_t written = 0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const std::uint64_t line = mix(i) % 64;
    if (mix(i + 5000) % 3 != 0) {
      for (L2* l2 : {&through, &reads}) l2->read(128 * line, 64, color_origin);
    } else {
      through.write(128 * line + 32, 16, attribute_origin);
      written += 16;
    }
  }
  EXPECT_EQ(through.below.bytes.written, written);
  EXPECT_EQ(through.behaviour->memory_bytes().written, written);
  EXPECT_EQ(through.below.bytes.read, reads.below.bytes.read);
  EXPECT_EQ(through.count("cache.sector_misses"), reads.count("cache.sector_misses"));
  EXPECT_EQ(through.count("cache.sectors_written_back"), 0U);
  const auto is_write = [](const MemoryRequest& request) { return request.command == tlm::TLM_WRITE_COMMAND; };
  const auto first = std::find_if(through.below.requests.begin(), through.below.requests.end(), is_write);
  EXPECT_EQ(first->origin.traffic, MemoryTraffic::attribute);
  EXPECT_EQ(first->bytes, 16U);
}

TEST(SectoredL2, ColourStreamsThroughAndAttributesStay) {
  for (const bool held : {true, false}) {
    L2 l2(Settings{{"bytes", "64K"}, {"hold_attributes", held ? "on" : "off"}, {"hash_sets", "on"}});
    constexpr std::uint64_t lines = 256;  // of attributes: half of it
    for (std::uint64_t line = 0; line < lines; ++line) l2.write(128 * line, 128, attribute_origin);
    for (std::uint64_t line = 0; line < 4096; ++line) l2.read((1U << 30U) + 128 * line, 128, color_origin);
    EXPECT_EQ(l2.below.bytes.written, held ? 0 : 128 * lines);
    for (std::uint64_t line = 0; line < lines; ++line) l2.read(128 * line, 128, attribute_origin);
    EXPECT_EQ(l2.count("attribute_sector_misses"), 4 * (held ? lines : 2 * lines));
    EXPECT_EQ(l2.count("attribute_lines_held") > 0, held);
  }
}

TEST(SectoredL2, AttributesThatAreMoreThanItHoldsGoAsOthersDo) {
  L2 l2(Settings{{"bytes", "64K"}});
  for (std::uint64_t line = 0; line < 1024; ++line) l2.write(128 * line, 128, attribute_origin);
  EXPECT_EQ(l2.below.bytes.written, 64U * 1024);
  EXPECT_EQ(l2.count("attribute_lines_held"), 0U);
}

TEST(SectoredL2, ARequestLongerThanALineIsOneForEachLine) {
  L2 l2(Settings{{"line_bytes", "64"}});
  l2.read(4096, 256, color_origin);
  EXPECT_EQ(l2.below.requests.size(), 4U);
  EXPECT_EQ(l2.below.bytes.read, 256U);
  EXPECT_EQ(l2.count("cache.line_misses"), 4U);
  EXPECT_EQ(l2.count("color_reads"), 1U);
}

std::set<std::pair<std::uint64_t, bool>> sectors_of(const std::vector<MemoryRequest>& requests, std::size_t from) {
  std::set<std::pair<std::uint64_t, bool>> sectors;
  for (std::size_t i = from; i < requests.size(); ++i) {
    const MemoryRequest& request = requests[i];
    EXPECT_EQ(request.bytes & (request.bytes - 1), 0U);
    EXPECT_EQ(request.address % request.bytes, 0U);
    EXPECT_LE(request.bytes, 128U);
    for (std::uint64_t address = request.address; address < request.address + request.bytes; address += 32) {
      EXPECT_TRUE(sectors.insert({address, request.command == tlm::TLM_WRITE_COMMAND}).second);
    }
  }
  return sectors;
}

// Colour, attributes, and reads of vertices that come once; some of them parts of a sector.
MemoryRequest random_request(std::uint64_t seed) {
  MemoryRequest request;
  request.bytes = 4U << mix(seed) % 6;
  const std::uint64_t kind = mix(seed + 1) % 3;
  request.origin.traffic = kind == 0   ? MemoryTraffic::color
                           : kind == 1 ? MemoryTraffic::attribute
                                       : MemoryTraffic::vertex;
  request.origin.gpc = static_cast<std::uint16_t>(mix(seed + 2) % 4);
  request.command = kind < 2 && mix(seed + 3) % 2 == 0 ? tlm::TLM_WRITE_COMMAND : tlm::TLM_READ_COMMAND;
  const std::uint64_t span = kind == 0 ? 40'000 : kind == 1 ? 9'000 : 1'000'000'000;
  const std::uint64_t offset = mix(seed + 4) % span;
  request.address = (kind << 32U) + offset - offset % request.bytes;
  return request;
}

const std::pair<std::string, std::string> unheld{"hold_attributes", "off"};

TEST(SectoredL2, ReadsAndWritesBelowWhatACacheByItsDefinitionWould) {
  const Settings variants[] = {{{"ways", "4"}},
                               {{"ways", "4"}, unheld},
                               {{"ways", "2"}, {"hash_sets", "off"}, {"tell_conflicts", "on"}},
                               {{"ways", "8"}, {"replacement", "tree-plru"}},
                               {{"ways", "0"}, {"replacement", "random"}, {"banks", "1"}},
                               {{"bytes", "30K"}, {"ways", "4"}, {"banks", "12"}},
                               {{"bytes", "30K"}, {"ways", "2"}, {"banks", "10"}, {"hash_sets", "on"}},
                               {{"bytes", "40K"}, {"ways", "8"}, {"banks", "40"}, {"hash_sets", "on"}},
                               {{"bytes", "33K"}, {"ways", "8"}, {"banks", "3"}, {"replacement", "fifo"}},
                               {{"bytes", "30K"}, {"ways", "5"}, {"banks", "48"}, {"tell_conflicts", "on"}}};
  for (Settings settings : variants) {
    settings.insert(settings.begin(), {{"bytes", "32K"}, {"banks", "8"}});
    L2 l2(settings);
    CacheOrganization organization = l2.behaviour->cache().organization();
    ReferenceCache reference(organization);
    const bool holds = std::find(settings.begin(), settings.end(), unheld) == settings.end();
    std::uint64_t held = 0;
    std::map<std::uint64_t, unsigned> gpc_of;  // that brought a line in
    std::map<MemoryTraffic, std::uint64_t> misses;
    for (std::uint64_t i = 0; i < 20'000; ++i) {
      const MemoryRequest request = random_request(10 * i);
      const bool writes = request.command == tlm::TLM_WRITE_COMMAND;
      const std::size_t before = l2.below.requests.size();
      l2.behaviour->access(request);
      const ReferenceCache::Outcome expected = reference.access(request.address, request.bytes, writes);
      if (holds && expected.replaced && request.origin.traffic == MemoryTraffic::attribute) {
        reference.keep(request.address);
      }
      held += expected.spared ? 1 : 0;
      std::set<std::pair<std::uint64_t, bool>> sectors;
      const std::uint64_t line = request.address - request.address % 128;
      for (const unsigned sector : expected.filled) sectors.insert({line + 32 * sector, false});
      for (const unsigned sector : expected.written_back) sectors.insert({expected.old_address + 32 * sector, true});
      ASSERT_EQ(sectors_of(l2.below.requests, before), sectors) << i;
      for (std::size_t asked = before; asked < l2.below.requests.size(); ++asked) {
        const MemoryRequest& below = l2.below.requests[asked];
        const bool written = below.command == tlm::TLM_WRITE_COMMAND;
        ASSERT_EQ(below.origin.gpc, written ? gpc_of[below.address - below.address % 128] : request.origin.gpc);
        ASSERT_EQ(static_cast<unsigned>(below.origin.traffic),
                  written ? 1 + 3 * (below.address >> 32U) : static_cast<unsigned>(request.origin.traffic));
      }
      misses[request.origin.traffic] += expected.missed.size();
      if (expected.replaced) gpc_of[line] = request.origin.gpc;
    }
    const SectoredCacheStatistics& statistics = l2.behaviour->statistics();
    if (!organization.tells_conflicts) {
      reference.capacity += reference.conflict;
      reference.conflict = 0;
    }
    reference.expect_equal(statistics);
    EXPECT_EQ(l2.count("attribute_lines_held"), held);
    EXPECT_EQ(held > 100, holds) << held;
    EXPECT_EQ(l2.below.bytes.read, statistics.bytes_filled.value());
    EXPECT_EQ(l2.below.bytes.written, statistics.bytes_written_back.value());
    EXPECT_EQ(l2.behaviour->memory_bytes().read, l2.below.bytes.read);
    EXPECT_EQ(l2.behaviour->memory_bytes().written, l2.below.bytes.written);
    EXPECT_EQ(l2.count("color_sector_misses"), misses[MemoryTraffic::color]);
    EXPECT_EQ(l2.count("attribute_sector_misses"), misses[MemoryTraffic::attribute]);
    EXPECT_EQ(l2.count("vertex_sector_misses"), misses[MemoryTraffic::vertex]);
    EXPECT_GT(misses[MemoryTraffic::color], 100U);
    EXPECT_GT(misses[MemoryTraffic::attribute], 100U);
    EXPECT_GT(l2.below.bytes.written, 10'000U);
  }
}

/// Sectors read from below when a surface is read and written, sector by sector, so many times.
std::uint64_t filled(L2& l2, std::uint64_t bytes, unsigned rounds) {
  for (unsigned round = 0; round < rounds; ++round) {
    for (std::uint64_t address = 0; address < bytes; address += 32) {
      l2.read(address, 32, color_origin);
      l2.write(address, 32, color_origin);
    }
  }
  return l2.below.bytes.read / 32;
}

TEST(SectoredL2, ASurfaceThatFitsIsFetchedOnceAndStays) {
  L2 l2;
  constexpr std::uint64_t bytes = 3 << 20;
  EXPECT_EQ(filled(l2, bytes, 5), bytes / 32);
  EXPECT_EQ(l2.below.bytes.written, 0U) << "dirty at the end of the frame";
  EXPECT_EQ(l2.count("cache.sector_misses_compulsory"), bytes / 32);
  EXPECT_EQ(l2.count("cache.sector_misses"), bytes / 32);
}

TEST(SectoredL2, TheKneeIsAtItsSize) {
  constexpr unsigned rounds = 3;
  for (const char* hashed : {"on", "off"}) {
    for (const std::uint64_t eighths : {1U, 4U, 7U, 8U, 9U, 12U, 16U}) {
      L2 l2(Settings{{"bytes", "512K"}, {"hash_sets", hashed}});
      const std::uint64_t lines = eighths * 512;
      const std::uint64_t missed = filled(l2, 128 * lines, rounds) / 4;
      // In turn, more lines than a set has ways all miss; each set has its share of them.
      EXPECT_EQ(missed, eighths <= 8 ? lines : rounds * lines) << eighths << "/8 of the cache";
    }
  }
}

TEST(SectoredL2, NeighbouringLinesAreInOtherBanksAndAllBanksHaveTheirShare) {
  for (const char* hashed : {"on", "off"}) {
    const L2 l2(Settings{{"hash_sets", hashed}});
    std::map<std::uint32_t, unsigned> lines;
    for (std::uint64_t line = 0; line < 32 * 64; ++line) {
      ++lines[l2.behaviour->bank_of(128 * line)];
      EXPECT_NE(l2.behaviour->bank_of(128 * line), l2.behaviour->bank_of(128 * (line + 1)));
    }
    EXPECT_EQ(lines.size(), 32U);
    for (const auto& [bank, count] : lines) EXPECT_EQ(count, 64U) << bank;
  }
  // A column of a surface whose rows are a power of two of lines.
  for (const char* hashed : {"on", "off"}) {
    const L2 l2(Settings{{"hash_sets", hashed}});
    std::set<std::uint32_t> banks;
    for (std::uint64_t row = 0; row < 64; ++row) banks.insert(l2.behaviour->bank_of(row * 128 * 2048));
    EXPECT_EQ(banks.size(), hashed == std::string("on") ? 32U : 1U);
  }
}

struct RealL2 {
  const char* bytes;
  std::uint32_t banks, sets;
};
constexpr RealL2 real_l2s[] = {{"6M", 12, 3072}, {"5M", 10, 2560},    {"40M", 40, 20480},
                               {"3M", 6, 1536},  {"5632K", 11, 2816}, {"6M", 48, 3072}};

TEST(SectoredL2, MayHaveTheBanksOfRealGpus) {
  for (const RealL2& real : real_l2s) {
    for (const char* hashed : {"on", "off"}) {
      const L2 l2(Settings{{"bytes", real.bytes}, {"banks", std::to_string(real.banks)}, {"hash_sets", hashed}});
      EXPECT_EQ(l2.behaviour->cache().organization().sets(), real.sets);
      // As many neighbouring lines as banks: one in each.
      const std::uint64_t first = (std::uint64_t{1} << 30U) * real.sets;
      for (std::uint64_t round = 0; round < 5000; ++round) {
        std::set<std::uint32_t> banks;
        for (std::uint64_t i = 0; i < real.banks; ++i) {
          banks.insert(l2.behaviour->bank_of(128 * (first + round * real.banks + i)));
        }
        ASSERT_EQ(banks.size(), real.banks);
        ASSERT_EQ(*banks.rbegin(), real.banks - 1);
      }
      // Every set is in one bank, and each bank has as many.
      std::map<std::uint32_t, std::set<std::uint32_t>> sets_of;
      std::set<std::uint32_t> sets;
      for (std::uint64_t line = 0; line < 3 * std::uint64_t{real.sets}; ++line) {
        const std::uint32_t set = l2.behaviour->cache().set_of(128 * line);
        sets_of[l2.behaviour->bank_of(128 * line)].insert(set);
        sets.insert(set);
      }
      EXPECT_EQ(sets.size(), real.sets);
      EXPECT_EQ(sets_of.size(), real.banks);
      for (const auto& [bank, of_bank] : sets_of) EXPECT_EQ(of_bank.size(), real.sets / real.banks) << bank;
    }
  }
}

TEST(SectoredL2, ItsBanksAreBusyForTheBytesThatTheyMove) {
  L2 l2(Settings{{"bank_bytes_per_cycle", "32"}, {"port_requests", "1"}});
  for (std::uint64_t line = 0; line < 32; ++line) l2.read(128 * line, 128);
  l2.read(0, 64);
  const std::vector<OccupancyPart> parts = l2.behaviour->least_occupancy(1000);
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_DOUBLE_EQ(parts[0].cycles, 4 + 4 + 2 - 4)
      << "of the busiest: a line and its fill, and half a line; less a line that may wait at the port";
}

// What is missed once more, or read beside what was written, depends on what came between.
TEST(SectoredL2, WhatEveryOrderReadsFromBelowIsWhatWasNeverThere) {
  L2 l2(Settings{{"bytes", "2048"}, {"banks", "1"}, {"write_allocate", "byte-mask"}});
  l2.write(128 * 32, 8);
  l2.read(128 * 32, 32);
  for (std::uint64_t line = 0; line < 17; ++line) l2.read(128 * line, 32);
  l2.read(0, 32);
  std::vector<std::uint64_t> uncertain;
  for (const MemoryRequest& request : l2.below.requests) {
    if (!request.is_certain) uncertain.push_back(request.address);
  }
  EXPECT_EQ(uncertain, (std::vector<std::uint64_t>{128 * 32, 128 * 32, 0})) << "read, written back; read again";
}

// A frame may end before they are done.
TEST(SectoredL2, NoQuadWaitsForVerticesOrForAttributesToBeWritten) {
  L2 l2(Settings{{"port_requests", "1"}});
  for (std::uint64_t line = 0; line < 1024; ++line) {
    l2.behaviour->access({128 * line, 128, tlm::TLM_READ_COMMAND, {MemoryTraffic::vertex, 0}});
    l2.behaviour->access({128 * (2048 + line), 128, tlm::TLM_WRITE_COMMAND, {MemoryTraffic::attribute, 0}});
  }
  EXPECT_DOUBLE_EQ(l2.behaviour->least_occupancy(1000)[0].cycles, 0);
}

TEST(L1, IsAsLargeAsThoseOf16CoresAndWritesThrough) {
  const SectoredL2Parameters parameters(level_of_l1);
  const Draw draw = testing::draw_of(16, 16);
  const RenderContext context = testing::context_of(draw);
  SectoredL2 l1(parameters, context);
  EXPECT_EQ(l1.cache().organization().bytes, 16U * 48 * 1024);
  EXPECT_EQ(l1.cache().organization().sets(), 64U) << "4 of each core";
  EXPECT_TRUE(l1.writes_through());
  SectoredL2Parameters refused(level_of_l1);
  refused.set("l1", "banks", "3");
  try {
    SectoredL2 made(refused, context);
    FAIL() << "accepted";
  } catch (const UserError& error) {
    EXPECT_NE(
        std::string(error.what()).find("unusable L1 (l1.banks, l1.bytes): 64 sets cannot be dealt out evenly to 3"),
        std::string::npos);
  }
}

TEST(L1, HoldsEachRoundOfABufferForItselfAndTheL2TheLast) {
  const Draw draw = testing::draw_of(16, 16);
  const RenderContext context = testing::context_of(draw);
  for (const CacheLevel* level : {&level_of_l1, &level_of_l2}) {
    const bool is_l1 = level == &level_of_l1;
    const SectoredL2Parameters parameters(*level);
    SectoredL2 cache(parameters, context);
    Recorder below;
    cache.set_below(below);
    const auto access = [&](tlm::tlm_command command, std::uint16_t round) {
      cache.access({4096, 64, command, {MemoryTraffic::attribute, 0, round}});
      return cache.statistics().sector_misses.value();
    };
    EXPECT_EQ(access(tlm::TLM_READ_COMMAND, 0), 2U);
    EXPECT_EQ(access(tlm::TLM_READ_COMMAND, 0), 2U);
    EXPECT_EQ(access(tlm::TLM_READ_COMMAND, 1), is_l1 ? 4U : 2U);
    EXPECT_EQ(access(tlm::TLM_READ_COMMAND, 1), is_l1 ? 4U : 2U);
    access(tlm::TLM_WRITE_COMMAND, 2);
    ASSERT_EQ(below.requests.size(), is_l1 ? 3U : 1U);
    for (const MemoryRequest& request : below.requests) EXPECT_EQ(request.address, 4096U);
    EXPECT_EQ(below.requests.back().origin.round, is_l1 ? 2 : 0);
  }
}

TEST(SectoredL2, RefusesBanksThatCannotBe) {
  const auto refusal = [](const Settings& settings) {
    try {
      L2 made(settings);
    } catch (const UserError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(
      refusal({{"banks", "12"}}),
      "unusable L2 (l2.banks, l2.bytes): 2048 sets cannot be dealt out evenly to 12 banks; use a multiple of 24576 "
      "bytes (banks x ways x line), or other banks or ways");
  EXPECT_NE(refusal({{"bytes", "64K"}, {"banks", "64"}}).find("32 sets cannot be dealt out evenly to 64 banks"),
            std::string::npos);
  EXPECT_NE(refusal({{"ways", "5"}}).find("unusable L2 (l2.ways, l2.bytes)"), std::string::npos);
  EXPECT_EQ(refusal({}), "accepted");
}

}  // namespace
}  // namespace vrpipe
