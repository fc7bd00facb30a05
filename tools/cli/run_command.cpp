#include <iostream>

#include "cli/command_line.h"
#include "cli/options.h"
#include "cli/print_config.h"
#include "cli/print_result.h"
#include "jobs/simulation_job.h"

namespace vrpipe::tools {
namespace {

class RunCommand : public Command {
 public:
  std::string name() const override { return "run"; }
  std::string summary() const override { return "one platform, one variant, one scene"; }

  void declare(Arguments& arguments) override {
    arguments_.declare(arguments, SimulationArguments::Variants::one);
    arguments_.declare_error(arguments);
    arguments_.declare_frames(arguments);
    arguments_.declare_page(arguments);
    arguments_.declare_energy(arguments);
    arguments_.declare_explanation(arguments);
    arguments_.declare_time(arguments, SimulationArguments::Variants::one);
    arguments.set_footer(
        "Prints cycles, counts, utilization and what each unit spent its cycles on.\n"
        "\n"
        "Examples:\n"
        "  vrpipe run\n"
        "  vrpipe run --variant baseline --size 640x360 --output images\n"
        "  vrpipe run --scene point_cloud.ply --eye 0,1.5,-4 --look-at 0,0,0 --fovy 45\n"
        "  vrpipe run --frame frame.json --variant het\n"
        "  vrpipe run --set crop.cache_bytes=32768 --set tc.bins=64 --json -\n"
        "  vrpipe run --interval 10000 --interval-csv run.csv --interval-statistics 'crop.quads_blended,l2.*'\n"
        "  vrpipe run --size 320x180 --trace run.json@10000:20000 --log gpc0.crop@10000:10100\n"
        "  vrpipe run --size 320x180 --explain-effects\n"
        "  vrpipe run --plugin my_qru.so --unit qru=my-qru\n"
        "  vrpipe run --fidelity functional --termination strict\n"
        "  vrpipe run --scene builtin:train --fidelity sampled --seed 7");
  }

  void run() override {
    const SimulationJob job = arguments_.resolve(SimulationArguments::Variants::one, invocation());
    if (prints_config(invocation())) {
      std::cout << config_text(invocation(), job.requests, job.preprocess_parameters, camera_texts(job));
      return;
    }
    print_result(job, perform(job));
  }

 private:
  SimulationArguments arguments_;
};

}  // namespace

std::unique_ptr<Command> make_run_command() { return std::make_unique<RunCommand>(); }

}  // namespace vrpipe::tools
