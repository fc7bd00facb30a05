#include <iostream>

#include <vrpipe/component/error.h>

#include "cli/command_line.h"
#include "cli/listing.h"
#include "host/output_file.h"
#include "host/terminal.h"
#include "output/diff_report.h"
#include "output/json_text.h"

namespace vrpipe::tools {
namespace {

class DiffCommand : public Command {
 public:
  std::string name() const override { return "diff"; }
  std::string summary() const override {
    return "what differs between two results: settings, counts, cycles, pictures";
  }

  void declare(Arguments& arguments) override {
    arguments.add_positional("A.json", a_, "a result that --json wrote");
    arguments.add_positional("B.json", b_, "another one");
    arguments.add_flag("--all", all_, "everything that differs: units, effects, counts, every statistic", result_group);
    declare_json(arguments, json_, "differences");
    arguments.set_footer(
        "Says what was asked for otherwise, the cycles of both, and which statistics changed most. The results are of\n"
        "the same command; runs, units and statistics are matched by name. Pictures are compared where both results\n"
        "have them (--output). What the host makes is left out: seconds, load, names of files. Exit code 0 whether "
        "they\n"
        "differ or not; JSON has `equal`.\n"
        "\n"
        "Examples:\n"
        "  vrpipe diff before.json after.json\n"
        "  vrpipe diff before.json after.json --json - | python3 -m json.tool");
  }

  void run() override {
    for (const auto& [text, name] : {std::pair{&a_, "A.json"}, std::pair{&b_, "B.json"}}) {
      if (text->empty())
        throw UserError("missing argument", "vrpipe diff", std::string("there is no ") + name, "name two results");
    }
    const auto place = single(json_, "--json");
    if (place && *place != "-") {
      check_output_file(*place, "--json");
      check_files_differ({{"A.json", a_}, {"B.json", b_}}, {{"--json", *place}});
    }
    const ResultFile a = read_result(a_), b = read_result(b_);
    const ResultDiff diff = diff_results(a, b);
    if (place == "-") {
      std::cout << json_text(diff_json(diff));
      return;
    }
    if (place) write_output_file(*place, json_text(diff_json(diff)), "--json");
    std::cout << diff_text(diff, all_, stdout_style());
  }

 private:
  std::string a_, b_;
  Values json_;
  bool all_ = false;
};

}  // namespace

std::unique_ptr<Command> make_diff_command() { return std::make_unique<DiffCommand>(); }

}  // namespace vrpipe::tools
