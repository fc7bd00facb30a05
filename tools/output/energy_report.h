#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/terminal.h"
#include "jobs/energy.h"
#include "output/result_json.h"

namespace vrpipe::tools {

/// Three digits or so, so that what is small is seen beside what is large.
std::string three_digits(double value);
/// "LOW to HIGH".
std::string between(const Range& range);
/// With low, nominal and high; null where there is none.
Json range_json(const Range& range);
Json range_json(const std::optional<Range>& range);

/// What the runs spend, side by side; of several, over the first as well. Lines of at most 100 characters.
/// @param baseline  of `runs`, over which efficiencies are
std::string energy_text(const std::vector<RunResult>& runs, std::size_t baseline, const EnergyTable& table,
                        const TextStyle& style);

/// `energy` of a run.
/// @param baseline  what its ratio is over; null for none
Json energy_json(const RunResult& run, const RunResult* baseline, const EnergyTable& table);

}  // namespace vrpipe::tools
