#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/geometry.h>

#include "raster/raster.h"
#include "vpo/vpo.h"

namespace vrpipe::testing {

/// How often each sample of an image is covered, row by row.
struct Coverage {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<unsigned> times;
  std::uint64_t quads = 0;
  std::uint64_t fragments = 0;

  unsigned at(std::uint32_t x, std::uint32_t y) const { return times[std::size_t{y} * width + x]; }
  bool operator==(const Coverage& other) const { return times == other.times; }
};

/// What the units cover: vertex operations, then the rasteriser, over the whole draw.
inline Coverage rasterize(const RenderContext& context, const PixelRect& clip = {0, 0, 16384, 16384}) {
  const Draw& draw = *context.draw(0).geometry;
  Coverage coverage{draw.width, draw.height, std::vector<unsigned>(std::size_t{draw.width} * draw.height), 0, 0};
  const PrimitiveAssembly::Parameters vpo_parameters;
  const TileRasterizer::Parameters raster_parameters;
  PrimitiveAssembly vpo(vpo_parameters, context);
  TileRasterizer raster(raster_parameters, context);
  std::array<Primitive, 2> primitives;
  for (std::uint32_t splat = 0; splat < draw.splats.size(); ++splat) {
    const unsigned count = vpo.assemble(0, splat, primitives);
    for (unsigned i = 0; i < count; ++i) {
      raster.begin(primitives[i], clip);
      QuadBeat beat;
      unsigned tests = 0;
      bool new_screen_tile = false;
      while (raster.next(beat, tests, new_screen_tile)) {
        coverage.quads += beat.count;
        for (unsigned q = 0; q < beat.count; ++q) {
          for (unsigned lane = 0; lane < 4; ++lane) {
            if (((beat.quads[q].coverage >> lane) & 1U) == 0) continue;
            const unsigned position = beat.quads[q].position;
            const std::uint32_t x = beat.tile.x * 16U + position % 8 * 2 + lane % 2;
            const std::uint32_t y = beat.tile.y * 16U + position / 8 * 2 + lane / 2;
            ++coverage.times.at(std::size_t{y} * draw.width + x);
            ++coverage.fragments;
          }
        }
      }
    }
  }
  return coverage;
}

/// Whether a snapped triangle covers the sample of a pixel: the sample, moved right by an infinitesimal and down by a
/// smaller one, lies strictly inside. That is the top-left rule, without mention of edges' directions.
inline bool covers(const SnappedTriangle& t, unsigned subpixel_bits, std::int64_t px, std::int64_t py) {
  using Wide = __int128;
  const Wide unit = Wide{1} << 56;  // an infinitesimal is 1, the larger one 2^27
  const std::int64_t step = std::int64_t{1} << subpixel_bits;
  const Wide x = Wide{px * step + step / 2} * unit + (Wide{1} << 27);
  const Wide y = Wide{py * step + step / 2} * unit + 1;
  int positive = 0;
  int negative = 0;
  for (unsigned i = 0; i < 3; ++i) {
    const unsigned j = (i + 1) % 3;
    const Wide cross =
        (Wide{t.x[j]} - t.x[i]) * (y - Wide{t.y[i]} * unit) - (Wide{t.y[j]} - t.y[i]) * (x - Wide{t.x[i]} * unit);
    positive += cross > 0;
    negative += cross < 0;
  }
  return positive == 3 || negative == 3;
}

/// The same, brute force: every sample against every snapped triangle.
inline Coverage cover_exactly(const RenderContext& context) {
  const Draw& draw = *context.draw(0).geometry;
  Coverage coverage{draw.width, draw.height, std::vector<unsigned>(std::size_t{draw.width} * draw.height), 0, 0};
  for (std::uint32_t splat = 0; splat < draw.splats.size(); ++splat) {
    for (unsigned triangle = 0; triangle < primitives_per_splat(context.draw(0)); ++triangle) {
      SnappedTriangle snapped;
      if (!snap_triangle(context, 0, splat, triangle, snapped)) continue;
      for (std::uint32_t y = 0; y < draw.height; y += 2) {
        for (std::uint32_t x = 0; x < draw.width; x += 2) {
          bool any = false;
          for (unsigned lane = 0; lane < 4; ++lane) {
            const std::uint32_t sx = x + lane % 2;
            const std::uint32_t sy = y + lane / 2;
            if (sx >= draw.width || sy >= draw.height || !covers(snapped, context.precision.subpixel_bits, sx, sy))
              continue;
            ++coverage.times[std::size_t{sy} * draw.width + sx];
            ++coverage.fragments;
            any = true;
          }
          coverage.quads += any;
        }
      }
    }
  }
  return coverage;
}

}  // namespace vrpipe::testing
