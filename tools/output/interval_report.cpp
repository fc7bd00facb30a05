#include "output/interval_report.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace vrpipe::tools {
namespace {

bool is_quotient(const StatisticIntervals& statistic) {
  return statistic.kind == "ratio" || statistic.kind == "histogram";
}

nlohmann::ordered_json interval_value_json(const StatisticIntervals& statistic, std::size_t interval) {
  if (is_quotient(statistic)) {
    const std::optional<double> quotient = statistic.quotient(interval);
    return quotient ? nlohmann::ordered_json(*quotient) : nlohmann::ordered_json();
  }
  return statistic.values[interval] ? nlohmann::ordered_json(*statistic.values[interval]) : nlohmann::ordered_json();
}

/// The cells of an interval, by column.
using Row = std::map<std::string, std::string>;

void add_column(std::vector<std::string>& columns, const std::string& name) {
  if (std::find(columns.begin(), columns.end(), name) == columns.end()) columns.push_back(name);
}

std::vector<std::string> columns_of(const std::vector<RunResult>& runs) {
  std::vector<std::string> columns;
  for (const RunResult& run : runs) {
    for (const StatisticIntervals& statistic : run.intervals->statistics) add_column(columns, statistic.name);
  }
  for (const RunResult& run : runs) {
    for (const UnitIntervals& unit : run.intervals->units) {
      for (unsigned state = 0; state < unit_states; ++state) {
        add_column(columns, unit.name + "." + vrpipe::name_of(static_cast<UnitState>(state)));
      }
    }
  }
  return columns;
}

Row row_of(const IntervalReport& intervals, std::size_t interval) {
  Row row;
  for (const StatisticIntervals& statistic : intervals.statistics) {
    const nlohmann::ordered_json value = interval_value_json(statistic, interval);
    row[statistic.name] = value.is_null()           ? std::string()
                          : value.is_number_float() ? fmt::format("{:.6g}", value.get<double>())
                                                    : fmt::format("{}", value.get<std::uint64_t>());
  }
  for (const UnitIntervals& unit : intervals.units) {
    for (unsigned state = 0; state < unit_states; ++state) {
      row[unit.name + "." + vrpipe::name_of(static_cast<UnitState>(state))] =
          fmt::format("{}", unit.cycles[state][interval]);
    }
  }
  return row;
}

}  // namespace

nlohmann::ordered_json intervals_json(const IntervalReport& intervals) {
  nlohmann::ordered_json states = nlohmann::ordered_json::object();
  for (const UnitIntervals& unit : intervals.units) {
    nlohmann::ordered_json& of_unit = states[unit.name];
    for (unsigned state = 0; state < unit_states; ++state) {
      of_unit[vrpipe::name_of(static_cast<UnitState>(state))] = unit.cycles[state];
    }
  }
  nlohmann::ordered_json statistics = nlohmann::ordered_json::object();
  for (const StatisticIntervals& statistic : intervals.statistics) {
    nlohmann::ordered_json& values = statistics[statistic.name] = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < intervals.from.size(); ++i) values.push_back(interval_value_json(statistic, i));
  }
  return {{"cycles", intervals.every},
          {"from", intervals.from},
          {"states", std::move(states)},
          {"statistics", std::move(statistics)}};
}

std::string intervals_csv(const std::vector<RunResult>& runs) {
  const std::vector<std::string> columns = columns_of(runs);
  const bool names_runs = runs.size() > 1;
  std::string text = names_runs ? "run,from,to" : "from,to";
  for (const std::string& column : columns) text += "," + column;
  text += "\n";
  for (const RunResult& run : runs) {
    const IntervalReport& intervals = *run.intervals;
    for (std::size_t i = 0; i < intervals.from.size(); ++i) {
      const std::uint64_t to = i + 1 < intervals.from.size() ? intervals.from[i + 1] : run.cycles.value_or(0);
      if (names_runs) text += name_of(run.request) + ",";
      text += fmt::format("{},{}", intervals.from[i], to);
      Row row = row_of(intervals, i);
      for (const std::string& column : columns) text += "," + row[column];
      text += "\n";
    }
  }
  return text;
}

}  // namespace vrpipe::tools
