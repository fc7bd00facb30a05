#include <vrpipe/platforms/validated_range.h>

#include <cstdint>

#include "bound/bound.h"

#include <fmt/format.h>

#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/netlist.h>

namespace vrpipe {

namespace {

// Parameters of links, each tried alone on agx-orin-ideal-memory, baseline and het+qm: errors of 1.1 % at most inside, of up to 40 % outside.
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
    const std::string::size_type dot = name.find('.');
    const std::string slot = name.substr(0, dot);
    if (!Registry::instance().has_slot(slot)) continue;
    for (const ValidatedRange& range : Registry::instance().slot(slot).validated) {
      if (name.compare(dot + 1, std::string::npos, range.parameter) != 0) continue;
      const std::uint64_t number = std::stoull(value);
      if (number >= range.least && number <= range.most) continue;
      const bool is_below = number < range.least;
      reasons.push_back(fmt::format("{}={} is {} {}, the {} that was validated", name, value,
                                    is_below ? "below" : "above", is_below ? range.least : range.most,
                                    is_below ? "least" : "most"));
    }
  }
  return reasons;
}

std::vector<std::string> outside_validated_range(const Netlist& netlist) {
  std::vector<std::string> reasons;
  for (const Instance& instance : netlist.instances()) {
    const bool is_known = Netlist::is_memory(instance) || Pipeline::place_of(instance.slot) != Pipeline::places;
    if (!is_known && Registry::instance().slot(instance.slot).validated.empty()) {
      reasons.push_back(instance.path + " is in slot " + instance.slot + ", which was not validated");
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
