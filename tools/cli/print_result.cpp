#include "cli/print_result.h"

#include <filesystem>
#include <iostream>
#include <string>

#include <nlohmann/json.hpp>

#include <vrpipe/component/printable.h>

#include "host/output_file.h"
#include "host/stdout_to_stderr.h"
#include "host/terminal.h"
#include "output/compare_page.h"
#include "output/interval_report.h"
#include "output/json_text.h"
#include "output/report.h"
#include "output/result_json.h"
#include "output/views_json.h"
#include "output/views_report.h"

namespace vrpipe::tools {

namespace {

/// Both made and printed as the job says; false when stdout is for the JSON alone.
template <class MakeJson, class MakeText>
bool print(const SimulationJob& job, const MakeJson& make_json, const MakeText& make_text) {
  const TextStyle style = stdout_style();
  std::string json;
  std::string text;
  {
    const StdoutToStderr redirected;  // both make units of plugins, which may print
    if (job.json) json = json_text(make_json());
    text = make_text(style);
  }
  if (job.json) {
    if (*job.json == "-") {
      std::cout << json;
      return false;
    }
    write_output_file(*job.json, json, "--json");
  }
  std::cout << text;
  if (job.json) std::cout << "result: " << printable(*job.json) << '\n';
  return true;
}

}  // namespace

void print_result(const SimulationJob& job, const JobResult& result) {
  if (job.interval_csv) write_output_file(*job.interval_csv, intervals_csv(result.runs), "--interval-csv");
  if (job.html) {
    std::string page;
    {
      const StdoutToStderr redirected;
      page = compare_page(result);
    }
    write_output_file(*job.html, page, "--html");
  }
  const bool has_text = print(
      job, [&] { return result_json(result); }, [&](const TextStyle& style) { return report(result, style); });
  if (!has_text) return;
  const auto tell = [](const char* what, const std::filesystem::path& where) {
    std::cout << what << ": " << printable(where.string()) << '\n';
  };
  if (job.html) tell("page", *job.html);
  if (job.save_draw) tell("draw", *job.save_draw);
  if (job.interval_csv) tell("intervals", *job.interval_csv);
  if (job.trace) tell("trace", job.trace->path());
  if (job.log && job.log->file()) tell("log", *job.log->file());
  if (job.heat_maps) tell("heat maps", *job.output);
}

void print_result(const SimulationJob& job, const ViewsResult& result) {
  print(
      job, [&] { return views_json(result); }, [&](const TextStyle& style) { return views_report(result, style); });
  // Not before all of it is safe.
  std::cout.flush();
  if (std::cout) result.journal->finish();
}

}  // namespace vrpipe::tools
