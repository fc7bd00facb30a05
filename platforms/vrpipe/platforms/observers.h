#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/link_observer.h>
#include <vrpipe/pipeline/fragment_observer.h>

namespace vrpipe {

class Netlist;
struct RunResult;

/// What sees a run from outside, without changing it: given to `simulate` in its request. Links and units that are not
/// observed cost nothing.
///
///     auto observers = std::make_shared<Observers>();
///     observers->on_link<BinItem>("tc.bins", [&](const auto& passed) { ++bins[passed.link]; });
///     observers->on_states([&](const std::string& unit, UnitState state, Cycle from) { ... });
///     observers->on_statistics(1000, {"crop.quads_blended"}, [&](Cycle cycle, const auto& values) { ... });
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
  using SeeItem = std::function<void(const Passed<Item>&)>;
  /// Places of a link's queue: taken, or fewer than 0 for some that are free again, from a cycle on. At first, before the
  /// first cycle, all become free. At `cycle` alone: at `lt` nothing waits in a queue.
  using SeePlaces = std::function<void(const std::string& link, std::int64_t places, Cycle at)>;
  template <class Item>
  void on_link(std::string link, SeeItem<Item> see, SeePlaces see_places = {}) {
    links_.push_back({std::move(link), std::make_shared<LinkSightOf<Item>>(std::move(see), std::move(see_places))});
  }

  /// Called when a unit enters a state; units begin starved. With time alone.
  void on_states(std::function<void(const std::string& unit, UnitState state, Cycle from)> see) {
    states_.push_back(std::move(see));
  }

  /// A statistic in the course of a run.
  struct Sampled {
    std::string name;  ///< crop.quads_blended; gpc1.crop.quads_blended
    std::string kind;  ///< as in StatisticReport: counter, largest, smallest, histogram, ratio
    /// Of a ratio the numerator, of a histogram the sum of the values seen; none of an extreme that saw nothing yet.
    std::optional<std::uint64_t> value;
    std::optional<std::uint64_t> denominator;  ///< of a ratio, of a histogram the number of values seen; none otherwise
    /// Of a ratio, or the mean of a histogram; none where there is none, or the denominator is 0.
    std::optional<double> quotient() const;
  };
  using SeeStatistics = std::function<void(Cycle cycle, const std::vector<Sampled>& values)>;

  /// Samples statistics at the cycles `every`, 2 `every`, ... before the end of the frame, and at its end, where the
  /// values are those of the result. With time alone: at the other fidelities it is a UserError.
  ///
  /// @param every  cycles, at least 1; otherwise a UserError
  /// @param names  as in the results, over all components of a kind (crop.quads_blended), or of one component, by its
  ///               path (gpc1.crop.cache.sector_hits). A `*` stands for any text without a dot: crop.*, gpc*.tc.quads.
  ///               One that names nothing is a UserError when the run begins.
  /// @param see    is called in the order of cycles, perhaps later than in them: what comes after the end of the frame
  ///               is in the last sample, and the end is known late. `values` are in the order of the names.
  ///
  /// A sample has what was counted at the edges of all earlier cycles, and nothing of its own. Not every counter is at
  /// the time of what it counts (figures: builtin:object, 400x400, agx-orin-ideal-memory):
  /// - At `cycle` all are, but in strict termination with early termination, where SM and CROP count a bin when it is
  ///   tested: 1,000 cycles ahead on average, at most 4,000.
  /// - At `lt` all that a vertex warp leads to is counted when the warp is issued: 4,000 to 8,000 cycles before its time
  ///   on average, at most 31,000. Samples tell the share of the work that has been done, not when.
  void on_statistics(Cycle every, std::vector<std::string> names, SeeStatistics see);

  /// Some fragments of a quad, and what has become of them.
  struct Fragments {
    FragmentFate fate;
    TileId tile;
    unsigned position;  ///< of the quad in the screen tile
    LaneMask lanes;
  };
  /// At every fidelity. Of units that tell it (FragmentObserver); those of this library do.
  void on_fragments(std::function<void(const Fragments&)> see) { fragments_.see.push_back(std::move(see)); }

  /// Called when the run has ended well, with its result, of which `intervals` may be filled in.
  void on_end(std::function<void(RunResult& result)> see) { ends_.push_back(std::move(see)); }

  // For the elaboration of a run.

  /// Throws UserError for a link that is asked for and not there.
  void check(const Netlist& netlist) const;
  LinkObservers of_link(const std::string& name);
  bool observes_link(const std::string& name) const;
  /// Whether anybody looks at links, states or statistics.
  bool sees_units() const { return !links_.empty() || !states_.empty() || !statistics_.empty(); }
  /// Null if nobody looks.
  StateObserver* of_unit(const std::string& path);
  FragmentObserver* of_fragments() { return fragments_.see.empty() ? nullptr : &fragments_; }
  void end(RunResult& result) const {
    for (const auto& see : ends_) see(result);
  }
  struct OnStatistics {
    Cycle every;
    std::vector<std::string> names;
    SeeStatistics see;
  };
  const std::vector<OnStatistics>& of_statistics() const { return statistics_; }

 private:
  template <class Item>
  struct Seeing final : ItemObserver<Item> {
    explicit Seeing(std::string name_of_link) : name(std::move(name_of_link)) {}
    void passed(const Item& item, Cycle first, Cycle last) override {
      for (const auto& see : items) see({name, item, first, last});
    }
    void places_taken(unsigned count, Cycle at) override {
      for (const auto& see : places) see(name, std::int64_t{count}, at);
    }
    void places_freed(unsigned count, Cycle at) override {
      for (const auto& see : places) see(name, -std::int64_t{count}, at);
    }
    const std::string name;
    std::vector<SeeItem<Item>> items;
    std::vector<SeePlaces> places;
  };
  /// What one call of on_link asked for.
  class LinkSight {
   public:
    virtual ~LinkSight() = default;
    virtual std::unique_ptr<LinkObserver> make(const std::string& link) const = 0;
    /// Whether it is for the items of that observer, which sees for this one as well then.
    virtual bool join(LinkObserver& observer) const = 0;
  };
  template <class Item>
  class LinkSightOf final : public LinkSight {
   public:
    LinkSightOf(SeeItem<Item> see, SeePlaces see_places) : item_(std::move(see)), places_(std::move(see_places)) {}
    std::unique_ptr<LinkObserver> make(const std::string& link) const override {
      auto made = std::make_unique<Seeing<Item>>(link);
      join(*made);
      return made;
    }
    bool join(LinkObserver& observer) const override {
      auto* const seeing = dynamic_cast<Seeing<Item>*>(&observer);
      if (seeing == nullptr) return false;
      if (item_) seeing->items.push_back(item_);
      if (places_) seeing->places.push_back(places_);
      return true;
    }

   private:
    SeeItem<Item> item_;
    SeePlaces places_;
  };
  struct OnLink {
    std::string name;
    std::shared_ptr<const LinkSight> sight;
  };
  struct SeenFragments final : FragmentObserver {
    void happened(FragmentFate fate, TileId tile, unsigned position, LaneMask lanes) override {
      for (const auto& each : see) each({fate, tile, position, lanes});
    }
    std::vector<std::function<void(const Fragments&)>> see;
  };
  class States;
  std::vector<OnLink> links_;
  std::vector<std::function<void(const std::string&, UnitState, Cycle)>> states_;
  std::vector<OnStatistics> statistics_;
  SeenFragments fragments_;
  std::vector<std::function<void(RunResult&)>> ends_;
  std::vector<std::shared_ptr<LinkObserver>> made_;
  std::vector<std::shared_ptr<StateObserver>> made_states_;
};

}  // namespace vrpipe
