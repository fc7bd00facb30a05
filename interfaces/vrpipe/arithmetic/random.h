#pragma once

#include <cstdint>

namespace vrpipe {

/// SplitMix64: a full-period mixing function; the only source of randomness in the simulator.
constexpr std::uint64_t mix(std::uint64_t value) {
  value += 0x9e3779b97f4a7c15ULL;
  value = (value ^ (value >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  value = (value ^ (value >> 27U)) * 0x94d049bb133111ebULL;
  return value ^ (value >> 31U);
}

/// Whether a seeded random stall holds in a cycle; a pure function, so that who asks, and how often, does not matter.
constexpr bool stall_at(std::uint64_t seed, std::uint64_t cycle, unsigned per_256) {
  return (mix(seed ^ mix(cycle)) & 0xffU) < per_256;
}

}  // namespace vrpipe
