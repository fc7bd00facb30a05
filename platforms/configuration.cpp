#include <vrpipe/platforms/configuration.h>

#include <algorithm>

#include <vrpipe/error.h>

namespace vrpipe {

const Implementation& default_implementation(const std::string& slot, const Variant& variant) {
  const bool absent = !variant.quad_merging && (slot == "tgc" || slot == "qru");
  static const std::map<std::string, std::string> real{{"draw", "vertex-issue"},        {"vpo", "primitive-assembly"},
                                                       {"tgc", "tile-grid-coalescing"}, {"raster", "tile-rasterizer"},
                                                       {"tc", "tile-coalescing"},       {"prop", "pre-rop"},
                                                       {"zrop", "depth-stencil-rop"},   {"qru", "pairing"},
                                                       {"sm", "splat-shader"},          {"crop", "color-rop"}};
  return Registry::instance().find(slot, absent ? "pass-through" : real.at(slot));
}

Configuration::Configuration(const RunRequest& request, const Draw& draw) : request_(request) {
  // Of the program itself; a plugin's are reported when it is loaded.
  const std::vector<Registry::Problem> problems = Registry::instance().take_problems();
  if (!problems.empty()) {
    throw UserError("cannot use all units of this program", "registry", problems.front().why, problems.front().remedy);
  }
  Variant with_all = request.variant;
  with_all.quad_merging = true;
  for (const std::string& name : Registry::slots()) {
    Slot& slot = slots_[name];
    slot.chosen = &default_implementation(name, request.variant);
    slot.real = &default_implementation(name, with_all);
  }
  for (const UnitChoice& choice : request.units) {
    const Implementation& implementation = Registry::instance().find(choice.slot, choice.implementation);
    Slot& slot = slots_[choice.slot];
    if (!slot.chosen->pass_through) slot.chosen = &implementation;
    slot.real = &implementation;
  }
  for (auto& [name, slot] : slots_) {
    slot.real_parameters = slot.real->make_parameters();
    slot.chosen_parameters = slot.chosen->make_parameters();
  }
  for (const Setting& setting : request.platform->settings) {
    if (concerns_chosen_unit(setting)) apply(setting);
  }
  for (const Setting& setting : request.settings) apply(setting);

  states_.resize(request.platform->gpcs);
  for (unsigned gpc = 0; gpc < states_.size(); ++gpc) {
    RenderState& state = states_[gpc];
    state.draw = &draw;
    state.format = request.format;
    state.blend_rounding = static_cast<BlendRounding>(static_cast<unsigned>(state_parameters_.blend_rounding));
    state.termination = request.termination;
    state.early_termination = request.variant.early_termination;
    state.termination_threshold = static_cast<float>(static_cast<double>(state_parameters_.termination_threshold));
    state.termination_inclusive = state_parameters_.termination_compare == 0U;
    state.pruning_threshold = static_cast<float>(static_cast<double>(state_parameters_.pruning_threshold));
    state.exponential = static_cast<Exponential>(static_cast<unsigned>(state_parameters_.exponential));
    state.splat_extent = static_cast<SplatExtent>(static_cast<unsigned>(state_parameters_.splat_extent));
    state.subpixel_bits = state_parameters_.subpixel_bits;
    state.obb_padding = static_cast<float>(static_cast<double>(state_parameters_.obb_padding));
    state.gpcs = static_cast<unsigned>(states_.size());
    state.gpc = gpc;
  }
}

/// A platform's settings are for the units that it was made with: another one in a slot takes those that it declares.
bool Configuration::concerns_chosen_unit(const Setting& setting) const {
  const auto slot = slots_.find(setting.unit);
  if (slot == slots_.end()) return true;
  const auto declared_by = [&](const ParameterSet& set) {
    return std::any_of(set.parameters().begin(), set.parameters().end(),
                       [&](const Parameter* parameter) { return setting.parameter == parameter->name(); });
  };
  if (declared_by(*slot->second.real_parameters)) return true;
  Variant with_all = request_.variant;
  with_all.quad_merging = true;
  // What no unit declares is a mistake of the platform's.
  return !declared_by(*default_implementation(setting.unit, with_all).make_parameters());
}

void Configuration::apply(const Setting& setting) {
  if (setting.unit == "state") return state_parameters_.set(setting.unit, setting.parameter, setting.value);
  if (setting.unit == "l2") return l2_.set(setting.unit, setting.parameter, setting.value);
  const auto slot = slots_.find(setting.unit);
  if (slot == slots_.end()) {
    std::vector<std::string> known = Registry::slots();
    known.insert(known.end(), {"state", "l2"});
    throw UserError("unknown unit '" + setting.unit + "'", "--set " + setting.unit + "." + setting.parameter,
                    "no such unit", "did you mean " + nearest_name(setting.unit, known) + "? `vrpipe units` lists all");
  }
  // A setting is for the unit proper; the pass-through of a variant without it has nothing to set.
  slot->second.real_parameters->set(setting.unit, setting.parameter, setting.value);
  if (slot->second.chosen == slot->second.real) {
    slot->second.chosen_parameters->set(setting.unit, setting.parameter, setting.value);
  }
}

std::unique_ptr<Behaviour> Configuration::make(const std::string& slot, unsigned gpc) const {
  const Slot& chosen = slots_.at(slot);
  return chosen.chosen->make_behaviour(*chosen.chosen_parameters, states_[gpc]);
}

std::vector<std::pair<std::string, std::string>> Configuration::parameters() const {
  std::vector<std::pair<std::string, std::string>> all;
  const auto add = [&](const std::string& unit, const ParameterSet& set) {
    for (const Parameter* parameter : set.parameters())
      all.emplace_back(unit + "." + parameter->name(), parameter->value());
  };
  for (const std::string& name : Registry::slots()) add(name, *slots_.at(name).real_parameters);
  add("l2", l2_);
  add("state", state_parameters_);
  return all;
}

}  // namespace vrpipe
