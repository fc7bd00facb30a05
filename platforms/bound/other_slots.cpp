#include "bound/other_slots.h"

#include <algorithm>

#include <vrpipe/pipeline/registry.h>

#include "bound/bound.h"

namespace vrpipe {

OtherSlots::OtherSlots(const UntimedGpu& gpu, bool spares) {
  const unsigned raster = Pipeline::rank(Pipeline::raster);
  const unsigned tc = Pipeline::rank(Pipeline::tc);
  for (const UntimedGpu::Placed& placed : gpu.units()) {
    const std::string& slot = placed.instance->slot;
    if (Pipeline::place_of(slot) != Pipeline::places) continue;
    const unsigned rank = Registry::instance().slot(slot).rank;
    const Place place = rank <= raster ? Place::before_raster : rank <= tc ? Place::before_tc : Place::behind_tc;
    const std::string& path = placed.instance->path;
    if (placed.unit->work().empty()) {
      unknown_.push_back(path + " does not say what its work takes (UntimedUnit)");
    } else if (place == Place::behind_tc && spares) {
      unknown_.push_back(path + " may be spared work where bins time out");
    }
    if (place == Place::behind_tc && spares) continue;
    others_.push_back({&placed, place, {}});
  }
}

void OtherSlots::note(Place place, unsigned gpc) {
  for (Other& other : others_) {
    const Instance& instance = *other.placed->instance;
    if (other.place != place || (!instance.in_front_end && instance.gpc != gpc)) continue;
    other.items = other.placed->unit->items();
  }
}

const OtherSlots::Other* OtherSlots::find(const std::string& path) const {
  const auto found = std::find_if(others_.begin(), others_.end(),
                                  [&](const Other& other) { return other.placed->instance->path == path; });
  return found == others_.end() ? nullptr : &*found;
}

std::vector<OccupancyPart> OtherSlots::parts(const std::string& path) const {
  const Other* const other = find(path);
  return other == nullptr ? std::vector<OccupancyPart>() : other->placed->unit->least_parts(other->items, true);
}

}  // namespace vrpipe
