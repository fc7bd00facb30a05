#include <vrpipe/model/untimed.h>

#include <algorithm>
#include <map>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

std::map<std::string, UntimedUnitMaker>& untimed_makers() {
  static std::map<std::string, UntimedUnitMaker> all;
  return all;
}

}  // namespace

void UntimedUnit::check_work() const {
  if (work_.empty()) return;
  for (auto kind = static_cast<unsigned>(work_.size()); kind < items_.size(); ++kind) {
    if (items_[kind] > 0) refuse_work_kind(name_, kind);
  }
}

std::vector<OccupancyPart> UntimedUnit::least_parts(const Items& items, bool to_last) const {
  std::vector<OccupancyPart> parts;
  for (std::size_t i = 0; i < work_.size(); ++i) {
    const WorkKind& kind = work_[i];
    if (kind.cycles_per_item == 0) continue;
    const auto count = static_cast<double>(items[i]);
    const bool is_interval = to_last && items[i] > 0 && kind.cycles_per_item > 1;
    const double cycles = is_interval ? (count - 1) * kind.cycles_per_item + 1 : count * kind.cycles_per_item;
    parts.push_back({kind.name, kind.resource, cycles, kind.is_throughput});
  }
  return parts;
}

double UntimedUnit::idle_after_last() const {
  double longest = 1;
  for (const WorkKind& kind : work_) longest = std::max(longest, kind.cycles_per_item);
  return longest - 1;
}

void register_untimed_unit_maker(const std::string& slot, UntimedUnitMaker maker) {
  if (untimed_makers().emplace(slot, std::move(maker)).second) return Registry::instance().count_registration();
  Registry::instance().add_problem(
      {"slot " + slot + " has a unit without time already", "write a behaviour for the slot instead"});
}

const UntimedUnitMaker& untimed_unit_maker(const std::string& slot) {
  const auto found = untimed_makers().find(slot);
  if (found == untimed_makers().end())
    throw SimulationFault("registry", 0, "slot " + slot + " has no unit without time");
  return found->second;
}

}  // namespace vrpipe
