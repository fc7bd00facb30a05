#pragma once

#include <string>
#include <vector>

#include "host/terminal.h"

namespace vrpipe::tools {

/// A table in plain text: the first column to the left, the others to the right, with headings of groups of rows.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> heading) : heading_(std::move(heading)) {}

  /// A row of text that heads the rows below.
  void group(const std::string& title);
  /// As many cells as the heading has, or fewer. An emphasised row is drawn to catch the eye.
  void row(std::vector<std::string> cells, bool emphasised = false);

  std::string text(const TextStyle& style) const;

 private:
  struct Row {
    std::vector<std::string> cells;
    bool is_group;
    bool emphasised;
  };
  std::vector<std::string> heading_;
  std::vector<Row> rows_;
};

}  // namespace vrpipe::tools
