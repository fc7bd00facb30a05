#include <vrpipe/model/memory_unit.h>

#include <map>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

std::map<std::string, MemoryUnitMaker>& makers() {
  static std::map<std::string, MemoryUnitMaker> all;
  return all;
}

}  // namespace

void register_memory_unit_maker(const std::string& slot, MemoryUnitMaker maker) {
  if (makers().emplace(slot, std::move(maker)).second) return Registry::instance().count_registration();
  Registry::instance().add_problem(
      {"slot " + slot + " has a timing model already", "write a functional model for the slot instead"});
}

const MemoryUnitMaker& memory_unit_maker(const std::string& slot) {
  const auto found = makers().find(slot);
  if (found == makers().end()) throw SimulationFault("registry", 0, "slot " + slot + " has no timing model");
  return found->second;
}

}  // namespace vrpipe
