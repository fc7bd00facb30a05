#include <vrpipe/pipeline/tile_owners.h>

#include <algorithm>

namespace vrpipe {

TileOwners::TileOwners(unsigned width, unsigned height, const std::function<unsigned(TileId)>& owner_of)
    : columns_((width + screen_tile_pixels - 1) / screen_tile_pixels),
      rows_((height + screen_tile_pixels - 1) / screen_tile_pixels) {
  owners_.reserve(std::size_t{columns_} * rows_);
  for (std::uint32_t y = 0; y < rows_; ++y) {
    for (std::uint32_t x = 0; x < columns_; ++x) {
      owners_.push_back(
          static_cast<std::uint8_t>(owner_of({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y)})));
    }
  }
}

/// `look` is given owners until it returns true.
template <class Look>
void TileOwners::look_at(const PixelRect& pixels, Look&& look) const {
  constexpr auto side = static_cast<std::int32_t>(screen_tile_pixels);
  const std::int32_t last_x = std::min((pixels.x1 - 1) / side, static_cast<std::int32_t>(columns_) - 1);
  const std::int32_t last_y = std::min((pixels.y1 - 1) / side, static_cast<std::int32_t>(rows_) - 1);
  for (std::int32_t y = pixels.y0 / side; y <= last_y; ++y) {
    for (std::int32_t x = pixels.x0 / side; x <= last_x; ++x) {
      if (look(owners_[static_cast<std::size_t>(y) * columns_ + static_cast<std::size_t>(x)])) return;
    }
  }
}

GpcSet TileOwners::owners_in(const PixelRect& pixels) const {
  GpcSet owners;
  look_at(pixels, [&](std::uint8_t owner) {
    owners.set(owner);
    return false;
  });
  return owners;
}

bool TileOwners::has_any(unsigned gpc, const PixelRect& pixels) const {
  bool found = false;
  look_at(pixels, [&](std::uint8_t owner) { return found = owner == gpc; });
  return found;
}

}  // namespace vrpipe
