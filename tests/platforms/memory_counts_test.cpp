// Memories with as many banks and channels as real GPUs have, which are not powers of two, below a whole pipeline.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/mixed_frames.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::run;
using testing::same_image;
using testing::statistic;

/// An L2 that holds a part of what is asked for, over a DRAM that has too little bandwidth.
struct Memory {
  unsigned banks, channels, sets_of_a_bank;
  std::string text() const { return std::to_string(banks) + " banks, " + std::to_string(channels) + " channels"; }
};

RunRequest request_for(const Memory& memory, const char* variant, Fidelity fidelity, const char* hash = "off") {
  RunRequest request = testing::request_of(variant, fidelity);
  request.platform = &platform_named("agx-orin");
  request.effects = EffectChoice::everything();
  request.settings = {{"l2", "banks", std::to_string(memory.banks)},
                      {"l2", "bytes", std::to_string(memory.banks * memory.sets_of_a_bank * 16 * 128)},
                      {"l2", "hash_sets", hash},
                      {"dram", "channels", std::to_string(memory.channels)},
                      {"dram", "channel_bits", "8"},
                      {"crop", "cache_bytes", "2048"},
                      {"sm", "attribute_buffer_bytes", "65536"}};
  return request;
}

std::uint64_t of_all_traffic(const RunResult& result, const std::string& unit, const std::string& what) {
  std::uint64_t sum = 0;
  for (const char* traffic : {"other_", "color_", "depth_stencil_", "vertex_", "attribute_"}) {
    sum += statistic(result, unit + "." + traffic + what);
  }
  return sum;
}

TEST(MemoryCounts, OfAnyNumberLoseNoByteAndNoCycle) {
  const Draw draw = testing::random_draw(256, 192, 900, 31);
  for (const char* variant : {"baseline", "het+qm"}) {
    const auto expected = run(testing::request_of(variant, Fidelity::functional), draw);
    // How far `lt` is from `cycle`, and what `cycle` takes.
    const auto measured = [&](const Memory& memory, const char* hash = "off") {
      const std::string what = memory.text() + " " + variant;
      double cycle = 0;
      double off = 0;
      for (const Fidelity fidelity : {Fidelity::cycle, Fidelity::lt, Fidelity::bound}) {
        const RunResult result = run(request_for(memory, variant, fidelity, hash), draw);
        EXPECT_TRUE(same_image(result.framebuffer.color, expected.framebuffer.color)) << what;
        const auto cycles = static_cast<double>(*result.cycles);
        if (fidelity == Fidelity::cycle) cycle = cycles;
        if (fidelity == Fidelity::lt) off = std::abs(cycles / cycle - 1);
        if (fidelity == Fidelity::bound) {
          EXPECT_LE(cycles, cycle) << what;
          continue;
        }
        EXPECT_EQ(statistic(result, "crop.cache.bytes_filled"), statistic(result, "l2.color_bytes_read")) << what;
        EXPECT_EQ(statistic(result, "crop.cache.bytes_written_back"), statistic(result, "l2.color_bytes_written"))
            << what;
        EXPECT_EQ(statistic(result, "l2.cache.bytes_filled"), of_all_traffic(result, "dram", "bytes_read")) << what;
        EXPECT_EQ(statistic(result, "l2.cache.bytes_written_back"), of_all_traffic(result, "dram", "bytes_written"))
            << what;
        EXPECT_GT(statistic(result, "dram.color_bytes_written"), 100'000U) << what;
        EXPECT_EQ(statistic(result, "l2.cache.most_lines_held"), memory.banks * memory.sets_of_a_bank * 16) << what;
      }
      return std::make_pair(cycle, off);
    };
    const auto [cycles_of_fewer, off_of_fewer] = measured({8, 8, 4});
    const auto [cycles_of_more, off_of_more] = measured({16, 16, 2});
    for (const Memory& memory : {Memory{10, 12, 3}, Memory{10, 10, 3}, Memory{12, 12, 3}}) {
      const auto [cycles, off] = measured(memory);
      EXPECT_LT(cycles, cycles_of_fewer * 1.02) << memory.text();
      EXPECT_GT(cycles, cycles_of_more * 0.98) << memory.text();
      EXPECT_LT(off, std::max(off_of_fewer, off_of_more) + 0.03) << memory.text();
    }
    measured({10, 12, 3}, "on");
  }
}

TEST(MemoryCounts, OfRealGpusDrawAFrame) {
  struct Real {
    const char *bytes, *banks, *channels;
  };
  const Draw draw = testing::random_draw(128, 96, 300, 32);
  for (const Real& real :
       {Real{"6M", "12", "12"}, Real{"5M", "10", "10"}, Real{"40M", "40", "40"}, Real{"3M", "6", "6"},
        Real{"2560K", "5", "5"}, Real{"5632K", "11", "11"}, Real{"6M", "48", "12"}}) {
    for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
      RunRequest request = testing::request_of("baseline", fidelity);
      request.platform = &platform_named("agx-orin");
      request.settings = {{"l2", "bytes", real.bytes},
                          {"l2", "banks", real.banks},
                          {"dram", "channels", real.channels}};
      const RunResult result = run(request, draw);
      EXPECT_EQ(statistic(result, "l2.cache.sector_misses"), statistic(result, "l2.cache.sector_misses_compulsory"))
          << real.bytes;
    }
  }
}

// An L2 and a DRAM of ours work in the cycles of the units' clock.
TEST(MemoryCounts, OfThePlatformNeedNoEventOfTheKernelForEachCycle) {
  RunRequest request = testing::request_of("baseline", Fidelity::cycle);
  request.platform = &platform_named("agx-orin");
  const RunResult result = run(request, testing::random_draw(64, 64, 200, 3));
  EXPECT_LT(result.kernel_events, *result.cycles / 10);
}

// What is written back at the frame's end is under way for longer than the frame.
TEST(MemoryCounts, AChannelThatIsFullIsOccupiedForNoMoreThanTheFrame) {
  for (const unsigned banks : {8U, 10U}) {
    for (const Fidelity fidelity : {Fidelity::cycle, Fidelity::lt}) {
      RunRequest request = request_for({banks, 1, 1}, "qm", fidelity);
      request.settings = {{"l2", "banks", std::to_string(banks)},
                          {"l2", "bytes", std::to_string(banks * 16 * 128)},
                          {"dram", "channels", "1"}};
      for (const std::uint64_t seed : {775535U, 1U, 2U, 3U}) {
        const RunResult result = run(request, testing::mixed_frame(seed, request));
        for (const auto& [slot, share] : result.utilization) EXPECT_LE(share, 1) << slot;
      }
    }
  }
}

}  // namespace
}  // namespace vrpipe
