#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "jobs/views_job.h"
#include "output/result_json.h"

namespace vrpipe::tools {

/// Of a distribution over views with these indices; null for none.
Json distribution_json(const std::optional<Distribution>& of, const std::vector<std::size_t>& indices);

/// The result of `compare --views`: schema vrpipe.views/1 (docs/cameras.md).
Json views_json(const ViewsResult& result);

}  // namespace vrpipe::tools
