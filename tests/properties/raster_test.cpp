#include <boost/multiprecision/cpp_int.hpp>

#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/raster.h>
#include <vrpipe/pipeline/slots/vpo.h>

#include "scenes.h"

namespace vrpipe {
namespace {

using namespace testing;
using Wide = boost::multiprecision::int128_t;

/// The top-left rule, written from its definition (y down, the triangle turned so that its area is positive).
bool covers_pixel(const SnappedTriangle& given, unsigned bits, std::uint32_t x, std::uint32_t y) {
  SnappedTriangle t = given;
  if (doubled_area(t) < 0) {
    std::swap(t.x[1], t.x[2]);
    std::swap(t.y[1], t.y[2]);
  }
  const Wide sx = (Wide{2 * x + 1} << bits) / 2;
  const Wide sy = (Wide{2 * y + 1} << bits) / 2;
  for (unsigned i = 0; i < 3; ++i) {
    const unsigned j = (i + 1) % 3;
    const Wide across = Wide{t.x[j]} - t.x[i];
    const Wide down = Wide{t.y[j]} - t.y[i];
    const Wide edge = across * (sy - t.y[i]) - down * (sx - t.x[i]);
    const bool top_left = (down == 0 && across > 0) || down < 0;
    if (edge < 0 || (edge == 0 && !top_left)) return false;
  }
  return true;
}

RC_GTEST_PROP(Raster, EachSampleOfASplatIsProducedExactlyOnce, ()) {
  const std::uint32_t width = *rc::gen::element(1U, 16U, 17U, 64U);
  const std::uint32_t height = *rc::gen::element(1U, 15U, 33U);
  const Draw draw = draw_of(width, height, {*splat_in(width, height, 1.0F)});
  RenderContext context = context_of(draw);
  context.precision.subpixel_bits = *rc::gen::element(8U, 4U, 12U);

  const auto make = [&](const char* slot, const char* name) {
    const Implementation& found = Registry::instance().find(slot, name);
    return found.make_behaviour(*found.make_parameters(), context);
  };
  const auto vpo = make("vpo", "primitive-assembly");
  const auto raster = make("raster", "tile-rasterizer");
  auto& rasterizer = dynamic_cast<RasterBehaviour&>(*raster);
  std::array<Primitive, 2> primitives;
  const unsigned count = dynamic_cast<VpoBehaviour&>(*vpo).assemble(0, 0, primitives);

  // In one piece or cut into grids, whichever.
  const std::int32_t grid = *rc::gen::element(16384, 64, 16, 7);
  std::vector<unsigned> hits(std::size_t{width} * height);
  for (unsigned i = 0; i < count; ++i) {
    for (std::int32_t y = 0; y < static_cast<std::int32_t>(height); y += grid) {
      for (std::int32_t x = 0; x < static_cast<std::int32_t>(width); x += grid) {
        const PixelRect& bounds = primitives[i].bounds;
        if (x >= bounds.x1 || y >= bounds.y1 || x + grid <= bounds.x0 || y + grid <= bounds.y0) continue;
        rasterizer.begin(primitives[i], {x, y, x + grid, y + grid});
        QuadBeat beat;
        unsigned tests = 0;
        bool first = false;
        while (rasterizer.next(beat, tests, first)) {
          for (unsigned q = 0; q < beat.count; ++q) {
            for (unsigned lane = 0; lane < 4; ++lane) {
              if (((beat.quads[q].coverage >> lane) & 1U) == 0) continue;
              const std::uint32_t px = beat.tile.x * 16U + beat.quads[q].position % 8U * 2 + (lane & 1U);
              const std::uint32_t py = beat.tile.y * 16U + beat.quads[q].position / 8U * 2 + (lane >> 1U);
              RC_ASSERT(px < width && py < height);
              ++hits[std::size_t{py} * width + px];
            }
          }
        }
      }
    }
  }
  std::array<SnappedTriangle, 2> snapped;
  const bool finite = snap_triangle(context, 0, 0, 0, snapped[0]) && snap_triangle(context, 0, 0, 1, snapped[1]);
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      unsigned expected = 0;
      for (unsigned i = 0; finite && i < 2; ++i) {
        if (doubled_area(snapped[i]) != 0 && covers_pixel(snapped[i], context.precision.subpixel_bits, x, y))
          ++expected;
      }
      RC_ASSERT(hits[std::size_t{y} * width + x] == expected);
      RC_ASSERT(expected <= 1U);
    }
  }
}

}  // namespace
}  // namespace vrpipe
