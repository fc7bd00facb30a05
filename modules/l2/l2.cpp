#include "l2/annotated_l2.h"
#include "l2/clocked_l2.h"
#include "l2/fixed_latency.h"
#include "l2/sectored_l2.h"

#include <vrpipe/component/error.h>
#include <vrpipe/model/memory_unit.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

const SlotRegistrar slot_of_l1{{"l1", 105, "sectored-cache", "", false, nullptr, true}};
const SlotRegistrar slot_of_l2{{"l2", 110, "fixed-latency", "", true, nullptr, true}};
const Registrar<FixedLatency, MemoryBehaviour> fixed_latency(
    "l2", "fixed-latency", "holds everything: a fixed latency, a number of bytes a cycle for each GPC", false,
    Trust::trusted);

Implementation sectored_cache(const CacheLevel& level) {
  Implementation implementation;
  implementation.slot = level.slot;
  implementation.name = "sectored-cache";
  implementation.description = "a cache of sectored lines in banks behind a crossbar, with a memory below it";
  implementation.trust = Trust::trusted;
  implementation.make_parameters = [&level] { return std::make_unique<SectoredL2Parameters>(level); };
  implementation.make_behaviour = [](const ParameterSet& parameters, const RenderContext& context) {
    return std::make_unique<SectoredL2>(dynamic_cast<const SectoredL2Parameters&>(parameters), context);
  };
  return implementation;
}

std::unique_ptr<MemoryUnit> make(const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                 const MemoryPlace& place) {
  Behaviour* const made = behaviour.release();
  if (auto* const fixed = dynamic_cast<FixedLatency*>(made)) {
    return std::make_unique<FixedLatencyUnit>(name, domain, std::unique_ptr<FixedLatency>(fixed), place);
  }
  auto* const sectored = dynamic_cast<SectoredL2*>(made);
  if (sectored == nullptr) {
    const std::unique_ptr<Behaviour> other(made);
    throw SimulationFault(name, 0, "there is no timing model for a functional model of its kind");
  }
  std::unique_ptr<SectoredL2> l2(sectored);
  const std::vector<unsigned> ports = place.port_bytes(l2->sizes().bytes_per_cycle);
  if (place.is_clocked) return std::make_unique<ClockedL2>(name.c_str(), domain, std::move(l2), ports);
  return std::make_unique<AnnotatedL2>(name.c_str(), domain, std::move(l2), ports);
}

[[maybe_unused]] const bool registered = [] {
  for (const CacheLevel* level : {&level_of_l1, &level_of_l2}) {
    Registry::instance().add(sectored_cache(*level));
    register_memory_unit_maker(level->slot, make);
  }
  return true;
}();

}  // namespace

}  // namespace vrpipe
