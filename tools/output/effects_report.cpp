#include "output/effects_report.h"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

#include <vrpipe/component/printable.h>

#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

constexpr std::size_t report_width = 100;

std::string seconds_text(double seconds) { return fmt::format("{:.2f}", seconds); }

std::string ratio_text(double with, double without) {
  return without > 0 ? fmt::format("{:.2f}x", with / without) : std::string("-");
}

/// Effect, proof, CPU seconds without and with it and their ratio, and the reason.
std::string run_text(const RunResult& run, const EffectCosts& costs, const TextStyle& style) {
  TextTable table(
      {"effects of " + printable(name_of(run.request)), "proof", "host s without", "with", "ratio", "reason"});
  table.left(1);
  table.wrap(report_width);
  const auto row = [&](const std::string& name, const std::string& proof, const std::optional<double>& with,
                       const std::string& reason) {
    std::vector<std::string> cells{name, proof};
    if (with) {
      cells.insert(cells.end(), {seconds_text(costs.without), seconds_text(*with), ratio_text(*with, costs.without)});
    } else {
      cells.insert(cells.end(), 3, "");
    }
    cells.push_back(reason);
    table.row(std::move(cells));
  };
  for (const bool omitted : {false, true}) {
    const auto belongs = [omitted](const EffectReport& effect) { return effect.omitted == omitted; };
    if (std::none_of(run.effects.begin(), run.effects.end(), belongs)) continue;
    table.group(omitted ? "omitted" : "active");
    for (const EffectReport& effect : run.effects) {
      if (!belongs(effect)) continue;
      row(printable(effect.name), omitted ? state_of(run, effect) : std::string(), costs.with_effect(effect.name),
          printable(effect.reason));
    }
  }
  table.group("together");
  row("all effects", "", costs.with_all, "--effects all");
  return table.text(style);
}

constexpr const char* where_all_are =
    "each with its reason: --json, --html; with what it would cost: --explain-effects\n";

/// How many are in each state, of `where`; by name those that change what comes out.
std::string counted_text(const std::map<std::string, std::vector<std::string>>& names_of_state,
                         const std::string& where) {
  std::size_t active = 0, omitted = 0;
  std::string states, named;
  for (const auto& [state, names] : names_of_state) {
    (state == "active" ? active : omitted) += names.size();
    if (state == "active") continue;
    states += fmt::format("{}{} {}", states.empty() ? "" : ", ", names.size(), state);
    if (state != "bounded" && state != "forced") continue;
    const std::string title = state == "forced" ? "left out by force" : "approximated";
    const std::vector<std::string> lines =
        wrapped(fmt::format("{}: {}", title, fmt::join(names, ", ")), report_width - 2);
    for (const std::string& line : lines) named += (&line == &lines.front() ? "" : "  ") + line + "\n";
  }
  return fmt::format("effects: {} active{}, {} left out{}{}\n", active, where, omitted, where,
                     states.empty() ? "" : " (" + states + ")") +
         named + where_all_are;
}

std::string short_text(const RunResult& run) {
  std::map<std::string, std::vector<std::string>> names_of_state;
  for (const EffectReport& effect : run.effects) {
    const std::string state = state_of(run, effect);
    const std::string bound = state == "bounded" ? " (" + effect.reason + ")" : std::string();
    names_of_state[state].push_back(printable(effect.name + bound));
  }
  return counted_text(names_of_state, "");
}

/// Those that differ, a column for each run; the others are counted.
std::string comparison_text(const std::vector<const RunResult*>& runs, const TextStyle& style) {
  std::vector<std::string> heading{"effects that differ"};
  for (const RunResult* run : runs) heading.push_back(printable(name_of(run->request)));
  TextTable table(std::move(heading));
  bool any_differs = false;
  std::map<std::string, std::vector<std::string>> alike;  // names, by state
  // Platforms may have different ones.
  std::set<std::string> all_names;
  for (const RunResult* run : runs) {
    for (const EffectReport& effect : run->effects) all_names.insert(effect.name);
  }
  for (const std::string& name : all_names) {
    std::vector<std::string> cells{printable(name)};
    for (const RunResult* run : runs) {
      const auto found = std::find_if(run->effects.begin(), run->effects.end(),
                                      [&](const EffectReport& effect) { return effect.name == name; });
      cells.push_back(found == run->effects.end() ? "-" : state_of(*run, *found));
    }
    if (std::all_of(cells.begin() + 1, cells.end(), [&](const std::string& cell) { return cell == cells[1]; })) {
      alike[cells[1]].push_back(cells[0]);
    } else {
      table.row(std::move(cells));
      any_differs = true;
    }
  }
  return (any_differs ? table.text(style) : std::string()) + counted_text(alike, " in all");
}

}  // namespace

std::optional<EffectProof> proof_of(const RunResult& run, const EffectReport& effect) {
  if (!effect.omitted || run.request.effects.forces_out(effect.name)) return std::nullopt;
  return effect.proof;
}

std::string state_of(const RunResult& run, const EffectReport& effect) {
  if (!effect.omitted) return "active";
  const std::optional<EffectProof> proof = proof_of(run, effect);
  return proof ? vrpipe::name_of(*proof) : "forced";
}

std::string effects_choice_text(const RunRequest& request) {
  const std::string text = request.effects.text();
  return text == EffectChoice().text() ? std::string() : ", effects " + text;
}

std::string effects_text(const std::vector<RunResult>& runs, const std::vector<EffectCosts>& costs,
                         const TextStyle& style) {
  std::vector<const RunResult*> with;
  for (const RunResult& run : runs) {
    if (!run.effects.empty()) with.push_back(&run);
  }
  if (with.empty()) return {};
  if (costs.empty()) return "\n" + (with.size() > 1 ? comparison_text(with, style) : short_text(*with.front()));
  std::string text;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    text += "\n" + (runs[i].effects.empty() ? fmt::format("{} has no effects\n", printable(name_of(runs[i].request)))
                                            : run_text(runs[i], costs[i], style));
  }
  return text;
}

}  // namespace vrpipe::tools
