#include <vrpipe/platforms/observers.h>

#include <algorithm>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/netlist.h>

namespace vrpipe {

class Observers::States final : public StateObserver {
 public:
  States(std::string unit, const std::vector<std::function<void(const std::string&, UnitState, Cycle)>>& see)
      : unit_(std::move(unit)), see_(see) {}
  void entered(UnitState state, Cycle from) override {
    for (const auto& see : see_) see(unit_, state, from);
  }

 private:
  const std::string unit_;
  const std::vector<std::function<void(const std::string&, UnitState, Cycle)>>& see_;
};

std::optional<double> Observers::Sampled::quotient() const {
  if (!value || denominator.value_or(0) == 0) return std::nullopt;
  return static_cast<double>(*value) / static_cast<double>(*denominator);
}

void Observers::on_statistics(Cycle every, std::vector<std::string> names, SeeStatistics see) {
  if (every == 0) {
    throw UserError("cannot sample statistics", "observers", "the interval is 0 cycles", "give at least 1");
  }
  statistics_.push_back({every, std::move(names), std::move(see)});
}

void Observers::check(const Netlist& netlist) const {
  for (const OnLink& wanted : links_) {
    std::vector<std::string> names;
    bool found = false;
    for (const Link& link : netlist.links()) {
      names.push_back(link.name());
      names.push_back(without_gpc(link.name()));
      found = found || names_path(wanted.name, link.name());
    }
    if (found) continue;
    throw UserError("cannot observe link '" + wanted.name + "'", "observers", "the platform has no such link",
                    names.empty() ? "it has none" : suggestion(wanted.name, names));
  }
}

LinkObservers Observers::of_link(const std::string& name) {
  LinkObservers observers;
  for (const OnLink& wanted : links_) {
    if (!names_path(wanted.name, name)) continue;
    const auto joins = [&](LinkObserver* observer) { return wanted.sight->join(*observer); };
    if (std::any_of(observers.begin(), observers.end(), joins)) continue;
    made_.push_back(wanted.sight->make(name));
    observers.push_back(made_.back().get());
  }
  return observers;
}

bool Observers::observes_link(const std::string& name) const {
  return std::any_of(links_.begin(), links_.end(), [&](const OnLink& wanted) { return names_path(wanted.name, name); });
}

StateObserver* Observers::of_unit(const std::string& path) {
  if (states_.empty()) return nullptr;
  made_states_.push_back(std::make_shared<States>(path, states_));
  return made_states_.back().get();
}

}  // namespace vrpipe
