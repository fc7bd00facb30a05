// What one draw of a frame calls for costs the others nothing.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/platforms/simulation.h>

#include "support/measured_scenes.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::request_of;
using testing::run;

class OtherDraws : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Frame, OtherDraws, ::testing::Values("agx-orin", "gh100-gpc", "desktop"),
                         [](const auto& each) { return each.param.substr(0, each.param.find('-')); });

// A draw that was tested late, anywhere behind it, made a draw 3.5 % longer on gh100-gpc.
TEST_P(OtherDraws, TakeAsLongWhateverADrawBehindThemCallsFor) {
  const Draw draw = testing::measured_draw();
  RunRequest request = request_of("baseline", Fidelity::cycle);
  request.platform = &platform_named(GetParam());
  DrawState plain = draw_state_of(request);
  plain.early_termination = false;
  std::vector<std::pair<std::string, DrawState>> states(5, {std::string(), plain});
  const auto tests_stencil = [](DrawState& state) {
    state.stencil.test = true;
    for (StencilFace* face : {&state.stencil.front, &state.stencil.back}) face->compare = Compare::always;
  };
  const auto writes_stencil = [&](DrawState& state) {
    tests_stencil(state);
    for (StencilFace* face : {&state.stencil.front, &state.stencil.back}) face->pass = StencilOperation::replace;
  };
  states[0].first = "tested before it is shaded";
  tests_stencil(states[0].second);
  states[1].first = "tested late";
  writes_stencil(states[1].second);
  states[2].first = "not blended";
  states[2].second.blend = false;
  states[3].first = "not shaded";
  writes_stencil(states[3].second);
  states[3].second.shader = FragmentShader::none;
  states[4].first = "pruned by another threshold";
  states[4].second.pruning_threshold = 0.02F;
  const auto geometry = std::make_shared<const Draw>(draw);
  const auto cycles = [&](const DrawState& state) {
    Frame frame(draw.width, draw.height);
    frame.draw(geometry, plain, "", 100'000, 2000);
    frame.draw(geometry, state, "", 0, 1);
    return static_cast<double>(*run(request, frame).draws.at(0).cycles);
  };
  const double beside_its_like = cycles(plain);
  for (const auto& [name, state] : states) EXPECT_NEAR(cycles(state), beside_its_like, 0.002 * beside_its_like) << name;
}

}  // namespace
}  // namespace vrpipe
