#include <algorithm>
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
#include "output/frames_page.h"
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
        "on the baseline GPU, `multi-pass` with early termination by N passes, `in-shader` with a shader that blends "
        "under\n"
        "an ordered lock, `vr-pipe` with quad merging and early termination by hardware. Kernels run on the "
        "platform's\n"
        "SM array; they are units, so that --unit puts another one into the slots preparation, binning and render.\n"
        "`accelerator` has units, a clock and a memory of its own; --unit accelerator=NAME takes another: gscore, "
        "gcc,\n"
        "flicker.\n"
        "Millijoules are by the table of `vrpipe energies`; --imitation adds what the paper measured energy by.\n"
        "\n"
        "Examples:\n"
        "  vrpipe frames --fidelity lt --html frames.html\n"
        "  vrpipe frames --fidelity lt --views 6 --size 400x300\n"
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
      std::cout << config_text(invocation(), requests, parameters, camera_texts(job));
      return;
    }
    if (const std::optional<ViewsChoice> views = arguments_.views()) {
      FrameViewsResult result = perform_frame_views(job, *views);
      ResultFiles files;
      const bool has_images = std::all_of(result.views.begin(), result.views.end(),
                                          [](const FramesResult& view) { return view.files.has("--output"); });
      print(job, result, files, has_images);
      for (const FramesResult& view : result.views) view.files.check();
      return;
    }
    FramesResult result = perform_frames(job);
    if (job.html) {
      std::string page;
      {
        const StdoutToStderr redirected;
        page = frames_page(result);
      }
      result.files.write(*job.html, page, "--html");
    }
    print(job, result, result.files, result.files.has("--output"));
  }

 private:
  template <class Result>
  static void print(const SimulationJob& job, const Result& result, ResultFiles& files, bool has_images) {
    std::string text, json;
    {
      const StdoutToStderr redirected;  // units of plugins may print
      text = frames_report(result, stdout_style());
      if (job.json) json = json_text(frames_json(result));
    }
    if (job.json && *job.json == "-") {
      std::cout << json;
      return files.check();
    }
    if (job.json) files.write(*job.json, json, "--json");
    std::cout << text;
    if (has_images) std::cout << "images: " << printable(job.output->string()) << '\n';
    if (files.has("--html")) std::cout << "page: " << printable(job.html->string()) << '\n';
    if (files.has("--json")) std::cout << "result: " << printable(*job.json) << '\n';
    files.check();
  }

  SimulationArguments arguments_;
};

}  // namespace

std::unique_ptr<Command> make_frames_command() { return std::make_unique<FramesCommand>(); }

}  // namespace vrpipe::tools
