#include <vrpipe/platforms/validated_range.h>

#include "bound/bound.h"

#include <fmt/format.h>

#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/netlist.h>

namespace vrpipe {

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
  for (const ForeignInstance& memory : netlist.foreign_memories()) {
    reasons.push_back("memory " + memory.path +
                      " is of another make, and asked by b_transport, whose times may be a guess of its own");
  }
  return reasons;
}

}  // namespace vrpipe
