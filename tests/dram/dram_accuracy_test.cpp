// How near annotated time, of `lt`, comes to that of `cycle`.

#include <algorithm>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

#include "dram_bench.h"

namespace vrpipe {
namespace {

using namespace testing;

struct Pattern {
  const char* name;
  std::function<Access(std::uint64_t)> access;
  double tolerance;  ///< of the cycles that all of it takes
};

std::uint64_t random_sector(std::uint64_t i) { return mix(i) % (1U << 21U) * 32; }

std::vector<Pattern> patterns() {
  return {
      {"Stream", [](std::uint64_t i) { return read(0, i * 32); }, 0.03},
      {"WrittenStream", [](std::uint64_t i) { return write(0, i * 32); }, 0.03},
      {"Lines", [](std::uint64_t i) { return read(0, i * 128, 128); }, 0.03},
      {"Random", [](std::uint64_t i) { return read(0, random_sector(i)); }, 0.05},
      {"RandomLines", [](std::uint64_t i) { return read(0, random_sector(i) / 128 * 128, 128); }, 0.06},
      {"RandomWrites", [](std::uint64_t i) { return write(0, random_sector(i)); }, 0.08},
      {"StreamsReadAndWritten",
       [](std::uint64_t i) {
         const std::uint64_t address = i / 2 * 32 + i % 2 * (16U << 20U);
         return i % 2 == 0 ? read(0, address) : write(0, address);
       },
       0.13},
      {"FourStreamsAQuarterWritten",
       [](std::uint64_t i) {
         const std::uint64_t address = i / 4 * 32 + i % 4 * (5U << 20U) + i % 4 * 4352;
         return i % 4 < 3 ? read(0, address) : write(0, address);
       },
       0.06},
      {"RandomAThirdWritten",
       [](std::uint64_t i) { return mix(i + 77) % 3 > 0 ? read(0, random_sector(i)) : write(0, random_sector(i)); },
       0.16},
      {"TilesReadAndWrittenBack",
       [](std::uint64_t i) {  // tiles of 2 KB, here and there, read and written back a while later
         const std::uint64_t step = i / 128 >= 8 && i % 2 == 1 ? i / 2 - 64 * 8 : i / 2;
         const std::uint64_t address = mix(step / 64) % 8192 * 2048 + step % 64 * 32;
         return i % 2 == 0 ? read(0, address) : write(0, address);
       },
       0.16},
  };
}

class DramAccuracy : public ::testing::TestWithParam<std::tuple<const char*, unsigned>> {};

TEST_P(DramAccuracy, OfThroughput) {
  const auto& [implementation, in_flight] = GetParam();
  const std::uint64_t accesses = in_flight > 100 ? 32000 : in_flight > 1 ? 12000 : 2000;
  for (const Pattern& pattern : patterns()) {
    std::vector<Access> all;
    for (std::uint64_t i = 0; i < accesses; ++i) all.push_back(pattern.access(i));
    DramBench bench(implementation);
    const auto last = [](const std::vector<Cycle>& answered) {
      return static_cast<double>(*std::max_element(answered.begin(), answered.end()));
    };
    const double cycles = last(bench.answered(all, in_flight));
    const double annotated = last(bench.annotated_answers(all, in_flight));
    EXPECT_NEAR(annotated / cycles, 1.0, pattern.tolerance) << pattern.name;
    // Without time: never more.
    for (const Access& access : all) bench.behaviour->access(access.request);
    const double bound = bench.behaviour->least_occupancy(1000).front().cycles;
    EXPECT_LE(bound, cycles) << pattern.name;
    if (in_flight > 100 && pattern.tolerance < 0.04) {
      EXPECT_GE(bound, 0.9 * cycles) << pattern.name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, DramAccuracy,
                         ::testing::Combine(::testing::Values("lpddr3-1600", "lpddr5-6400"),
                                            ::testing::Values(1U, 32U, 512U)),
                         [](const auto& of) {
                           return std::string(std::get<0>(of.param)).substr(0, 6) + "With" +
                                  std::to_string(std::get<1>(of.param)) + "InFlight";
                         });

}  // namespace
}  // namespace vrpipe
