#pragma once

#include <optional>

#include <vrpipe/platforms/gpu.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

/// The least that a run at lt says of itself, in percent of its cycles.
double least_expected_error_percent();

/// What a run at lt that has ended says of itself, in percent of its cycles; none where it is outside what was validated.
std::optional<double> expected_error_percent(const Gpu& gpu, const RunResult& result);

}  // namespace vrpipe
