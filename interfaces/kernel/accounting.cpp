#include <vrpipe/kernel/accounting.h>

#include <algorithm>
#include <map>
#include <string>

#include <vrpipe/component/error.h>

namespace vrpipe {

double busiest(const std::vector<OccupancyPart>& parts) {
  double longest = 0;
  std::map<unsigned, double> resources;
  for (const OccupancyPart& part : parts) {
    longest = std::max(longest, resources[part.resource] += part.cycles);
  }
  return longest;
}

void refuse_work_kind(const std::string& unit, unsigned kind) {
  throw SimulationFault(unit, 0,
                        "did(" + std::to_string(kind) +
                            ", ...) is work of a kind that it has not declared; there are " +
                            std::to_string(most_work_kinds) + " at most");
}

const char* name_of(UnitState state) {
  switch (state) {
    case UnitState::busy: return "busy";
    case UnitState::starved: return "starved";
    case UnitState::blocked: return "blocked";
    case UnitState::memory: return "memory";
    case UnitState::latency: return "latency";
  }
  return "";
}

void StateAccount::keep_change(UnitState state, Cycle now) {
  changes_.push({state_, now});
  if (changes_.size() >= most_changes_) settle();
  begin(state, now);
}

void StateAccount::settle() {
  for (; !changes_.empty() && changes_.front().until <= frame_end_->so_far(); changes_.pop()) {
    charge(changes_.front().state, changes_.front().until);
  }
  most_changes_ = std::max(fewest_changes, 2 * changes_.size());
}

void StateAccount::close(Cycle end) {
  for (; !changes_.empty(); changes_.pop()) charge(changes_.front().state, std::min(changes_.front().until, end));
  charge(state_, end);
}

void WorkTally::note(std::uint64_t items, Cycle from, Cycle until) {
  if (!late_.empty() && late_.back().from == from && late_.back().until == until) {
    late_.back().items += items;
    return;
  }
  late_.push({items, from, until});
  if (late_.size() < most_spans_) return;
  while (!late_.empty() && late_.front().until <= frame_end_->so_far()) late_.pop();
  most_spans_ = std::max(fewest_spans, 2 * late_.size());
}

double WorkTally::items(Cycle end) const {
  auto sum = static_cast<double>(items_);
  for (std::size_t i = 0; i < late_.size(); ++i) {
    const CycleInterval& span = late_[i];
    if (span.until <= end) continue;
    const double after = static_cast<double>(span.until - std::max(span.from, end));
    sum -= static_cast<double>(span.items) * (after / static_cast<double>(span.until - span.from));
  }
  return sum;
}

}  // namespace vrpipe
