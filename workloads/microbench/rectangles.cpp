#include "microbench/rectangles.h"

#include <utility>

namespace vrpipe::microbench {

Splat rectangle(double x, double y, double width, double height, float alpha) {
  Splat splat{};
  splat.cx = static_cast<float>(x + width / 2);
  splat.cy = static_cast<float>(y + height / 2);
  splat.ax = static_cast<float>(width / 2);
  splat.by = static_cast<float>(height / 2);
  splat.red = 0.9F;
  splat.green = 0.6F;
  splat.blue = 0.3F;
  splat.opacity = alpha;
  return splat;
}

DrawState rectangle_state() {
  DrawState state;
  state.splat_extent = SplatExtent::fill_rectangle;
  state.obb_padding = 0;
  state.pruning_threshold = 0;
  return state;
}

std::vector<TileId> tiles_of(const GpcTiles& gpc, unsigned count) {
  const unsigned in_a_row = 16 * gpc.gpcs;
  std::vector<TileId> tiles;
  for (unsigned i = 0; tiles.size() < count; ++i) {
    const TileId tile{static_cast<std::uint16_t>(i % in_a_row), static_cast<std::uint16_t>(i / in_a_row)};
    if (gpc.owns(tile)) tiles.push_back(tile);
  }
  return tiles;
}

FrameMaker& FrameMaker::draw(std::vector<Splat> splats, const DrawState& state) {
  auto geometry = std::make_shared<Draw>();
  geometry->width = frame_->width();
  geometry->height = frame_->height();
  geometry->splats = std::move(splats);
  frame_->draw(std::move(geometry), state);
  return *this;
}

FrameMaker& FrameMaker::clear(const Clear& clear) {
  frame_->clear(clear);
  return *this;
}

}  // namespace vrpipe::microbench
