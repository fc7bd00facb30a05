// Everything that is shipped, platforms, formats, terminations and variants, on one small draw: each fidelity beside cycle.
#include <algorithm>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

constexpr double most_percent = 2.5;

std::string name_in_grid(const RunRequest& request) {
  return request.platform->name + " " + name_of(request.format) + " " + name_of(request.termination) + " " +
         request.variant.name;
}

class Grid : public ::testing::TestWithParam<std::size_t> {};

TEST_P(Grid, LtIsNearBoundIsBelowAndStrictResultsAreTheSame) {
  const Draw draw = random_draw(64, 48, 800, 5);
  RunRequest request;
  request.platform = &platforms()[GetParam()];
  for (const ColorFormat format : color_formats) {
    for (const Termination termination : {Termination::paper, Termination::strict}) {
      for (const Variant& variant : variants()) {
        request.format = format;
        request.termination = termination;
        request.variant = variant;
        SCOPED_TRACE(name_in_grid(request));
        const auto result_at = [&](Fidelity fidelity) {
          request.fidelity = fidelity;
          return run(request, draw);
        };
        const RunResult cycle = result_at(Fidelity::cycle);
        const RunResult lt = result_at(Fidelity::lt);
        const RunResult bound = result_at(Fidelity::bound);
        EXPECT_LE(*bound.cycles, *cycle.cycles);
        EXPECT_EQ(lt.outside_validated_range, std::vector<std::string>{});
        EXPECT_NEAR(percent_above(*lt.cycles, *cycle.cycles), 0, most_percent);
        EXPECT_NEAR(percent_above(lt.counts.quads_blended, cycle.counts.quads_blended), 0, 1) << "% of what is blended";
        if (termination == Termination::paper) continue;
        for (const RunResult& other : {lt, bound, result_at(Fidelity::functional)}) {
          EXPECT_EQ(other.counts.named(), cycle.counts.named()) << name_of(other.request.fidelity);
          EXPECT_TRUE(same_image(other.framebuffer.color, cycle.framebuffer.color)) << name_of(other.request.fidelity);
        }
      }
    }
  }
}

std::string name_of_platform(const ::testing::TestParamInfo<std::size_t>& info) {
  std::string name = platforms()[info.param].name;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Platforms, Grid, ::testing::Range(std::size_t{0}, platforms().size()), name_of_platform);

}  // namespace
}  // namespace vrpipe
