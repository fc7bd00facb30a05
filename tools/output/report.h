#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/terminal.h"
#include "jobs/simulation_job.h"

namespace vrpipe::tools {

/// What a person reads: the runs side by side, and under the table what they mean.
std::string report(const JobResult& result, const TextStyle& style);

/// What to say of a draw of which no fragment was rasterised; one line.
std::string nothing_visible(const SceneSummary& scene, bool has_camera);

/// What a reader of any kind of report is to know of the numbers, the gravest first: a line each.
std::vector<std::string> notes_of(const JobResult& result);

/// A unit that is occupied for this share of a run bounds it.
constexpr double bounding_occupancy = 0.9;

/// What bounds a run: the unit that is occupied the most, and what with; a line, empty where nothing has time.
std::string bound_text(const RunResult& run);

/// Whether nothing of the scene is in a run's image. What is drawn outside the pipeline may not count fragments.
bool draws_nothing(const RunResult& run, const SceneSummary& scene);
/// Which runs are less exact than others, since there is nothing more exact of them; a line each.
std::string fidelities_text(const std::vector<RunResult>& runs);

/// Share of the peak of units of a slot; none in a run without them, or without time.
std::optional<double> utilization_of(const RunResult& run, const std::string& slot);
/// Slots of which any run has it.
std::vector<std::string> utilized(const std::vector<RunResult>& runs);

/// Digits in groups of three: 12,345,678.
std::string grouped(std::uint64_t value);

}  // namespace vrpipe::tools
