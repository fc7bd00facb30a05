#include <vrpipe/platforms/validated_range.h>

#include <cstdint>

#include "bound/bound.h"

#include <vrpipe/platforms/netlist.h>

namespace vrpipe {

namespace {

struct Range {
  const char* parameter;
  std::uint64_t least, most;
};

// Parameters that decide how much can be under way, and for how long: there a warp or a bin that moves in one piece, or
// vertex warps that do not wait for fragment warps, may tell. Rates of units do not matter to that.
constexpr Range ranges[] = {{"tc.bins", 2, 65536},
                            {"tc.bin_quads", 8, 4096},
                            {"zrop.latency_cycles", 1, 200},
                            {"sm.cores", 4, 1024},
                            {"sm.warps_per_core", 2, 256},
                            {"sm.warps_to_one_core", 4, 256},
                            {"sm.attribute_latency_cycles", 0, 1000},
                            {"sm.fragment_latency_cycles", 0, 1000},
                            {"sm.merge_latency_cycles", 0, 1000},
                            {"crop.latency_cycles", 1, 200},
                            {"crop.cache_bytes", 1024, 1 << 24},
                            {"l2.latency_cycles", 1, 1000}};

// Parameters of links, each tried alone on agx-orin, baseline and het+qm: errors of 1.1 % at most inside, of up to 40 % outside.
constexpr std::uint64_t most_depth = 1024;
constexpr std::uint64_t most_latency = 16;
constexpr std::uint64_t most_latency_of_color = 4;

void check_link(const Link& link, std::vector<std::string>& reasons) {
  const std::string color = ".out_color";
  const bool is_color =
      link.from.size() > color.size() && link.from.compare(link.from.size() - color.size(), color.size(), color) == 0;
  const std::uint64_t latency = is_color ? most_latency_of_color : most_latency;
  const auto above = [&](const char* parameter, std::uint64_t value, std::uint64_t most) {
    if (value <= most) return;
    reasons.push_back("link." + link.name() + "." + parameter + "=" + std::to_string(value) + " is above " +
                      std::to_string(most) + ", the most that was validated");
  };
  above("depth", link.parameters->depth, most_depth);
  above("latency_cycles", link.parameters->latency_cycles, latency);
  // A warp passes in one piece, at cycle by parts that leave room between them to others.
  if (is_color) above("items_per_cycle", link.parameters->items_per_cycle, 0);
}

}  // namespace

std::vector<std::string> outside_validated_range(const std::vector<std::pair<std::string, std::string>>& parameters) {
  std::vector<std::string> reasons;
  for (const auto& [name, value] : parameters) {
    for (const Range& range : ranges) {
      if (name != range.parameter) continue;
      const std::uint64_t number = std::stoull(value);
      if (number < range.least) {
        reasons.push_back(name + "=" + value + " is below " + std::to_string(range.least) +
                          ", the least that was validated");
      } else if (number > range.most) {
        reasons.push_back(name + "=" + value + " is above " + std::to_string(range.most) +
                          ", the most that was validated");
      }
    }
  }
  return reasons;
}

std::vector<std::string> outside_validated_range(const Netlist& netlist) {
  std::vector<std::string> reasons;
  for (const Instance& instance : netlist.instances()) {
    if (!Netlist::is_memory(instance) && !PhaseBound::knows(instance.slot)) {
      reasons.push_back(instance.path + " is in slot " + instance.slot + " of a plugin, which was not validated");
    }
  }
  for (const Link& link : netlist.links()) check_link(link, reasons);
  for (const ForeignInstance& memory : netlist.foreign_memories()) {
    reasons.push_back("memory " + memory.path +
                      " is of another make, and asked by b_transport, whose times may be a guess of its own");
  }
  return reasons;
}

}  // namespace vrpipe
