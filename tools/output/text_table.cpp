#include "output/text_table.h"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>

namespace vrpipe::tools {

namespace {
/// Below which a column is not narrowed any more.
constexpr std::size_t least_wrapped = 20;
}  // namespace

std::vector<std::string> wrapped(const std::string& text, std::size_t width) {
  std::vector<std::string> lines(1);
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    std::string& line = lines.back();
    if (line.empty()) {
      line = word;
    } else if (line.size() + 1 + word.size() <= width) {
      line += ' ' + word;
    } else {
      lines.push_back(word);
    }
  }
  return lines;
}

void TextTable::group(const std::string& title) { rows_.push_back({{title}, Row::Kind::group, false}); }

void TextTable::row(std::vector<std::string> cells, bool emphasised) {
  rows_.push_back({std::move(cells), Row::Kind::cells, emphasised});
}

void TextTable::below(const std::string& text, std::size_t width) {
  const std::string indent(6, ' ');
  for (const std::string& line : wrapped(text, width - indent.size())) {
    rows_.push_back({{indent + line}, Row::Kind::lines, false});
  }
}

void TextTable::wrap(std::size_t width) {
  left(heading_.size() - 1);
  width_ = width;
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
    if (row.kind == Row::Kind::cells) fit(row.cells, 2);
  }
  if (width_ > 0) {
    std::size_t before = 0;
    for (std::size_t i = 0; i + 1 < widths.size(); ++i) before += widths[i] + 2;
    widths.back() = std::min(widths.back(), std::max(least_wrapped, width_ - std::min(width_, before)));
  }

  const auto line = [&](const std::vector<std::string>& cells, const std::string& indent) {
    std::string text = fmt::format("{:<{}}", indent + cells.front(), widths.front());
    for (std::size_t i = 1; i < cells.size(); ++i) {
      text += is_left_[i] ? fmt::format("  {:<{}}", cells[i], widths[i]) : fmt::format("  {:>{}}", cells[i], widths[i]);
    }
    if (is_left_.back()) text.erase(text.find_last_not_of(' ') + 1);
    return text;
  };
  std::string text = style.bold(line(heading_, "")) + '\n';
  std::size_t total = 0;
  for (const std::size_t width : widths) total += width + 2;
  for (std::size_t i = 2; i < total; ++i) text += style.unicode ? "─" : "-";
  text += '\n';
  for (const Row& row : rows_) {
    if (row.kind != Row::Kind::cells) {
      text += (row.kind == Row::Kind::group ? style.bold(row.cells.front()) : row.cells.front()) + '\n';
      continue;
    }
    std::vector<std::string> cells = row.cells;
    const std::vector<std::string> last =
        width_ > 0 && cells.size() == widths.size() ? wrapped(cells.back(), widths.back()) : std::vector{cells.back()};
    for (const std::string& part : last) {
      cells.back() = part;
      const std::string content = line(cells, "  ");
      text += (row.emphasised ? style.good(content) : content) + '\n';
      std::fill(cells.begin(), cells.end(), std::string());
    }
  }
  return text;
}

}  // namespace vrpipe::tools
