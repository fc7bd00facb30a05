#include "jobs/measured_table.h"

#include <sstream>
#include <stdexcept>

namespace vrpipe::tools {

namespace {

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream rest(line);
  for (std::string cell; std::getline(rest, cell, ',');) cells.push_back(cell);
  return cells;
}

std::vector<MeasuredRow> parse_table(const std::string& name) {
  const char* const text = measured_text(name);
  if (text == nullptr) throw std::logic_error("no measured table " + name);
  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> columns = cells_of(line);
  std::vector<MeasuredRow> rows;
  while (std::getline(lines, line)) {
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() != columns.size()) throw std::logic_error(name + ".csv: " + line);
    std::map<std::string, std::string> by_column;
    for (std::size_t i = 0; i < cells.size(); ++i) by_column[columns[i]] = cells[i];
    rows.emplace_back(std::move(by_column));
  }
  return rows;
}

}  // namespace

const std::string& MeasuredRow::text(const std::string& column) const {
  const auto found = cells_.find(column);
  if (found == cells_.end()) throw std::logic_error("no measured column " + column);
  return found->second;
}

double MeasuredRow::number(const std::string& column) const { return std::stod(text(column)); }

unsigned MeasuredRow::count(const std::string& column) const { return static_cast<unsigned>(std::stoul(text(column))); }

const std::vector<MeasuredRow>& measured_table(const std::string& name) {
  static std::map<std::string, std::vector<MeasuredRow>> tables;
  const auto found = tables.find(name);
  return found != tables.end() ? found->second : tables.emplace(name, parse_table(name)).first->second;
}

}  // namespace vrpipe::tools
