#pragma once

#include <string>
#include <utility>
#include <vector>

namespace vrpipe {

class Netlist;

/// How far from the defaults lt was tried on the stress configurations (stress.h): where final parameters
/// (UNIT.PARAMETER and value) lie outside, a reason each, e.g. "sm.cores=1 is below 4, the least that was validated".
std::vector<std::string> outside_validated_range(const std::vector<std::pair<std::string, std::string>>& parameters);
/// The same of what a platform is made of: links, slots of plugins, and memories of another make, of which lt knows b_transport
/// alone.
std::vector<std::string> outside_validated_range(const Netlist& netlist);

}  // namespace vrpipe
