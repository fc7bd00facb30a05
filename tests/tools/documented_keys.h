#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace vrpipe::testing {

/// The keys in the first column of the tables of a section.
inline std::set<std::string> documented(const std::string& page, const std::string& heading) {
  std::set<std::string> keys;
  const std::size_t start = page.find("\n### " + heading + "\n");
  EXPECT_NE(start, std::string::npos) << heading;
  std::istringstream lines(page.substr(start + 5, page.find("\n#", start + 5) - start - 5));
  const std::regex key("`([^`]+)`");
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("| `", 0) != 0) continue;
    const std::string cell = line.substr(0, line.find(" |", 2));
    for (std::sregex_iterator i(cell.begin(), cell.end(), key), end; i != end; ++i) keys.insert((*i)[1]);
  }
  return keys;
}

inline std::string without_brackets(const std::string& key) {
  return key.size() > 2 && key.substr(key.size() - 2) == "[]" ? key.substr(0, key.size() - 2) : key;
}

/// Every key of a result as the documentation writes it; `known` says which names depend on the run.
inline void find_keys(const nlohmann::json& value, const std::string& path, const std::set<std::string>& known,
                      std::set<std::string>& found) {
  if (value.is_object() && !value.empty()) {
    const auto map = known.lower_bound(path + ".*");
    const bool is_map = map != known.end() && map->rfind(path + ".*", 0) == 0;
    for (const auto& entry : value.items()) {
      find_keys(entry.value(), (path.empty() ? "" : path + ".") + (is_map ? "*" : entry.key()), known, found);
    }
  } else if (value.is_array() && !value.empty()) {
    for (const nlohmann::json& element : value) find_keys(element, path + "[]", known, found);
  } else if (value.is_object()) {
    found.insert(path + ".*");
  } else if (!value.is_array() || known.count(path + "[]") > 0) {
    found.insert(without_brackets(path));
  }
}

inline std::vector<std::string> only_in(const std::set<std::string>& some, const std::set<std::string>& others) {
  std::vector<std::string> rest;
  std::set_difference(some.begin(), some.end(), others.begin(), others.end(), std::back_inserter(rest));
  return rest;
}

/// That all keys of some results are those that a page documents: `known`, as documented() has them.
inline void expect_documented(const std::vector<nlohmann::json>& results, const std::set<std::string>& known) {
  std::set<std::string> expected;
  for (const std::string& key : known) expected.insert(without_brackets(key));
  std::set<std::string> found;
  for (const nlohmann::json& result : results) find_keys(result, "", known, found);
  EXPECT_EQ(only_in(found, expected), std::vector<std::string>()) << "are not documented";
  EXPECT_EQ(only_in(expected, found), std::vector<std::string>()) << "do not exist";
}

}  // namespace vrpipe::testing
