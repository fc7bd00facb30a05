#pragma once

#include <string>

#include "host/terminal.h"
#include "jobs/result_diff.h"
#include "output/result_json.h"

namespace vrpipe::tools {

/// What differs, for a person, on one screen: what was asked for otherwise, cycles, and the statistics that changed most; or
/// `all` differences.
std::string diff_text(const ResultDiff& diff, bool all, const TextStyle& style);

/// Schema vrpipe.diff/1.
Json diff_json(const ResultDiff& diff);

}  // namespace vrpipe::tools
