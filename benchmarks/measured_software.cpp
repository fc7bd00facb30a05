// What software rendering takes on `gh100-gpc`, beside what kernels after the published ones took on the GPU itself, on as
// many of its SMs: milliseconds of the draw tests/data/measured_draw.spl.xz (tests/data/README.md).
//   measured_software [--fidelity NAME] [--short]
// --short takes one splat in two hundred, of which nothing was measured, to see that it works.
#include <cmath>
#include <cstdio>
#include <string>

#include <vrpipe/platforms/software.h>

#include "measured/command.h"

namespace vrpipe {
namespace {

struct MeasuredKernel {
  const char* lists;
  const char* kernel;
  const char* sms;
  double render, frame;  ///< milliseconds; a frame of 0 was not measured
};
constexpr MeasuredKernel measurements[] = {
    {"obb", "endless", "4", 9.28, 0},
    {"obb", "published", "4", 8.30, 9.83},
    {"obb", "threshold", "4", 6.56, 0},
    {"ellipse", "published", "4", 7.45, 0},
    {"three_sigma", "endless", "4", 15.31, 0},
    {"three_sigma", "published", "4", 13.49, 15.77},
    {"three_sigma", "threshold", "4", 10.66, 0},
    {"obb", "published", "8", 4.17, 4.98},
    {"obb", "published", "16", 2.12, 2.59},
    {"obb", "published", "132", 0.46, 0.63},
};

void compare(const Draw& draw, Fidelity fidelity) {
  const auto percent = [](double got, double measured) { return 100 * (got / measured - 1); };
  std::printf(
      "%-38srender                     frame\n"
      "lists        kernel      SMs     meas.   pred.     %%       meas.   pred.     %%     pairs   host s\n",
      (std::string("milliseconds at ") + name_of(fidelity)).c_str());
  for (const MeasuredKernel& measured : measurements) {
    RunRequest request;
    request.platform = &platform_named("gh100-gpc");
    request.variant = variant_named("baseline");
    request.fidelity = fidelity;
    request.settings = {{"binning", "lists", measured.lists}, {"sm", "cores", measured.sms}};
    request.units = {{"render", measured.kernel}};
    const SoftwareResult result = simulate_software(request, *Frame::of(draw), {});
    const auto milliseconds = [&](std::uint64_t cycles) {
      return static_cast<double>(cycles) / (1000 * request.platform->frequency_mhz);
    };
    const double render = milliseconds(*result.render.cycles);
    const double frame = milliseconds(*result.cycles);
    std::printf("%-13s%-11s%4s%10.2f%8.2f%+6.1f", measured.lists, measured.kernel, measured.sms, measured.render,
                render, percent(render, measured.render));
    if (measured.frame > 0) {
      std::printf("%12.2f%8.2f%+6.1f", measured.frame, frame, percent(frame, measured.frame));
    } else {
      std::printf("%12s%8.2f%6s", "", frame, "");
    }
    std::printf("%10llu%9.2f\n", static_cast<unsigned long long>(result.binning.back().items), result.host_seconds);
  }
}

}  // namespace
}  // namespace vrpipe

int main(int argc, char** argv) {
  return vrpipe::measured::run_of_measured_draw("measured_software", argc, argv, vrpipe::compare);
}
