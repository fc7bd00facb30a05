// Host time of an access to the DRAM: of its channels alone at `cycle`, without ports, and with annotated time.
#include <benchmark/benchmark.h>

#include <vrpipe/arithmetic/random.h>

#include "dram/annotated_channel.h"
#include "dram/dram_channel.h"

namespace vrpipe {

namespace {

struct Owner : StatisticSet {};

enum class Pattern { stream, random };

std::uint64_t address_of(Pattern pattern, std::uint64_t access) {
  return pattern == Pattern::stream ? access * 32 : mix(access) % (1U << 24U) * 32;
}

/// One access in so many is a write.
constexpr std::uint64_t reads_per_write = 4;

void report(benchmark::State& state, std::uint64_t accesses) {
  state.counters["per_access"] =
      benchmark::Counter(static_cast<double>(accesses), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

/// As many accesses as the queues of all channels take, until all are read.
void clocked(benchmark::State& state, const DramDevice& device, Pattern pattern) {
  const DramParameters parameters(device);
  const DramAddressMap map(parameters);
  Owner owner;
  DramStatistics statistics(owner, "channels");
  std::vector<DramChannel> channels(parameters.channels, DramChannel(timing_of(parameters), statistics));
  std::uint64_t access = 0;
  Cycle now = 0;
  for (auto _ : state) {
    const DramAddress place = map.place_of(address_of(pattern, access));
    const bool writes = access % reads_per_write == 0;
    DramChannel& channel = channels[place.channel];
    channel.advance(now);
    while (!(writes ? channel.can_write() : channel.can_read())) {
      now = channel.next_command() + 1;
      channel.advance(now);
    }
    if (writes) {
      channel.write(place, now);
    } else {
      channel.read(place, static_cast<std::uint32_t>(access), now);
    }
    for (; !channel.completions().empty(); channel.completions().pop())
      benchmark::DoNotOptimize(channel.completions().front());
    ++access;
  }
  report(state, access);
}

/// Eight accesses a cycle that run ahead of the clock.
void annotated(benchmark::State& state, const DramDevice& device, Pattern pattern) {
  const DramParameters parameters(device);
  const DramAddressMap map(parameters);
  Owner owner;
  DramStatistics statistics(owner, "channels");
  std::vector<AnnotatedChannel> channels(parameters.channels, AnnotatedChannel(timing_of(parameters), statistics));
  std::uint64_t access = 0;
  Cycle now = 0;
  for (auto _ : state) {
    const DramAddress place = map.place_of(address_of(pattern, access));
    AnnotatedChannel& channel = channels[place.channel];
    const Cycle present = now;
    if (access % reads_per_write == 0) {
      benchmark::DoNotOptimize(channel.write(place, now, present));
    } else {
      benchmark::DoNotOptimize(channel.read(place, now, present));
    }
    // At the rate of the data buses, or of random rows.
    const std::uint64_t apart = pattern == Pattern::stream ? 4 : 10;
    if (++access % channels.size() == 0) now += apart;
  }
  report(state, access);
}

BENCHMARK_CAPTURE(clocked, lpddr3_stream, lpddr3_1600, Pattern::stream);
BENCHMARK_CAPTURE(clocked, lpddr3_random, lpddr3_1600, Pattern::random);
BENCHMARK_CAPTURE(clocked, lpddr5_stream, lpddr5_6400, Pattern::stream);
BENCHMARK_CAPTURE(clocked, lpddr5_random, lpddr5_6400, Pattern::random);
BENCHMARK_CAPTURE(annotated, lpddr3_stream, lpddr3_1600, Pattern::stream);
BENCHMARK_CAPTURE(annotated, lpddr3_random, lpddr3_1600, Pattern::random);

}  // namespace

}  // namespace vrpipe

BENCHMARK_MAIN();
