#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/platforms/simulation.h>

#include "cli/command_line.h"
#include "cli/effects_listing.h"
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

std::string unit_heading(const ParameterListing& unit) {
  return unit.implementation.empty() ? unit.unit : unit.unit + "=" + unit.implementation;
}

/// How a heading calls the unit's part in a run; starts with a blank unless it is empty.
std::string role_in_run(const ParameterListing& unit, const Used& used) {
  if (unit.implementation.empty()) return "";
  if (used.has(unit)) return is_default(unit) ? " (default)" : " (on " + used.platform.name + ")";
  if (is_default(unit)) return " (default on other platforms)";
  return unit.pass_through ? " (where a variant does without the unit)" : "";
}

/// Effects stand below all implementations of their slot.
bool is_last_of_slot(const std::vector<ParameterListing>& units, std::size_t index) {
  return index + 1 == units.size() || units[index + 1].unit != units[index].unit;
}

std::string units_as_text(const std::vector<ParameterListing>& units, const Used& used, const TextStyle& style) {
  std::string text;
  for (std::size_t i = 0; i < units.size(); ++i) {
    const ParameterListing& unit = units[i];
    if (!text.empty()) text += '\n';
    text += style.bold(printable(unit_heading(unit))) + printable(role_in_run(unit, used)) + "\n  " +
            printable(unit.description) + "\n";
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
    if (is_last_of_slot(units, i)) text += effects_as_text(effects_of(unit.unit), style);
  }
  return text;
}

/// The reference that the documentation holds, a table for each implementation.
std::string units_as_markdown(const std::vector<ParameterListing>& units, const Used& used) {
  std::string text;
  std::string slot;
  for (std::size_t i = 0; i < units.size(); ++i) {
    const ParameterListing& unit = units[i];
    if (!text.empty()) text += '\n';
    const std::string chapter = unit.implementation.empty() ? "links" : unit.unit;
    if (chapter != slot) {
      slot = chapter;
      text += "## " + slot + "\n\n";
    }
    text += fmt::format("### `{}`{}\n\n{}.\n", unit_heading(unit), role_in_run(unit, used),
                        markdown_escaped(unit.description));
    if (!unit.parameters->parameters().empty()) {
      text += "\n| parameter | default | unit | allowed | meaning | default from |\n|---|---|---|---|---|---|\n";
    }
    for (const Parameter* parameter : unit.parameters->parameters()) {
      text += fmt::format("| `{}.{}` | {} | {} | {} | {} | {} |\n", unit.unit, parameter->name(),
                          parameter->default_value(), markdown_escaped(parameter->unit()),
                          markdown_escaped(parameter->range()), markdown_escaped(parameter->meaning()),
                          markdown_escaped(parameter->source()));
    }
    const std::vector<StatisticReport> statistics = list_statistics(unit);
    if (!statistics.empty()) text += "\n| statistic | kind | unit | meaning |\n|---|---|---|---|\n";
    for (const StatisticReport& statistic : statistics) {
      text += fmt::format("| `{}` | {} | {} | {} |\n", statistic.name, statistic.kind, markdown_escaped(statistic.unit),
                          markdown_escaped(meaning_of(statistic)));
    }
    const std::string effects = is_last_of_slot(units, i) ? effects_as_markdown(effects_of(unit.unit)) : std::string();
    if (!effects.empty()) text += fmt::format("\n### Effects of `{}`\n\n", unit.unit) + effects;
  }
  return text;
}

/// What has effects and is none of these units, such as the clock.
std::map<std::string, EffectList> effects_of_others(const std::vector<ParameterListing>& units,
                                                    const EffectList& effects) {
  std::map<std::string, EffectList> others;
  for (const Effect* effect : effects) {
    const auto is_its = [&](const ParameterListing& unit) { return unit.unit == effect->component; };
    if (std::none_of(units.begin(), units.end(), is_its)) others[effect->component].push_back(effect);
  }
  return others;
}

Json units_as_json(const std::vector<ParameterListing>& units, const EffectList& effects, const Used& used) {
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
  return {{"schema", "vrpipe.units/1"},
          {"platform", used.platform.name},
          {"units", std::move(list)},
          {"effects", effects_as_json(effects)}};
}

class UnitsCommand : public Command {
 public:
  std::string name() const override { return "units"; }
  std::string summary() const override {
    return "every unit, its implementations, all parameters, statistics and effects";
  }

  void declare(Arguments& arguments) override {
    arguments.add_option("--slot", slot_, "NAME", "only the units of this slot, e.g. tc", listed_group);
    arguments.add_option("--platform", platform_, "NAME",
                         "values as this GPU sets them (default: " + platforms().front().name + ")", listed_group);
    arguments.add_option("--plugin", plugins_, "FILE.so", "loads a plugin's units first; can be repeated",
                         listed_group);
    declare_json(arguments, json_, "list");
    arguments.add_flag("--effects", effects_only_,
                       "only effects: what can be left out, when, and what notices (docs/effects.md)", listed_group);
    arguments.add_flag("--markdown", markdown_, "prints the reference as Markdown", result_group);
    arguments.set_footer(
        "Examples:\n"
        "  vrpipe units --slot crop\n"
        "  vrpipe units --effects\n"
        "  vrpipe run --set crop.cache_bytes=32768      changes a parameter\n"
        "  vrpipe run --unit qru=pass-through           puts another unit into a slot");
  }

  void run() override {
    check_one_form("--markdown", markdown_, json_);
    load_plugins(plugins_);
    const auto named = single(platform_, "--platform");
    const Platform& platform = named ? platform_named(*named) : platforms().front();
    std::vector<ParameterListing> units = all_parameters(&platform);
    EffectList effects = all_effects();
    const auto slot = single(slot_, "--slot");
    if (slot) keep_alone(*slot, units, effects);
    if (effects_only_) units.clear();
    const TextStyle style = stdout_style();
    Json json;
    std::string text;
    {
      const StdoutToStderr redirected;  // plugins may print while their units are made
      const Used used(platform);
      json = units_as_json(units, effects, used);
      text = effects_only_ ? effects_alone(effects, style) : everything(units, effects, used, style);
    }
    print_listing(json, text, json_, plugins_);
  }

 private:
  std::string effects_alone(const EffectList& effects, const TextStyle& style) const {
    if (!markdown_) return effects_as_text(effects, style);
    return slot_.empty() ? all_effects_as_markdown() : effects_as_markdown(effects);
  }
  std::string everything(const std::vector<ParameterListing>& units, const EffectList& effects, const Used& used,
                         const TextStyle& style) const {
    std::string text = markdown_ ? units_as_markdown(units, used) : units_as_text(units, used, style);
    for (const auto& [component, some] : effects_of_others(units, effects)) {
      if (!text.empty()) text += '\n';
      text += markdown_ ? fmt::format("## {}\n\n", component) + effects_as_markdown(some)
                        : style.bold(component) + "\n" + effects_as_text(some, style);
    }
    return text;
  }

  /// Throws UserError for what has neither units nor effects.
  static void keep_alone(const std::string& slot, std::vector<ParameterListing>& units, EffectList& effects) {
    std::vector<std::string> slots;
    for (const ParameterListing& unit : units) slots.push_back(unit.unit);
    for (const Effect* effect : effects) slots.push_back(effect->component);
    if (std::find(slots.begin(), slots.end(), slot) == slots.end()) {
      throw UserError("unknown slot '" + slot + "'", "--slot", "there is no such slot",
                      suggestion(slot, slots, "`vrpipe units` lists all"));
    }
    const auto is_other = [&](const ParameterListing& unit) { return unit.unit != slot; };
    units.erase(std::remove_if(units.begin(), units.end(), is_other), units.end());
    effects = effects_of(slot);
  }

  Values slot_, platform_, plugins_, json_;
  bool markdown_ = false;
  bool effects_only_ = false;
};

}  // namespace

std::unique_ptr<Command> make_units_command() { return std::make_unique<UnitsCommand>(); }

}  // namespace vrpipe::tools
