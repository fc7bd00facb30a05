#pragma once

#include <cstddef>
#include <string_view>

namespace vrpipe::tools {

/// toml++ limits how deep values are nested, but not keys, and goes down them by recursion.
constexpr std::size_t most_parts_of_a_key = 64;

/// The line, from 1, of a dotted key or a table's name of more parts; 0 if there is none.
std::size_t line_of_too_deep_a_key(std::string_view text);

}  // namespace vrpipe::tools
