#pragma once

#include <string>

#include "host/terminal.h"
#include "output/reproduce_tables.h"

namespace vrpipe::tools {

/// For the terminal, 80 columns where cells allow it.
std::string reproduction_text(const Reproduction& of, const TextStyle& style);

}  // namespace vrpipe::tools
