#include <iostream>
#include <optional>

#include "cli/command_line.h"
#include "cli/options.h"
#include "cli/print_config.h"
#include "cli/print_result.h"
#include "jobs/simulation_job.h"
#include "jobs/views_job.h"

namespace vrpipe::tools {
namespace {

class CompareCommand : public Command {
 public:
  std::string name() const override { return "compare"; }
  std::string summary() const override {
    return "variants side by side: baseline, qm, het, het+qm and those of your own (the main job)";
  }

  void declare(Arguments& arguments) override {
    arguments_.declare(arguments, SimulationArguments::Variants::all);
    arguments_.declare_comparison(arguments);
    arguments_.declare_error(arguments);
    arguments_.declare_frames(arguments);
    arguments_.declare_views(arguments);
    arguments_.declare_page(arguments);
    arguments_.declare_energy(arguments);
    arguments_.declare_explanation(arguments);
    arguments_.declare_time(arguments, SimulationArguments::Variants::all);
    arguments.set_footer(
        "Simulates GPUs that differ only in the units swapped in, on the same draw: baseline, qm (TGC and QRU merge\n"
        "overlapping quads), het (ZROP and CROP terminate opaque pixels) and het+qm (both), or any set of variants\n"
        "and platforms. Prints cycles, speed-ups, counts and utilization side by side; with --views, how speed-ups\n"
        "and early-termination ratios are distributed over many cameras.\n"
        "\n"
        "Examples:\n"
        "  vrpipe compare\n"
        "  vrpipe compare --scene builtin:outdoor --output images --json outdoor.json\n"
        "  vrpipe compare --html compare.html\n"
        "  vrpipe compare --scene point_cloud.ply --camera cameras.json#3 --size 1280x720\n"
        "  vrpipe compare --scene point_cloud.ply --camera cameras.json --views 20 --size 1280x720\n"
        "  vrpipe compare --scene builtin:indoor --views 8 --fidelity lt\n"
        "  vrpipe compare --scene builtin:train --error 2%\n"
        "  vrpipe compare --platform mobile --format rgba8\n"
        "  vrpipe compare --variant het+qm --variant small=het+qm,tc.bins=16,tgc.bins=64\n"
        "  vrpipe compare --variant baseline --variant software --variant no-end=software,render=endless\n"
        "  vrpipe compare --platform agx-orin --platform mobile --relative-to mobile/baseline\n"
        "  vrpipe compare --platform agx-orin-lpddr5 --energy\n"
        "  vrpipe compare --set qru.quads_per_cycle=4 --json - | python3 -m json.tool");
  }

  void run() override {
    const std::optional<ViewsChoice> views = arguments_.views();
    const SimulationJob job = arguments_.resolve(SimulationArguments::Variants::all, invocation());
    if (prints_config(invocation())) {
      std::cout << config_text(invocation(), job.requests, job.preprocess_parameters, camera_texts(job));
      return;
    }
    if (views) {
      print_result(job, simulate_views(job, *views));
    } else {
      print_result(job, perform(job));
    }
  }

 private:
  SimulationArguments arguments_;
};

}  // namespace

std::unique_ptr<Command> make_compare_command() { return std::make_unique<CompareCommand>(); }

}  // namespace vrpipe::tools
