#pragma once

#include <sstream>
#include <string>
#include <vector>

namespace vrpipe::testing {

/// The lines of a table, each split at its commas.
inline std::vector<std::vector<std::string>> csv_rows(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string>& row = rows.emplace_back(1);
    for (const char letter : line) {
      if (letter == ',') {
        row.emplace_back();
      } else {
        row.back() += letter;
      }
    }
  }
  return rows;
}

}  // namespace vrpipe::testing
