#pragma once

#include <charconv>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

namespace vrpipe {

/// The words of a line, which blanks separate.
inline std::vector<std::string_view> words_of(std::string_view line) {
  constexpr std::string_view kBlank = " \t\r\v\f";
  std::vector<std::string_view> words;
  for (std::size_t begin = line.find_first_not_of(kBlank); begin != std::string_view::npos;) {
    const std::size_t end = line.find_first_of(kBlank, begin);
    words.push_back(line.substr(begin, end == std::string_view::npos ? end : end - begin));
    begin = end == std::string_view::npos ? end : line.find_first_not_of(kBlank, end);
  }
  return words;
}

/// A number that all of a word is; `nan` and `inf` are numbers.
template <class Number>
std::optional<Number> number_of(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  Number value{};
  const auto result = std::from_chars(word.data(), word.data() + word.size(), value);
  if (result.ec != std::errc{} || result.ptr != word.data() + word.size()) return {};
  return value;
}

/// The float nearest to a number that all of a word is, perhaps an infinity.
inline std::optional<float> float_of(std::string_view word) {
  const std::optional<double> value = number_of<double>(word);
  if (!value) return {};
  constexpr double kMax = std::numeric_limits<float>::max();
  if (*value > kMax) return std::numeric_limits<float>::infinity();
  if (*value < -kMax) return -std::numeric_limits<float>::infinity();
  return static_cast<float>(*value);
}

}  // namespace vrpipe
