#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <deque>
#include <vector>

#include <vrpipe/arithmetic/blend.h>
#include <vrpipe/arithmetic/lanes.h>
#include <vrpipe/kernel/rate.h>

namespace vrpipe {

constexpr unsigned screen_tile_pixels = 16;  ///< side of a screen tile (paper 5.1; measured)
constexpr unsigned raster_tile_pixels = 8;   ///< side of a raster tile (paper, table)
constexpr unsigned quads_per_tile_row = 8;   ///< quads along a side of a screen tile
constexpr unsigned positions_per_tile = 64;  ///< quad positions in a screen tile
constexpr unsigned quads_per_warp = 8;       ///< 32 threads
constexpr unsigned vertices_per_splat = 4;
constexpr unsigned splats_per_vertex_warp = 8;
constexpr unsigned vertices_per_rectangle = 3;  ///< of a filled one, by which its box is known

/// The number of a draw in its frame, from 0.
using DrawIndex = std::uint16_t;
inline constexpr std::size_t most_draws = 0x7fff;  ///< of a frame: quads carry the number in 15 bits

/// Goes from unit to unit in a place of its own, behind all that comes before a command of the frame and in front of all
/// that comes after: before a clear, a draw of another state than the one before it, and at the end. Frame::mark_of gives
/// the others; frame.h says what they stand for.
enum class Mark : std::uint16_t { none = 0, end_of_frame = 0xffff };

/// A screen tile, in tiles from the upper left.
struct TileId {
  std::uint16_t x = 0;
  std::uint16_t y = 0;
  friend bool operator==(TileId a, TileId b) { return std::memcmp(&a, &b, sizeof a) == 0; }  // in one word
  friend bool operator!=(TileId a, TileId b) { return !(a == b); }
};

/// Pixels [x0, x1) x [y0, y1).
struct PixelRect {
  std::int32_t x0 = 0;
  std::int32_t y0 = 0;
  std::int32_t x1 = 0;
  std::int32_t y1 = 0;
  bool empty() const { return !(x0 < x1 && y0 < y1); }
};
/// What two have in common; empty if nothing.
inline PixelRect intersection(const PixelRect& a, const PixelRect& b) {
  return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}

/// A triangle after vertex processing. Attributes stay in the circular buffer in L2; units pass the pointer (`splat`).
struct Primitive {
  std::uint32_t splat = 0;    ///< in the frame, in draw order
  std::uint8_t triangle = 0;  ///< 0 or 1 of the splat's two triangles
  DrawIndex draw = 0;
  PixelRect bounds;  ///< of the pixels that may be covered, clipped to the viewport, never empty
};

/// 2x2 samples of one primitive of which at least one is covered. Begins as `Quad{}`; without the braces it has no
/// values, so that a beat's places for quads cost nothing.
struct Quad {
  std::uint32_t splat;         ///< in the frame
  std::uint8_t position;       ///< in the screen tile: 8 * row + column, 0 to 63
  LaneMask coverage;           ///< live samples; never 0 in flight
  std::uint16_t triangle : 1;  ///< of the splat
  std::uint16_t draw : 15;     ///< that it is of
};
static_assert(sizeof(Quad) == 8, "quads are copied from buffer to buffer");

/// Vertices of up to eight consecutive splats, shaded by one warp. DRAW to SM to VPO.
struct VertexWarp {
  std::uint32_t first_splat = 0;  ///< in the frame
  std::uint32_t splats = 0;
  DrawIndex draw = 0;
  Mark mark = Mark::none;  ///< or a mark; then `splats` is 0
};

/// VPO to TGC; of several GPCs, by way of the crossbar.
struct PrimitiveItem {
  Primitive primitive;
  Mark mark = Mark::none;   ///< or a mark; then there is no primitive
  bool ends_batch = false;  ///< to the crossbar: nor is there where a vertex warp's primitives end
};

/// TGC to RASTER: a primitive and the part of the screen in which to rasterise it now.
struct RasterJob {
  Primitive primitive;
  PixelRect clip;
  Mark mark = Mark::none;
};

/// Quads of one screen tile that move in one cycle. RASTER to TC, TC to PROP, PROP to ZROP and back, PROP to QRU.
struct QuadBeat {
  static constexpr unsigned capacity = 16;
  TileId tile;
  std::uint8_t count = 0;
  bool last_of_bin = false;  ///< closes the bin that TC flushed (count may be 0 once its quads are dead)
  Mark mark = Mark::none;    ///< or a mark; then count is 0
  std::array<Quad, capacity> quads;
};

/// Up to eight quads of one screen tile, to be shaded together; they may be of several draws, but of one state. QRU to SM.
struct Warp {
  TileId tile;
  std::uint32_t sequence = 0;       ///< launch order in the GPC, from 0
  std::uint32_t tile_sequence = 0;  ///< launch order in its screen tile, from 0
  std::uint8_t count = 0;
  std::uint8_t merge_pairs = 0;  ///< bit n: quads 2n (front) and 2n + 1 (back) are to be merged
  Mark mark = Mark::none;        ///< or a mark; then count is 0, and `sequence` that of the warp that follows
  std::array<Quad, quads_per_warp> quads;
};

/// The slot of what holds none: a mark.
inline constexpr std::uint16_t no_slot = 0xffff;

class ShadedWarpPool;

/// A warp's quads after shading, pruning and merging, as many as survive; where RenderContext::hands_on_coverage, all, of
/// which some may have no live sample.
struct ShadedWarp {
  TileId tile;
  std::uint32_t sequence = 0;
  std::uint32_t tile_sequence = 0;
  std::uint8_t count = 0;
  Mark mark = Mark::none;
  std::uint16_t slot = no_slot;  ///< of the SM, to be released when the last quad has left PROP
  std::array<std::uint8_t, quads_per_warp> position;
  std::array<LaneMask, quads_per_warp> live;
  ShadedWarpPool* pool = nullptr;  ///< to which it returns; null: it stays where it is
  /// Draw order of the first and the last primitive in a quad's colour, for the order monitor.
  std::array<std::uint32_t, quads_per_warp> first_primitive;
  std::array<std::uint32_t, quads_per_warp> last_primitive;
  std::array<DrawIndex, quads_per_warp> draw{};  ///< of each quad; of a merged one, that of its front
  std::array<LaneMask, quads_per_warp> covered;  ///< where RenderContext::hands_on_coverage: before pruning
  std::array<QuadColor, quads_per_warp> color;   ///< premultiplied; (0,0,0,0) in dead lanes

  /// Takes samples out: of each quad those of `left` stay, and quads without any go.
  void keep(const std::array<LaneMask, quads_per_warp>& left);
  /// For ZROP, which tests it late: has it alone meanwhile, and takes samples out. Warps are not made const.
  inline ShadedWarp& editable() const { return const_cast<ShadedWarp&>(*this); }
  /// Back to its pool: by whoever takes its last quad off the pipeline, or passes it over if it has none.
  inline void release() const;
};

/// Shaded warps of an SM array, as many as were ever in use at a time. The one released last is taken first: it is still
/// in the host's cache.
class ShadedWarpPool {
 public:
  ShadedWarp& take() {
    if (free_.empty()) {
      warps_.emplace_back().pool = this;
      free_.push_back(&warps_.back());
    }
    ShadedWarp& warp = *free_.back();
    free_.pop_back();
    return warp;
  }

 private:
  friend struct ShadedWarp;
  std::deque<ShadedWarp> warps_;
  std::vector<ShadedWarp*> free_;
};

void ShadedWarp::release() const {
  if (pool != nullptr) pool->free_.push_back(const_cast<ShadedWarp*>(this));
}

/// Draw order of a quad's primitive, through all draws of the frame.
inline std::uint32_t primitive_order(const Quad& quad) { return 2 * quad.splat + quad.triangle; }

/// SM to PROP, and to ZROP and back to be tested late: registers stay in the SM until PROP releases the slot.
struct ShadedWarpItem {
  const ShadedWarp* warp = nullptr;
};

/// PROP to SM.
struct WarpRelease {
  std::uint16_t slot = 0;
};

/// One quad on its way to blending. Quads of a warp stay in order, and whoever takes the last off the pipeline releases
/// the warp. Like a `Quad` without values unless it begins with braces.
struct ColorQuad {
  const ShadedWarp* warp;
  std::uint32_t index;  ///< in the warp
  unsigned position() const { return warp->position[index]; }
  LaneMask live() const { return warp->live[index]; }
  const QuadColor& color() const { return warp->color[index]; }
  bool is_last() const { return index + 1 == warp->count; }
};

/// Quads that move from PROP to CROP together: in a cycle as many beats as the rate needs.
struct ColorBeat {
  static constexpr unsigned capacity = 4;
  static constexpr unsigned in_a_cycle(Rate quads) { return (quads.most_in_a_cycle() + capacity - 1) / capacity; }
  std::uint8_t count = 0;
  Mark mark = Mark::none;
  std::array<ColorQuad, capacity> quads;
};

/// Pixels of one quad position that newly passed the termination threshold.
struct TerminationSignal {
  TileId tile;
  std::uint8_t position = 0;
  LaneMask pixels = 0;
  std::uint16_t epoch = 0;  ///< of the draw (DrawCall::epoch): once that has passed, the signal is void
};

/// ZROP to RASTER: what Hi-Z is to know of a raster tile, or a mark.
struct HiZUpdate {
  TileId tile;
  std::uint8_t part = 0;    ///< raster tile of the screen tile: 2 * row + column, 0 to 3
  Mark mark = Mark::none;   ///< or a mark, behind the updates of what was drawn before it; then there is no raster tile
  std::uint16_t epoch = 0;  ///< of the draw (HiZPlan::epoch): once that has passed, the update is void
  std::uint32_t farthest = 0;  ///< depth stored at any of its pixels in the frame, as store_depth has it
};

/// ZROP to CROP: reads of the depth-stencil target, which take the ROPs' port to L2 (crop.port_flits_per_cycle).
struct PortReads {
  std::uint32_t flits = 0;
};

/// CROP to DRAW: all that was drawn before a mark has been blended (BarrierPlan).
struct BlendsDone {
  Mark mark = Mark::none;
};

/// CROP to ZROP: signals of one cycle, or some of them.
struct TerminationBeat {
  static constexpr unsigned capacity = 4;
  std::uint8_t count = 0;
  std::array<TerminationSignal, capacity> signals;
};

}  // namespace vrpipe
