#include "run/chosen_kernel.h"

#include <algorithm>

namespace vrpipe {

namespace {
bool has_parameter(const ParameterSet& set, const std::string& name) {
  const std::vector<Parameter*>& all = set.parameters();
  return std::any_of(all.begin(), all.end(), [&](const Parameter* each) { return name == each->name(); });
}
}  // namespace

void ChosenKernel::add_parameters_to(std::vector<std::pair<std::string, std::string>>& all) const {
  for (const Parameter* parameter : parameters->parameters()) {
    all.emplace_back(implementation->slot + "." + parameter->name(), parameter->value());
  }
}

bool ChosenKernel::is_as_shipped() const {
  const std::vector<Parameter*>& all = parameters->parameters();
  return implementation->name == Registry::instance().slot(implementation->slot).implementation &&
         std::all_of(all.begin(), all.end(),
                     [](const Parameter* each) { return each->value() == each->default_value(); });
}

ChosenKernel choose_kernel(const std::string& slot, const RunRequest& request) {
  const Registry& registry = Registry::instance();
  ChosenKernel kernel;
  std::string common = registry.slot(slot).implementation, name = common;
  for (const auto* units : {&request.variant.units, &request.units, &request.variant.changed_units}) {
    if (units == &request.variant.changed_units) common = name;
    for (const UnitChoice& choice : *units) {
      if (choice.slot == slot) name = choice.implementation;
    }
  }
  kernel.implementation = &registry.find(slot, name);
  kernel.parameters = kernel.implementation->make_parameters();
  const std::unique_ptr<ParameterSet> of_common = registry.find(slot, common).make_parameters();
  for (const auto* settings : {&request.variant.settings, &request.settings, &request.variant.changed_settings}) {
    for (const Setting& setting : *settings) {
      if (setting.unit != slot) continue;
      // One of all runs is for the unit that a variant may have put another in the place of.
      const bool is_of_other = name != common && settings == &request.settings &&
                               !has_parameter(*kernel.parameters, setting.parameter) &&
                               has_parameter(*of_common, setting.parameter);
      if (!is_of_other) kernel.parameters->set(slot, setting.parameter, setting.value);
    }
  }
  return kernel;
}

void check_is_of_splats(const Frame& frame, const char* what) {
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    throw UserError(what, "the frame", why, remedy);
  };
  if (frame.commands().size() != 1 || frame.draws().size() != 1) refuse("it is not one draw", "draw one scene");
  const DrawCall& call = frame.draws().front();
  if (call.geometry->is_mesh() || !call.geometry->triangles.empty()) refuse("it draws triangles", "draw splats");
  const DrawState& state = call.state;
  const bool is_plain = state.blend && state.shader == FragmentShader::splat && !state.tests_depth_stencil() &&
                        !state.writes_depth_stencil();
  if (!is_plain) refuse("its draw has a state that nothing but the graphics pipeline has", "draw a plain scene");
}

}  // namespace vrpipe
