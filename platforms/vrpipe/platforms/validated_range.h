#pragma once

#include <string>
#include <utility>
#include <vector>

namespace vrpipe {

class Netlist;

/// How far from the defaults lt were tried on the stress configurations (stress.h): where final parameters
/// (UNIT.PARAMETER and value) lie outside, a reason each, e.g. "sm.cores=1 is below 4, the least that was validated".
std::vector<std::string> outside_validated_range(const std::vector<std::pair<std::string, std::string>>& parameters);
/// The same of memories of another make, of which lt knows b_transport alone: a reason each.
std::vector<std::string> memories_outside_validated_range(const Netlist& netlist);

}  // namespace vrpipe
