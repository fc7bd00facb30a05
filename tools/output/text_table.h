#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "host/terminal.h"

namespace vrpipe::tools {

/// Lines of at most `width` characters, broken between words; a longer word has a line of its own. One at least.
std::vector<std::string> wrapped(const std::string& text, std::size_t width);

/// A table in plain text: the first column to the left, the others to the right unless they are asked to go to the left,
/// with headings of groups of rows.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> heading) : heading_(std::move(heading)), is_left_(heading_.size()) {}

  /// A row of text that heads the rows below.
  void group(const std::string& title);
  /// As many cells as the heading has, or fewer. An emphasised row is drawn to catch the eye.
  void row(std::vector<std::string> cells, bool emphasised = false);

  /// Lines of their own below the last row, indented, of at most `width` characters.
  void below(const std::string& text, std::size_t width);

  /// Aligns a column to the left.
  void left(std::size_t column) { is_left_.at(column) = true; }

  /// Breaks the last column, which goes to the left, between words where lines would have more characters than this.
  void wrap(std::size_t width);

  std::string text(const TextStyle& style) const;

 private:
  struct Row {
    enum class Kind { cells, group, lines };
    std::vector<std::string> cells;
    Kind kind;
    bool emphasised;
  };
  std::vector<std::string> heading_;
  std::vector<bool> is_left_;
  std::vector<Row> rows_;
  std::size_t width_ = 0;  ///< to which lines are broken; 0: they are not
};

}  // namespace vrpipe::tools
