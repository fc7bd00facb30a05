#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/testkit/sink.h>

#include "support/builders.h"

namespace vrpipe::testing {

/// A draw of 128x128 pixels, empty at first, and RASTER's jobs.
class RasterScene {
 protected:
  RasterScene() : draw(draw_of(128, 128)), context(context_of(draw)) {
    change_state(context, [&](DrawState& drawn) { drawn.obb_padding = 0; });
  }

  /// The jobs of all triangles of the draw, unclipped.
  std::vector<RasterJob> jobs() const {
    std::vector<RasterJob> all;
    for (std::uint32_t splat = 0; splat < draw.splats.size(); ++splat) {
      for (unsigned triangle = 0; triangle < primitives_per_splat(context.draw(0)); ++triangle) {
        SnappedTriangle snapped;
        if (!snap_triangle(context, 0, splat, triangle, snapped) || doubled_area(snapped) == 0) continue;
        RasterJob job;
        job.primitive.splat = splat;
        job.primitive.triangle = static_cast<std::uint8_t>(triangle);
        job.primitive.bounds = covered_bounds(snapped, context.precision.subpixel_bits, draw.width, draw.height);
        job.clip = job.primitive.bounds;
        if (!job.primitive.bounds.empty()) all.push_back(job);
      }
    }
    return all;
  }
  void add_triangle(const ScreenTriangle& triangle) {
    draw.triangles.push_back(triangle);
    draw.splats.emplace_back();
  }
  /// A triangle that covers the whole image: 4096 quads in 256 raster tiles.
  void add_full() { add_triangle({{-1, 300, -1}, {-1, -1, 300}}); }
  void add_one_quad(float x) { add_triangle(one_quad_triangle(x, 4)); }

  Draw draw;
  RenderContext context;
};

inline std::uint64_t quads_in(const testkit::Sink<QuadBeat>& sink) {
  std::uint64_t quads = 0;
  for (const auto& record : sink.records()) quads += record.item.count;
  return quads;
}

}  // namespace vrpipe::testing
