#include "elaboration/hierarchy.h"

#include <algorithm>
#include <utility>

namespace vrpipe {

namespace {

class InstanceGroup : public sc_core::sc_module {
 public:
  explicit InstanceGroup(const sc_core::sc_module_name& name) : sc_module(name) {}
};

}  // namespace

ModuleScope::ModuleScope(sc_core::sc_module* module)
    : pushed_to_(module == nullptr ? nullptr : sc_core::sc_get_curr_simcontext()) {
  if (pushed_to_ != nullptr) pushed_to_->hierarchy_push(module);
}

ModuleScope::~ModuleScope() {
  if (pushed_to_ != nullptr) pushed_to_->hierarchy_pop();
}

Hierarchy::Hierarchy(const Netlist& netlist) : netlist_(netlist) {}

Hierarchy::~Hierarchy() = default;

Hierarchy::Place Hierarchy::place_of(const std::string& path) {
  sc_core::sc_module* parent = nullptr;
  std::size_t begin = 0;
  for (std::size_t dot = path.find('.'); dot != std::string::npos; dot = path.find('.', begin)) {
    const std::string above = path.substr(0, dot);
    if (netlist_.find(above) != nullptr || netlist_.has_foreign(above)) break;
    std::unique_ptr<sc_core::sc_module>& module = modules_[above];
    if (module == nullptr) {
      const ModuleScope scope(parent);
      module = std::make_unique<InstanceGroup>(above.substr(begin).c_str());
    }
    parent = module.get();
    begin = dot + 1;
  }
  std::string name = path.substr(begin);
  std::replace(name.begin(), name.end(), '.', '_');
  return {ModuleScope(parent), std::move(name)};
}

}  // namespace vrpipe
