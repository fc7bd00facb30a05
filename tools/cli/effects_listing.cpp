#include "cli/effects_listing.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/printable.h>
#include <vrpipe/pipeline/registry.h>

#include "cli/listing.h"

namespace vrpipe::tools {
namespace {

template <class Belongs>
EffectList effects_that(const Belongs& belongs) {
  EffectList some;
  for (const Effect& effect : effects()) {
    if (belongs(effect)) some.push_back(&effect);
  }
  return some;
}

/// Never omitted: the declaration says why in the place of when.
bool is_decided(const Effect& effect) { return effect.decide != nullptr; }

std::string row(const std::vector<std::string>& cells) {
  std::string text = "|";
  for (const std::string& cell : cells) text += " " + markdown_escaped(cell) + " |";
  return text + "\n";
}

/// The effect's name, and the implementation that it is of where it is not of all.
std::string name_cell(const Effect& effect) {
  const std::string name = "`" + effect.full_name() + "`";
  return effect.implementation.empty() ? name : name + " of " + effect.implementation;
}

}  // namespace

EffectList all_effects() {
  EffectList all = effects_that([](const Effect&) { return true; });
  const auto rank = [](const Effect* effect) {
    const Registry& registry = Registry::instance();
    const bool is_slot = registry.has_slot(effect->component);
    return is_slot ? registry.slot(effect->component).rank : std::numeric_limits<unsigned>::max();
  };
  std::stable_sort(all.begin(), all.end(), [&](const Effect* a, const Effect* b) { return rank(a) < rank(b); });
  return all;
}

EffectList effects_of(const std::string& component) {
  return effects_that([&](const Effect& effect) { return effect.component == component; });
}

std::string effects_as_text(const EffectList& effects, const TextStyle& style) {
  std::string text;
  for (const Effect* effect : effects) {
    text += "  effect " + style.bold(printable(effect->full_name()));
    if (!effect->implementation.empty()) text += " of " + printable(effect->implementation);
    text += fmt::format(", {}: {}\n", name_of(effect->kind), printable(effect->models));
    text += fmt::format("      {}: {}\n", is_decided(*effect) ? "omitted when" : "always active",
                        printable(effect->omitted_when));
    text += fmt::format("      elaborates {}\n", printable(effect->elaborates));
    if (is_decided(*effect)) text += fmt::format("      tripwire: {}\n", printable(effect->tripwire));
  }
  return text;
}

std::string effects_as_markdown(const EffectList& effects) {
  if (effects.empty()) return {};
  std::string text = "| effect | kind | models | omitted when | elaborates | tripwire |\n|---|---|---|---|---|---|\n";
  for (const Effect* effect : effects) {
    const std::string when = (is_decided(*effect) ? "" : "never: ") + effect->omitted_when;
    text +=
        row({name_cell(*effect), name_of(effect->kind), effect->models, when, effect->elaborates, effect->tripwire});
  }
  return text;
}

std::string all_effects_as_markdown() {
  EffectList decided;
  std::string others;
  for (const Effect* effect : all_effects()) {
    if (is_decided(*effect)) {
      decided.push_back(effect);
    } else {
      others += row({name_cell(*effect), name_of(effect->kind), effect->models, effect->omitted_when});
    }
  }
  std::string text = effects_as_markdown(decided);
  if (!others.empty()) {
    text +=
        "\n## Not decided, and why\n\n| effect | kind | models | why it stays active |\n|---|---|---|---|\n" + others;
  }
  return text;
}

Json effects_as_json(const EffectList& effects) {
  Json list = Json::array();
  for (const Effect* effect : effects) {
    list.push_back({{"name", effect->full_name()},
                    {"component", effect->component},
                    {"implementation", effect->implementation.empty() ? Json() : Json(effect->implementation)},
                    {"kind", name_of(effect->kind)},
                    {"models", effect->models},
                    {"decided", is_decided(*effect)},
                    {is_decided(*effect) ? "omitted_when" : "always_active_because", effect->omitted_when},
                    {"elaborates", effect->elaborates},
                    {"tripwire", effect->tripwire}});
  }
  return list;
}

}  // namespace vrpipe::tools
