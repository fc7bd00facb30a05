#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/platforms/simulation.h>

#include "cli/command_line.h"
#include "cli/listing.h"
#include "cli/options.h"
#include "host/stdout_to_stderr.h"
#include "host/terminal.h"
#include "jobs/settings.h"
#include "output/result_json.h"

namespace vrpipe::tools {
namespace {

/// Whether the unit is what its slot gets in a variant that has it; what is no slot (l2, links, state, preprocess) has one each.
bool is_default(const ParameterListing& unit) {
  const Registry& registry = Registry::instance();
  if (!registry.has_slot(unit.unit)) return true;
  return default_implementation(registry.slot(unit.unit), variant_named("het+qm")).name == unit.implementation;
}

/// A platform, and what it has in its slots.
struct Used {
  explicit Used(const Platform& of) : platform(of) {
    RunRequest request;
    request.platform = &of;
    request.variant = variant_named("het+qm");
    for (auto& [slot, name] : Configuration(request, Frame(16, 16)).implementations()) names[slot] = std::move(name);
  }
  /// Whether the unit is in its slot; of a slot that the platform is without, whether it is the default.
  bool has(const ParameterListing& unit) const {
    const auto found = names.find(unit.unit);
    return found == names.end() ? is_default(unit) : found->second == unit.implementation;
  }
  const Platform& platform;
  std::map<std::string, std::string> names;  ///< of implementations, by slot
};

/// With the formula, where it has one.
std::string meaning_of(const StatisticReport& statistic) {
  return statistic.meaning + (statistic.formula.empty() ? "" : ": " + statistic.formula);
}

std::string with_unit(const std::string& value, const Parameter& parameter) {
  std::string unit = parameter.unit();
  if (unit.empty()) return value;
  if (value == "1" && unit.back() == 's') unit.pop_back();
  return value + " " + unit;
}

std::string heading(const ParameterListing& unit) {
  return unit.implementation.empty() ? unit.unit : unit.unit + "=" + unit.implementation;
}

/// How a heading calls the unit's part in a run; starts with a blank unless it is empty.
std::string role(const ParameterListing& unit, const Used& used) {
  if (unit.implementation.empty()) return "";
  if (used.has(unit)) return is_default(unit) ? " (default)" : " (on " + used.platform.name + ")";
  if (is_default(unit)) return " (default on other platforms)";
  return unit.pass_through ? " (where a variant does without the unit)" : "";
}

std::string as_text(const std::vector<ParameterListing>& units, const Used& used, const TextStyle& style) {
  std::string text;
  for (const ParameterListing& unit : units) {
    if (!text.empty()) text += '\n';
    text += style.bold(printable(heading(unit))) + printable(role(unit, used)) + "\n  " + printable(unit.description) +
            "\n";
    for (const Parameter* parameter : unit.parameters->parameters()) {
      text += fmt::format("  {} = {}", style.bold(unit.unit + "." + parameter->name()),
                          with_unit(parameter->value(), *parameter));
      if (parameter->value() != parameter->default_value()) {
        text += fmt::format(" on {}, by default {}", used.platform.name, parameter->default_value());
      }
      text += fmt::format("; {}\n      {}\n      default from: {}\n", parameter->range(),
                          printable(parameter->meaning()), printable(parameter->source()));
    }
    for (const StatisticReport& statistic : list_statistics(unit)) {
      text += fmt::format("  {} {}: {}, {}\n", statistic.kind == "counter" ? "counts" : statistic.kind,
                          style.bold(printable(statistic.name)), printable(statistic.unit),
                          printable(meaning_of(statistic)));
    }
  }
  return text;
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : printable(text)) {
    if (c == '|' || c == '<') result += '\\';
    result += c;
  }
  return result;
}

/// The reference that the documentation holds, a table for each implementation.
std::string as_markdown(const std::vector<ParameterListing>& units, const Used& used) {
  std::string text;
  std::string slot;
  for (const ParameterListing& unit : units) {
    if (!text.empty()) text += '\n';
    const std::string chapter = unit.implementation.empty() ? "links" : unit.unit;
    if (chapter != slot) {
      slot = chapter;
      text += "## " + slot + "\n\n";
    }
    text += fmt::format("### `{}`{}\n\n{}.\n", heading(unit), role(unit, used), escaped(unit.description));
    if (!unit.parameters->parameters().empty()) {
      text += "\n| parameter | default | unit | allowed | meaning | default from |\n|---|---|---|---|---|---|\n";
    }
    for (const Parameter* parameter : unit.parameters->parameters()) {
      text += fmt::format("| `{}.{}` | {} | {} | {} | {} | {} |\n", unit.unit, parameter->name(),
                          parameter->default_value(), escaped(parameter->unit()), escaped(parameter->range()),
                          escaped(parameter->meaning()), escaped(parameter->source()));
    }
    const std::vector<StatisticReport> statistics = list_statistics(unit);
    if (!statistics.empty()) text += "\n| statistic | kind | unit | meaning |\n|---|---|---|---|\n";
    for (const StatisticReport& statistic : statistics) {
      text += fmt::format("| `{}` | {} | {} | {} |\n", statistic.name, statistic.kind, escaped(statistic.unit),
                          escaped(meaning_of(statistic)));
    }
  }
  return text;
}

Json as_json(const std::vector<ParameterListing>& units, const Used& used) {
  Json list = Json::array();
  for (const ParameterListing& unit : units) {
    Json parameters = Json::array();
    for (const Parameter* parameter : unit.parameters->parameters()) {
      parameters.push_back({{"name", unit.unit + "." + parameter->name()},
                            {"default", typed_value(*parameter, parameter->default_value())},
                            {"value", typed_value(*parameter, parameter->value())},
                            {"unit", parameter->unit()},
                            {"range", parameter->range()},
                            {"meaning", parameter->meaning()},
                            {"source", parameter->source()}});
    }
    Json statistics = Json::array();
    for (const StatisticReport& statistic : list_statistics(unit)) {
      statistics.push_back({{"name", statistic.name},
                            {"kind", statistic.kind},
                            {"unit", statistic.unit},
                            {"meaning", statistic.meaning},
                            {"formula", statistic.formula.empty() ? Json() : Json(statistic.formula)}});
    }
    list.push_back({{"slot", unit.unit},
                    {"implementation", unit.implementation},
                    {"description", unit.description},
                    {"default", is_default(unit)},
                    {"used", used.has(unit)},
                    {"pass_through", unit.pass_through},
                    {"parameters", std::move(parameters)},
                    {"statistics", std::move(statistics)}});
  }
  return {{"schema", "vrpipe.units/1"}, {"platform", used.platform.name}, {"units", std::move(list)}};
}

class UnitsCommand : public Command {
 public:
  std::string name() const override { return "units"; }
  std::string summary() const override { return "every unit, its implementations, all parameters and statistics"; }

  void declare(CLI::App& app) override {
    add_option(app, "--slot", slot_, "NAME", "only the units of this slot, e.g. tc", "What is listed");
    add_option(app, "--platform", platform_, "NAME",
               "values as this GPU sets them (default: " + platforms().front().name + ")", "What is listed");
    add_option(app, "--plugin", plugins_, "FILE.so", "loads a plugin's units first; can be repeated", "What is listed");
    declare_json(app, json_);
    app.add_flag("--markdown", markdown_, "prints the reference as Markdown")
        ->disable_flag_override()
        ->group("Where results go");
    app.footer(
        "Examples:\n"
        "  vrpipe units --slot crop\n"
        "  vrpipe run --set crop.cache_bytes=32768      changes a parameter\n"
        "  vrpipe run --unit qru=pass-through           puts another unit into a slot");
  }

  void run() override {
    load_plugins(plugins_);
    const auto named = single(platform_, "--platform");
    const Platform& platform = named ? platform_named(*named) : platforms().front();
    std::vector<ParameterListing> units = all_parameters(&platform);
    if (const auto slot = single(slot_, "--slot")) {
      std::vector<std::string> slots;
      for (const ParameterListing& unit : units) slots.push_back(unit.unit);
      const auto is_other = [&](const ParameterListing& unit) { return unit.unit != *slot; };
      units.erase(std::remove_if(units.begin(), units.end(), is_other), units.end());
      if (units.empty()) {
        throw UserError("unknown slot '" + *slot + "'", "--slot", "there is no such slot",
                        "did you mean " + nearest_name(*slot, slots) + "? `vrpipe units` lists all");
      }
    }
    const TextStyle style = stdout_style();
    Json json;
    std::string text;
    {
      const StdoutToStderr redirected;  // plugins may print while their units are made
      const Used used(platform);
      json = as_json(units, used);
      text = markdown_ ? as_markdown(units, used) : as_text(units, used, style);
    }
    print_listing(json, text, json_, plugins_);
  }

 private:
  Values slot_, platform_, plugins_, json_;
  bool markdown_ = false;
};

}  // namespace

std::unique_ptr<Command> make_units_command() { return std::make_unique<UnitsCommand>(); }

}  // namespace vrpipe::tools
