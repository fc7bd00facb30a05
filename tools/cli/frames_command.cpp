#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include <vrpipe/component/printable.h>

#include "cli/command_line.h"
#include "cli/options.h"
#include "cli/print_config.h"
#include "host/output_file.h"
#include "host/stdout_to_stderr.h"
#include "host/terminal.h"
#include "jobs/frames_job.h"
#include "output/frames_json.h"
#include "output/frames_report.h"
#include "output/json_text.h"

namespace vrpipe::tools {
namespace {

class FramesCommand : public Command {
 public:
  std::string name() const override { return "frames"; }
  std::string summary() const override {
    return "a whole frame in software, by today's hardware, by VR-Pipe and by an accelerator";
  }

  void declare(Arguments& arguments) override {
    arguments_.declare_whole_frames(arguments);
    arguments.set_footer(
        "Times all of a frame: Gaussians projected, splats sorted, and drawn. `software` is the published CUDA "
        "renderer:\n"
        "tiles have sorted lists of splats, and a block of threads each. `hardware` sorts splats by depth and draws "
        "them\n"
        "on the baseline GPU, `multi-pass` with early termination by N passes, `vr-pipe` with quad merging and early\n"
        "termination by hardware. Kernels run on the platform's SM array;\n"
        "they are units, so that --unit puts another one into the slots preparation, binning and render. `accelerator` "
        "has\n"
        "units, a clock and a memory of its own; --unit accelerator=NAME takes another: gscore, gcc, flicker.\n"
        "Millijoules are by the table of `vrpipe energies`; --imitation adds what the paper measured energy by.\n"
        "\n"
        "Examples:\n"
        "  vrpipe frames --fidelity lt\n"
        "  vrpipe frames --scene draw.spl --platform gh100-gpc --set sm.cores=8\n"
        "  vrpipe frames --fidelity lt --imitation\n"
        "  vrpipe frames --set binning.lists=three_sigma --unit render=endless --json -\n"
        "  vrpipe frames --fidelity lt --unit accelerator=gcc --set accelerator.volume_units=8");
  }

  void run() override {
    const SimulationJob job = arguments_.resolve(SimulationArguments::Variants::all, invocation());
    if (prints_config(invocation())) {
      std::vector<RunRequest> requests = job.requests;
      std::vector<UnitChoice>& units = requests.front().units;
      units.insert(units.end(), job.kernel_units.begin(), job.kernel_units.end());
      auto parameters = job.preprocess_parameters;
      parameters.insert(parameters.end(), job.kernel_parameters.begin(), job.kernel_parameters.end());
      std::cout << config_text(invocation(), requests, parameters);
      return;
    }
    FramesResult result = perform_frames(job);
    ResultFiles& files = result.files;
    std::string text;
    {
      const StdoutToStderr redirected;
      text = frames_report(result, stdout_style());
      if (job.json) {
        const std::string json = json_text(frames_json(result));
        if (*job.json != "-") {
          files.write(*job.json, json, "--json");
        } else {
          text = json;
        }
      }
    }
    std::cout << text;
    if (job.json && *job.json == "-") return files.check();
    if (files.has("--output")) std::cout << "images: " << printable(job.output->string()) << '\n';
    if (files.has("--json")) std::cout << "result: " << printable(*job.json) << '\n';
    files.check();
  }

 private:
  SimulationArguments arguments_;
};

}  // namespace

std::unique_ptr<Command> make_frames_command() { return std::make_unique<FramesCommand>(); }

}  // namespace vrpipe::tools
