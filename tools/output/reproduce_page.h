#pragma once

#include <string>

#include "output/reproduce_tables.h"

namespace vrpipe::tools {

/// A page of HTML that stands alone: every row, tables, plots and heat maps. Nothing in it is loaded from elsewhere.
std::string reproduction_page(const Reproduction& of);

}  // namespace vrpipe::tools
