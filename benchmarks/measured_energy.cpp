// What the table of energies says that `gh100-gpc` spends above idle on a draw that was measured on the GPU itself, beside the
// power of its board: the draw tests/data/measured_draw.spl.xz by hardware, and rendered in software (tests/data/README.md).
//   measured_energy [--fidelity NAME] [--short]
// --short takes one splat in two hundred, of which nothing was measured, to see that it works.
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <vrpipe/platforms/software.h>

#include "jobs/energy.h"
#include "jobs/frame_energy.h"
#include "measured/command.h"
#include "measured/gpu.h"

namespace vrpipe::measured {
namespace {

using tools::EnergyAmounts;
using tools::Range;

const tools::EnergyTable& table() { return tools::shipped_energies(); }

struct MeasuredDraw {
  const char* mode;
  double millijoules;
  const char* decides;  ///< of the table; empty: nothing
};
constexpr MeasuredDraw draws[] = {{"RGBA16F", 91, ""},
                                  {"RGBA8", 69, "the power of an SM"},
                                  {"stencil test, all killed", 19, "the power of a GPC"},
                                  {"ideal early termination", 65, ""}};

void print(const char* what, double measured, const Range& predicted, const char* unit, const char* decides) {
  std::printf("%-34s%9.*f%11.*f%+7.1f   %.*f to %.*f%s%s\n", what, unit[0] == 'x' ? 2 : 0, measured,
              unit[0] == 'x' ? 2 : 1, predicted.nominal, percent(predicted.nominal, measured), unit[0] == 'x' ? 2 : 0,
              predicted.low, unit[0] == 'x' ? 2 : 0, predicted.high, decides[0] == 0 ? "" : "   decides ", decides);
  std::fflush(stdout);
}

EnergyAmounts in_software(const Draw& draw, const RunResult& hardware, const char* sms) {
  RunRequest request;
  request.platform = &platform_named("gh100-gpc");
  request.variant = variant_named("baseline");
  request.fidelity = hardware.request.fidelity;
  request.settings = {{"sm", "cores", sms}};
  const auto frame = Frame::of(draw);
  const tools::FrameEnergies energies(table(), hardware, prepare_for_hardware(request, *frame, {}));
  return *energies.of_software(simulate_software(request, *frame, {})).amounts;
}

void compare(const Draw& draw, Fidelity fidelity) {
  const Gpu gpu(fidelity);
  std::printf("%-34s%9s%11s%7s   %s\n", "mJ above idle", "measured", "predicted", "%", "low to high");
  std::vector<EnergyAmounts> of_draws;
  std::vector<RunResult> runs;
  for (const MeasuredDraw& measured : draws) {
    runs.push_back(gpu.run(draw, mode_named(measured.mode)));
    of_draws.push_back(energy_amounts(runs.back(), table()));
    print(measured.mode, measured.millijoules, energy_report(of_draws.back(), table()).total.value(), "mJ",
          measured.decides);
  }
  const EnergyAmounts on_four = in_software(draw, runs.front(), "4");
  const EnergyAmounts on_all = in_software(draw, runs.front(), "132");
  print("frame in software, 4 SMs", 131, energy_report(on_four, table()).total.value(), "mJ", "");
  print("frame in software, 132 SMs", 117, energy_report(on_all, table()).total.value(), "mJ", "");
  print("draw over frame in software", 0.70, energy_ratio(of_draws[0], on_four, table()).value(), "x", "");
  print("draw over ideal early termination", 1.41, energy_ratio(of_draws[0], of_draws[3], table()).value(), "x", "");
}

}  // namespace
}  // namespace vrpipe::measured

int main(int argc, char** argv) {
  return vrpipe::measured::run_of_measured_draw("measured_energy", argc, argv, vrpipe::measured::compare);
}
