#include "bound/other_slots.h"

#include <algorithm>

#include <vrpipe/pipeline/registry.h>

#include "bound/bound.h"

namespace vrpipe {

OtherSlots::OtherSlots(const UntimedGpu& gpu, bool spares) {
  const Registry& registry = Registry::instance();
  const unsigned raster = registry.slot("raster").rank;
  const unsigned tc = registry.slot("tc").rank;
  for (const UntimedGpu::Placed& placed : gpu.units()) {
    const std::string& slot = placed.instance->slot;
    if (PhaseBound::knows(slot)) continue;
    const unsigned rank = registry.slot(slot).rank;
    const Place place = rank <= raster ? Place::before_raster : rank <= tc ? Place::before_tc : Place::behind_tc;
    const std::string& path = placed.instance->path;
    if (placed.unit->work().empty()) {
      unknown_.push_back(path + " does not say what its work takes (UntimedUnit)");
    } else if (place == Place::behind_tc && spares) {
      unknown_.push_back(path + " may be spared work where bins time out");
    }
    if (place == Place::behind_tc && spares) continue;
    others_.push_back({&placed, place, std::vector<std::uint64_t>(placed.unit->work().size())});
  }
}

void OtherSlots::note(Place place, unsigned gpc) {
  for (Other& other : others_) {
    const Instance& instance = *other.placed->instance;
    if (other.place != place || (!instance.in_front_end && instance.gpc != gpc)) continue;
    for (unsigned kind = 0; kind < other.items.size(); ++kind) other.items[kind] = other.placed->unit->items(kind);
  }
}

const OtherSlots::Other* OtherSlots::find(const std::string& path) const {
  const auto found = std::find_if(others_.begin(), others_.end(),
                                  [&](const Other& other) { return other.placed->instance->path == path; });
  return found == others_.end() ? nullptr : &*found;
}

std::vector<OccupancyPart> OtherSlots::parts(const std::string& path) const {
  std::vector<OccupancyPart> parts;
  const Other* const other = find(path);
  if (other == nullptr) return parts;
  const std::vector<WorkKind>& work = other->placed->unit->work();
  for (std::size_t i = 0; i < work.size(); ++i) {
    // Nobody waits for what the last item takes after it has gone.
    const double last = other->items[i] == 0 ? 0 : std::max(work[i].cycles_per_item - 1, 0.0);
    const double cycles = static_cast<double>(other->items[i]) * work[i].cycles_per_item - last;
    parts.push_back({work[i].name, work[i].resource, cycles, work[i].is_throughput});
  }
  return parts;
}

}  // namespace vrpipe
