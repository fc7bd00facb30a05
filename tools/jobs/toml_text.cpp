#include "jobs/toml_text.h"

#include <algorithm>
#include <string>

#include <fmt/format.h>

namespace vrpipe::tools {

namespace {

/// Where a string that begins at a quotation mark ends: behind its last one.
std::size_t end_of_string(std::string_view text, std::size_t from) {
  const std::string_view mark = text.substr(from, 1);
  const bool has_lines = text.substr(from, 3) == std::string(3, mark.front());
  const std::string_view end = has_lines ? text.substr(from, 3) : mark;
  for (std::size_t i = from + end.size(); i < text.size(); ++i) {
    if (text[i] == '\\' && mark == "\"") {
      ++i;
    } else if (text.substr(i, end.size()) == end) {
      return i + end.size();
    } else if (text[i] == '\n' && !has_lines) {
      return i;  // it has none, and the parser says so
    }
  }
  return text.size();
}

}  // namespace

std::size_t line_of_too_deep_a_key(std::string_view text) {
  std::size_t parts = 1;
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    if (c == '"' || c == '\'') {
      i = end_of_string(text, i);
      continue;
    }
    if (c == '#') {
      i = std::min(text.find('\n', i), text.size());
      continue;
    }
    if (c == '.' && ++parts > most_parts_of_a_key) {
      return 1 +
             static_cast<std::size_t>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(i), '\n'));
    }
    if (std::string_view("\n=,[]{}").find(c) != std::string_view::npos) parts = 1;
    ++i;
  }
  return 0;
}

toml::table parse_toml(const std::string& text, const std::string& name,
                       const std::function<void(const toml::source_region& where, const std::string& why)>& refuse) {
  if (const std::size_t line = line_of_too_deep_a_key(text); line != 0) {
    toml::source_region where;
    where.begin.line = static_cast<toml::source_index>(line);
    refuse(where, fmt::format("a key has more than {} parts", most_parts_of_a_key));
  }
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    refuse(error.source(), std::string(error.description()));
    throw;
  }
}

}  // namespace vrpipe::tools
