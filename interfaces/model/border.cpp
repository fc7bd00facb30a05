#include <vrpipe/model/border.h>

#include <vrpipe/component/error.h>

namespace vrpipe {

Cycle Lane::taken(std::uint64_t item, Cycle at) const {
  if (item < size_ || left_ == 0) return at;
  const std::uint64_t before = std::min(item - size_, left_ - 1);
  const std::uint64_t first = left_ - left_at_.size();
  return before < first ? at : std::max(at, left_at_[before - first]);
}

Cycle Lane::leaves(Cycle local) {
  if (late_.empty() || rooms_.empty()) throw SimulationFault("lane", local, "more comes out than has gone in");
  const Cycle late = late_.front();
  const Room room = rooms_.front();
  late_.pop();
  rooms_.pop();
  Cycle at = local - std::min(local, late);
  // It may have waited for its room, or for the one before it: then it comes as much behind that as here.
  const bool by_room = room.told >= last_local_;
  const Cycle before = by_room ? room.told : last_local_;
  if (local <= before + 1) at = std::min(at, (by_room ? room.since : last_at_) + (local - std::min(local, before)));
  at = std::max(at, room.since);
  last_local_ = local;
  last_at_ = at;
  left_at_.push(at);
  ++left_;
  while (left_at_.size() > size_ + 1) left_at_.pop();
  return at;
}

Lane* Border::lane_to(const OutPort& out) {
  const auto found = lanes_.find(&out);
  return found == lanes_.end() ? nullptr : &found->second;
}

void Border::open() {
  for (Exit* exit : exits_) exit->open();
}

void Border::before_edge(Cycle cycle) {
  for (const auto& ask : asks_) ask(cycle);
}

/// Whether anything was offered.
bool Border::offer_held() {
  bool any = false;
  for (Exit* exit : exits_) {
    const OutPort& out = exit->unit_out();
    if (&out == followed_ || (is_asked_ && lane_to(out) != nullptr)) continue;
    while (exit->offer_first()) any = true;
  }
  return any;
}

/// One by one: whatever goes into the unit before the next does so in its time.
bool Border::offer_followed() {
  if (withholds_) return false;
  return std::any_of(exits_.begin(), exits_.end(),
                     [&](Exit* exit) { return &exit->unit_out() == followed_ && exit->offer_first(); });
}

void Border::make_room(const char* who) {
  if (rouse()) return;
  if (next_edge() == never) {
    for (const auto& ask : asks_) ask(never);
  }
  if (const Cycle next = next_edge(); next != never) return advance(next + 1);
  // It waits for what is on its way in others, as for a mark that is to come around.
  if (!step_locals())
    throw SimulationFault(who, now(),
                          "an item is offered, and the unit is at rest: it waits for another unit at cycle, which "
                          "waits for it by way of units at lt; simulate fewer units at cycle, or those between them "
                          "as well");
}

void Border::advance_for(Cycle until, const std::function<bool()>& is_enough) {
  const bool was_asked = std::exchange(is_asked_, true);
  if (until != never) advance(until);
  for (Cycle next = next_edge(); until == never && next != never && !is_enough(); next = next_edge()) advance(next + 1);
  is_asked_ = was_asked;
  if (held_ > 0) call_at(now() + 1);
}

bool Border::rouse() {
  if (held_ == 0) return false;
  const bool any = offer_held();
  return offer_followed() || any;
}

namespace {

std::vector<BorderRegistrar::Connect>& known_items() {
  static std::vector<BorderRegistrar::Connect> known{
      connect_across<VertexWarp, VertexWarp>,
      connect_across<PrimitiveItem, PrimitiveItem>,
      connect_across<RasterJob, RasterJob>,
      connect_across<QuadBeat, QuadBeat>,
      connect_across<QuadBeat, BinItem>,
      connect_across<Warp, Warp>,
      connect_across<ShadedWarpItem, ShadedWarpItem>,
      connect_across<ColorBeat, ColorBeat>,
      connect_across<ColorBeat, ShadedWarpItem>,
      connect_across<WarpRelease, WarpRelease>,
      connect_across<TerminationBeat, TerminationBeat>,
      connect_across<HiZUpdate, HiZUpdate>,
      connect_across<PortReads, PortReads>,
      connect_across<BlendsDone, BlendsDone>,
  };
  return known;
}

}  // namespace

BorderRegistrar::BorderRegistrar(Connect connect) { known_items().push_back(connect); }

void connect_across_borders(const BorderLink& link, const LinkOptions& options) {
  for (const BorderRegistrar::Connect connect : known_items()) {
    if (connect(link, options)) return;
  }
  throw UserError("cannot simulate one unit at cycle and another at lt", link.out.name() + " to " + link.in.name(),
                  "it is not known how the link's items pass between the two",
                  "register them (BorderRegistrar in model/border.h), or take one fidelity for both");
}

}  // namespace vrpipe
