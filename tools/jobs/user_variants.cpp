#include "jobs/user_variants.h"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/component/names.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/netlist.h>

namespace vrpipe::tools {
namespace {

constexpr const char* variant_option = "--variant";
constexpr const char* form = "NAME=BASE[,SLOT=IMPLEMENTATION][,UNIT.PARAMETER=VALUE]...";
constexpr const char* example = "give e.g. --variant mine=het+qm,tgc=pass-through,tc.bins=64";

/// Splits at the first `=`; both sides must be there.
std::pair<std::string, std::string> pair_of(const std::string& part, const std::string& text) {
  const std::size_t equals = part.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == part.size()) {
    throw UserError("bad value '" + text + "'", variant_option, fmt::format("'{}' is not as in {}", part, form),
                    example);
  }
  return {part.substr(0, equals), part.substr(equals + 1)};
}

}  // namespace

VariantDefinition parse_variant(const std::string& text) {
  VariantDefinition definition;
  std::size_t start = 0;
  while (true) {
    const std::size_t comma = std::min(text.find(',', start), text.size());
    auto part = pair_of(text.substr(start, comma - start), text);
    if (start == 0) {
      std::tie(definition.name, definition.base) = std::move(part);
    } else {
      definition.changes.push_back(std::move(part));
    }
    if (comma == text.size()) return definition;
    start = comma + 1;
  }
}

std::string text_of(const VariantDefinition& definition) {
  std::string text = definition.name + "=" + definition.base;
  for (const auto& [key, value] : definition.changes) text += "," + key + "=" + value;
  return text;
}

const Variant& add_user_variant(const VariantDefinition& definition) {
  const std::string where = std::string(variant_option) + " " + definition.name;
  if (!is_good_name(definition.name)) {
    throw UserError("bad name '" + definition.name + "' of a variant", variant_option,
                    fmt::format("it is not {}", good_name_rule), example);
  }
  std::vector<Variant> known = variants();
  known.insert(known.end(), more_variants().begin(), more_variants().end());
  if (std::any_of(known.begin(), known.end(), [&](const Variant& each) { return each.name == definition.name; })) {
    throw UserError("cannot define variant '" + definition.name + "'", where, "there is one of that name",
                    "choose another name");
  }
  if (std::none_of(known.begin(), known.end(), [&](const Variant& each) { return each.name == definition.base; })) {
    std::vector<std::string> names;
    for (const Variant& each : known) names.push_back(each.name);
    throw UserError("unknown variant '" + definition.base + "'", where, "it is to be the base, and there is none",
                    suggestion(definition.base, names));
  }
  Variant variant = variant_named(definition.base);
  variant.name = definition.name;
  variant.base = definition.base;
  std::vector<std::string> seen;
  for (const auto& change : definition.changes) {
    // Not as a structured binding, which lambdas of C++17 do not capture.
    const std::string& key = change.first;
    const std::string& value = change.second;
    if (std::find(seen.begin(), seen.end(), key) != seen.end()) {
      throw UserError("'" + key + "' given twice", where, "a variant has one value of it", "leave out one");
    }
    seen.push_back(key);
    // In the place of the same change of the base.
    auto& units = variant.changed_units;
    units.erase(std::remove_if(units.begin(), units.end(), [&](const UnitChoice& unit) { return unit.slot == key; }),
                units.end());
    if (Registry::instance().has_slot(without_gpc(key))) {
      units.push_back({key, value});
      continue;
    }
    const std::size_t dot = key.rfind('.');
    if (dot == std::string::npos || dot == 0 || dot + 1 == key.size()) {
      const std::vector<std::string> slots = Registry::instance().slot_names();
      throw UserError("unknown slot '" + key + "'", where, "it is no slot, and no UNIT.PARAMETER",
                      suggestion(key, slots, "`vrpipe units` lists all"));
    }
    if (key.compare(0, dot, "preprocess") == 0) {
      throw UserError("cannot change '" + key + "'", where, "the scene is preprocessed once, for all variants",
                      "set it for all with --set " + key + "=" + value);
    }
    auto& settings = variant.changed_settings;
    const auto is_same = [&](const Setting& setting) { return setting.unit + "." + setting.parameter == key; };
    settings.erase(std::remove_if(settings.begin(), settings.end(), is_same), settings.end());
    settings.push_back({key.substr(0, dot), key.substr(dot + 1), value});
  }
  add_variant(std::move(variant));
  return variant_named(definition.name);
}

void add_user_variants(std::vector<VariantDefinition> definitions) {
  const auto based_on = [&](const VariantDefinition& definition) {
    for (const std::vector<Variant>* const list : {&variants(), &more_variants()}) {
      for (const Variant& known : *list) {
        if (known.name == definition.base) return definitions.end();
      }
    }
    return std::find_if(definitions.begin(), definitions.end(),
                        [&](const VariantDefinition& other) { return other.name == definition.base; });
  };
  while (!definitions.empty()) {
    auto next = definitions.begin();
    std::vector<std::string> chain{next->name};
    for (auto base = based_on(*next); base != definitions.end(); base = based_on(*next)) {
      const bool is_circle = std::find(chain.begin(), chain.end(), base->name) != chain.end();
      chain.push_back(base->name);
      if (is_circle) {
        throw UserError("cannot define variant '" + next->name + "'", std::string(variant_option) + " " + next->name,
                        fmt::format("it is based on itself: {}", fmt::join(chain, " on ")),
                        "base one of them on what there is, e.g. het+qm");
      }
      next = base;
    }
    const VariantDefinition definition = *next;
    definitions.erase(next);
    add_user_variant(definition);
  }
}

const UnitChoice* own_unit(const Variant& variant, const UnitChoice& choice) {
  for (const UnitChoice& own : variant.changed_units) {
    const bool is_there = own.slot == choice.slot || own.slot == without_gpc(choice.slot);
    if (is_there && own.implementation != choice.implementation) return &own;
  }
  return nullptr;
}

std::string changes_text(const Variant& variant) {
  std::string text;
  const auto add = [&](const std::string& change) { text += (text.empty() ? "" : ", ") + change; };
  for (const UnitChoice& unit : variant.changed_units) add(unit.slot + "=" + unit.implementation);
  for (const Setting& setting : variant.changed_settings) {
    add(setting.unit + "." + setting.parameter + "=" + setting.value);
  }
  return text;
}

}  // namespace vrpipe::tools
