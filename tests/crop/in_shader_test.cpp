// What a shader that blends does to colours, and what it is refused with.
#include <cstring>
#include <memory>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>

#include "crop/in_shader.h"
#include "support/builders.h"

namespace vrpipe {
namespace {

std::unique_ptr<Behaviour> made(const std::string& name, const RenderContext& context,
                                const std::vector<std::pair<std::string, std::string>>& settings = {}) {
  const Implementation& implementation = Registry::instance().find("crop", name);
  const std::unique_ptr<ParameterSet> parameters = implementation.make_parameters();
  for (const auto& [parameter, value] : settings) parameters->set("crop", parameter, value);
  return implementation.make_behaviour(*parameters, context);
}

class InShaderColors : public ::testing::TestWithParam<std::tuple<ColorFormat, BlendRounding, bool>> {};
INSTANTIATE_TEST_SUITE_P(Formats, InShaderColors,
                         ::testing::Combine(::testing::ValuesIn(color_formats),
                                            ::testing::Values(BlendRounding::rne, BlendRounding::rtz,
                                                              BlendRounding::measured),
                                            ::testing::Bool()));

TEST_P(InShaderColors, AreThoseOfAColourRopBitByBit) {
  DrawState state;
  state.blend = std::get<2>(GetParam());
  const Draw draw = testing::draw_of(64, 64);
  RenderContext context = testing::context_of(draw, state);
  context.format = std::get<0>(GetParam());
  context.precision.blend_rounding = std::get<1>(GetParam());
  if (!can_round(context.format, context.precision.blend_rounding)) {
    for (const char* name : {"in-shader", "color-rop"}) EXPECT_THROW(made(name, context), UserError) << name;
    return;
  }
  const auto shader = behaviour_as<CropBehaviour>(made("in-shader", context));
  const auto rop = behaviour_as<CropBehaviour>(made("color-rop", context));
  ColorSurface of_shader(64, 64, context.format), of_rop(64, 64, context.format);
  shader->attach(of_shader);
  rop->attach(of_rop);
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const float alpha = testing::uniform(7, 4 * i, 0, 1);
    const QuadColor color = testing::color_of(alpha * testing::uniform(7, 4 * i + 1, 0, 2), alpha * 0.3F, alpha, alpha);
    const auto place = static_cast<std::size_t>(mix(i) % 40);
    const auto live = static_cast<LaneMask>(1 + mix(i + 9) % 15);
    shader->blend(0, place, live, color);
    rop->blend(0, place, live, color);
  }
  for (std::size_t place = 0; place < 40; ++place)
    EXPECT_EQ(std::memcmp(&of_shader.quad(place), &of_rop.quad(place), sizeof(QuadColor)), 0) << place;
  EXPECT_EQ(shader->fragments_blended.value(), rop->fragments_blended.value());
  EXPECT_EQ(dynamic_cast<InShaderBlending&>(*shader).updates_lost.value(), 0U);
}

TEST(InShader, AStoreTakesBackWhatOthersHaveStoredSinceTheLoad) {
  const Draw draw = testing::draw_of(16, 16);
  const RenderContext context = testing::context_of(draw);
  const auto behaviour = made("in-shader", context, {{"lock", "none"}});
  auto& shader = dynamic_cast<InShaderBlending&>(*behaviour);
  ColorSurface surface(16, 16, ColorFormat::rgba16f);
  shader.attach(surface);
  const QuadColor loaded = surface.quad(0);
  shader.store(0, 0, 0b0011, testing::color_of(0.5F, 0.5F, 0.5F, 0.5F), loaded);
  EXPECT_EQ(shader.updates_lost.value(), 0U);
  shader.store(0, 0, 0b0110, testing::color_of(0.25F, 0.25F, 0.25F, 0.25F), loaded);
  EXPECT_EQ(shader.updates_lost.value(), 1U) << "one pixel is in both";
  const Lanes& alpha = surface.quad(0).alpha;
  EXPECT_EQ(alpha[0], 0.5F);
  EXPECT_EQ(alpha[1], 0.25F);
  EXPECT_EQ(alpha[2], 0.25F);
  EXPECT_EQ(alpha[3], 0.0F);
  EXPECT_EQ(shader.fragments_blended.value(), 4U) << "lost ones were blended";
}

TEST(InShader, EarlyTerminationIsRefused) {
  const Draw draw = testing::draw_of(16, 16);
  RenderContext context = testing::context_of(draw);
  testing::terminate_early(context);
  EXPECT_THROW(made("in-shader", context), UserError);
}

TEST(InShader, LoadsAndStoresAreNaturallyAlignedAndMoveWhatItsQuadsAre) {
  for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
    const ColorSurface surface(64, 64, format);
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
      ShadedWarp warp;
      warp.tile = {1, 2};
      for (unsigned i = 0; i < quads_per_warp; ++i)  // no position twice
        warp.position[warp.count++] =
            static_cast<std::uint8_t>((mix(seed) % 64 + (2 * (mix(seed + 300) % 16) + 1) * i) % 64);
      std::uint64_t bytes = 0;
      warp.live.fill(all_lanes);
      for_each_shader_access(surface, warp, warp.live, 0, warp.count, [&](std::uint64_t address, unsigned size) {
        EXPECT_EQ(address % size, 0U);
        EXPECT_EQ(size & (size - 1), 0U);
        bytes += size;
      });
      EXPECT_EQ(bytes, std::uint64_t{warp.count} * 4 * bytes_per_pixel(format));
    }
  }
}

InShaderTime time_of(const std::vector<std::pair<std::string, std::string>>& settings, std::uint64_t clock_ps) {
  InShaderParameters parameters;
  for (const auto& [name, value] : settings) parameters.set("crop", name, value);
  return InShaderTime(parameters, clock_ps);
}

TEST(InShaderTime, IsCyclesOfAnyClockOrAsLongAtEach) {
  constexpr std::uint64_t orin_ps = 1634, gh100_ps = 505;
  const InShaderTime in_cycles = time_of({}, orin_ps);
  EXPECT_EQ(in_cycles.hand_over_cycles, 1300U);
  EXPECT_EQ(in_cycles.price_of(false), 13700U);
  EXPECT_EQ(in_cycles.price_of(true), 31100U);
  const InShaderTime as_long = time_of({{"lock_clock_mhz", "1980"}}, orin_ps);
  EXPECT_EQ(as_long.hand_over_cycles, 402U);
  EXPECT_EQ(as_long.price_of(false), 4235U);
  EXPECT_NEAR(static_cast<double>(time_of({{"lock_clock_mhz", "1980"}}, gh100_ps).hand_over_cycles), 1300, 1)
      << "the clock that it was measured at";
}

TEST(CoverageTiles, TakeWarpsUntilAPixelComesTwice) {
  CoverageTiles tiles{ScreenTiling(32, 32)};
  const auto take = [&](const ShadedWarp& of, unsigned from, std::size_t place, bool is_open) {
    return tiles.take(of, of.live, from, place, is_open);
  };
  const auto warp = [](std::vector<std::pair<unsigned, unsigned>> quads) {
    ShadedWarp made;
    for (const auto& [position, live] : quads) {
      made.position[made.count] = static_cast<std::uint8_t>(position);
      made.live[made.count++] = static_cast<LaneMask>(live);
    }
    return made;
  };
  const auto expect = [](CoverageTiles::Part part, unsigned end, bool opens) {
    EXPECT_EQ(part.end, end);
    EXPECT_EQ(part.opens, opens);
  };
  const ShadedWarp first = warp({{0, 3}, {1, 15}, {0, 12}});
  expect(take(first, 0, 0, false), 3, true);  // both triangles of a quad: no pixel twice
  expect(take(warp({{2, 1}}), 0, 0, true), 1, false);
  expect(take(warp({{2, 3}}), 0, 0, true), 1, true);  // pixel 0 of it is taken
  const ShadedWarp twice = warp({{5, 1}, {6, 1}, {5, 3}});
  expect(take(twice, 0, 0, true), 2, false);
  expect(take(twice, 2, 0, true), 3, true);
  expect(take(warp({{0, 15}}), 0, positions_per_tile, true), 1, false);  // another screen tile
  expect(take(warp({{7, 1}}), 0, 0, false), 1, true);                    // nobody holds the lock any more
}

}  // namespace
}  // namespace vrpipe
