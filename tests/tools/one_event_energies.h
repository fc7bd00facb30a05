#pragma once

#include <string>

namespace vrpipe::testing {

/// A table of energies that has one event, in a process of its own, which nothing is scaled to.
/// @param count  as TOML has it, of what
/// @param picojoules  { low, nominal, high }
inline std::string one_event_energies(const std::string& unit, const std::string& count,
                                      const std::string& picojoules) {
  return R"(
schema = "vrpipe.energies/1"
process = "mine"
[[node]]
name = "mine"
factor = { low = 1, nominal = 1, high = 1 }
voltage_ratio = 1
source = "s"
[[event]]
name = "event"
unit = ")" +
         unit + R"("
count = )" +
         count + R"(
node = "mine"
pj = )" + picojoules +
         R"(
source = "s"
meaning = "m"
)";
}

}  // namespace vrpipe::testing
