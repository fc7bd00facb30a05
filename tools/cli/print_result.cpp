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
bool print(const SimulationJob& job, ResultFiles& files, const MakeJson& make_json, const MakeText& make_text) {
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
    files.write(*job.json, json, "--json");
  }
  std::cout << text;
  if (files.has("--json")) std::cout << "result: " << printable(*job.json) << '\n';
  return true;
}

}  // namespace

void print_result(const SimulationJob& job, JobResult result) {
  ResultFiles& files = result.files;
  if (job.interval_csv) files.write(*job.interval_csv, intervals_csv(result.runs), "--interval-csv");
  if (job.html) {
    std::string page;
    {
      const StdoutToStderr redirected;
      page = compare_page(result);
    }
    files.write(*job.html, page, "--html");
  }
  const bool has_text = print(
      job, files, [&] { return result_json(result); }, [&](const TextStyle& style) { return report(result, style); });
  if (!has_text) return files.check();
  const auto tell = [](const char* what, const std::filesystem::path& where) {
    std::cout << what << ": " << printable(where.string()) << '\n';
  };
  if (files.has("--html")) tell("page", *job.html);
  if (job.save_draw) tell("draw", *job.save_draw);
  if (files.has("--interval-csv")) tell("intervals", *job.interval_csv);
  if (files.has(Trace::option)) tell("trace", job.trace->path());
  if (files.has(EventLog::file_option)) tell("log", *job.log->file());
  if (files.has(HeatMaps::option)) tell("heat maps", *job.output);
  files.check();
}

void print_result(const SimulationJob& job, const ViewsResult& result) {
  ResultFiles files;
  print(
      job, files, [&] { return views_json(result); },
      [&](const TextStyle& style) { return views_report(result, style); });
  files.check();
  // Not before all of it is safe.
  std::cout.flush();
  if (std::cout) result.journal->finish();
}

}  // namespace vrpipe::tools
