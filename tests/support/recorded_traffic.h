#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "l2/sectored_l2.h"

#include <vrpipe/pipeline/registry.h>

#include "support/reference_cache.h"

namespace vrpipe::testing {

/// The look-ups of a sectored cache in a run, in their order.
struct LookUps final : L2Observer {
  struct Event {
    MemoryRequest part;
    bool served = false;  ///< or looked up
  };
  void looked_up(const MemoryRequest& part) override { events.push_back({part, false}); }
  void served(const MemoryRequest& part) override { events.push_back({part, true}); }
  std::vector<Event> events;
};

/// Registers an implementation `recorded` of a slot: its sectored cache, which is observed. One instance of it may run.
inline LookUps& record_look_ups(const std::string& slot) {
  static std::map<std::string, LookUps> of_slot;
  const auto [place, is_new] = of_slot.try_emplace(slot);
  LookUps& look_ups = place->second;
  if (!is_new) return look_ups;
  Implementation recorded = Registry::instance().find(slot, "sectored-cache");
  recorded.name = "recorded";
  recorded.make_behaviour = [make = recorded.make_behaviour, &look_ups](const ParameterSet& set,
                                                                        const RenderContext& context) {
    auto made = make(set, context);
    dynamic_cast<SectoredL2&>(*made).observe(look_ups);
    return made;
  };
  Registry::instance().add(std::move(recorded));
  return look_ups;
}

/// By traffic, in sectors.
struct Counted {
  std::uint64_t needed = 0, missed = 0, filled = 0, written_back = 0;
};
struct Replayed {
  std::map<MemoryTraffic, Counted> of;
  std::uint64_t held = 0;
};

/// What a cache by its definition does for these. `pins`: a line stays from its look-up until that is served.
/// `holds_attributes`: their lines go only where a set has no others.
inline Replayed replay(const CacheOrganization& organization, const std::vector<LookUps::Event>& events, bool pins,
                       bool holds_attributes = true) {
  ReferenceCache cache(organization);
  Replayed counted;
  std::map<std::uint64_t, MemoryTraffic> brought_in_by;
  for (const auto& [part, served] : events) {
    if (served) {
      if (pins) cache.unpin(part.address);
      continue;
    }
    const bool writes = part.command == tlm::TLM_WRITE_COMMAND;
    const auto done =
        pins ? cache.access_and_pin(part.address, part.bytes, writes) : cache.access(part.address, part.bytes, writes);
    const std::uint64_t last = (part.address + part.bytes - 1) / organization.sector_bytes;
    Counted& of = counted.of[part.origin.traffic];
    of.needed += last - part.address / organization.sector_bytes + 1;
    of.missed += done.missed.size();
    of.filled += done.filled.size();
    counted.held += done.spared ? 1 : 0;
    if (!done.written_back.empty()) {
      counted.of[brought_in_by.at(done.old_address)].written_back += done.written_back.size();
    }
    if (!done.replaced) continue;
    brought_in_by[part.address - part.address % organization.line_bytes] = part.origin.traffic;
    if (holds_attributes && part.origin.traffic == MemoryTraffic::attribute) cache.keep(part.address);
  }
  return counted;
}

}  // namespace vrpipe::testing
