#include <iostream>

#include <boost/algorithm/string/classification.hpp>
#include <boost/algorithm/string/split.hpp>
#include <nlohmann/json.hpp>

#include <vrpipe/component/printable.h>

#include "cli/command_line.h"
#include "cli/options.h"
#include "cli/parse.h"
#include "cli/print_config.h"
#include "host/output_file.h"
#include "host/terminal.h"
#include "jobs/accuracy_job.h"
#include "output/accuracy_json.h"
#include "output/accuracy_page.h"
#include "output/accuracy_report.h"
#include "output/json_text.h"

namespace vrpipe::tools {
namespace {

constexpr unsigned largest_repeat = 100;

class AccuracyCommand : public Command {
 public:
  std::string name() const override { return "accuracy"; }
  std::string summary() const override { return "what accuracy costs in time, on one scene"; }

  void declare(Arguments& arguments) override {
    arguments_.declare(arguments, SimulationArguments::Variants::all);
    arguments_.declare_variants(arguments);
    const std::string ladders = "The ladders";
    arguments.add_flag("--quick", quick_,
                       "a first answer: the middle ninth of the image unless --size is given, two\n"
                       "variants, and one value of some knobs",
                       ladders);
    arguments.add_option("--repeat", repeat_, "N",
                         "measures each rung of the fidelity ladder N times, interleaved, and\n"
                         "takes the median of the seconds (default: 1)",
                         ladders);
    arguments.find("--repeat")->check = [](const std::string& text) { parse_count(text, "--repeat", largest_repeat); };
    arguments.add_option("--at-cycle", at_cycle_, "UNIT,...",
                         "a rung with these units at cycle among others at lt; can be repeated\n"
                         "(default: zrop,crop)",
                         ladders);
    arguments.add_option("--html", html_, "FILE",
                         "writes a page with plots, images and error maps; it needs no network", result_group);
    arguments.add_flag("--markdown", markdown_, "prints the tables as Markdown in place of the report", result_group);
    arguments.set_footer(
        "Climbs two ladders. Fidelity: every variant at every --fidelity that there is, one at a time, with its\n"
        "error in cycles and speed-up against the most exact, and its CPU seconds; then with one thing changed at a\n"
        "time in the platform, format, termination, units and settings given. Precision: het+qm, at the --fidelity\n"
        "given (default: cycle), with one arithmetic choice changed at a time, with its error against an image in\n"
        "double precision (no tiles, no termination, all bands, exact order), and its simulated cycles. --jobs is\n"
        "for what is not timed. --output writes the image of every choice.\n"
        "\n"
        "Examples:\n"
        "  vrpipe accuracy --quick\n"
        "  vrpipe accuracy --scene builtin:indoor --html indoor.html --json indoor.json\n"
        "  vrpipe accuracy --repeat 5 --set state.blend_rounding=measured\n"
        "  vrpipe accuracy --variant software --variant accelerator\n"
        "  vrpipe accuracy --scene point_cloud.ply --camera cameras.json#3 --fidelity functional");
  }

  void run() override {
    AccuracyJob job;
    job.simulation = arguments_.resolve(SimulationArguments::Variants::all, invocation());
    if (prints_config(invocation())) {
      std::cout << config_text(invocation(), job.simulation.requests, job.simulation.preprocess_parameters,
                               camera_texts(job.simulation));
      return;
    }
    job.quick = quick_;
    job.markdown = markdown_;
    if (const auto text = single(repeat_, "--repeat")) job.repeat = parse_count(*text, "--repeat", largest_repeat);
    if (const auto file = single(html_, "--html")) job.html = *file;
    if (!at_cycle_.empty()) job.units_at_cycle = units_at_cycle(job.simulation.requests);

    ProgressLine progress;
    AccuracyResult result = measure_accuracy(job, progress);
    ResultFiles& files = result.files;
    if (job.html) {
      progress.show("writing the page");
      files.write(*job.html, accuracy_page(result), "--html");
    }
    progress.erase();
    const std::optional<std::string>& json = job.simulation.json;
    if (json) {
      const std::string text = json_text(accuracy_json(result));
      if (*json == "-") {
        std::cout << text;
        return files.check();
      }
      files.write(*json, text, "--json");
    }
    std::cout << (job.markdown ? accuracy_markdown(result) : accuracy_text(result, stdout_style()));
    if (files.has("--json") && !job.markdown) std::cout << "result: " << printable(*json) << '\n';
    if (files.has("--html") && !job.markdown) std::cout << "page: " << printable(job.html->string()) << '\n';
    files.check();
  }

 private:
  /// Of --at-cycle. Throws UserError for what no variant can have.
  std::vector<std::vector<std::string>> units_at_cycle(const std::vector<RunRequest>& requests) const {
    std::vector<std::vector<std::string>> all;
    for (const std::string& text : at_cycle_) {
      RunRequest request = requests.front();
      request.fidelity = Fidelity::lt;
      boost::split(request.units_at_cycle, text, boost::is_any_of(","));
      if (request.variant.is_of_pipeline()) check_configuration(request);
      all.push_back(request.units_at_cycle);
    }
    return all;
  }

  SimulationArguments arguments_;
  Values repeat_, html_, at_cycle_;
  bool quick_ = false;
  bool markdown_ = false;
};

}  // namespace

std::unique_ptr<Command> make_accuracy_command() { return std::make_unique<AccuracyCommand>(); }

}  // namespace vrpipe::tools
