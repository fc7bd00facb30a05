#include "output/json_text.h"

#include <algorithm>
#include <cstddef>

#include <nlohmann/json.hpp>

#include <vrpipe/component/printable.h>

namespace vrpipe::tools {
namespace {

nlohmann::ordered_json with_valid_texts(const nlohmann::ordered_json& json) {
  if (json.is_string()) return valid_utf8(json.get_ref<const std::string&>());
  if (!json.is_structured()) return json;
  nlohmann::ordered_json copy(json.type());
  for (const auto& [key, value] : json.items()) {
    if (json.is_array()) {
      copy.push_back(with_valid_texts(value));
    } else {
      copy[valid_utf8(key)] = with_valid_texts(value);
    }
  }
  return copy;
}

/// Numbers of a row, such as those of intervals, belong on one line from so many on.
constexpr std::size_t long_row = 16;

bool is_long_row(const nlohmann::ordered_json& json) {
  const auto is_number = [](const nlohmann::ordered_json& value) { return value.is_number() || value.is_null(); };
  return json.is_array() && json.size() >= long_row && std::all_of(json.begin(), json.end(), is_number);
}

/// As dump(2), but for long rows.
void put_text(const nlohmann::ordered_json& json, const std::string& indent, std::string& text) {
  if (!json.is_structured() || json.empty() || is_long_row(json)) {
    text += json.dump();
    return;
  }
  const std::string inner = indent + "  ";
  text += json.is_array() ? "[" : "{";
  bool is_first = true;
  for (const auto& [key, value] : json.items()) {
    text += is_first ? "\n" : ",\n";
    is_first = false;
    text += inner;
    if (json.is_object()) text += nlohmann::ordered_json(key).dump() + ": ";
    put_text(value, inner, text);
  }
  text += "\n" + indent + (json.is_array() ? "]" : "}");
}

}  // namespace

std::string json_text(const nlohmann::ordered_json& json) {
  std::string text;
  put_text(with_valid_texts(json), "", text);
  return text + "\n";
}

}  // namespace vrpipe::tools
