#include <vrpipe/platforms/configuration.h>

#include <algorithm>
#include <cmath>

#include <vrpipe/component/error.h>
#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/checked_behaviours.h>
#include <vrpipe/pipeline/slots/wdx.h>
#include <vrpipe/platforms/observers.h>

namespace vrpipe {

namespace {

const std::string link_prefix = "link.";

bool declares(const ParameterSet& set, const std::string& parameter) {
  const std::vector<Parameter*>& all = set.parameters();
  return std::any_of(all.begin(), all.end(), [&](const Parameter* each) { return parameter == each->name(); });
}

}  // namespace

const Implementation& default_implementation(const Slot& slot, const Variant& variant) {
  const bool absent = !variant.quad_merging && !slot.stand_in.empty();
  return Registry::instance().find(slot.name, absent ? slot.stand_in : slot.implementation);
}

namespace {

DrawState draw_state_from(const StateParameters& parameters) {
  DrawState state;
  state.early_termination = true;
  state.termination_threshold = static_cast<float>(static_cast<double>(parameters.termination_threshold));
  state.termination_inclusive = parameters.termination_compare == 0U;
  state.pruning_threshold = static_cast<float>(static_cast<double>(parameters.pruning_threshold));
  state.splat_extent = static_cast<SplatExtent>(static_cast<unsigned>(parameters.splat_extent));
  state.obb_padding = static_cast<float>(static_cast<double>(parameters.obb_padding));
  return state;
}

DevicePrecision device_precision_from(const StateParameters& parameters) {
  DevicePrecision precision;
  precision.blend_rounding = static_cast<BlendRounding>(static_cast<unsigned>(parameters.blend_rounding));
  precision.exponential = static_cast<Exponential>(static_cast<unsigned>(parameters.exponential));
  precision.shading = static_cast<NumberFormat>(static_cast<unsigned>(parameters.shading));
  precision.merging = static_cast<NumberFormat>(static_cast<unsigned>(parameters.merging));
  precision.export_format = static_cast<NumberFormat>(static_cast<unsigned>(parameters.export_format));
  precision.attributes = static_cast<AttributeFormat>(static_cast<unsigned>(parameters.attributes));
  precision.alpha_max = static_cast<float>(static_cast<double>(parameters.alpha_max));
  precision.subpixel_bits = parameters.subpixel_bits;
  return precision;
}

}  // namespace

namespace {
/// What is said of `unit` by all who may, the last of them counting.
void set_all(const char* unit, ParameterSet& parameters, const RunRequest& request,
             const std::vector<Setting>& own = {}) {
  for (const auto* settings : {&request.platform->settings, &request.variant.settings, &request.settings,
                               &request.variant.changed_settings, &own}) {
    for (const Setting& setting : *settings) {
      if (setting.unit == unit) parameters.set(setting.unit, setting.parameter, setting.value);
    }
  }
}
}  // namespace

PlatformParameters::PlatformParameters(const Platform& platform)
    : gpcs(*this, "gpcs", platform.gpcs, 1, most_gpcs, "GPCs", "the platform's",
           "graphics processing clusters, which share screen tiles, L2 and DRAM") {}

unsigned gpcs_of(const RunRequest& request) {
  PlatformParameters parameters(*request.platform);
  set_all("platform", parameters, request);
  return parameters.gpcs;
}

DrawState draw_state_of(const RunRequest& request, const std::vector<Setting>& own) {
  StateParameters parameters;
  set_all("state", parameters, request, own);
  return draw_state_from(parameters);
}

DepthFormat depth_format_of(const RunRequest& request) {
  StateParameters parameters;
  set_all("state", parameters, request);
  return static_cast<DepthFormat>(static_cast<unsigned>(parameters.depth_format));
}

DevicePrecision device_precision_of(const RunRequest& request) {
  StateParameters parameters;
  set_all("state", parameters, request);
  return device_precision_from(parameters);
}

Configuration::Configuration(const RunRequest& request, const Frame& frame) : Configuration(request, frame, nullptr) {}

Configuration::Configuration(const RunRequest& request, const Frame& part, const Configuration& whole)
    : Configuration(request, part, whole.facts_) {}

Configuration::Configuration(const RunRequest& request, const Frame& frame, std::shared_ptr<const FrameFacts> facts)
    : request_(request), netlist_(gpcs_of(request)), elaborated_(netlist_.gpcs()), facts_(std::move(facts)) {
  // Of the program itself; a plugin's are reported when it is loaded.
  const std::vector<Registry::Problem> problems = Registry::instance().take_problems();
  if (!problems.empty()) {
    throw UserError("cannot use all units of this program", "registry", problems.front().why, problems.front().remedy);
  }
  wire();
  choose_implementations();
  check_units_at_cycle();
  for (const Setting& setting : request.platform->settings) {
    if (concerns_chosen_unit(setting)) apply(setting);
  }
  for (const Setting& setting : request.variant.settings) apply(setting);
  // Those of all runs are for the units that a variant may have put others in the place of.
  for (const Setting& setting : request.settings) {
    if (request.variant.changed_units.empty() || concerns_chosen_unit(setting)) apply(setting);
  }
  for (const Setting& setting : request.variant.changed_settings) apply(setting);
  if (request.observers != nullptr) request.observers->check(netlist_);

  auto drawn = std::make_shared<Frame>(frame);
  drawn->change_states([&](DrawState& state) {
    state.early_termination = state.early_termination && request.variant.early_termination;
  });
  RenderContext context;
  context.frame = std::move(drawn);
  context.format = request.format;
  context.termination = request.termination;
  context.precision = device_precision_from(state_parameters_);
  context.clock_ps =
      std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(1e6 / request.platform->frequency_mhz)));
  if (request.observers != nullptr) context.fragments = request.observers->of_fragments();
  context.placement.gpcs = netlist_.gpcs();
  context.placement.owners = owners_of_tiles(context);
  for (unsigned& gpc = context.placement.gpc; gpc < netlist_.gpcs(); ++gpc) {
    context.hands_on_coverage = all_know_coverage("sm", gpc) && all_know_coverage("crop", gpc);
    contexts_.push_back(context);
  }
  if (facts_ == nullptr) facts_ = std::make_shared<FrameFacts>(contexts_.front());
  decide_effects();
  check_left_out();
}

/// The units of a slot in a GPC, of which there is one.
bool Configuration::all_know_coverage(const std::string& slot, unsigned gpc) const {
  bool is_there = false;
  for (const Instance* const instance : instances_of(slot)) {
    if (instance->gpc != gpc) continue;
    if (!units_.at(instance->path).chosen->knows_coverage) return false;
    is_there = true;
  }
  return is_there;
}

/// Null where one GPC has all. The map is asked once: units look into a table.
std::shared_ptr<const TileOwners> Configuration::owners_of_tiles(const RenderContext& context) const {
  if (netlist_.gpcs() == 1) return nullptr;
  const std::vector<const Instance*> crossbars = instances_of("wdx");
  if (crossbars.size() != 1) {
    throw UserError("incomplete platform " + request_.platform->name, "its wiring",
                    "it has " + std::to_string(netlist_.gpcs()) + " GPCs and " + std::to_string(crossbars.size()) +
                        " crossbars, which say whose the screen tiles are",
                    "add one unit `wdx`, as wire_pipeline does");
  }
  const UnitChoices& unit = units_.at(crossbars.front()->path);
  const auto map = behaviour_as<WdxBehaviour>(unit.real->make_behaviour(*unit.real_parameters, context));
  return std::make_shared<TileOwners>(context.frame->width(), context.frame->height(),
                                      [&](TileId tile) { return map->owner_of(tile); });
}

std::function<unsigned(TileId)> tile_map_of(const RunRequest& request) {
  const Configuration configuration(request, Frame(1, 1));
  for (const Instance& instance : configuration.netlist().instances()) {
    if (instance.slot != "wdx") continue;
    std::shared_ptr<const WdxBehaviour> map = configuration.make_as<WdxBehaviour>(instance);
    return [map](TileId tile) { return map->owner_of(tile); };
  }
  return [](TileId) { return 0U; };
}

/// Parameters that cannot be are refused whatever the frame calls for: the units that are left out, or pass through in this
/// variant, are made once.
void Configuration::check_left_out() const {
  for (const Instance& instance : netlist_.instances()) {
    const UnitChoices& unit = units_.at(instance.path);
    if (elaborated_.find(instance.path) != nullptr && unit.chosen == unit.real) continue;
    unit.real->make_behaviour(*unit.real_parameters, contexts_[instance.gpc]);
  }
}

void Configuration::wire() {
  const Platform& platform = *request_.platform;
  call_with_fault([&] { platform.wire(netlist_); },
                  [&](const char* text) {
                    throw SimulationFault("platform " + platform.name, 0,
                                          std::string("its wiring throws ") +
                                              (text != nullptr ? text : "an exception of unknown type"));
                  });
  if (netlist_.instances().empty()) {
    throw UserError("incomplete platform " + platform.name, "its wiring", "it adds no unit",
                    "add units, as platforms/catalogue/agx_orin.cpp does");
  }
}

void Configuration::choose_implementations() {
  const Registry& registry = Registry::instance();
  Variant with_all = request_.variant;
  with_all.quad_merging = true;
  for (const Instance& instance : netlist_.instances()) {
    const Slot& slot = registry.slot(instance.slot);
    UnitChoices& unit = units_[instance.path];
    unit.chosen = &default_implementation(slot, request_.variant);
    unit.real = &default_implementation(slot, with_all);
    if (instance.implementation.empty()) continue;
    unit.real = &registry.find(slot.name, instance.implementation);
    if (!unit.chosen->pass_through) unit.chosen = unit.real;
  }
  std::vector<UnitChoice> choices = request_.variant.units;
  for (const auto* units : {&request_.units, &request_.variant.changed_units}) {
    choices.insert(choices.end(), units->begin(), units->end());
  }
  for (const std::string& slot : netlist_.absent()) {
    absent_[slot] = &default_implementation(registry.slot(slot), request_.variant);
  }
  for (const UnitChoice& choice : choices) {
    const auto absent = absent_.find(choice.slot);
    if (absent != absent_.end()) {
      absent->second = &registry.find(choice.slot, choice.implementation);
      continue;
    }
    const std::vector<const Instance*> named = instances_named(choice.slot);
    const std::string& slot = named.empty() ? choice.slot : named.front()->slot;
    const Implementation& implementation = registry.find(slot, choice.implementation);
    if (named.empty()) {
      throw UserError("cannot choose a unit for '" + choice.slot + "'", "--unit",
                      "platform " + request_.platform->name + " has none", "take another platform");
    }
    for (const Instance* instance : named) {
      UnitChoices& unit = units_[instance->path];
      if (!unit.chosen->pass_through) unit.chosen = &implementation;
      unit.real = &implementation;
    }
  }
  for (auto& [path, unit] : units_) {
    unit.real_parameters = unit.real->make_parameters();
    unit.chosen_parameters = unit.chosen->make_parameters();
  }
}

namespace {
/// By its slot or its path.
bool is_named(const std::string& name, const Instance& instance) {
  return name == instance.slot || names_path(name, instance.path);
}

/// What settings and options may name: slots and paths.
std::vector<std::string> names_of_instances(const Netlist& netlist, bool with_memories) {
  std::vector<std::string> names;
  for (const Instance& instance : netlist.instances()) {
    if (!with_memories && Netlist::is_memory(instance)) continue;
    names.push_back(instance.slot);
    names.push_back(instance.path);
  }
  return names;
}

bool is_before_crossbar(const std::string& slot) { return slot == "draw" || slot == "sm" || slot == "vpo"; }
}  // namespace

void Configuration::check_units_at_cycle() const {
  if (request_.fidelity != Fidelity::lt) return;
  for (const std::string& name : request_.units_at_cycle) {
    const std::string where = "--fidelity lt," + name + "=cycle";
    const std::vector<const Instance*> named = instances_named(name);
    if (!named.empty() && netlist_.gpcs() > 1 && is_before_crossbar(named.front()->slot)) {
      throw UserError(
          "cannot simulate " + name + " at a fidelity of its own", where,
          fmt::format("the primitives of {} GPCs meet behind it in draw order, which at lt is that of the calls",
                      netlist_.gpcs()),
          "take --fidelity cycle, or one GPC: --set platform.gpcs=1");
    }
    if (!named.empty() && !netlist_.foreign_memories().empty()) {
      throw UserError("cannot simulate " + name + " at a fidelity of its own", where,
                      "it would be ahead of the time that the platform's memory has of its own",
                      "take one fidelity for all units");
    }
    if (!named.empty() && !Netlist::is_memory(*named.front())) continue;
    const std::vector<std::string> known = names_of_instances(netlist_, false);
    if (!named.empty()) {
      throw UserError("cannot simulate " + name + " at a fidelity of its own", where, "a memory's is that of the run",
                      "take --fidelity cycle, or a unit: " + known.front());
    }
    throw UserError("unknown unit '" + name + "'", where, "platform " + request_.platform->name + " has none",
                    suggestion(name, known, "`vrpipe units` lists all"));
  }
}

bool Configuration::is_at_cycle(const Instance& instance) const {
  const std::vector<std::string>& names = request_.units_at_cycle;
  if (request_.fidelity != Fidelity::lt) return request_.fidelity == Fidelity::cycle;
  if (!has_timed_unit_maker(instance.slot)) return true;
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) { return is_named(name, instance); });
}

std::vector<const Instance*> Configuration::instances_named(const std::string& name) const {
  std::vector<const Instance*> found;
  for (const Instance& instance : netlist_.instances()) {
    if (is_named(name, instance)) found.push_back(&instance);
  }
  return found;
}

std::vector<const Instance*> Configuration::instances_of(const std::string& slot) const {
  std::vector<const Instance*> found;
  for (const Instance& instance : netlist_.instances()) {
    if (instance.slot == slot) found.push_back(&instance);
  }
  return found;
}

/// A platform's settings are for the units that it was made with: another one in a slot takes those that it declares.
bool Configuration::concerns_chosen_unit(const Setting& setting) const {
  const std::vector<const Instance*> named = instances_named(setting.unit);
  if (named.empty()) return !netlist_.has_foreign(setting.unit);
  Variant with_all = request_.variant;
  with_all.quad_merging = true;
  for (const Instance* instance : named) {
    if (declares(*units_.at(instance->path).real_parameters, setting.parameter)) return true;
  }
  // What no unit declares is a mistake of the platform's.
  const Slot& slot = Registry::instance().slot(named.front()->slot);
  return !declares(*default_implementation(slot, with_all).make_parameters(), setting.parameter);
}

void Configuration::apply(const Setting& setting) {
  if (setting.unit == "state") return state_parameters_.set(setting.unit, setting.parameter, setting.value);
  if (setting.unit == "platform" || set_absent(setting)) return;  // gpcs_of has seen to the first
  if (setting.unit.compare(0, link_prefix.size(), link_prefix) == 0) return set_link(setting);
  const std::vector<const Instance*> named = instances_named(setting.unit);
  if (named.empty()) {
    std::vector<std::string> known = names_of_instances(netlist_, true);
    known.insert(known.begin(), {"state", "platform"});
    const bool elsewhere = Registry::instance().has_slot(setting.unit);
    throw UserError("unknown unit '" + setting.unit + "'", "--set " + setting.unit + "." + setting.parameter,
                    elsewhere ? "platform " + request_.platform->name + " has none" : "no such unit",
                    suggestion(setting.unit, known, "`vrpipe units` lists all"));
  }
  for (const Instance* instance : named) {
    UnitChoices& unit = units_[instance->path];
    // A setting is for the unit proper; the pass-through of a variant without it has nothing to set.
    unit.real_parameters->set(setting.unit, setting.parameter, setting.value);
    if (unit.chosen == unit.real) unit.chosen_parameters->set(setting.unit, setting.parameter, setting.value);
  }
}

/// Whether the setting is for a slot that the platform does without; then it is checked.
bool Configuration::set_absent(const Setting& setting) {
  const auto absent = absent_.find(setting.unit);
  if (absent == absent_.end()) return false;
  absent->second->make_parameters()->set(setting.unit, setting.parameter, setting.value);
  return true;
}

void Configuration::set_link(const Setting& setting) {
  const std::string name = setting.unit.substr(link_prefix.size());
  bool found = false;
  std::vector<std::string> known;
  for (const Link& link : netlist_.links()) {
    known.push_back(link.name());
    known.push_back(without_gpc(link.name()));
    if (!names_path(name, link.name())) continue;
    link.parameters->set(setting.unit, setting.parameter, setting.value);
    found = true;
  }
  if (found) return;
  throw UserError("unknown link '" + name + "'", "--set " + setting.unit + "." + setting.parameter, "no such link",
                  known.empty() ? "the platform has none"
                                : suggestion(name, known, "`vrpipe units` lists all", link_prefix));
}

std::unique_ptr<Behaviour> Configuration::make(const Instance& instance) const {
  const UnitChoices& unit = units_.at(instance.path);
  std::unique_ptr<Behaviour> behaviour = unit.chosen->make_behaviour(*unit.chosen_parameters, contexts_[instance.gpc]);
  behaviour->unit().set_draws(frame().draws().size());
  return behaviour;
}

std::vector<std::pair<std::string, std::string>> Configuration::parameters() const {
  std::vector<std::pair<std::string, std::string>> all;
  std::map<std::string, std::string> first;  // by the name that stands for all
  const auto add = [&](const std::string& shared, const std::string& path, const ParameterSet& set) {
    for (const Parameter* parameter : set.parameters()) {
      const std::string name = shared + "." + parameter->name();
      const std::string value = parameter->value();
      const auto place = first.emplace(name, value);
      if (place.second) {
        all.emplace_back(name, value);
      } else if (place.first->second != value) {
        all.emplace_back(path + "." + parameter->name(), value);
      }
    }
  };
  for (const Slot& slot : Registry::instance().slots()) {
    for (const Instance* instance : instances_of(slot.name)) {
      add(slot.name, instance->path, *units_.at(instance->path).real_parameters);
    }
  }
  for (const Link& link : netlist_.links()) {
    add(link_prefix + without_gpc(link.name()), link_prefix + link.name(), *link.parameters);
  }
  PlatformParameters platform(*request_.platform);
  platform.gpcs = netlist_.gpcs();
  add("platform", "platform", platform);
  add("state", "state", state_parameters_);
  return all;
}

std::vector<std::pair<std::string, std::string>> Configuration::implementations() const {
  std::vector<std::pair<std::string, std::string>> all;
  for (const Slot& slot : Registry::instance().slots()) {
    const std::vector<const Instance*> instances = instances_of(slot.name);
    for (const Instance* instance : instances) {
      const std::string& name = implementation(*instance).name;
      if (instance == instances.front()) {
        all.emplace_back(slot.name, name);
      } else if (name != implementation(*instances.front()).name) {
        all.emplace_back(instance->path, name);
      }
    }
  }
  return all;
}

}  // namespace vrpipe
