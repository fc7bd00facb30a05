// Images and counts of whole GPUs: against a double-precision renderer, and of one against another.

#include <gtest/gtest.h>

#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::request_of;
using testing::run;
using testing::same_image;
using testing::strictly;

struct Size {
  std::uint32_t width, height, splats;
};
void PrintTo(const Size& size, std::ostream* out) { *out << size.width << "x" << size.height; }

class RandomScene : public ::testing::TestWithParam<Size> {
 protected:
  RandomScene()
      : draw(testing::random_draw(GetParam().width, GetParam().height, GetParam().splats, 1000 + GetParam().width)) {}
  Draw draw;
};

// case M08
TEST_P(RandomScene, BaselineAndMergingAreWithinTheRunningBoundOfTheReference) {
  for (const char* variant : {"baseline", "qm"}) {
    for (const ColorFormat format : color_formats) {
      SCOPED_TRACE(std::string(variant) + " " + name_of(format));
      testing::expect_near_reference(
          run(request_of(variant, Fidelity::functional, [&](RunRequest& r) { r.format = format; }), draw), draw, 0);
    }
  }
}

// case H02
TEST_P(RandomScene, EarlyTerminationIsWithinTheThresholdsRemainderOfTheReference) {
  for (const char* variant : {"het", "het+qm"}) {
    for (const ColorFormat format : color_formats) {
      SCOPED_TRACE(std::string(variant) + " " + name_of(format));
      testing::expect_near_reference(
          run(request_of(variant, Fidelity::cycle, [&](RunRequest& r) { r.format = format; }), draw), draw, 0.004);
    }
  }
}

TEST_P(RandomScene, StrictlyFunctionalAndCycleHaveTheSameImageAndCounts) {
  for (const Variant& variant : variants()) {
    for (const ColorFormat format : color_formats) {
      SCOPED_TRACE(variant.name + " " + name_of(format));
      const auto change = [&](RunRequest& r) {
        r.format = format;
        strictly(r);
      };
      const RunResult functional = run(request_of(variant.name, Fidelity::functional, change), draw);
      const RunResult cycle = run(request_of(variant.name, Fidelity::cycle, change), draw);
      EXPECT_TRUE(same_image(functional.framebuffer.color, cycle.framebuffer.color));
      EXPECT_EQ(functional.counts.named(), cycle.counts.named());
      EXPECT_FALSE(functional.cycles.has_value());
      EXPECT_TRUE(cycle.cycles.has_value());
    }
  }
}

// case T06
TEST_P(RandomScene, WhatGoesInComesOutAndStatesSumToTheCycles) {
  for (const Variant& variant : variants()) {
    for (const Termination termination : {Termination::paper, Termination::strict}) {
      const RunResult result =
          run(request_of(variant.name, Fidelity::cycle, [&](RunRequest& r) { r.termination = termination; }), draw);
      const Counts& c = result.counts;
      EXPECT_EQ(c.quads_rasterized,
                c.quads_depth_stencil_failed + c.quads_terminated + c.quads_unshaded + c.quads_shaded);
      EXPECT_EQ(c.fragments_rasterized, c.fragments_depth_stencil_failed + c.fragments_terminated + c.fragments_shaded);
      EXPECT_EQ(c.quads_shaded, c.quads_pruned + c.quads_merged + c.quads_dropped_late + c.quads_late_failed +
                                    c.quads_unblended + c.quads_blended);
      EXPECT_EQ(c.fragments_shaded, c.fragments_pruned + c.fragments_merged + c.fragments_dropped_late +
                                        c.fragments_late_failed + c.fragments_unblended + c.fragments_blended);
      if (variant.quad_merging) {
        EXPECT_GT(c.quads_merged, 0U) << variant.name;
      } else {
        EXPECT_EQ(c.quads_merged, 0U) << variant.name;
      }
      EXPECT_LE(c.quads_shaded, 8 * c.warps);
      EXPECT_FALSE(result.units.empty());
      for (const UnitReport& unit : result.units) {
        std::uint64_t sum = 0;
        for (const std::uint64_t cycles : unit.cycles) sum += cycles;
        EXPECT_EQ(sum, result.cycles) << unit.name;
      }
      for (const auto& [unit, share] : result.utilization) {
        EXPECT_GE(share, 0) << unit;
        EXPECT_LE(share, 1) << unit;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, RandomScene,
                         ::testing::Values(Size{1, 1, 60}, Size{15, 17, 150}, Size{64, 64, 300}, Size{97, 65, 400}),
                         [](const auto& size) {
                           return std::to_string(size.param.width) + "x" + std::to_string(size.param.height);
                         });

TEST(DesktopPlatform, HasTheImageOfAgxOrinBitForBit) {
  const Draw draw = testing::random_draw(97, 65, 400, 5);
  const auto on = [](const char* platform) {
    return [platform](RunRequest& r) {
      r.platform = &platform_named(platform);
      strictly(r);
    };
  };
  for (const char* variant : {"baseline", "het"}) {  // merging depends on what else is in a bin
    const RunResult orin = run(request_of(variant, Fidelity::cycle, on("agx-orin-ideal-memory")), draw);
    const RunResult desktop = run(request_of(variant, Fidelity::cycle, on("desktop")), draw);
    const RunResult functional = run(request_of(variant, Fidelity::functional, on("desktop")), draw);
    EXPECT_TRUE(same_image(orin.framebuffer.color, desktop.framebuffer.color)) << variant;
    EXPECT_TRUE(same_image(functional.framebuffer.color, desktop.framebuffer.color)) << variant;
    EXPECT_EQ(functional.counts.named(), desktop.counts.named()) << variant;
    EXPECT_EQ(orin.counts.fragments_rasterized, desktop.counts.fragments_rasterized) << variant;
    EXPECT_EQ(orin.counts.fragments_blended, desktop.counts.fragments_blended) << variant;
  }
}

TEST(MobilePlatform, HasTheImageOfAgxOrinBitForBitAndTakesLonger) {
  const Draw draw = testing::random_draw(97, 65, 400, 5);
  const RunResult orin = run(request_of("baseline"), draw);
  const RunResult mobile =
      run(request_of("baseline", Fidelity::cycle, [](RunRequest& r) { r.platform = &platform_named("mobile"); }), draw);
  EXPECT_TRUE(same_image(orin.framebuffer.color, mobile.framebuffer.color));
  EXPECT_GT(*mobile.cycles, *orin.cycles);
}

TEST(Desktop, IsFasterThanOneOfItsGpcs) {
  const Draw draw = testing::random_draw(256, 256, 600, 8);
  const RunResult orin = run(request_of("baseline"), draw);
  const RunResult desktop =
      run(request_of("baseline", Fidelity::cycle, [](RunRequest& r) { r.platform = &platform_named("desktop"); }),
          draw);
  EXPECT_LT(*desktop.cycles * 2, *orin.cycles);
}

// case Z01
TEST(EmptyDraw, HasOnlyItsFixedOverheadAndNoNumberThatIsNone) {
  const Draw draw = testing::draw_of(64, 64);
  for (const Variant& variant : variants()) {
    const RunResult result = run(request_of(variant.name), draw);
    EXPECT_LT(*result.cycles, 200U);
    for (const auto& [name, value] : result.counts.named()) EXPECT_EQ(value, 0U) << name;
    for (const auto& [unit, share] : result.utilization) EXPECT_EQ(share, 0.0) << unit;
    EXPECT_EQ(result.framebuffer.color.pixel(33, 7), (std::array<float, 4>{0, 0, 0, 0}));
  }
}

// case Z02
TEST(AllOutside, HasTheImageOfNothing) {
  Draw draw = testing::draw_of(64, 64);
  for (int i = 0; i < 100; ++i)
    draw.splats.push_back(testing::round_splat(-500.0F - static_cast<float>(i), 900, 5, 0.8F));
  const RunResult result = run(request_of("het+qm"), draw);
  EXPECT_EQ(result.counts.primitives, 0U);
  EXPECT_TRUE(same_image(result.framebuffer.color, ColorSurface(64, 64, ColorFormat::rgba16f)));
}

// case Z03
TEST(OneSplat, IsItsClosedFormAtEveryPixel) {
  const Draw draw = testing::draw_of(40, 30, {testing::round_splat(17.3F, 12.8F, 3, 0.8F, 0.5F, 0.25F, 1)});
  const RunResult result =
      run(request_of("baseline", Fidelity::cycle, [](RunRequest& r) { r.format = ColorFormat::rgba32f; }), draw);
  for (std::uint32_t y = 0; y < 30; ++y) {
    for (std::uint32_t x = 0; x < 40; ++x) {
      const double dx = x + 0.5 - static_cast<double>(17.3F);
      const double dy = y + 0.5 - static_cast<double>(12.8F);
      double alpha = static_cast<double>(0.8F) * std::exp(-(dx * dx + dy * dy) / 18);
      if (std::fabs(alpha - 1.0 / 255) < 1e-6) continue;
      if (alpha < 1.0 / 255) alpha = 0;
      EXPECT_NEAR(static_cast<double>(result.framebuffer.color.pixel(x, y)[3]), alpha, 1e-5);
      EXPECT_NEAR(static_cast<double>(result.framebuffer.color.pixel(x, y)[0]), 0.5 * alpha, 1e-5);
    }
  }
}

// case Z04
TEST(EqualSplats, FillUpAsAPower) {
  const Draw draw = testing::draw_of(32, 32, std::vector<Splat>(20, testing::flat_box(0, 0, 32, 32, 0.25F)));
  for (const char* variant : {"baseline", "qm"}) {
    const RunResult result =
        run(request_of(variant, Fidelity::cycle, [](RunRequest& r) { r.format = ColorFormat::rgba32f; }), draw);
    EXPECT_NEAR(static_cast<double>(result.framebuffer.color.pixel(11, 21)[3]), 1 - std::pow(0.75, 20), 1e-6)
        << variant;
  }
}

// case Z05
TEST(SplatsThatAreNotSeen, DoNotPerturbTheImage) {
  const Draw draw = testing::random_draw(64, 64, 200, 9);
  Draw with_prefix = testing::draw_of(64, 64, std::vector<Splat>(50'000, testing::round_splat(-1000, 5, 2, 0.5F)));
  with_prefix.splats.insert(with_prefix.splats.end(), draw.splats.begin(), draw.splats.end());
  for (const Variant& variant : variants()) {
    const auto request = request_of(variant.name, Fidelity::functional, strictly);
    const RunResult plain = run(request, draw);
    const RunResult prefixed = run(request, with_prefix);
    EXPECT_TRUE(same_image(plain.framebuffer.color, prefixed.framebuffer.color)) << variant.name;
    EXPECT_EQ(plain.counts.named(), prefixed.counts.named()) << variant.name;
  }
}

// case Z06
TEST(FullScreenSplats, LoseNoTile) {
  Draw draw = testing::draw_of(200, 120);
  for (std::uint64_t i = 0; i < 150; ++i) {
    draw.splats.push_back(testing::splat_at(testing::uniform(i, 1, 0, 200), testing::uniform(i, 2, 0, 120), 3000, 2000,
                                            testing::uniform(i, 3, 0, 6), 0.03F));
  }
  for (const char* variant : {"baseline", "het+qm"}) {
    const RunResult result = run(request_of(variant), draw);
    EXPECT_EQ(result.counts.fragments_rasterized, 150U * 200 * 120) << variant;
    for (std::uint32_t y = 0; y < 120; y += 4) {
      for (std::uint32_t x = 0; x < 200; x += 4) EXPECT_GT(result.framebuffer.color.pixel(x, y)[3], 0.9F);
    }
  }
}

// case Z07
TEST(ATowerOnOneQuad, MergesHalfOfItsQuadsAway) {
  Draw draw = testing::draw_of(64, 64, std::vector<Splat>(16'384, testing::flat_box(0, 0, 1, 1, 0.004F)));
  draw.triangles.assign(draw.splats.size(), testing::one_quad_triangle(20, 36));
  const RunResult result = run(request_of("qm", Fidelity::cycle, strictly), draw);
  EXPECT_EQ(result.counts.quads_shaded, 16'384U);
  EXPECT_EQ(result.counts.quads_merged, 8'192U);
  EXPECT_EQ(result.counts.quads_blended, 8'192U);
}

// case Z08
TEST(AnOpaqueWall, HidesAllThatLiesBehindIt) {
  Draw draw = testing::draw_of(64, 64, std::vector<Splat>(3, testing::flat_box(-8, -8, 72, 72, 1.0F)));
  const std::size_t wall = draw.splats.size();
  for (const Splat& splat : testing::random_draw(64, 64, 200, 3).splats) draw.splats.push_back(splat);
  // The wall fills bins of 128 quads tile by tile; what follows in later bins is tested against it.
  const RunResult result = run(request_of("het", Fidelity::cycle, strictly), draw);
  EXPECT_LE(result.counts.fragments_blended, wall * 64 * 64);
  EXPECT_GT(result.counts.fragments_terminated, 0U);
  const RunResult alone =
      run(request_of("het", Fidelity::cycle, strictly),
          testing::draw_of(64, 64, {draw.splats.begin(), draw.splats.begin() + static_cast<std::ptrdiff_t>(wall)}));
  EXPECT_TRUE(same_image(result.framebuffer.color, alone.framebuffer.color));
}

// case Z09
TEST(ACheckerboardOfTerminatingPixels, TerminatesThoseAndOnlyThose) {
  Draw draw = testing::draw_of(32, 32);
  for (int layer = 0; layer < 12; ++layer) {
    for (int y = 0; y < 32; ++y) {
      for (int x = y % 2; x < 32; x += 2) {
        const auto fx = static_cast<float>(x);
        const auto fy = static_cast<float>(y);
        draw.splats.push_back(testing::flat_box(fx + 0.2F, fy + 0.2F, fx + 0.8F, fy + 0.8F, 0.9F));
      }
    }
  }
  draw.splats.push_back(testing::flat_box(0, 0, 32, 32, 0.5F, 0, 1, 0));
  const RunResult result = run(request_of("het", Fidelity::cycle, strictly), draw);
  for (std::uint32_t y = 0; y < 32; ++y) {
    for (std::uint32_t x = 0; x < 32; ++x)
      EXPECT_EQ(result.framebuffer.color.pixel(x, y)[3] >= 0.996F, (x + y) % 2 == 0);
  }
  EXPECT_EQ(testing::statistic(result, "crop.termination_signals"), result.counts.termination_updates);
  EXPECT_EQ(result.counts.termination_updates, 512U) << "one for each pixel";
}

// case H01
TEST(TerminationSignals, AreAsManyAsPixelsThatPassTheThreshold) {
  // Quads of one pixel: a signal is a pixel.
  Draw draw = testing::draw_of(48, 48);
  for (std::uint64_t i = 0; i < 6000; ++i) {
    const float x = 2 * std::floor(testing::uniform(i, 1, 0, 24));
    const float y = 2 * std::floor(testing::uniform(i, 2, 0, 24));
    draw.splats.push_back(
        testing::flat_box(x + 0.2F, y + 0.2F, x + 0.8F, y + 0.8F, testing::uniform(i, 3, 0.05F, 0.9F)));
  }
  for (const Termination termination : {Termination::paper, Termination::strict}) {
    const RunResult result =
        run(request_of("het", Fidelity::cycle, [&](RunRequest& r) { r.termination = termination; }), draw);
    std::uint64_t terminated = 0;
    for (std::uint32_t y = 0; y < 48; ++y) {
      for (std::uint32_t x = 0; x < 48; ++x) terminated += result.framebuffer.color.pixel(x, y)[3] >= 0.996F;
    }
    EXPECT_GT(terminated, 50U);
    EXPECT_EQ(result.counts.termination_updates, terminated);
  }
}

// case H02
TEST(UpdateLatency, LengthensTheTimeInWhichLateFragmentsBlendAndStrictlyChangesNothing) {
  const Draw draw = testing::random_draw(64, 64, 900, 21);
  std::uint64_t blended = 0;
  RunResult strict;
  for (const char* latency : {"1", "100", "1000"}) {
    const auto with = [&](Termination termination) {
      return [&, termination](RunRequest& r) {
        r.settings.push_back({"crop", "latency_cycles", latency});
        r.termination = termination;
      };
    };
    const RunResult paper = run(request_of("het", Fidelity::cycle, with(Termination::paper)), draw);
    EXPECT_GE(paper.counts.fragments_blended, blended) << latency;
    blended = paper.counts.fragments_blended;
    testing::expect_near_reference(paper, draw, 0.004);
    const RunResult now = run(request_of("het", Fidelity::cycle, with(Termination::strict)), draw);
    if (strict.framebuffer.color.width() > 1) {
      EXPECT_TRUE(same_image(now.framebuffer.color, strict.framebuffer.color)) << latency;
      EXPECT_EQ(now.counts.named(), strict.counts.named()) << latency;
    }
    strict = now;
  }
}

// case H03
TEST(EarlyTermination, ThatCannotFireChangesNeitherImageNorBlends) {
  const Draw draw = testing::random_draw(64, 64, 300, 2);
  const RunResult off = run(request_of("baseline"), draw);
  const RunResult never_fires = run(request_of("het", Fidelity::cycle,
                                               [](RunRequest& r) {
                                                 r.settings.push_back({"state", "termination_threshold", "1"});
                                                 r.settings.push_back({"state", "termination_compare", "gt"});
                                               }),
                                    draw);
  EXPECT_TRUE(same_image(off.framebuffer.color, never_fires.framebuffer.color));
  EXPECT_EQ(off.counts.fragments_blended, never_fires.counts.fragments_blended);
  EXPECT_EQ(never_fires.counts.termination_updates, 0U);
}

// case H09
TEST(SplatsBehindTerminatedPixels, ChangeNeitherImageNorBlends) {
  Draw draw = testing::draw_of(64, 64, std::vector<Splat>(8, testing::flat_box(-8, -8, 72, 72, 0.9F, 0.2F)));
  const RunResult before = run(request_of("het", Fidelity::cycle, strictly), draw);
  for (const Splat& splat : testing::random_draw(64, 64, 300, 4).splats) draw.splats.push_back(splat);
  const RunResult after = run(request_of("het", Fidelity::cycle, strictly), draw);
  EXPECT_TRUE(same_image(before.framebuffer.color, after.framebuffer.color));
  EXPECT_EQ(before.counts.fragments_blended, after.counts.fragments_blended);
}

// case R06
TEST(AScene, MovedByAWholeGridHasTheSameCounts) {
  // On multiples of 1/256 and of 64 pixels, so that neither floats nor grids tell the places apart.
  Draw here = testing::draw_of(384, 384);
  Draw there = testing::draw_of(384, 384);
  for (std::uint64_t i = 0; i < 250; ++i) {
    ScreenTriangle t;
    for (unsigned v = 0; v < 3; ++v) {
      t.x[v] = std::floor(testing::uniform(i, v, 4, 180) * 256) / 256;
      t.y[v] = std::floor(testing::uniform(i, 10 + v, 4, 180) * 256) / 256;
    }
    here.triangles.push_back(t);
    for (float& x : t.x) x += 128;
    for (float& y : t.y) y += 64;
    there.triangles.push_back(t);
    here.splats.push_back(testing::flat_box(0, 0, 1, 1, 0.3F));
    there.splats.push_back(testing::flat_box(0, 0, 1, 1, 0.3F));
  }
  for (const Variant& variant : variants()) {
    const auto request = request_of(variant.name, Fidelity::functional, strictly);
    EXPECT_EQ(run(request, here).counts.named(), run(request, there).counts.named()) << variant.name;
  }
}

// case O09
TEST(EnlargedBoxes, BlendTheSameFragments) {
  const Draw draw = testing::random_draw(64, 64, 200, 12);
  Draw enlarged = draw;
  for (Splat& splat : enlarged.splats) {
    for (float* value : {&splat.ax, &splat.ay, &splat.bx, &splat.by, &splat.r}) *value *= 2;
  }
  const auto request = request_of("baseline", Fidelity::functional);
  const RunResult a = run(request, draw);
  const RunResult b = run(request, enlarged);
  EXPECT_TRUE(same_image(a.framebuffer.color, b.framebuffer.color));
  EXPECT_EQ(a.counts.fragments_blended, b.counts.fragments_blended);
  EXPECT_GT(b.counts.fragments_rasterized, 2 * a.counts.fragments_rasterized);
}

// case B09
TEST(GreySplats, GiveAGreyImageInEveryFormat) {
  Draw draw = testing::random_draw(64, 64, 200, 14);
  for (Splat& splat : draw.splats) splat.green = splat.blue = splat.red;
  for (const ColorFormat format : color_formats) {
    const RunResult result =
        run(request_of("het+qm", Fidelity::cycle, [&](RunRequest& r) { r.format = format; }), draw);
    for (std::uint32_t y = 0; y < 64; ++y) {
      for (std::uint32_t x = 0; x < 64; ++x) {
        const auto pixel = result.framebuffer.color.pixel(x, y);
        ASSERT_TRUE(pixel[0] == pixel[1] && pixel[1] == pixel[2]);
      }
    }
  }
}

// case O08
TEST(PrunedFragments, AreTheCornersOfTheBoxes) {
  const Draw draw = testing::draw_of(512, 512, {testing::splat_at(256, 256, 60, 40, 0.5F, 0.95F)});
  const RunResult result = run(request_of("baseline", Fidelity::functional), draw);
  EXPECT_NEAR(static_cast<double>(result.counts.fragments_pruned) /
                  static_cast<double>(result.counts.fragments_rasterized),
              0.2146, 0.003);
}

}  // namespace
}  // namespace vrpipe
