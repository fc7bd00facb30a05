#include <vrpipe/platforms/validated_range.h>

#include <cstdint>

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

std::vector<std::string> memories_outside_validated_range(const Netlist& netlist) {
  std::vector<std::string> reasons;
  for (const ForeignInstance& memory : netlist.foreign_memories()) {
    reasons.push_back("memory " + memory.path +
                      " is of another make, and asked by b_transport, whose times may be a guess of its own");
  }
  return reasons;
}

}  // namespace vrpipe
