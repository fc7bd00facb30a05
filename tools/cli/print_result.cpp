#include "cli/print_result.h"

#include <iostream>
#include <string>

#include <vrpipe/component/printable.h>

#include "host/output_file.h"
#include "host/stdout_to_stderr.h"
#include "host/terminal.h"
#include "output/json_text.h"
#include "output/report.h"
#include "output/result_json.h"

namespace vrpipe::tools {

void print_result(const SimulationJob& job, const JobResult& result) {
  const TextStyle style = stdout_style();
  std::string json;
  std::string text;
  {
    const StdoutToStderr redirected;  // both make units of plugins, which may print
    if (job.json) json = json_text(result_json(result));
    text = report(result, style);
  }
  if (job.json) {
    if (*job.json == "-") {
      std::cout << json;
      return;
    }
    write_output_file(*job.json, json, "--json");
  }
  std::cout << text;
  if (job.json) std::cout << "result: " << printable(*job.json) << '\n';
  if (job.save_draw) std::cout << "draw: " << printable(job.save_draw->string()) << '\n';
}

}  // namespace vrpipe::tools
