#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/half.h>
#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/quad_sectors.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/crop.h>

#include "crop/crop_time.h"
#include "support/builders.h"

namespace vrpipe {
namespace {

using testing::color_of;

class ColorRopTest : public ::testing::Test {
 protected:
  ColorRopTest() : draw(testing::draw_of(64, 64)), context(testing::context_of(draw)) {
    testing::terminate_early(context);
  }

  void make(const std::vector<std::pair<std::string, std::string>>& settings = {}) {
    const Implementation& implementation = Registry::instance().find("crop", "color-rop");
    const std::unique_ptr<ParameterSet> parameters = implementation.make_parameters();
    for (const auto& [name, value] : settings) parameters->set("crop", name, value);
    behaviour = implementation.make_behaviour(*parameters, context);
    crop = dynamic_cast<CropBehaviour*>(behaviour.get());
    surface = std::make_unique<ColorSurface>(draw.width, draw.height, context.format);
    crop->attach(*surface);
  }
  std::uint64_t count(const std::string& name) const {
    for (const Counter* counter : behaviour->counters()) {
      if (name == counter->name()) return counter->value();
    }
    ADD_FAILURE() << "no counter " << name;
    return 0;
  }
  LaneMask blend(float alpha, LaneMask live = all_lanes, unsigned position = 0, float grey = 1) {
    return crop->blend(0, position, live, color_of(alpha * grey, alpha * grey, alpha * grey, alpha)).terminated;
  }
  void set_alpha(float alpha) { surface->quad({0, 0}, 0).alpha = splat_lanes(alpha); }
  float alpha(unsigned lane = 0) const { return surface->quad({0, 0}, 0).alpha[lane]; }

  Draw draw;
  RenderContext context;
  std::unique_ptr<Behaviour> behaviour;
  CropBehaviour* crop = nullptr;
  std::unique_ptr<ColorSurface> surface;
};

TEST_F(ColorRopTest, OnlyLiveLanesAreBlendedAndCounted) {
  make();
  blend(0.5F, 0b0110);
  EXPECT_EQ(alpha(0), 0.0F);
  EXPECT_EQ(alpha(1), 0.5F);
  EXPECT_EQ(alpha(2), 0.5F);
  EXPECT_EQ(alpha(3), 0.0F);
  EXPECT_EQ(count("quads_blended"), 1U);
  EXPECT_EQ(count("fragments_blended"), 2U);
}

// case H01
TEST_F(ColorRopTest, EveryPixelSignalsOnceWhenItPassesTheThreshold) {
  make();
  unsigned pixels = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const LaneMask signalled = blend(testing::uniform(8, i, 0.1F, 0.5F), static_cast<LaneMask>(1 + mix(i) % 15));
    pixels += popcount(signalled);
  }
  unsigned terminated = 0;
  for (unsigned lane = 0; lane < 4; ++lane) terminated += alpha(lane) >= 0.996F;
  EXPECT_EQ(terminated, 4U);
  EXPECT_EQ(pixels, terminated);
}

// case H01
TEST_F(ColorRopTest, WithoutThePreviousAlphaCheckEveryLaterFragmentSignals) {
  make({{"previous_alpha_check", "off"}});
  unsigned signals = 0;
  for (unsigned i = 0; i < 10; ++i) signals += blend(0.99F) != 0;
  EXPECT_EQ(signals, 9U) << "0.99, then 0.9999 and all that follow";
}

// case H06
TEST_F(ColorRopTest, PixelsThatTerminateTogetherAreOneSignal) {
  make();
  blend(0.99F, 0b1011);
  EXPECT_EQ(blend(0.9F, 0b0011), 0b0011);
  EXPECT_EQ(count("termination_signals"), 1U);
}

// case H07
TEST_F(ColorRopTest, AMergedQuadThatTerminatesItsPixelsSignalsOnce) {
  make();
  const QuadColor merged = blend_front_to_back(color_of(0, 0, 0, 0.99F), color_of(0, 0, 0, 0.99F));
  EXPECT_EQ(crop->blend(0, 0, all_lanes, merged).terminated, all_lanes);
  EXPECT_EQ(count("termination_signals"), 1U);
  EXPECT_EQ(half_bits(alpha()), 0x3C00);
}

TEST_F(ColorRopTest, WithoutEarlyTerminationNothingIsSignalled) {
  testing::terminate_early(context, false);
  make();
  for (unsigned i = 0; i < 5; ++i) EXPECT_EQ(blend(0.99F), 0);
}

// case B03
TEST_F(ColorRopTest, TheThresholdIsPassedAtTheFirstStoredAlphaNotBelowIt) {
  const auto passes = [&](ColorFormat format, bool inclusive, float stored) {
    context.format = format;
    testing::change_state(context, [&](DrawState& drawn) { drawn.termination_inclusive = inclusive; });
    make();
    QuadColor fragment{};
    fragment.alpha = splat_lanes(stored);
    return crop->blend(0, 0, all_lanes, fragment).terminated != 0;
  };
  for (const bool inclusive : {true, false}) {
    EXPECT_TRUE(passes(ColorFormat::rgba16f, inclusive, half_value(0x3BF8)));
    EXPECT_FALSE(passes(ColorFormat::rgba16f, inclusive, half_value(0x3BF7)));
    EXPECT_TRUE(passes(ColorFormat::rgba8, inclusive, 254.0F / 255.0F));
    EXPECT_FALSE(passes(ColorFormat::rgba8, inclusive, 253.0F / 255.0F));
    EXPECT_EQ(passes(ColorFormat::rgba32f, inclusive, 0.996F), inclusive) << "only here the two comparisons differ";
    EXPECT_TRUE(passes(ColorFormat::rgba32f, inclusive, std::nextafter(0.996F, 1.0F)));
    EXPECT_FALSE(passes(ColorFormat::rgba32f, inclusive, std::nextafter(0.996F, 0.0F)));
  }
}

// case M11
TEST_F(ColorRopTest, AcrossTheThresholdAPairDiffersFromItsPartsByTheMissingTransmittanceAtMost) {
  context.format = ColorFormat::rgba32f;
  context.termination = Termination::strict;
  make();
  set_alpha(0.995F);
  blend(0.5F);
  blend(0.5F);  // dropped: terminated
  const float unmerged = alpha();
  EXPECT_NEAR(static_cast<double>(unmerged), 0.9975, 1e-6);
  make();
  set_alpha(0.995F);
  const QuadColor pair = blend_front_to_back(color_of(0.5F, 0, 0, 0.5F), color_of(0.5F, 0, 0, 0.5F));
  crop->blend(0, 0, all_lanes, pair);
  EXPECT_NEAR(static_cast<double>(alpha()), 0.99875, 1e-6);
  EXPECT_LE(alpha() - unmerged, 0.004F);
}

TEST_F(ColorRopTest, StrictlyAFragmentOfATerminatedPixelIsDropped) {
  context.termination = Termination::strict;
  make();
  blend(0.99F, 0b0011);
  blend(0.9F, 0b0011);
  const float before = alpha(0);
  const CropBehaviour::Outcome part = crop->blend(0, 0, 0b0110, color_of(0.5F, 0.5F, 0.5F, 0.5F));
  EXPECT_TRUE(part.changed);
  EXPECT_EQ(alpha(1), before);
  EXPECT_EQ(alpha(2), 0.5F);
  EXPECT_EQ(count("fragments_dropped_late"), 1U);
  EXPECT_EQ(count("quads_dropped_late"), 0U);
  const CropBehaviour::Outcome all = crop->blend(0, 0, 0b0001, color_of(0.5F, 0.5F, 0.5F, 0.5F));
  EXPECT_FALSE(all.changed);
  EXPECT_EQ(count("fragments_dropped_late"), 2U);
  EXPECT_EQ(count("quads_dropped_late"), 1U);
}

// case H02
TEST_F(ColorRopTest, InPaperTerminationALateFragmentStillBlendsByWhatIsLeftAtMost) {
  make();
  blend(0.99F, all_lanes, 0, 0);
  blend(0.9F, all_lanes, 0, 0);
  ASSERT_GE(alpha(), 0.996F);
  for (unsigned i = 0; i < 50; ++i) blend(0.99F);
  EXPECT_LE(surface->quad({0, 0}, 0).red[0], 0.004F);
  EXPECT_EQ(count("fragments_dropped_late"), 0U);
}

TEST_F(ColorRopTest, FragmentsBehindAPixelsLastAreCountedAsLate) {
  make();
  blend(0.5F);
  blend(0.9999F, 0b0011);  // the last of two pixels
  EXPECT_EQ(count("fragments_blended_late"), 0U);
  blend(0.5F);
  EXPECT_EQ(count("fragments_blended_late"), 2U);
  EXPECT_EQ(count("fragments_blended"), 10U);
  make({{"previous_alpha_check", "off"}});
  blend(0.9999F);
  blend(0.5F, 0b0100);
  EXPECT_EQ(count("fragments_blended_late"), 1U) << "signalled again, and late all the same";
}

TEST_F(ColorRopTest, TellsWhetherAValueChanged) {
  make();
  EXPECT_TRUE(crop->blend(0, 0, all_lanes, color_of(0.5F, 0, 0, 0.5F)).changed);
  EXPECT_FALSE(crop->blend(0, 0, all_lanes, color_of(0, 0, 0, 0)).changed);
  set_alpha(1.0F);
  EXPECT_FALSE(crop->blend(0, 0, all_lanes, color_of(0.5F, 0.5F, 0.5F, 0.5F)).changed);
}

// case B10
TEST_F(ColorRopTest, AThousandQuadsOnOnePositionAreTheSequentialResult) {
  for (const ColorFormat format : color_formats) {
    context.format = format;
    make();
    QuadColor expected{};
    const BlendFunction reference = blend_function(format, BlendRounding::rne);
    for (std::uint64_t i = 0; i < 1000; ++i) {
      const float a = testing::uniform(9, i, 0.001F, 0.02F);
      const QuadColor fragment = color_of(a * 0.3F, a * 0.9F, a, a);
      crop->blend(0, surface->grid().place({1, 1}, 7), all_lanes, fragment);
      expected = reference(expected, fragment);
    }
    EXPECT_EQ(std::memcmp(&surface->quad({1, 1}, 7), &expected, sizeof expected), 0) << name_of(format);
  }
}

/// Eight quads at four positions, some of their pixels live.
ShadedWarp random_warp(std::uint64_t seed) {
  ShadedWarp warp;
  warp.tile = {1, 2};
  warp.count = quads_per_warp;
  for (unsigned i = 0; i < warp.count; ++i) {
    const float a = testing::uniform(5, quads_per_warp * seed + i, 0.0F, 0.6F);
    warp.position[i] = static_cast<std::uint8_t>(mix(seed + 1000 * i) % 4);
    warp.live[i] = static_cast<LaneMask>(1 + mix(seed * 8 + i) % 15);
    warp.color[i] = color_of(a * 0.2F, a * 0.8F, a, a);
  }
  return warp;
}

TEST_F(ColorRopTest, QuadsOfAWarpAreBlendedAsOneByOne) {
  struct Result {
    std::vector<QuadColor> image;
    unsigned outcomes = 0;
    std::uint64_t fragments = 0, signals = 0;
  };
  const auto blend_warps = [&](bool together) {
    make();
    Result result;
    for (std::uint64_t w = 0; w < 300; ++w) {
      const ShadedWarp warp = random_warp(w);
      const auto from = static_cast<unsigned>(w % 3);
      CropBehaviour::Outcomes outcomes{};
      if (together) {
        crop->blend_quads(warp, from, warp.count, outcomes);
      } else {
        for (unsigned i = from; i < warp.count; ++i) {
          const std::size_t place = surface->grid().place(warp.tile, warp.position[i]);
          outcomes[i] = crop->blend(0, place, warp.live[i], warp.color[i]);
        }
      }
      for (const CropBehaviour::Outcome outcome : outcomes) {
        result.outcomes = 31 * result.outcomes + 2U * outcome.terminated + static_cast<unsigned>(outcome.changed);
      }
    }
    for (unsigned position = 0; position < 4; ++position) result.image.push_back(surface->quad({1, 2}, position));
    result.fragments = count("fragments_blended");
    result.signals = count("termination_signals");
    return result;
  };
  for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
    for (const Termination termination : {Termination::paper, Termination::strict}) {
      context.format = format;
      context.termination = termination;
      const Result alone = blend_warps(false);
      const Result together = blend_warps(true);
      EXPECT_EQ(std::memcmp(alone.image.data(), together.image.data(), 4 * sizeof(QuadColor)), 0) << name_of(format);
      EXPECT_EQ(alone.outcomes, together.outcomes) << name_of(format);
      EXPECT_EQ(alone.fragments, together.fragments) << name_of(format);
      EXPECT_EQ(alone.signals, together.signals) << name_of(format);
      EXPECT_GT(together.signals, 0U) << name_of(format);
    }
  }
}

TEST_F(ColorRopTest, QuadsPerCycleFollowTheFormat) {
  const std::pair<ColorFormat, unsigned> expected[] = {{ColorFormat::rgba8, 4},
                                                       {ColorFormat::rgba16f, 2},
                                                       {ColorFormat::rgba32f, 1}};
  for (const auto& [format, quads] : expected) {
    context.format = format;
    make();
    EXPECT_EQ(crop->time().blend_rate, (Rate{quads, 1}));
  }
}

TEST(CropQuads, AQuadsSectorsAreThoseThatHoldItsBytes) {
  for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
    const ColorSurface surface(32, 32, format);
    CacheOrganization cache;
    for (cache.line_bytes = 64; cache.line_bytes <= 1024; cache.line_bytes *= 2) {
      for (cache.sector_bytes = std::max(16U, cache.line_bytes / 32); cache.sector_bytes <= cache.line_bytes;
           cache.sector_bytes *= 2) {
        const auto quads = sectors_of_quads(cache, 4 * bytes_per_pixel(format));
        for (unsigned position = 0; position < positions_per_tile; ++position) {
          const std::uint64_t tile = surface.address({1, 1}, 0);
          const std::uint64_t line = tile + std::uint64_t{quads[position].line} * cache.line_bytes;
          std::uint32_t expected = 0;
          for (std::uint64_t byte = 0; byte < 4 * bytes_per_pixel(format); ++byte) {
            const std::uint64_t offset = surface.address({1, 1}, position) + byte - line;
            ASSERT_LT(offset, cache.line_bytes) << position;
            expected |= 1U << (offset / cache.sector_bytes);
          }
          ASSERT_EQ(quads[position].sectors, expected) << position;
        }
      }
    }
  }
}

TEST_F(ColorRopTest, ShapesThatMakeNoCacheAreRefusedWhenTheUnitIsMade) {
  const auto refused = [&](const std::vector<std::pair<std::string, std::string>>& settings, const std::string& names) {
    try {
      make(settings);
      ADD_FAILURE() << "accepted, " << names;
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find("(" + names + ")"), std::string::npos) << error.what();
    }
  };
  refused({{"cache_bytes", "5000"}}, "crop.cache_bytes");
  refused({{"line_bytes", "96"}}, "crop.line_bytes");
  refused({{"sector_bytes", "48"}}, "crop.sector_bytes");
  refused({{"cache_bytes", "256"}, {"line_bytes", "512"}}, "crop.line_bytes, crop.cache_bytes");
  refused({{"sector_bytes", "256"}}, "crop.sector_bytes, crop.line_bytes");
  refused({{"line_bytes", "1024"}, {"sector_bytes", "16"}}, "crop.line_bytes, crop.sector_bytes");
  make({{"line_bytes", "32"}});
  context.format = ColorFormat::rgba32f;
  refused({{"line_bytes", "32"}}, "crop.line_bytes, --format");
}

}  // namespace
}  // namespace vrpipe
