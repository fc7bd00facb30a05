#pragma once

#include "output/reproduce_tables.h"
#include "output/result_json.h"

namespace vrpipe::tools {

/// Schema vrpipe.reproduce/1. Nothing in it depends on the host or on how often the run was interrupted.
Json reproduction_json(const Reproduction& of);

}  // namespace vrpipe::tools
