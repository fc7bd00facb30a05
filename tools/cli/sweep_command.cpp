#include <cstdio>
#include <cstdlib>
#include <iostream>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/scene_substitution.h>

#include "cli/command_line.h"
#include "cli/options.h"
#include "cli/parse.h"
#include "host/command_failure.h"
#include "host/output_file.h"
#include "host/terminal.h"
#include "jobs/sweep_analysis.h"
#include "jobs/sweep_job.h"
#include "output/json_text.h"
#include "output/sweep_report.h"

namespace vrpipe::tools {
namespace {

constexpr unsigned most_shards = 1'000'000;

/// Of several processes that mpirun started, one says what there is to say.
bool is_later_rank() {
  for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMI_RANK"}) {
    const char* const rank = std::getenv(name);
    if (rank != nullptr && std::strtol(rank, nullptr, 10) > 0) return true;
  }
  return false;
}
void silence() {
  for (std::FILE* stream : {stdout, stderr}) {
    if (std::freopen("/dev/null", "w", stream) == nullptr) continue;
  }
}

/// "I/N", I from 1 to N.
Shard parse_shard(const std::string& text) {
  const std::size_t slash = text.find('/');
  const auto refuse = [&]() -> UserError {
    return {"bad value '" + text + "'", "--shard", "it is not I/N with whole numbers, I from 1 to N", "give e.g. 1/4"};
  };
  if (slash == std::string::npos) throw refuse();
  try {
    const Shard shard{parse_count(text.substr(0, slash), "--shard", most_shards),
                      parse_count(text.substr(slash + 1), "--shard", most_shards)};
    if (shard.index <= shard.count) return shard;
  } catch (const UserError&) {
    throw refuse();
  }
  throw refuse();
}

/// Whether results depend on an option, or only who makes them and where they go.
bool is_of_results(const Option& option) { return option.group != result_group || option.name == "--relative-to"; }

/// The words of a command line without such options, and without the program's folder, which mpirun may say otherwise.
std::vector<std::string> words_of_results(const Invocation& invocation) {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < invocation.words.size(); ++i) {
    const std::string& word = invocation.words[i];
    const Option* const option = invocation.arguments->find(word.substr(0, word.find('=')));
    if (option == nullptr || option->kind == Option::Kind::positional || is_of_results(*option)) {
      words.push_back(word);
    } else if (option->kind == Option::Kind::text && word == option->name) {
      ++i;
    }
  }
  words.front() = std::filesystem::path(words.front()).filename().string();
  return words;
}

class SweepCommand : public Command {
 public:
  std::string name() const override { return "sweep"; }
  std::string summary() const override { return "a study over scenes, views, platforms, variants and parameters"; }

  void declare(Arguments& arguments) override {
    arguments.add_positional("STUDY.toml", study_,
                             "axes and points, and whatever a configuration file says (docs/studies.md)");
    arguments_.declare_study(arguments);
    arguments.add_option("--relative-to", relative_to_, "AXIS=VALUE,...",
                         "over which point speed-ups are, e.g. variant=baseline,platform=mobile; of axes of\n"
                         "what the GPU is that are not named the baseline or the platform's own value, if it\n"
                         "is there, else the first; scene, view and fidelity are the point's own",
                         result_group);
    arguments.add_option("--csv", csv_, "FILE", "writes a row for each point", result_group);
    arguments.add_option("--jsonl", jsonl_, "FILE", "writes a line of JSON for each point", result_group);
    arguments.add_option("--html", html_, "FILE", "writes a page with a plot for each axis; it needs no network",
                         result_group);
    arguments.add_option("--shard", shard_, "I/N",
                         "simulates the points I, I + N, ... alone, into a journal of its own beside\n"
                         "--journal FILE; without --shard the same command takes in all of them",
                         result_group);
    arguments.add_option(SweepJob::journal_option, journal_, "FILE",
                         "where is stored what is done, to go on from after an interruption; it stays\n"
                         "(default: a file in the user's cache folder, removed at the end, or by a later\n"
                         "study when it was left alone for 30 days)",
                         result_group);
    arguments.set_footer(
        "Simulates every point of a study, prints which axes matter and which GPUs are worth it, and writes the\n"
        "points. Killed at any moment, the same command goes on where it was and ends with the same bytes. Several\n"
        "machines share a study by MPI (mpirun -n N vrpipe sweep ...: N processes in all) or by --shard.\n"
        "\n"
        "Examples:\n"
        "  vrpipe sweep study.toml --csv study.csv --html study.html\n"
        "  vrpipe sweep study.toml --relative-to variant=baseline,tc.bins=32\n"
        "  vrpipe sweep study.toml --journal study.jsonl --shard 2/8");
  }

  std::optional<ConfigFile> configuration(Arguments& arguments) const override {
    if (study_.empty())
      throw UserError("missing argument", "vrpipe sweep", "there is no STUDY.toml",
                      "name a study; docs/studies.md describes it");
    return std::optional<ConfigFile>(std::in_place, study_, arguments, study_keys());
  }

  void run() override {
    if (is_later_rank()) silence();
    const SweepJob job = resolve();
    const SweepResult result = run_sweep(job);
    if (result.is_elsewhere) return;
    if (job.shard) return tell_shard(job, result);
    const SweepFindings findings = sweep_findings(result);
    ResultFiles files;
    if (job.csv) files.write(*job.csv, sweep_csv(findings.table), "--csv");
    if (job.jsonl) files.write(*job.jsonl, sweep_jsonl(findings.table), "--jsonl");
    if (job.html) files.write(*job.html, sweep_page(findings), "--html");
    const auto& json = job.common.json;
    if (json && *json != "-") files.write(*json, json_text(sweep_json(findings)), "--json");
    if (json == "-") {
      std::cout << json_text(sweep_json(findings));
    } else {
      std::cout << sweep_text(findings, stdout_style());
      std::cout << fmt::format("took {:.1f} s to simulate {} of the points, {} at a time", result.seconds,
                               result.points.size() - result.done_before, result.processes);
      if (result.done_before > 0) std::cout << fmt::format("; {} were done before", result.done_before);
      std::cout << '\n';
      if (files.has("--csv")) std::cout << "points: " << printable(job.csv->string()) << '\n';
      if (files.has("--jsonl")) std::cout << "points: " << printable(job.jsonl->string()) << '\n';
      if (files.has("--html")) std::cout << "page: " << printable(job.html->string()) << '\n';
      if (files.has("--json")) std::cout << "result: " << printable(*json) << '\n';
    }
    files.check();
    // Not before all of it is safe.
    std::cout.flush();
    if (std::cout) result.journal->finish();
    check_faults(result);
  }

 private:
  SweepJob resolve() const {
    SweepJob job;
    job.study_file = study_;
    job.study = read_study(study_);
    check_pareto(job.study);
    if (const auto text = single(relative_to_, "--relative-to"))
      job.study.relative_to = parse_axis_values(*text, job.study, "--relative-to");
    const auto variants = job.study.axis("variant");
    job.common = arguments_.resolve(SimulationArguments::Variants::one, invocation(),
                                    variants ? job.study.axes[*variants].values : std::vector<std::string>());
    job.common.provenance.command = words_of_results(invocation());
    for (const Option& option : invocation().arguments->options()) {
      if (option.kind != Option::Kind::positional && option.is_given() && is_of_results(option))
        job.options.emplace_back(option.name.substr(2), option.texts);
    }
    leave_out_absent(job);
    choose_references(job);
    job.csv = single_path(csv_, "--csv");
    job.jsonl = single_path(jsonl_, "--jsonl");
    job.html = single_path(html_, "--html");
    job.journal = single_path(journal_, SweepJob::journal_option);
    if (const auto text = single(shard_, "--shard")) job.shard = parse_shard(*text);
    check_outputs(job);
    return job;
  }

  /// After all results are written. Throws CommandFailure.
  static void check_faults(const SweepResult& result) {
    std::size_t faults = 0;
    const PointOutcome* first = nullptr;
    for (const auto& point : result.points) {
      if (!point || point->fault.empty()) continue;
      if (faults++ == 0) first = &*point;
    }
    if (first == nullptr) return;
    throw CommandFailure(exit_fault, fmt::format("{} of {} points ended in a fault, the first of them: {}", faults,
                                                 result.points.size(), first->fault));
  }

  static void check_outputs(const SweepJob& job) {
    std::vector<NamedFile> outputs;
    const auto add = [&](const char* option, const std::optional<std::filesystem::path>& file) {
      if (file) outputs.push_back({option, *file});
    };
    if (job.common.json && *job.common.json != "-") add("--json", *job.common.json);
    add("--csv", job.csv);
    add("--jsonl", job.jsonl);
    add("--html", job.html);
    if (job.shard && !job.journal)
      throw UserError("nowhere to store the shard", "--shard", "results of a shard are in its journal alone",
                      "add --journal FILE");
    if (job.shard && !outputs.empty())
      throw UserError("cannot write results", outputs.front().option, "a shard has not all points",
                      "leave it out; without --shard the command takes in all shards and writes them");
    for (const NamedFile& output : outputs) check_output_file(output.path, output.option);
    add(SweepJob::journal_option, job.journal);
    std::vector<NamedFile> inputs = job.common.inputs;
    inputs.push_back({"STUDY.toml", job.study_file});
    for (const StudyAxis& axis : job.study.axes) {
      if (axis.name != "scene") continue;
      for (const std::string& scene : axis.values) {
        if (!builtin_name_of(scene))
          inputs.push_back({"axis scene", gaussian_file_path(scene_file(scene_of_axis(job, scene)))});
      }
    }
    check_files_differ(inputs, outputs);
  }

  static void tell_shard(const SweepJob& job, const SweepResult& result) {
    std::size_t own = 0;
    for (std::size_t i = 0; i < result.points.size(); ++i) own += job.shard->has(i) ? 1U : 0U;
    std::cout << fmt::format("shard {} of {}: its {} points are done, in {:.1f} s\n", job.shard->index,
                             job.shard->count, own, result.seconds);
    result.journal->finish();
    check_faults(result);
  }

  SimulationArguments arguments_;
  std::string study_;
  Values relative_to_, csv_, jsonl_, html_, shard_, journal_;
};

}  // namespace

std::unique_ptr<Command> make_sweep_command() { return std::make_unique<SweepCommand>(); }

}  // namespace vrpipe::tools
