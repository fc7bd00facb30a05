#include "output/text_table.h"

#include <algorithm>

#include <fmt/format.h>

namespace vrpipe::tools {

void TextTable::group(const std::string& title) { rows_.push_back({{title}, true, false}); }

void TextTable::row(std::vector<std::string> cells, bool emphasised) {
  rows_.push_back({std::move(cells), false, emphasised});
}

std::string TextTable::text(const TextStyle& style) const {
  std::vector<std::size_t> widths(heading_.size());
  const auto fit = [&](const std::vector<std::string>& cells, std::size_t indent) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      widths[i] = std::max(widths[i], cells[i].size() + (i == 0 ? indent : 0));
    }
  };
  fit(heading_, 0);
  for (const Row& row : rows_) {
    if (!row.is_group) fit(row.cells, 2);
  }

  const auto line = [&](const std::vector<std::string>& cells, const std::string& indent) {
    std::string text = fmt::format("{:<{}}", indent + cells.front(), widths.front());
    for (std::size_t i = 1; i < cells.size(); ++i) text += fmt::format("  {:>{}}", cells[i], widths[i]);
    return text;
  };
  std::string text = style.bold(line(heading_, "")) + '\n';
  std::size_t total = 0;
  for (const std::size_t width : widths) total += width + 2;
  for (std::size_t i = 2; i < total; ++i) text += style.unicode ? "─" : "-";
  text += '\n';
  for (const Row& row : rows_) {
    if (row.is_group) {
      text += style.bold(row.cells.front()) + '\n';
    } else {
      const std::string content = line(row.cells, "  ");
      text += (row.emphasised ? style.good(content) : content) + '\n';
    }
  }
  return text;
}

}  // namespace vrpipe::tools
