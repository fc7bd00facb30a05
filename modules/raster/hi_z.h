#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/depth_plane.h>
#include <vrpipe/pipeline/hi_z_plan.h>
#include <vrpipe/pipeline/screen_tiling.h>

namespace vrpipe {

/// A depth that no stored one of its step exceeds: the top of the step, of 2^bits from 0 to 1.
std::uint32_t top_of_step(DepthFormat format, unsigned bits, std::uint32_t stored);

/// Hi-Z: for each raster tile a depth that none of its pixels' exceeds, from what ZROP has said so far; and whether all that
/// a primitive has there would fail the depth test.
class HiZ {
 public:
  /// @param bits  that are kept of a depth, 1 to 24
  HiZ(const RenderContext& context, unsigned bits);
  /// Whether there is anything to cull in the frame.
  bool is_used() const { return plan_.is_used(); }

  /// The primitives that `hides` is asked for from now on; returns whether it need be.
  bool begin(const Primitive& primitive);
  /// Whether all samples of the primitive in a part of a raster tile (2 * row + column) fail; `area` is in it, not empty.
  bool hides(TileId tile, unsigned part, const PixelRect& area) const;

  /// Strict termination: it counts once a mark that is waited for comes.
  void update(const HiZUpdate& update);
  bool waits_at(Mark mark) const { return plan_.waits_at(mark); }
  /// Knows what another one of the frame does.
  void hold_as(const HiZ& other);

 private:
  struct Staged {
    std::size_t place;
    std::uint32_t bound;
  };
  std::size_t place_of(TileId tile, unsigned part) const { return 4 * tiling_.index(tile) + part; }
  /// Whether a depth, as stored, fails against whatever is no farther than a bound.
  bool fails(std::uint32_t depth, std::uint32_t bound) const {
    return compare_ == Compare::less ? depth >= bound : depth > bound;
  }
  void store(std::size_t place, std::uint32_t bound);

  const RenderContext& context_;
  const HiZPlan plan_;
  const DepthFormat format_;
  const unsigned bits_;
  const bool is_strict_;
  const ScreenTiling tiling_;
  std::vector<std::uint32_t> bounds_;  ///< by raster tile, as store_depth has it
  std::vector<Staged> staged_;         ///< since the last mark that was waited for
  std::uint16_t epoch_ = 0;
  // Of the primitive:
  DepthPlane plane_;
  Compare compare_ = Compare::less;
  std::uint32_t nearest_ = 0;
  std::uint32_t farthest_ = 0;
};

}  // namespace vrpipe
