#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "output/compare_sections.h"
#include "output/page_parts.h"
#include "output/result_json.h"
#include "output/svg_plot.h"

namespace vrpipe::tools {
namespace {

std::string value_text(const Json& value) {
  if (value.is_boolean()) return value.get<bool>() ? "on" : "off";
  return value.is_string() ? value.get<std::string>() : value.dump();
}

std::string unit_of(const std::string& key) { return key.substr(0, key.rfind('.')); }

/// Of a parameter: what runs have in place of the value of all.
using Others = std::vector<std::pair<std::string, std::string>>;

struct ParameterRow {
  std::string key;
  std::string value;   ///< that most runs share; "-" where the first have no such parameter
  std::string origin;  ///< of it
  Others others;
};

std::vector<ParameterRow> parameter_rows(const JobResult& result) {
  const Json platform = platform_json(result.runs, result.preprocessing, result.provenance);
  std::vector<ParameterRow> rows;
  std::map<std::string, std::size_t> places;
  for (const auto& [key, value] : platform["parameters"].items()) {
    places[key] = rows.size();
    rows.push_back({key, value_text(value), platform["origins"][key].get<std::string>(), {}});
  }
  for (const RunResult& run : result.runs) {
    const Json changed = changed_parameters_json(run, platform["parameters"]);
    for (const auto& [key, value] : changed.items()) {
      const auto [place, is_new] = places.emplace(key, rows.size());
      if (is_new) rows.push_back({key, "-", "", {}});
      rows[place->second].others.emplace_back(name_of(run.request), value_text(value));
    }
  }
  // Those of a unit together, also what a run alone has.
  std::vector<std::string> units;
  for (const ParameterRow& row : rows) {
    if (std::find(units.begin(), units.end(), unit_of(row.key)) == units.end()) units.push_back(unit_of(row.key));
  }
  const auto place_of = [&](const ParameterRow& row) {
    return std::find(units.begin(), units.end(), unit_of(row.key)) - units.begin();
  };
  std::stable_sort(rows.begin(), rows.end(),
                   [&](const ParameterRow& a, const ParameterRow& b) { return place_of(a) < place_of(b); });
  return rows;
}

std::string table_of(const std::vector<ParameterRow>& rows, bool has_others, bool only_others) {
  std::string text =
      "<div class=\"scroll\"><table class=\"parameters\">\n<tr><th>parameter</th><th>value</th>"
      "<th>from</th>";
  text += has_others ? "<th>otherwise in</th></tr>\n" : "</tr>\n";
  std::string unit;
  for (const ParameterRow& row : rows) {
    if (only_others && row.others.empty()) continue;
    if (unit_of(row.key) != unit && !only_others) {
      unit = unit_of(row.key);
      text +=
          fmt::format("<tr class=\"group\"><td colspan=\"{}\">{}</td></tr>\n", has_others ? 4 : 3, html_escaped(unit));
    }
    const bool is_default = row.origin == "default" || row.origin.empty();
    text += "<tr><td>" + html_escaped(row.key) + "</td><td>" + html_escaped(row.value) + "</td>" +
            (is_default ? "<td class=\"subtle\">" : "<td class=\"active\">") + html_escaped(row.origin) + "</td>";
    std::string others;
    for (const auto& [run, value] : row.others) others += (others.empty() ? "" : "; ") + run + ": " + value;
    if (has_others) text += (others.empty() ? "<td>" : "<td class=\"other\">") + html_escaped(others) + "</td>";
    text += "</tr>\n";
  }
  return text + "</table></div>\n";
}

std::string parameters_csv(const std::vector<ParameterRow>& rows, const std::vector<RunResult>& runs) {
  std::vector<std::string> heading{"parameter", "value", "origin"};
  for (const RunResult& run : runs) heading.push_back(name_of(run.request));
  CsvText csv(heading);
  for (const ParameterRow& row : rows) {
    std::vector<std::string> cells{row.key, row.value, row.origin};
    for (const RunResult& run : runs) {
      const auto own = std::find_if(row.others.begin(), row.others.end(),
                                    [&](const auto& other) { return other.first == name_of(run.request); });
      cells.push_back(own == row.others.end() ? row.value : own->second);
    }
    csv.row(cells);
  }
  return csv.text();
}

std::string implementations_table(const std::vector<RunResult>& runs) {
  std::vector<std::string> heading{"unit"};
  std::vector<std::string> slots;
  std::vector<Json> of_run;
  for (const RunResult& run : runs) {
    heading.push_back(name_of(run.request));
    of_run.push_back(implementations_json(run));
    for (const auto& slot : of_run.back().items()) {
      if (std::find(slots.begin(), slots.end(), slot.key()) == slots.end()) slots.push_back(slot.key());
    }
  }
  std::vector<PageRow> rows;
  for (const std::string& slot : slots) {
    PageRow row{{slot}};
    for (const Json& json : of_run) row.cells.push_back(json.contains(slot) ? json[slot].get<std::string>() : "-");
    if (std::adjacent_find(row.cells.begin() + 1, row.cells.end(), std::not_equal_to<>()) != row.cells.end()) {
      row.kind = "marked";
    }
    rows.push_back(std::move(row));
  }
  const bool differ = std::any_of(rows.begin(), rows.end(), [](const PageRow& row) { return !row.kind.empty(); });
  return (differ ? "<details open>" : "<details>") +
         std::string("<summary>Units and their implementations</summary>\n") + html_table(heading, rows, "parameters") +
         "</details>\n";
}

}  // namespace

std::string parameters_section(const JobResult& result) {
  const std::vector<ParameterRow> rows = parameter_rows(result);
  const auto differs = [](const ParameterRow& row) { return !row.others.empty(); };
  const bool has_others = std::any_of(rows.begin(), rows.end(), differs);
  std::string text;
  if (has_others) text += "<h3>What differs between runs</h3>\n" + table_of(rows, true, true);
  text += implementations_table(result.runs);
  text += fmt::format("<details><summary>All {} parameters</summary>\n", rows.size()) +
          table_of(rows, has_others, false) + "</details>\n";
  return text + "<p class=\"links\">" + csv_link("parameters", parameters_csv(rows, result.runs)) + "</p>\n";
}

}  // namespace vrpipe::tools
