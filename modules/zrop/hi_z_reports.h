#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/hi_z_plan.h>

namespace vrpipe {

/// What ZROP tells RASTER's Hi-Z: for each raster tile in which a test has changed depth, the farthest that is left there.
class HiZReports {
 public:
  explicit HiZReports(const RenderContext& context)
      : frame_(*context.frame), plan_(context), tiling_(frame_.width(), frame_.height()) {
    if (plan_.is_used()) told_.resize(4 * tiling_.tiles());
  }
  /// Whether anything is to be told of what a draw stores.
  bool wanted(DrawIndex draw) const { return plan_.is_used() && plan_.reports(draw); }
  /// Whether RASTER waits for a mark to come back.
  bool returns(Mark mark) const { return plan_.waits_at(mark); }

  static HiZUpdate of_mark(Mark mark) {
    HiZUpdate update;
    update.mark = mark;
    return update;
  }

  /// Quads of a beat have changed depth or stencil, a bit each; `beat` is that before the test, of draws that are wanted.
  /// `tell` gets what was not told before.
  template <class Tell>
  void changed(const QuadBeat& beat, std::uint32_t quads, const DepthStencilSurface& surface, Tell&& tell) {
    std::uint32_t parts = 0;
    DrawIndex draw = 0;
    for (; quads != 0; quads &= quads - 1) {
      const Quad& quad = beat.quads[static_cast<unsigned>(__builtin_ctz(quads))];
      parts |= 1U << part_of(quad.position);
      draw = quad.draw;
    }
    for (; parts != 0; parts &= parts - 1) {
      HiZUpdate update;
      update.tile = beat.tile;
      update.part = static_cast<std::uint8_t>(__builtin_ctz(parts));
      update.epoch = plan_.epoch(draw);
      update.farthest = farthest(update.tile, update.part, surface);
      Told& told = told_[4 * tiling_.index(update.tile) + update.part];
      if (told.is_any && told.epoch == update.epoch && told.farthest == update.farthest) continue;
      told = {update.farthest, update.epoch, true};
      tell(update);
    }
  }

  /// Of the pixels of a raster tile that are in the frame.
  std::uint32_t farthest(TileId tile, unsigned part, const DepthStencilSurface& surface) const {
    const std::uint32_t x = tile.x * screen_tile_pixels + (part & 1U) * raster_tile_pixels;
    const std::uint32_t y = tile.y * screen_tile_pixels + (part >> 1U) * raster_tile_pixels;
    const std::uint32_t columns = std::min(raster_tile_pixels, frame_.width() - std::min(x, frame_.width()));
    const std::uint32_t rows = std::min(raster_tile_pixels, frame_.height() - std::min(y, frame_.height()));
    const unsigned first =
        quads_per_tile_row * (part >> 1U) * (raster_tile_pixels / 2) + (part & 1U) * (raster_tile_pixels / 2);
    const std::size_t place = tiling_.place(tile, first);
    std::uint32_t farthest = 0;
    for (std::uint32_t row = 0; row < rows; ++row) {
      for (std::uint32_t column = 0; column < columns; ++column) {
        const DepthStencilQuad& quad = surface.quad(place + row / 2 * quads_per_tile_row + column / 2);
        farthest = std::max(farthest, quad.depth[2 * (row & 1U) + (column & 1U)]);
      }
    }
    return farthest;
  }

 private:
  struct Told {
    std::uint32_t farthest = 0;
    std::uint16_t epoch = 0;
    bool is_any = false;
  };
  static unsigned part_of(unsigned position) {
    const unsigned row = position / quads_per_tile_row;
    const unsigned column = position % quads_per_tile_row;
    return 2 * (row / (raster_tile_pixels / 2)) + column / (raster_tile_pixels / 2);
  }

  const Frame& frame_;
  const HiZPlan plan_;
  const ScreenTiling tiling_;
  std::vector<Told> told_;  ///< by raster tile
};

}  // namespace vrpipe
