// What a real GPU spent on a draw above idle, by hardware and in software, beside what the table of energies says. Two of its
// powers were found by the draws into RGBA8 and killed by stencil; all else is predicted.

#include <gtest/gtest.h>

#include <vrpipe/platforms/software.h>

#include "jobs/energy.h"
#include "jobs/frame_energy.h"
#include "support/measured_scenes.h"
#include "support/simulate.h"

namespace vrpipe::testing {
namespace {

using tools::EnergyAmounts;
using tools::EnergyTable;

class MeasuredEnergy : public ::testing::Test {
 protected:
  MeasuredEnergy() : draw_(measured_draw()) {}
  static RunRequest request(const char* variant) {
    RunRequest request;
    request.platform = &platform_named("gh100-gpc");
    request.variant = variant_named(variant);
    request.fidelity = Fidelity::lt;
    request.settings = {{"state", "obb_padding", "0"}};
    return request;
  }
  RunResult run(const RunRequest& request, Compare stencil = Compare::always) const {
    DrawState state = draw_state_of(request);
    state.early_termination = request.variant.name == "het";
    if (stencil != Compare::always) {
      state.stencil.test = true;
      state.stencil.front.compare = state.stencil.back.compare = stencil;
    }
    fresh_simulation();
    return simulate(request, *Frame::of(draw_, state));
  }
  EnergyAmounts software(const RunResult& hardware, const char* sms) const {
    RunRequest in_software = request("baseline");
    in_software.settings = {{"sm", "cores", sms}};
    const auto frame = Frame::of(draw_);
    const tools::FrameEnergies energies(table_, hardware, prepare_for_hardware(in_software, *frame, {}));
    return energies.of_software(simulate_software(in_software, *frame, {})).amounts.value();
  }
  double millijoules(const EnergyAmounts& amounts) const { return energy_report(amounts, table_).total->nominal; }
  double ratio(const EnergyAmounts& a, const EnergyAmounts& b) const { return energy_ratio(a, b, table_)->nominal; }

  const EnergyTable& table_ = tools::shipped_energies();
  Draw draw_;
};

TEST_F(MeasuredEnergy, IsThatOfTheGpuAboveIdle) {
  const RunResult half = run(request("baseline"));
  const EnergyAmounts draw = energy_amounts(half, table_);
  EXPECT_NEAR(millijoules(draw), 91, 0.1 * 91);
  RunRequest bytes = request("baseline");
  bytes.format = ColorFormat::rgba8;
  EXPECT_NEAR(millijoules(energy_amounts(run(bytes), table_)), 69, 0.1 * 69);
  EXPECT_NEAR(millijoules(energy_amounts(run(request("baseline"), Compare::none), table_)), 19, 0.1 * 19);
  RunRequest terminating = request("het");
  terminating.termination = Termination::strict;
  const EnergyAmounts ideal = energy_amounts(run(terminating), table_);
  EXPECT_NEAR(millijoules(ideal), 65, 0.1 * 65);
  EXPECT_NEAR(ratio(draw, ideal), 1.41, 0.1 * 1.41);
  const EnergyAmounts on_four = software(half, "4");
  EXPECT_NEAR(millijoules(on_four), 131, 0.1 * 131);
  EXPECT_NEAR(ratio(draw, on_four), 0.70, 0.15 * 0.70);
  EXPECT_NEAR(millijoules(software(half, "132")), 117, 0.15 * 117) << "and seven GPCs that nothing is said of";
}

}  // namespace
}  // namespace vrpipe::testing
