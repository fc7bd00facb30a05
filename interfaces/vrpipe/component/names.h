#pragma once

#include <string>

namespace vrpipe {

/// Whether a name of a platform, variant, unit, slot or effect can be typed, listed and part of a file's name.
bool is_good_name(const std::string& name);
/// The rule, for messages: "it is not ..."
inline constexpr const char* good_name_rule = "1 to 64 letters, digits, + - _ or ., the first no - or .";

}  // namespace vrpipe
