// Hi-Z against samples: what it culls fails the depth test everywhere, and what lies well behind is culled.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <set>

#include <gtest/gtest.h>

#include "raster/raster.h"
#include "support/builders.h"
#include "support/mixed_reference.h"

namespace vrpipe {
namespace {

using testing::uniform;

constexpr std::uint32_t hi_z_width = 60;  // the last raster tiles are cut
constexpr std::uint32_t hi_z_height = 44;
constexpr std::uint32_t hi_z_primitives = 40;

constexpr DepthFormat depth_formats[] = {DepthFormat::d16, DepthFormat::d24, DepthFormat::d32f};

TEST(HiZ, KeepsADepthInItsBitsRoundedUp) {
  for (const DepthFormat format : depth_formats) {
    for (unsigned bits = 1; bits <= 24; ++bits) {
      std::set<std::uint32_t> kept;
      std::uint32_t before = 0;
      for (unsigned i = 0; i <= 4096; ++i) {
        const double depth = i / 4096.0;
        const std::uint32_t stored = store_depth(format, depth);
        const std::uint32_t top = top_of_step(format, bits, stored);
        kept.insert(top);
        EXPECT_GE(top, stored);
        EXPECT_GE(top, before);
        EXPECT_LE(top, store_depth(format, 1));
        EXPECT_EQ(top_of_step(format, bits, top), top);
        EXPECT_LE(depth_of(format, top) - depth_of(format, stored), std::ldexp(1.0, -static_cast<int>(bits)));
        before = top;
      }
      if (bits < 12) {
        EXPECT_EQ(kept.size(), std::size_t{1} << bits) << name_of(format);
      }
    }
  }
}

/// Triangles of a mesh that cross one another, or splats of any depth; drawn behind a draw that stores.
class Scene {
 public:
  Scene(std::uint64_t seed, bool splats, DepthFormat format, Compare compare) : frame_(hi_z_width, hi_z_height) {
    frame_.set_depth_format(format);
    auto stored = std::make_shared<Draw>(testing::draw_of(hi_z_width, hi_z_height, {Splat{}}));
    DrawState state;
    state.depth = {true, Compare::less, true};
    frame_.draw(stored, state);
    auto tested = std::make_shared<Draw>(testing::draw_of(hi_z_width, hi_z_height));
    if (splats) {
      *tested = testing::random_draw(hi_z_width, hi_z_height, hi_z_primitives, seed);
      for (std::uint32_t i = 0; i < hi_z_primitives; ++i) tested->splats[i].depth = uniform(seed, 7000 + i, 0, 1);
    } else {
      state.shader = FragmentShader::vertex;
      for (std::uint32_t i = 0; i < hi_z_primitives; ++i) tested->mesh.push_back(triangle(seed, i));
    }
    state.depth = {true, compare, false};
    frame_.draw(tested, state);
    context_ = testing::context_of(frame_);
    store(seed);
  }
  Scene(const Scene&) = delete;

  const RenderContext& context() const { return context_; }
  DepthFormat format() const { return frame_.depth_format(); }
  std::uint32_t at(std::int32_t x, std::int32_t y) const {
    return depth_[static_cast<std::size_t>(y) * hi_z_width + static_cast<std::size_t>(x)];
  }

  /// The farthest of a raster tile's pixels in the frame.
  std::uint32_t farthest(std::int32_t x, std::int32_t y) const {
    std::uint32_t farthest = 0;
    for (std::int32_t row = y; row < std::min<std::int32_t>(y + 8, hi_z_height); ++row) {
      for (std::int32_t column = x; column < std::min<std::int32_t>(x + 8, hi_z_width); ++column) {
        farthest = std::max(farthest, at(column, row));
      }
    }
    return farthest;
  }

  /// The samples that are left of a primitive.
  using Covered = std::array<bool, std::size_t{hi_z_width} * hi_z_height>;
  Covered rasterize(TileRasterizer& raster, const Primitive& primitive) const {
    Covered covered{};
    raster.begin(primitive, primitive.bounds);
    QuadBeat beat;
    unsigned tests = 0;
    bool new_screen_tile = false;
    while (raster.next(beat, tests, new_screen_tile)) {
      for (unsigned q = 0; q < beat.count; ++q) {
        for (unsigned lane = 0; lane < 4; ++lane) {
          if ((beat.quads[q].coverage >> lane & 1U) == 0) continue;
          const unsigned position = beat.quads[q].position;
          const std::uint32_t x = beat.tile.x * 16U + position % 8 * 2 + lane % 2;
          covered.at(std::size_t{beat.tile.y * 16U + position / 8 * 2 + lane / 2} * hi_z_width + x) = true;
        }
      }
    }
    return covered;
  }
  void tell(TileRasterizer& raster) const {
    for (std::uint16_t y = 0; y < hi_z_height; y = static_cast<std::uint16_t>(y + 8)) {
      for (std::uint16_t x = 0; x < hi_z_width; x = static_cast<std::uint16_t>(x + 8)) {
        HiZUpdate update;
        update.tile = {static_cast<std::uint16_t>(x / 16), static_cast<std::uint16_t>(y / 16)};
        update.part = static_cast<std::uint8_t>(y / 8 % 2 * 2 + x / 8 % 2);
        update.farthest = farthest(x, y);
        raster.update(update);
      }
    }
  }
  std::vector<Primitive> assembled() const {
    std::vector<Primitive> all;
    const DrawCall& call = context_.draw(1);
    for (std::uint32_t i = 0; i < hi_z_primitives; ++i) {
      for (unsigned triangle = 0; triangle < primitives_per_splat(call); ++triangle) {
        Primitive primitive;
        primitive.splat = call.base + i;
        primitive.triangle = static_cast<std::uint8_t>(triangle);
        primitive.draw = 1;
        const Culling culling = cull_triangle(context_, 1, primitive.splat, triangle, primitive.bounds);
        if (culling == Culling::none) all.push_back(primitive);
      }
    }
    return all;
  }

 private:
  static MeshTriangle triangle(std::uint64_t seed, std::uint32_t i) {
    MeshTriangle made;
    const std::uint64_t k = 50ULL * i;
    // Some are thin, some far larger than the frame, some nearly flat.
    const float size = std::exp(uniform(seed, k, 1, 8));
    const float x = uniform(seed, k + 1, 0, hi_z_width);
    const float y = uniform(seed, k + 2, 0, hi_z_height);
    const float depth = uniform(seed, k + 3, 0, 1);
    const float slope = i % 3 == 0 ? 1e-6F : 1.0F;
    for (unsigned v = 0; v < 3; ++v) {
      MeshVertex& vertex = made.vertices[v];
      vertex = {};
      vertex.x = x + uniform(seed, k + 4 + v, -size, size);
      vertex.y = y + uniform(seed, k + 7 + v, -size, size) * (i % 4 == 0 ? 0.01F : 1.0F);
      vertex.depth = std::clamp(depth + slope * uniform(seed, k + 10 + v, -0.5F, 0.5F), 0.0F, 1.0F);
      vertex.inverse_w = 1;
    }
    return made;
  }
  /// Of each raster tile depths about one of its own.
  void store(std::uint64_t seed) {
    depth_.resize(std::size_t{hi_z_width} * hi_z_height);
    for (std::uint32_t y = 0; y < hi_z_height; ++y) {
      for (std::uint32_t x = 0; x < hi_z_width; ++x) {
        const std::uint64_t tile = y / 8 * 100 + x / 8;
        const float middle = uniform(seed, 9000 + tile, 0, 1);
        const float around = std::exp(uniform(seed, 10000 + tile, -14, -1));
        const float depth = middle + around * uniform(seed, 20000 + std::uint64_t{y} * hi_z_width + x, -1, 1);
        depth_[std::size_t{y} * hi_z_width + x] = store_depth(format(), static_cast<double>(depth));
      }
    }
  }

  Frame frame_;
  RenderContext context_;
  std::vector<std::uint32_t> depth_;
};

/// What became of a primitive's samples in a raster tile.
struct TileFate {
  unsigned kept = 0;
  unsigned culled = 0;
  unsigned culled_wrongly = 0;  ///< though they pass; or kept, though they are not covered
  double behind = 0;            ///< by how much all of its depth there is beyond the farthest that is stored
};
TileFate fate_of(const Scene& scene, const DepthPlane& plane, Compare compare, std::int32_t x0, std::int32_t y0,
                 const Scene::Covered& all, const Scene::Covered& left) {
  TileFate fate;
  double nearest = 1;
  for (std::int32_t y = y0; y < y0 + 8; ++y) {
    for (std::int32_t x = x0; x < x0 + 8; ++x) {
      nearest = std::min(nearest, plane.at(x, y));
      if (x >= static_cast<std::int32_t>(hi_z_width) || y >= static_cast<std::int32_t>(hi_z_height)) continue;
      const std::size_t place = static_cast<std::size_t>(y) * hi_z_width + static_cast<std::size_t>(x);
      if (left[place] && !all[place]) ++fate.culled_wrongly;
      if (left[place]) ++fate.kept;
      if (!all[place] || left[place]) continue;
      ++fate.culled;
      const std::uint32_t depth = store_depth(scene.format(), plane.at(x, y));
      if (testing::passes_by_table(compare, depth, scene.at(x, y))) ++fate.culled_wrongly;
    }
  }
  fate.behind = nearest - depth_of(scene.format(), scene.farthest(x0, y0));
  return fate;
}

TEST(HiZ, CullsWhatFailsAtEverySampleAlone) {
  std::uint64_t culled = 0;
  std::uint64_t kept = 0;
  std::uint64_t well_behind = 0;
  for (const bool splats : {false, true}) {
    for (const DepthFormat format : depth_formats) {
      for (const Compare compare : {Compare::less, Compare::less_equal, Compare::equal}) {
        for (unsigned bits = 1; bits <= 24; ++bits) {
          const Scene scene(mix(bits * 64 + static_cast<unsigned>(format) * 8 + static_cast<unsigned>(compare)), splats,
                            format, compare);
          TileRasterizer::Parameters on;
          on.hi_z_bits = bits;
          TileRasterizer::Parameters off;
          off.set("raster", "hi_z", "off");
          TileRasterizer with(on, scene.context());
          TileRasterizer without(off, scene.context());
          scene.tell(with);
          for (const Primitive& primitive : scene.assembled()) {
            const Scene::Covered left = scene.rasterize(with, primitive);
            const Scene::Covered all = scene.rasterize(without, primitive);
            const DepthPlane plane(scene.context(), primitive.draw, primitive.splat, primitive.triangle);
            for (std::int32_t y = 0; y < static_cast<std::int32_t>(hi_z_height); y += 8) {
              for (std::int32_t x = 0; x < static_cast<std::int32_t>(hi_z_width); x += 8) {
                const TileFate fate = fate_of(scene, plane, compare, x, y, all, left);
                SCOPED_TRACE(std::to_string(bits) + " bits, primitive " + std::to_string(primitive.splat));
                ASSERT_EQ(fate.culled_wrongly, 0U) << "raster tile at " << x << "," << y;
                culled += fate.culled;
                kept += fate.kept;
                // More than two steps behind, and two of the coarsest format.
                const double step = std::ldexp(1.0, -static_cast<int>(std::min(bits, 15U)));
                if (fate.behind > 2 * step) {
                  well_behind += fate.culled;
                  ASSERT_EQ(fate.kept, 0U) << "raster tile at " << x << "," << y << ", behind by " << fate.behind;
                }
              }
            }
          }
          EXPECT_GT(with.hi_z_tests.value(), 0U);
          EXPECT_EQ(with.hi_z_updates.value(), 8U * 6U);
          EXPECT_EQ(with.raster_tiles_kept.value() + with.hi_z_culled.value(), without.raster_tiles_kept.value());
          EXPECT_EQ(with.raster_tiles_tested.value(), without.raster_tiles_tested.value());
        }
      }
    }
  }
  EXPECT_GT(culled, 100000U);
  EXPECT_GT(kept, 100000U);
  EXPECT_GT(well_behind, 100000U);
}

TEST(HiZ, HoldsWhatAnotherOneOfTheFrameHas) {
  const Scene scene(7, false, DepthFormat::d24, Compare::less);
  const TileRasterizer::Parameters parameters;
  TileRasterizer told(parameters, scene.context()), holds(parameters, scene.context());
  scene.tell(told);
  holds.hold_as(told);
  for (const Primitive& primitive : scene.assembled())
    EXPECT_EQ(scene.rasterize(holds, primitive), scene.rasterize(told, primitive)) << primitive.splat;
  EXPECT_GT(holds.hi_z_culled.value(), 0U);
  EXPECT_EQ(holds.hi_z_culled.value(), told.hi_z_culled.value());
  EXPECT_EQ(holds.hi_z_updates.value(), 0U);
}

TEST(HiZ, IsNotBuiltWhereNothingIsStored) {
  const Draw draw = testing::draw_of(hi_z_width, hi_z_height, {testing::round_splat(20, 20, 5, 1)});
  DrawState state;
  state.depth = {true, Compare::less, false};
  const RenderContext context = testing::context_of(draw, state);
  const TileRasterizer::Parameters parameters;
  TileRasterizer raster(parameters, context);
  HiZUpdate update;
  update.farthest = 0;
  raster.update(update);
  EXPECT_EQ(raster.hi_z_updates.value(), 0U);
}

TEST(HiZ, ForgetsAtAClearOfDepthAndTakesNothingFromBefore) {
  Frame frame(16, 16);
  DrawState state;
  state.depth = {true, Compare::less, true};
  const auto splats = std::make_shared<Draw>(testing::draw_of(16, 16, {testing::flat_box(0, 0, 16, 16, 1)}));
  frame.draw(splats, state);
  Clear clear;
  clear.depth = true;
  clear.depth_value = 0.5F;
  frame.clear(clear);
  frame.draw(splats, state);
  const RenderContext context = testing::context_of(frame);
  HiZ hi_z(context, 24);
  Primitive primitive;
  primitive.bounds = {0, 0, 16, 16};
  EXPECT_TRUE(hi_z.begin(primitive));
  const PixelRect area{0, 0, 8, 8};
  EXPECT_FALSE(hi_z.hides({0, 0}, 0, area)) << "of depth 0, in front of 1";
  HiZUpdate update;
  update.farthest = 0;
  hi_z.update(update);
  EXPECT_TRUE(hi_z.hides({0, 0}, 0, area));
  EXPECT_FALSE(hi_z.hides({0, 0}, 1, area)) << "another raster tile";
  primitive.splat = 1;
  primitive.draw = 1;
  EXPECT_TRUE(hi_z.begin(primitive));
  EXPECT_FALSE(hi_z.hides({0, 0}, 0, area)) << "cleared to 0.5";
  hi_z.update(update);
  EXPECT_FALSE(hi_z.hides({0, 0}, 0, area)) << "late, from before the clear";
  update.epoch = 1;
  hi_z.update(update);
  EXPECT_TRUE(hi_z.hides({0, 0}, 0, area));
}

}  // namespace
}  // namespace vrpipe
