#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <vrpipe/arithmetic/blend.h>
#include <vrpipe/pipeline/frame.h>
#include <vrpipe/pipeline/payload.h>

/// What `vrpipe microbench` draws: the workloads of the paper's analysis (VII), and those with which a real GPU was measured
/// beside it. Rectangles are filled rectangles, of whole pixels; nothing is pruned, and nothing terminates early.
namespace vrpipe::microbench {

using FramePointer = std::shared_ptr<const Frame>;

/// What takes it draws in screen tiles of one GPC alone.
struct GpcTiles {
  unsigned gpcs = 1;  ///< that share the screen
  std::function<bool(TileId)> owns = [](TileId) { return true; };
};

// Tile binning.

/// Rectangles of one quad, one in each of these screen tiles, in this order; tiles are numbered row by row.
FramePointer quads_in_tiles(const std::vector<unsigned>& tiles, const GpcTiles& gpc);
/// `rounds` of them over `tiles` screen tiles.
FramePointer rounds_over_tiles(unsigned tiles, unsigned rounds, const GpcTiles& gpc);
/// Two of them in a row of quads, so many pixels from one another.
FramePointer pair_at_distance(unsigned pixels);
/// Two of them at one place, and `culled` rectangles beyond the viewport between them.
FramePointer pair_with_gap(unsigned culled);

// ROP throughput.

/// Rectangles of side x side pixels, one upon another.
FramePointer stacked_layers(unsigned side, unsigned layers, bool blend);

// Coverage of quads.

/// Which pixels of a quad pass.
enum class LivePixels : std::uint8_t { four, three, two_horizontal, two_vertical, two_diagonal, one };
unsigned live_of(LivePixels pixels);
/// Layers of side x side pixels where a stencil that was drawn before lets these pixels of each quad pass.
FramePointer layers_through_stencil(LivePixels pixels, unsigned side, unsigned layers);

struct Shape {
  const char* name;
  unsigned width, height;  ///< pixels
  bool odd_x, odd_y;       ///< its left and upper edge go through quads
  unsigned quads() const;
  unsigned live_per_quad() const { return width * height / quads(); }
};
/// Those that a real GPU was measured with.
const std::vector<Shape>& shapes();
/// So many of a shape all over 512x512 pixels.
FramePointer scattered(const Shape& shape, unsigned count);

// Colour cache.

/// `rounds` of rectangles of width x height pixels in the upper left corner of `tiles` screen tiles, in turn.
FramePointer rectangles_in_turn(unsigned tiles, unsigned rounds, unsigned width, unsigned height, bool blend,
                                const GpcTiles& gpc);

// Order of blending.

/// Layers of random colours and alphas that overlap on side x side pixels, as splats of two triangles.
FramePointer overlapping_layers(unsigned layers, unsigned side);
/// What `overlapping_layers` gives, one layer after the other: the value of each pixel.
std::array<float, 4> blended_in_order(const Frame& frame, ColorFormat format, BlendRounding rounding);

// The ROPs by themselves.

/// A rectangle in the grid of pixels.
struct Box {
  unsigned x, y, width, height;
};
/// What becomes of rectangles.
enum class BoxesAre : std::uint8_t {
  blended,         ///< each changes the values that it meets, until their alpha is about 1
  unchanged,       ///< blended where alpha is 1, so that no value changes
  written,         ///< not blended: they take the place of what is there
  killed,          ///< by stencil
  stencil_written  ///< nothing is shaded; each increments the stencil that it meets
};
/// `rounds` times all of the boxes, one after the other.
FramePointer boxes_in_turn(const std::vector<Box>& boxes, unsigned rounds, BoxesAre what);
/// `rounds` times one of width x height pixels in each of so many cells of whole screen tiles.
FramePointer strips(unsigned width, unsigned height, unsigned cells, unsigned rounds, BoxesAre what);
/// `rounds` times these boxes, each within a screen tile, in each of `tiles` screen tiles in turn, behind so many rounds of the first
/// of them alone.
FramePointer boxes_of_tiles(const std::vector<Box>& boxes, unsigned tiles, unsigned rounds, BoxesAre what,
                            const GpcTiles& gpc, unsigned of_the_first = 0);

/// So many of `side` x `side` pixels, each anywhere in the upper left `region` x `region` pixels, at multiples of `step` pixels; the
/// same ones each time.
FramePointer scattered_boxes(unsigned side, unsigned step, unsigned region, unsigned count, BoxesAre what);

/// What becomes of splats.
enum class SplatsAre : std::uint8_t { blended, written, passed, killed };
/// The first `count` of measured::equal_splats, in its image.
FramePointer equal_splats(double a, double b, float opacity, unsigned count, unsigned region, SplatsAre what);

// Front end, and rates at which quads are killed.

enum class Small : std::uint8_t { culled, rectangle, two_triangles };
/// Primitives of 2x2 pixels on 64x64, or beyond the viewport, or splats of two triangles. What is visible is killed by stencil.
FramePointer small_primitives(Small kind, unsigned count);

enum class KilledBy : std::uint8_t { stencil, depth, hi_z, shader };
/// Rectangles of side x side pixels, at places that are multiples of the side in an image of image x image, moved by `offset`.
FramePointer killed_rectangles(KilledBy killer, unsigned side, unsigned count, unsigned image, unsigned offset = 0);

}  // namespace vrpipe::microbench
