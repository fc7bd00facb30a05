#pragma once

#include <string>

#include "host/terminal.h"
#include "jobs/result_diff.h"
#include "output/result_json.h"

namespace vrpipe::tools {

/// What differs, for a person. Of statistics those that changed most, unless `all` are asked for.
std::string diff_text(const ResultDiff& diff, bool all, const TextStyle& style);

/// Schema vrpipe.diff/1.
Json diff_json(const ResultDiff& diff);

}  // namespace vrpipe::tools
