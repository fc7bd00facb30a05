#pragma once

#include <string>

#include <vrpipe/render_state.h>

namespace vrpipe::tools {

const char* name_of(Termination termination);
/// Throws UserError naming those that exist.
Termination termination_named(const std::string& name);

}  // namespace vrpipe::tools
