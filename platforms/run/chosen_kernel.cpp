#include "run/chosen_kernel.h"

#include <algorithm>

namespace vrpipe {

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
  std::string name = registry.slot(slot).implementation;
  for (const auto* units : {&request.variant.units, &request.units, &request.variant.changed_units}) {
    for (const UnitChoice& choice : *units) {
      if (choice.slot == slot) name = choice.implementation;
    }
  }
  kernel.implementation = &registry.find(slot, name);
  kernel.parameters = kernel.implementation->make_parameters();
  for (const auto* settings : {&request.variant.settings, &request.settings, &request.variant.changed_settings}) {
    for (const Setting& setting : *settings) {
      if (setting.unit == slot) kernel.parameters->set(slot, setting.parameter, setting.value);
    }
  }
  return kernel;
}

void check_is_of_splats(const Frame& frame, const char* what) {
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    throw UserError(what, "the frame", why, remedy);
  };
  if (frame.commands().size() != 1 || frame.draws().size() != 1) refuse("it is not one draw", "draw one scene");
  const Draw& draw = *frame.draws().front().geometry;
  if (draw.is_mesh() || !draw.triangles.empty()) refuse("it draws triangles", "draw splats");
}

}  // namespace vrpipe
