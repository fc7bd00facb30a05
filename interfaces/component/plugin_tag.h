#pragma once

#include <string>

namespace vrpipe {

/// What VRPIPE_PLUGIN left in a shared object, read without loading it; empty when there is none. Only the symbol counts:
/// the same words elsewhere in the file are no tag. Throws UserError for a file that cannot be read.
std::string plugin_tag(const std::string& path);

}  // namespace vrpipe
