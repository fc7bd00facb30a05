#include "l2/annotated_l2.h"
#include "l2/clocked_l2.h"
#include "l2/fixed_latency.h"
#include "l2/sectored_l2.h"

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/model/memory_unit.h>
#include <vrpipe/pipeline/frame_facts.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

const SlotRegistrar slot_of_l1{{"l1", 105, "sectored-cache", "", false, nullptr, true}};
// At lt a warp's neighbouring sectors are one access, with one header, and who asks does not wait for a place at the port.
const SlotRegistrar slot_of_l2{{"l2", 110, "fixed-latency", "", true, nullptr, true},
                               {{"header_bytes", 1, 64}, {"port_requests", 8, 65536}}};
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
  const std::vector<unsigned> ports = l2->clock().port_bytes(place, l2->sizes().bytes_per_cycle);
  if (place.is_clocked) return std::make_unique<ClockedL2>(name.c_str(), domain, std::move(l2), ports);
  return std::make_unique<AnnotatedL2>(name.c_str(), domain, std::move(l2), ports);
}

EffectDecision keep_with_surfaces(const EffectQuestion& asked, std::uint64_t bytes) {
  if (!asked.counts_work) return EffectDecision::omit("without time nothing waits for it");
  const AddressMap& map = asked.facts.addresses;
  return EffectDecision::keep(fmt::format("surfaces and buffers of {:.1f} MB, a cache of {:.1f} MB",
                                          1e-6 * static_cast<double>(map.attributes.end()),
                                          1e-6 * static_cast<double>(bytes)));
}
Effect contents(const CacheLevel& level) {
  return {level.slot,
          "contents",
          "sectored-cache",
          EffectKind::timing,
          "what the cache holds and misses, and what that costs",
          "there is no time (functional)",
          "the cache, and all that is looked up there",
          "none is needed: without it nothing of a frame's result asks for it",
          {level.slot},
          [](const EffectQuestion& asked) {
            return keep_with_surfaces(asked, asked.as<SectoredL2Parameters>().cache.organization().bytes);
          }};
}
const EffectRegistrar l1_contents_effect(contents(level_of_l1));
const EffectRegistrar l2_contents_effect(contents(level_of_l2));

[[maybe_unused]] const bool l2_registered = [] {
  for (const CacheLevel* level : {&level_of_l1, &level_of_l2}) {
    Registry::instance().add(sectored_cache(*level));
    register_memory_unit_maker(level->slot, make);
  }
  return true;
}();

// Not decided: why stands in place of a predicate.
const EffectRegistrar bank_conflicts_effect{{"l2",
                                             "bank_conflicts",
                                             "sectored-cache",
                                             EffectKind::timing,
                                             "requests for one bank wait for one another",
                                             "that none ever does is known only once they have been simulated",
                                             "a queue for each bank",
                                             "",
                                             {},
                                             nullptr}};
const EffectRegistrar crossbar_effect{{"l2",
                                       "crossbar",
                                       "sectored-cache",
                                       EffectKind::timing,
                                       "requests of several ports wait for one another",
                                       "as bank_conflicts; with one port bound, its queue and width still take time",
                                       "a queue for each port",
                                       "",
                                       {},
                                       nullptr}};
}  // namespace

}  // namespace vrpipe
