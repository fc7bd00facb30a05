#include <vrpipe/memory/sector_history.h>

#include <utility>

namespace vrpipe {

SectorHistory::Page& SectorHistory::add_page(std::uint64_t number) {
  const auto put = [&](Place&& place) -> Page& {
    const std::size_t mask = places_.size() - 1;
    std::size_t at = home_of(place.number);
    while (places_[at].number != no_page) at = (at + 1) & mask;
    places_[at] = std::move(place);
    return *places_[at].page;
  };
  if (2 * ++pages_ > places_.size()) {
    std::vector<Place> smaller(2 * places_.size());
    smaller.swap(places_);
    --shift_;
    for (Place& place : smaller) {
      if (place.number != no_page) put(std::move(place));
    }
  }
  return put({number, std::make_unique<Page>()});
}

}  // namespace vrpipe
