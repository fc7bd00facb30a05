#include "cli/parse.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

namespace vrpipe::tools {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t start = 0;
  for (std::size_t end = text.find(separator); end != std::string::npos; end = text.find(separator, start)) {
    parts.push_back(text.substr(start, end - start));
    start = end + 1;
  }
  parts.push_back(text.substr(start));
  return parts;
}

template <class Number>
bool read_number(const std::string& text, Number& out) {
  // from_chars refuses a leading plus, which people write.
  const char* begin = text.data();
  const char* const end = text.data() + text.size();
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') ++begin;
  const std::from_chars_result result = std::from_chars(begin, end, out);
  return result.ec == std::errc() && result.ptr == end;
}

Setting parse_setting(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::size_t dot = text.rfind('.', equals);
  if (equals == std::string::npos || dot == std::string::npos || dot == 0 || dot + 1 >= equals ||
      equals + 1 == text.size()) {
    throw UserError("bad value '" + text + "'", "--set", "it is not UNIT.PARAMETER=VALUE",
                    "give e.g. --set tc.bins=64; `vrpipe units` lists all parameters");
  }
  return {text.substr(0, dot), text.substr(dot + 1, equals - dot - 1), text.substr(equals + 1)};
}

UnitChoice parse_unit_choice(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw UserError("bad value '" + text + "'", "--unit", "it is not SLOT=IMPLEMENTATION",
                    "give e.g. --unit qru=pass-through; `vrpipe units` lists all implementations");
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

/// Of KEY=VALUE texts, only different keys may be given more than once.
void refuse_keys_given_twice(const std::vector<std::string>& values, const std::string& option) {
  std::map<std::string, std::string> given;
  for (const std::string& text : values) {
    const std::size_t equals = std::min(text.find('='), text.size());
    const std::string key = text.substr(0, equals);
    const std::string value = text.substr(std::min(equals + 1, text.size()));
    const auto [first, is_new] = given.emplace(key, value);
    if (is_new) continue;
    throw UserError("option given twice", option + " " + key, "as '" + first->second + "' and as '" + value + "'",
                    "give it once");
  }
}

}  // namespace

double parse_number(const std::string& text, const std::string& option) {
  double value = 0;
  if (!read_number(text, value) || !std::isfinite(value)) {
    throw UserError("bad value '" + text + "'", option, "it is not a finite number", "give a number, e.g. 45 or 0.5");
  }
  return value;
}

double parse_percent(const std::string& text, const std::string& option) {
  double value = 0;
  const bool has_sign = !text.empty() && text.back() == '%';
  if (!read_number(text.substr(0, text.size() - (has_sign ? 1 : 0)), value) || !(value > 0 && value <= 100)) {
    throw UserError("bad value '" + text + "'", option, "it is not a percentage above 0 and up to 100",
                    "give one, e.g. " + option + " 1%");
  }
  return value;
}

unsigned parse_count(const std::string& text, const std::string& option, unsigned largest) {
  unsigned value = 0;
  if (!read_number(text, value) || value < 1 || value > largest) {
    const std::string range = fmt::format("a whole number from 1 to {}", largest);
    throw UserError("bad value '" + text + "'", option, "it is not " + range, "give " + range);
  }
  return value;
}

Vec3 parse_triple(const std::string& text, const std::string& option, const std::string& form,
                  const std::string& example) {
  const std::vector<std::string> parts = split(text, ',');
  const std::string remedy = "give " + form + " without spaces, e.g. " + option + " " + example;
  if (parts.size() != 3) {
    throw UserError("bad value '" + text + "'", option,
                    fmt::format("it has {} number{}, not three", parts.size(), parts.size() == 1 ? "" : "s"), remedy);
  }
  Vec3 values{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!read_number(parts[i], values[i]) || !std::isfinite(values[i])) {
      throw UserError("bad value '" + text + "'", option, "'" + parts[i] + "' is not a finite number", remedy);
    }
  }
  return values;
}

ImageSize parse_size(const std::string& text, const std::string& option) {
  const std::vector<std::string> parts = split(text, 'x');
  std::uint64_t width = 0;
  std::uint64_t height = 0;
  if (parts.size() != 2 || !read_number(parts[0], width) || !read_number(parts[1], height)) {
    throw UserError("bad value '" + text + "'", option, "it is not WIDTHxHEIGHT in whole pixels",
                    fmt::format("give e.g. 1280x720, both sides from 1 to {}", kMaxImageSize));
  }
  check_image_size(width, height, option + " " + text);
  return {static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
}

std::array<float, 3> parse_background(const std::string& text, const std::string& option) {
  const Vec3 values = parse_triple(text, option, "R,G,B", "1,1,1");
  for (const double value : {values.x, values.y, values.z}) {
    if (!(value >= 0 && value <= 1)) {
      throw UserError("bad value '" + text + "'", option, fmt::format("{} is not from 0 to 1", value),
                      "give three numbers from 0 to 1, e.g. 1,1,1 for white");
    }
  }
  return {static_cast<float>(values[0]), static_cast<float>(values[1]), static_cast<float>(values[2])};
}

std::vector<std::string> parse_names(const std::string& text, const std::string& option) {
  std::vector<std::string> names = split(text, ',');
  if (std::find(names.begin(), names.end(), "") != names.end()) {
    throw UserError("bad value '" + text + "'", option, "a name is missing", "give names with commas between them");
  }
  return names;
}

std::pair<std::string, CycleWindow> parse_window(const std::string& text, const std::string& option) {
  CycleWindow window;
  const std::size_t at = text.rfind('@');
  const std::size_t colon = at == std::string::npos ? at : text.find(':', at);
  if (colon == std::string::npos) return {text, window};
  const std::string from = text.substr(at + 1, colon - at - 1), to = text.substr(colon + 1);
  const bool is_read = (from.empty() || read_number(from, window.from)) && (to.empty() || read_number(to, window.to));
  if (!is_read || window.from >= window.to) {
    throw UserError("bad value '" + text.substr(at) + "'", option,
                    is_read ? "it ends before it begins" : "cycles are whole numbers",
                    "give @FROM:TO, e.g. @1000:2000");
  }
  return {text.substr(0, at), window};
}

std::vector<Setting> parse_settings(const std::vector<std::string>& texts) {
  refuse_keys_given_twice(texts, "--set");
  std::vector<Setting> settings;
  for (const std::string& text : texts) settings.push_back(parse_setting(text));
  return settings;
}

std::vector<UnitChoice> parse_unit_choices(const std::vector<std::string>& texts) {
  refuse_keys_given_twice(texts, "--unit");
  std::vector<UnitChoice> choices;
  for (const std::string& text : texts) choices.push_back(parse_unit_choice(text));
  return choices;
}

}  // namespace vrpipe::tools
