#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::tools {

/// `runs[].intervals`.
nlohmann::ordered_json intervals_json(const IntervalReport& intervals);

/// A row for each interval of each run, a column for each statistic and each state of a unit; the first is the run's name
/// where there are several. All runs have intervals. A cell is empty where there is no value, or a run has no such column.
std::string intervals_csv(const std::vector<RunResult>& runs);

}  // namespace vrpipe::tools
