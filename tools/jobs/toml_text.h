#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include <toml++/toml.h>

namespace vrpipe::tools {

/// toml++ limits how deep values are nested, but not keys, and goes down them by recursion.
constexpr std::size_t most_parts_of_a_key = 64;

/// The line, from 1, of a dotted key or a table's name of more parts; 0 if there is none.
std::size_t line_of_too_deep_a_key(std::string_view text);

/// Reads TOML. `refuse` throws for what is none, told where and why.
toml::table parse_toml(const std::string& text, const std::string& name,
                       const std::function<void(const toml::source_region& where, const std::string& why)>& refuse);

}  // namespace vrpipe::tools
