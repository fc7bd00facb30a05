#pragma once

#include <string>

#include "jobs/simulation_job.h"

namespace vrpipe::tools {

// The parts of the page of runs, in its order: HTML below a heading each. Empty where there is nothing to show.

/// What was run, and what came of it.
std::string heading_section(const JobResult& result);
std::string pictures_section(const JobResult& result);
std::string speedups_section(const JobResult& result);
/// Where quads and fragments went.
std::string funnels_section(const JobResult& result);
/// What units spent cycles on, and their utilization.
std::string cycles_section(const JobResult& result);
/// The same over time.
std::string course_section(const JobResult& result);
std::string heat_section(const JobResult& result);
std::string energy_section(const JobResult& result);
std::string runs_effects_section(const JobResult& result);
/// What went wrong, or is to be kept in mind.
std::string notes_section(const JobResult& result);
std::string parameters_section(const JobResult& result);

}  // namespace vrpipe::tools
