#pragma once

#include <string>

#include "output/reproduce_tables.h"

namespace vrpipe::tools {

/// docs/reproduction.md.
std::string reproduction_markdown(const Reproduction& of);

}  // namespace vrpipe::tools
