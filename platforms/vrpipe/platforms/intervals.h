#pragma once

#include <string>
#include <vector>

#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

/// Adds observers that fill in `RunResult::intervals`: states of all units, and statistics, in each interval of `every`
/// cycles. With time alone: at the other fidelities a run with them is a UserError. States of an interval sum to its
/// length, and all intervals to the run's.
///
///     request.observers = std::make_shared<Observers>();
///     record_intervals(*request.observers, 1000, {"crop.quads_blended"});
///     const IntervalReport intervals = *simulate(request, draw).intervals;
///
/// @param every  at least 1; otherwise a UserError
/// @param names  as Observers::on_statistics takes them
void record_intervals(Observers& observers, Cycle every, std::vector<std::string> names);

}  // namespace vrpipe
