#pragma once

#include <vector>

#include <vrpipe/kernel/accounting.h>

namespace vrpipe {

/// Sees what passes a link, from outside.
class LinkObserver {
 public:
  virtual ~LinkObserver() = default;
  /// Of the receiver's queue, and of the sender's pipeline in front of it, so many places are taken or are free again, from
  /// a cycle on. At first, before the first cycle, all become free. With time alone, and not at `lt`, where nothing waits.
  virtual void places_taken(unsigned /*places*/, Cycle /*at*/) {}
  virtual void places_freed(unsigned /*places*/, Cycle /*at*/) {}
};
template <class Item>
class ItemObserver : public LinkObserver {
 public:
  /// An item was taken, in the cycles from `first` to `last`; both are 0 without time. What an item leads to without
  /// time, and at `lt`, passes other links before this is called.
  virtual void passed(const Item& item, Cycle first, Cycle last) = 0;
};
/// Those of a link, perhaps for different items: it depends on the fidelity what a link carries.
using LinkObservers = std::vector<LinkObserver*>;

}  // namespace vrpipe
