#include "sm/sm.h"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

using testing::draw_of;
using testing::flat_box;
using testing::round_splat;

/// A shader for a few splats, one quad or pair at a time.
struct Shader {
  explicit Shader(std::vector<Splat> splats, std::uint32_t width = 64, std::uint32_t height = 64)
      : draw(draw_of(width, height, std::move(splats))), context(testing::context_of(draw)), sm(parameters, context) {}

  ShadedWarp shade(std::vector<Quad> quads, std::uint8_t merge_pairs = 0, TileId tile = {0, 0}) {
    Warp warp;
    warp.tile = tile;
    warp.merge_pairs = merge_pairs;
    for (const Quad& quad : quads) warp.quads[warp.count++] = quad;
    ShadedWarp out;
    sm.shade(warp, out);
    return out;
  }

  Draw draw;
  RenderContext context;
  SplatShader::Parameters parameters;
  SplatShader sm;
};

Quad quad_of(std::uint32_t splat, unsigned position = 0, LaneMask coverage = all_lanes, std::uint8_t triangle = 0) {
  return {splat, static_cast<std::uint8_t>(position), coverage, static_cast<std::uint16_t>(triangle & 1U), 0};
}

/// Alpha of a splat at a point, in double.
double alpha_at(const Splat& splat, double x, double y) {
  const double dx = x - static_cast<double>(splat.cx);
  const double dy = y - static_cast<double>(splat.cy);
  const double ax = splat.ax, ay = splat.ay, bx = splat.bx, by = splat.by, r = splat.r;
  const double u = (dx * ax + dy * ay) / (ax * ax + ay * ay) * r;
  const double v = (dx * bx + dy * by) / (bx * bx + by * by) * r;
  return std::fmin(0.99, static_cast<double>(splat.opacity) * std::exp(-0.5 * (u * u + v * v)));
}

// case R15
TEST(SplatShader, MoreWarpsThanSlotsHaveNumbersAreRefused) {
  const Draw draw = draw_of(64, 64, {});
  const RenderContext context = testing::context_of(draw);
  SplatShader::Parameters parameters;
  parameters.cores = 255;
  parameters.warps_per_core = 256;
  EXPECT_NO_THROW(SplatShader(parameters, context));
  parameters.cores = 256;
  EXPECT_THROW(SplatShader(parameters, context), UserError);
}

TEST(SplatShader, OneSplatIsItsClosedFormAtEverySample) {
  for (std::uint64_t i = 0; i < 300; ++i) {
    const Splat splat = testing::splat_at(testing::uniform(i, 0, 0, 16), testing::uniform(i, 1, 0, 16),
                                          testing::uniform(i, 2, 0.6F, 8), testing::uniform(i, 3, 0.6F, 8),
                                          testing::uniform(i, 4, 0, 6.2F), testing::uniform(i, 5, 0.1F, 1));
    Shader shader({splat});
    testing::change_state(shader.context, [](DrawState& state) { state.pruning_threshold = 0; });
    for (unsigned position = 0; position < 64; position += 9) {
      const ShadedWarp out = shader.shade({quad_of(0, position)});
      ASSERT_EQ(out.count, 1);
      for (unsigned lane = 0; lane < 4; ++lane) {
        const double x = position % 8 * 2 + lane % 2 + 0.5;
        const double y = position / 8 * 2 + lane / 2 + 0.5;
        const double exact = alpha_at(splat, x, y);
        ASSERT_NEAR(static_cast<double>(out.color[0].alpha[lane]), exact, 2e-5 * exact + 1e-30) << i;
      }
    }
  }
}

// case R15
TEST(SplatShader, AtTheCornersOfItsBoxASplatIsROneSigmasOutAlongBothAxes) {
  // The corner (8 + 4, 8 + 2) on a sample: u = v = r, alpha = o exp(-r^2) = 1 / (255^2 o).
  Splat splat = flat_box(4.5F, 6.5F, 12.5F, 10.5F, 0.5F);
  splat.r = std::sqrt(2 * std::log(255 * 0.5F));
  Shader shader({splat});
  testing::change_state(shader.context, [](DrawState& state) { state.pruning_threshold = 0; });
  const ShadedWarp out = shader.shade({quad_of(0, 8 * 5 + 6)});
  EXPECT_NEAR(static_cast<double>(out.color[0].alpha[0]), 1 / (255.0 * 255.0 * 0.5), 1e-9);
}

// case R16
TEST(SplatShader, OnHugeSplatsAlphaIsWithinTheErrorOfTheirCoordinates) {
  for (const float sigma : {1e3F, 1e5F, 1e6F}) {
    for (std::uint64_t i = 0; i < 50; ++i) {
      const float angle = testing::uniform(i, 6, 0, 6.2F);
      const float away = testing::uniform(i, 7, 0, 2) * sigma;
      const Splat splat = testing::splat_at(8 + away * std::cos(angle), 8 + away * std::sin(angle), sigma, sigma / 3,
                                            angle + 0.3F, 0.9F);
      Shader shader({splat});
      const ShadedWarp out = shader.shade({quad_of(0, 27)});
      const double exact = alpha_at(splat, 6.5, 6.5);
      if (exact < 0.01) continue;
      // dx and dy carry half an ulp of the centre; u, v and their squares a few more roundings.
      const double r = std::sqrt(-2 * std::log(exact / 0.9));
      EXPECT_NEAR(static_cast<double>(out.color[0].alpha[0]), exact, exact * (r + 1) * 8 * 0x1p-24 * (1 + 3 * r))
          << sigma;
    }
  }
}

// case O02
TEST(SplatShader, ASplatBelowThePruningThresholdHasNoFragment) {
  Shader shader({flat_box(0, 0, 16, 16, std::nextafter(1.0F / 255.0F, 0.0F))});
  EXPECT_EQ(shader.shade({quad_of(0)}).count, 0);
  EXPECT_EQ(shader.sm.fragments_pruned.value(), 4U);
}

// case O03
TEST(SplatShader, AlphaOfExactlyOne255thIsKept) {
  Splat point = {3.5F, 3.5F, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1.0F / 255.0F};
  Shader shader({point});
  const ShadedWarp out = shader.shade({quad_of(0, 8 + 1, 0b1000)});
  ASSERT_EQ(out.count, 1);
  EXPECT_EQ(out.color[0].alpha[3], 1.0F / 255.0F);
}

// case O04
TEST(SplatShader, JustAboveOne255thAFragmentAtTheCentreIsKept) {
  const float opacity = std::nextafter(1.0F / 255.0F, 1.0F);
  Shader shader({round_splat(3.5F, 3.5F, 0.6F, opacity)});
  const ShadedWarp out = shader.shade({quad_of(0, 8 + 1)});
  ASSERT_EQ(out.count, 1);
  EXPECT_EQ(out.live[0], 0b1000);
}

// case O05
TEST(SplatShader, AnOpaqueSplatEndsAt3Point3290Sigmas) {
  constexpr float sigma = 10;
  const float reach = std::sqrt(2 * std::log(255.0F)) * sigma;
  EXPECT_NEAR(static_cast<double>(reach), 33.290, 0.001);
  const Splat splat = round_splat(100.5F, 100.5F, sigma, 1);
  Shader shader({splat}, 256, 256);
  unsigned kept = 0;
  for (std::uint16_t x = 100; x < 150; x += 2) {
    const TileId tile{static_cast<std::uint16_t>(x / 16), 100 / 16};
    const ShadedWarp out = shader.shade({quad_of(0, (100 % 16) / 2 * 8 + x % 16 / 2U, 0b0011)}, 0, tile);
    for (unsigned lane = 0; lane < 2; ++lane) {
      const bool live = out.count > 0 && ((out.live[0] >> lane) & 1U) != 0;
      EXPECT_EQ(live, static_cast<float>(x + lane - 100) < reach) << x + lane;
      kept += live;
    }
  }
  EXPECT_EQ(kept, 34U);
}

// case O06
TEST(SplatShader, ThePlateauOfAnOpaqueSplatHasTheRadiusOfItsClamp) {
  constexpr float sigma = 100;
  const double plateau = std::sqrt(2 * std::log(1 / 0.99)) * static_cast<double>(sigma);  // 14.18 pixels
  Shader shader({round_splat(100.5F, 100.5F, sigma, 1)}, 256, 256);
  for (std::uint16_t x = 100; x < 130; ++x) {
    const TileId tile{static_cast<std::uint16_t>(x / 16), 100 / 16};
    const ShadedWarp out = shader.shade({quad_of(0, (100 % 16) / 2 * 8 + x % 16 / 2U)}, 0, tile);
    EXPECT_EQ(out.color[0].alpha[x % 2] == 0.99F, x - 100 < plateau) << x;
  }
}

// case O08
TEST(SplatShader, TheCornersOfABoxHold1MinusPiOver4OfItsFragments) {
  const Splat splat = round_splat(128, 128, 30, 0.99F);
  Shader shader({splat}, 256, 256);
  const auto reach = static_cast<double>(splat.ax);
  for (std::uint16_t tile_y = 0; tile_y < 16; ++tile_y) {
    for (std::uint16_t tile_x = 0; tile_x < 16; ++tile_x) {
      for (unsigned position = 0; position < 64; ++position) {
        const double x = tile_x * 16 + position % 8 * 2 + 1;
        const double y = tile_y * 16 + position / 8 * 2 + 1;
        if (std::fabs(x - 128) < reach && std::fabs(y - 128) < reach)
          shader.shade({quad_of(0, position)}, 0, {tile_x, tile_y});
      }
    }
  }
  EXPECT_NEAR(static_cast<double>(shader.sm.fragments_pruned.value()) /
                  static_cast<double>(shader.sm.fragments_shaded.value()),
              0.2146, 0.006);
}

// case O09
TEST(SplatShader, TheBoxDoesNotDecideAlpha) {
  const Splat splat = testing::splat_at(9.3F, 7.1F, 3, 2, 0.4F, 0.7F);
  Splat enlarged = splat;
  for (float* axis : {&enlarged.ax, &enlarged.ay, &enlarged.bx, &enlarged.by, &enlarged.r}) *axis *= 2;
  Shader a({splat});
  Shader b({enlarged});
  for (unsigned position = 0; position < 64; ++position) {
    const ShadedWarp from_a = a.shade({quad_of(0, position)});
    const ShadedWarp from_b = b.shade({quad_of(0, position)});
    ASSERT_EQ(from_a.count, from_b.count);
    if (from_a.count > 0) {
      ASSERT_EQ(std::memcmp(&from_a.color[0], &from_b.color[0], sizeof from_a.color[0]), 0);
    }
  }
}

// case Q01
TEST(SplatShader, ThePartialQuadsOfASplatsTwoTrianglesMergeToItsWholeQuad) {
  Shader shader({testing::splat_at(4.7F, 5.2F, 2, 3, 0.6F, 0.8F, 0.3F, 0.6F, 0.9F)});
  const ShadedWarp whole = shader.shade({quad_of(0, 18)});
  const ShadedWarp merged = shader.shade({quad_of(0, 18, 0b0111, 0), quad_of(0, 18, 0b1000, 1)}, 1);
  ASSERT_EQ(merged.count, 1);
  EXPECT_EQ(merged.live[0], all_lanes);
  EXPECT_EQ(std::memcmp(&whole.color[0], &merged.color[0], sizeof whole.color[0]), 0);
  EXPECT_EQ(shader.sm.quads_merged.value(), 1U);
  EXPECT_EQ(shader.sm.fragments_merged.value(), 0U) << "no lane had two";
  EXPECT_EQ(shader.sm.fragments_of_back_quads.value(), 1U) << "the second quad has one all the same";
}

// case Q02
TEST(SplatShader, DeadLanesAreZeroAndDoNotTouchTheirPartners) {
  Shader shader({flat_box(0, 0, 16, 16, 0.5F, 0.25F), flat_box(0, 0, 16, 16, 0.75F, 1.0F)});
  const ShadedWarp one = shader.shade({quad_of(0, 0, 0b0101)});
  for (const unsigned lane : {1U, 3U}) {
    EXPECT_EQ(one.color[0].alpha[lane], 0.0F);
    EXPECT_EQ(one.color[0].red[lane], 0.0F);
    EXPECT_FALSE(std::signbit(one.color[0].alpha[lane]));
  }
  const ShadedWarp merged = shader.shade({quad_of(0, 0, 0b0101), quad_of(1, 0, 0b0011)}, 1);
  EXPECT_EQ(merged.live[0], 0b0111);
  EXPECT_EQ(merged.color[0].alpha[0], 0.5F + 0.5F * 0.75F);
  EXPECT_EQ(merged.color[0].alpha[1], 0.75F);
  EXPECT_EQ(merged.color[0].alpha[2], 0.5F);
  EXPECT_EQ(merged.color[0].alpha[3], 0.0F);
  EXPECT_EQ(merged.color[0].red[0], 0.125F + 0.5F * 0.75F);
}

// Also of splats whose set-ups share a place in the shader's tables.
TEST(SplatShader, EveryQuadOfAWarpHasTheColourThatItHasAlone) {
  const Draw draw = testing::random_draw(64, 64, 200, 4);
  Shader together(draw.splats);
  for (std::uint64_t i = 0; i < 500; ++i) {
    std::vector<Quad> quads;
    for (std::uint64_t k = 0; k < 1 + i % 8; ++k) {
      const auto splat =
          static_cast<std::uint32_t>(i % 3 == 0 ? mix(i) % 8 + 32 * (mix(i * 8 + k) % 6) : mix(i * 8 + k) % 200);
      quads.push_back(quad_of(splat, static_cast<unsigned>(mix(i * 64 + k) % 64)));
    }
    const ShadedWarp out = together.shade(quads, 0, {1, 2});
    unsigned at = 0;
    for (const Quad& quad : quads) {
      Shader one(draw.splats);
      const ShadedWarp alone = one.shade({quad}, 0, {1, 2});
      if (alone.count == 0) continue;
      ASSERT_LT(at, out.count);
      ASSERT_EQ(out.first_primitive[at], primitive_order(quad));
      ASSERT_EQ(out.live[at], alone.live[0]);
      ASSERT_EQ(std::memcmp(&out.color[at], &alone.color[0], sizeof alone.color[0]), 0) << i;
      ++at;
    }
    ASSERT_EQ(at, out.count);
  }
}

// case Q03
TEST(SplatShader, AQuadOfWhichAllIsPrunedLeavesAndIsCounted) {
  Shader shader({flat_box(0, 0, 16, 16, 0.001F), flat_box(0, 0, 16, 16, 0.5F)});
  const ShadedWarp out = shader.shade({quad_of(0, 1), quad_of(1, 2), quad_of(0, 3, 0b0110)});
  ASSERT_EQ(out.count, 1);
  EXPECT_EQ(out.position[0], 2);
  EXPECT_EQ(shader.sm.quads_shaded.value(), 3U);
  EXPECT_EQ(shader.sm.quads_pruned.value(), 2U);
  EXPECT_EQ(shader.sm.fragments_shaded.value(), 10U);
  EXPECT_EQ(shader.sm.fragments_pruned.value(), 6U);
}

// case Q04
TEST(SplatShader, AlphaIsClampedTo99Percent) {
  Shader shader({flat_box(0, 0, 16, 16, 1.0F)});
  EXPECT_EQ(shader.shade({quad_of(0)}).color[0].alpha[0], 0.99F);
}

// case Q04
TEST(SplatShader, ASplatWhoseCoordinatesOverflowIsNotLaunderedIntoAnOpaqueOne) {
  // Axes so short that sigmas per pixel overflow: u or v is Inf - Inf.
  for (const float tiny : {1e-38F, 1e-30F, 1e-20F}) {
    for (const float angle : {0.0F, 0.785398F, 2.0F}) {
      const float c = std::cos(angle) * tiny;
      const float s = std::sin(angle) * tiny;
      Shader shader({Splat{5.5F, 5.5F, c, s, -s, c, 3, 0, 1, 1, 1, 0.5F}});
      for (unsigned position = 0; position < 64; ++position) {
        const ShadedWarp out = shader.shade({quad_of(0, position)});
        for (unsigned lane = 0; lane < 4 && out.count > 0; ++lane) {
          EXPECT_LE(out.color[0].alpha[lane], 0.5F) << tiny << " at " << angle << " position " << position;
          EXPECT_FALSE(std::isnan(out.color[0].red[lane]));
        }
      }
    }
  }
}

// case Q05
TEST(SplatShader, ThePruningThresholdItselfIsKeptAndTheFloatBelowIsNot) {
  for (const float alpha : {std::nextafter(1.0F / 255.0F, 0.0F), 1.0F / 255.0F, std::nextafter(1.0F / 255.0F, 1.0F)}) {
    Shader shader({flat_box(0, 0, 16, 16, alpha)});
    EXPECT_EQ(shader.shade({quad_of(0)}).count, alpha >= 1.0F / 255.0F ? 1 : 0) << alpha;
  }
}

// case Q08
TEST(SplatShader, ColourIsPremultipliedWithOneRounding) {
  Shader shader({flat_box(0, 0, 16, 16, 0.7F, 0.3F, 0.9F, 123.0F)});
  const ShadedWarp out = shader.shade({quad_of(0)});
  EXPECT_EQ(out.color[0].red[2], 0.7F * 0.3F);
  EXPECT_EQ(out.color[0].green[2], 0.7F * 0.9F);
  EXPECT_EQ(out.color[0].blue[2], 0.7F * 123.0F);
}

// case B06
TEST(SplatShader, ColoursBeyondTheLargestHalfAreClampedAndCounted) {
  Shader shader({flat_box(0, 0, 16, 16, 0.5F, 1e30F, 70000.0F, 1.0F)});
  const ShadedWarp out = shader.shade({quad_of(0)});
  EXPECT_EQ(out.color[0].red[0], 0.5F * half_max);
  EXPECT_EQ(out.color[0].green[0], 0.5F * half_max);
  EXPECT_GE(shader.sm.colors_clamped.value(), 1U);
}

// case M10
TEST(SplatShader, PruningComesBeforeMerging) {
  Shader shader({flat_box(0, 0, 16, 16, 0.9F / 255), flat_box(0, 0, 16, 16, 0.9F / 255)});
  EXPECT_EQ(shader.shade({quad_of(0), quad_of(1)}, 1).count, 0);
  EXPECT_EQ(shader.sm.quads_pruned.value(), 2U);
  EXPECT_EQ(shader.sm.quads_merged.value(), 0U);
}

TEST(SplatShader, APairOfWhichOneIsPrunedLeavesTheOtherAsItIs) {
  Shader shader({flat_box(0, 0, 16, 16, 0.001F), flat_box(0, 0, 16, 16, 0.5F)});
  const ShadedWarp alone = shader.shade({quad_of(1)});
  for (const bool front_dead : {true, false}) {
    const ShadedWarp out = shader.shade({quad_of(front_dead ? 0 : 1), quad_of(front_dead ? 1 : 0)}, 1);
    ASSERT_EQ(out.count, 1);
    EXPECT_EQ(std::memcmp(&out.color[0], &alone.color[0], sizeof alone.color[0]), 0);
  }
  EXPECT_EQ(shader.sm.quads_merged.value(), 0U);
}

TEST(SplatShader, OnlyMarkedPairsMerge) {
  Shader shader({flat_box(0, 0, 16, 16, 0.5F)});
  const std::vector<Quad> quads(8, quad_of(0, 3));
  EXPECT_EQ(shader.shade(quads, 0).count, 8);
  EXPECT_EQ(shader.shade(quads, 0b0101).count, 6);
  EXPECT_EQ(shader.shade(quads, 0b1111).count, 4);
  EXPECT_EQ(shader.sm.quads_merged.value(), 6U);
  EXPECT_EQ(shader.sm.fragments_merged.value(), 24U);
  EXPECT_EQ(shader.sm.fragments_of_back_quads.value(), 24U);
}

TEST(SplatShader, AMergedQuadTellsItsFirstAndLastPrimitive) {
  Shader shader({flat_box(0, 0, 16, 16, 0.5F), flat_box(0, 0, 16, 16, 0.5F)});
  const ShadedWarp out = shader.shade({quad_of(0, 3, all_lanes, 1), quad_of(1, 3, all_lanes, 0)}, 1);
  EXPECT_EQ(out.first_primitive[0], 1U);
  EXPECT_EQ(out.last_primitive[0], 2U);
}

// case T06
TEST(SplatShader, EveryFragmentIsPrunedMergedOrLeaves) {
  Shader shader(testing::random_draw(64, 64, 200, 4).splats);
  std::uint64_t quads_out = 0;
  std::uint64_t fragments_out = 0;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    std::vector<Quad> quads;
    std::uint8_t pairs = 0;
    for (std::uint64_t q = 0; q < 8; q += 2) {
      const bool pair = mix(i + q) % 2 == 0;
      const auto position = static_cast<unsigned>(mix(i * 8 + q) % 64);
      for (std::uint64_t k = 0; k < 2; ++k) {
        quads.push_back(quad_of(static_cast<std::uint32_t>(mix(i * 16 + q + k) % 200),
                                pair ? position : (position + static_cast<unsigned>(k)) % 64,
                                static_cast<LaneMask>(1 + mix(i * 32 + q + k) % 15)));
      }
      if (pair) pairs = static_cast<std::uint8_t>(pairs | (1U << (q / 2)));
    }
    const ShadedWarp out = shader.shade(quads, pairs, {static_cast<std::uint16_t>(i % 4), 1});
    quads_out += out.count;
    for (unsigned q = 0; q < out.count; ++q) {
      ASSERT_NE(out.live[q], 0);
      fragments_out += popcount(out.live[q]);
    }
  }
  const SplatShader& sm = shader.sm;
  EXPECT_EQ(sm.quads_shaded.value(), quads_out + sm.quads_pruned.value() + sm.quads_merged.value());
  EXPECT_EQ(sm.fragments_shaded.value(), fragments_out + sm.fragments_pruned.value() + sm.fragments_merged.value());
  EXPECT_GT(sm.fragments_merged.value(), 0U);
}

}  // namespace
}  // namespace vrpipe
