#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <string>
#include <vector>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/simulation.h>

// What random configurations are drawn with.

namespace vrpipe::testing {

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() { return mix(state_++); }
  std::uint32_t below(std::uint64_t count) { return static_cast<std::uint32_t>(next() % count); }
  bool chance(unsigned percent) { return below(100) < percent; }
  /// In [low, high).
  double real(double low, double high) { return low + (high - low) * static_cast<double>(next() >> 11U) * 0x1p-53; }
  float real(float low, float high) {
    return static_cast<float>(real(static_cast<double>(low), static_cast<double>(high)));
  }
  template <class Items>
  const auto& one_of(const Items& items) {
    return *(std::begin(items) + below(std::size(items)));
  }

 private:
  std::uint64_t state_;
};

/// The bounds of `a whole number from 1 to 16`.
inline bool bounds_of(const Parameter& parameter, double& low, double& high) {
  const std::string range = parameter.range();
  const std::size_t from = range.find(" from ");
  return from != std::string::npos && std::sscanf(range.c_str() + from, " from %lf to %lf", &low, &high) == 2;
}

/// Those of `one of exact, fp16`.
inline std::vector<std::string> names_of(const Parameter& parameter) {
  std::vector<std::string> names;
  std::string rest = parameter.range().substr(std::strlen("one of "));
  for (std::size_t comma; (comma = rest.find(", ")) != std::string::npos; rest = rest.substr(comma + 2)) {
    names.push_back(rest.substr(0, comma));
  }
  names.push_back(rest);
  return names;
}

/// Whether the platform, wired as a netlist, has a unit of the listing's slot and kind; of what is in no slot it has all.
inline bool has_unit(const Netlist& netlist, const ParameterListing& listing) {
  if (!Registry::instance().has_slot(listing.unit)) return true;
  const Slot& slot = Registry::instance().slot(listing.unit);
  return std::any_of(netlist.instances().begin(), netlist.instances().end(), [&](const Instance& instance) {
    if (instance.slot != listing.unit) return false;
    return listing.implementation == (instance.implementation.empty() ? slot.implementation : instance.implementation);
  });
}

/// What a draw shows in a window of its image.
inline Draw window_of(const Draw& draw, std::uint32_t left, std::uint32_t top, std::uint32_t width,
                      std::uint32_t height) {
  Draw window;
  window.width = width;
  window.height = height;
  for (Splat splat : draw.splats) {
    splat.cx -= static_cast<float>(left);
    splat.cy -= static_cast<float>(top);
    const float reach_x = std::fabs(splat.ax) + std::fabs(splat.bx);
    const float reach_y = std::fabs(splat.ay) + std::fabs(splat.by);
    if (splat.cx + reach_x < 0 || splat.cx - reach_x > static_cast<float>(width)) continue;
    if (splat.cy + reach_y < 0 || splat.cy - reach_y > static_cast<float>(height)) continue;
    window.splats.push_back(splat);
  }
  return window;
}

}  // namespace vrpipe::testing
