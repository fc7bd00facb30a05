#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/accounting.h>
#include <vrpipe/link.h>

namespace vrpipe {

class Netlist;

/// What sees a run from outside, without changing it: given to `simulate` in its request. Links and units that are not
/// observed cost nothing.
///
///     auto observers = std::make_shared<Observers>();
///     observers->on_link<BinItem>("tc.bins", [&](const auto& passed) { ++bins[passed.link]; });
///     observers->on_states([&](const std::string& unit, UnitState state, Cycle from) { ... });
///     request.observers = observers;
class Observers {
 public:
  /// An item that passed a link, in the cycles from `first` to `last`: 0 without time.
  template <class Item>
  struct Passed {
    const std::string& link;  ///< as in `link.NAME`, with the GPC
    const Item& item;
    Cycle first, last;
  };

  /// @param link  NAME as in `link.NAME`: of one GPC (gpc0.tc.bins) or of all (tc.bins)
  /// What a link carries depends on the fidelity (batch.h): then give a function for each. A link that carries none of
  /// the items that are asked for, or that is not there, is a UserError when the run begins.
  template <class Item>
  void on_link(std::string link, std::function<void(const Passed<Item>&)> see) {
    struct Seeing final : ItemObserver<Item> {
      Seeing(std::string name_of_link, std::function<void(const Passed<Item>&)> function)
          : name(std::move(name_of_link)), call(std::move(function)) {}
      void passed(const Item& item, Cycle first, Cycle last) override { call({name, item, first, last}); }
      const std::string name;
      const std::function<void(const Passed<Item>&)> call;
    };
    links_.push_back({std::move(link),
                      [see = std::move(see)](const std::string& name) { return std::make_unique<Seeing>(name, see); }});
  }

  /// Called when a unit enters a state; units begin starved. With time alone.
  void on_states(std::function<void(const std::string& unit, UnitState state, Cycle from)> see) {
    states_.push_back(std::move(see));
  }

  // For the elaboration of a run.

  /// Throws UserError for a link that is asked for and not there.
  void check(const Netlist& netlist) const;
  LinkObservers of_link(const std::string& name);
  /// Null if nobody looks.
  StateObserver* of_unit(const std::string& path);

 private:
  struct OnLink {
    std::string name;
    std::function<std::unique_ptr<LinkObserver>(const std::string& link)> make;
  };
  class States;
  std::vector<OnLink> links_;
  std::vector<std::function<void(const std::string&, UnitState, Cycle)>> states_;
  std::vector<std::shared_ptr<LinkObserver>> made_;
  std::vector<std::shared_ptr<StateObserver>> made_states_;
};

}  // namespace vrpipe
