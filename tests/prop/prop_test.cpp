#include "prop/prop.h"

#include <gtest/gtest.h>

#include "support/builders.h"

namespace vrpipe {
namespace {

TEST(PreRop, ColourQuadsPerCycleFollowTheFormat) {
  const Draw draw = testing::draw_of(16, 16);
  RenderContext context = testing::context_of(draw);
  const PreRop::Parameters parameters;
  const std::pair<ColorFormat, unsigned> expected[] = {{ColorFormat::rgba8, 4},
                                                       {ColorFormat::rgba16f, 2},
                                                       {ColorFormat::rgba32f, 1}};
  for (const auto& [format, quads] : expected) {
    context.format = format;
    EXPECT_EQ(PreRop(parameters, context).time().color_rate, (Rate{quads, 1})) << name_of(format);
  }
}

TEST(PreRop, BytesThatAreNoWholeQuadsAreAFraction) {
  const Draw draw = testing::draw_of(16, 16);
  RenderContext context = testing::context_of(draw);
  context.format = ColorFormat::rgba32f;
  PreRop::Parameters parameters;
  parameters.set("prop", "color_bytes_per_cycle", "16");
  EXPECT_EQ(PreRop(parameters, context).time().color_rate, (Rate{1, 4}));
  parameters.set("prop", "color_bytes_per_cycle", "48");
  EXPECT_EQ(PreRop(parameters, context).time().color_rate, (Rate{3, 4}));
}

}  // namespace
}  // namespace vrpipe
