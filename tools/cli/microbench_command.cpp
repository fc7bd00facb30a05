#include <algorithm>
#include <iostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>

#include "cli/command_line.h"
#include "cli/options.h"
#include "cli/print_config.h"
#include "host/output_file.h"
#include "host/terminal.h"
#include "jobs/microbench_job.h"
#include "output/json_text.h"
#include "output/microbench_json.h"
#include "output/microbench_page.h"
#include "output/microbench_report.h"

namespace vrpipe::tools {
namespace {

class MicrobenchCommand : public Command {
 public:
  std::string name() const override { return "microbench"; }
  std::string summary() const override { return "the paper's analysis of GPUs as workloads, beside a real GPU"; }

  void declare(Arguments& arguments) override {
    arguments
        .add_positional("NAME", name_,
                        fmt::format("{}, or all of these;\n{}, or laws for all of those, on {} by default",
                                    fmt::join(microbench_names(), ", "), fmt::join(law_names(), ", "),
                                    measured_platform))
        .is_required = true;
    arguments_.declare_machine(arguments);
    arguments.add_option("--html", html_, "FILE", "writes a page with the curves; it needs no network", result_group);
    arguments.set_footer(
        "Each draws rectangles or splats of its own on the baseline GPU and prints what the paper found, what a real\n"
        "GPU (one graphics GPC of a GH100) measured and what the simulator does beside one another, with its curve;\n"
        "of the laws of that GPU's ROPs each measurement with its ratio, and how far each group of them is off. Draw\n"
        "state is the microbenchmark's: of --set state.NAME the precision of the hardware is taken alone.\n"
        "\n"
        "Examples:\n"
        "  vrpipe microbench tile-binning\n"
        "  vrpipe microbench rop-throughput --set crop.bytes_per_cycle=32 --set crop.cache_bytes=8K\n"
        "  vrpipe microbench all --json microbench.json --html microbench.html\n"
        "  vrpipe microbench same-place");
  }

  void run() override {
    const std::vector<std::string> laws = law_names();
    const bool is_law = name_ == "laws" || std::find(laws.begin(), laws.end(), name_) != laws.end();
    MachineJob job = arguments_.resolve_machine(invocation(), is_law ? &platform_named(measured_platform) : nullptr);
    if (prints_config(invocation())) {
      std::cout << config_text(invocation(), {job.request}, {});
      return;
    }
    const std::vector<std::string> names = name_ == "all"    ? microbench_names()
                                           : name_ == "laws" ? laws
                                                             : std::vector<std::string>{name_};
    check_microbench_state(job.request);
    for (const std::string& each : names) check_microbench(each, job.request);
    const auto html = single(html_, "--html");
    std::vector<NamedFile> outputs;
    if (job.json && *job.json != "-") outputs.push_back({"--json", *job.json});
    if (html) outputs.push_back({"--html", *html});
    for (const NamedFile& output : outputs) check_output_file(output.path, output.option);
    check_files_differ(job.inputs, outputs);

    MicrobenchRun run;
    run.provenance = std::move(job.provenance);
    run.request = job.request;
    run.processes = job.processes;
    for (const std::string& each : names) run.results.push_back(run_microbench(each, job.request, job.processes));
    ResultFiles files;
    if (html) files.write(*html, microbench_page(run), "--html");
    if (job.json) {
      const std::string text = json_text(microbench_json(run));
      if (*job.json == "-") {
        std::cout << text;
        return files.check();
      }
      files.write(*job.json, text, "--json");
    }
    std::cout << microbench_text(run, stdout_style());
    if (files.has("--json")) std::cout << "result: " << printable(*job.json) << '\n';
    if (files.has("--html")) std::cout << "page: " << printable(*html) << '\n';
    files.check();
  }

 private:
  SimulationArguments arguments_;
  std::string name_;
  Values html_;
};

}  // namespace

std::unique_ptr<Command> make_microbench_command() { return std::make_unique<MicrobenchCommand>(); }

}  // namespace vrpipe::tools
