#include "jobs/comparison.h"

#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

namespace vrpipe::tools {

std::optional<double> speedup(const RunResult& baseline, const RunResult& run) {
  if (!baseline.cycles || !run.cycles || *run.cycles == 0) return std::nullopt;
  // What is drawn outside the pipeline may not count fragments.
  if (baseline.request.variant.is_of_pipeline() && baseline.counts.fragments_rasterized == 0) return std::nullopt;
  const double ratio = static_cast<double>(*baseline.cycles) / static_cast<double>(*run.cycles);
  if (baseline.request.platform == run.request.platform) return ratio;
  const double from = baseline.request.platform->frequency_mhz;
  const double to = run.request.platform->frequency_mhz;
  return from == to ? ratio : ratio * to / from;
}

std::optional<double> early_termination_ratio(const std::vector<RunResult>& runs) {
  const RunResult* without = nullptr;
  const RunResult* with = nullptr;
  for (const RunResult& run : runs) {
    const Variant& variant = run.request.variant;
    if (!variant.is_of_pipeline() || variant.quad_merging || !variant.base.empty()) continue;
    if (run.request.platform != runs.front().request.platform) continue;
    const RunResult*& found = variant.early_termination ? with : without;
    if (found == nullptr) found = &run;
  }
  if (without == nullptr || with == nullptr || with->counts.fragments_blended == 0) return std::nullopt;
  return static_cast<double>(without->counts.fragments_blended) / static_cast<double>(with->counts.fragments_blended);
}

Fidelity finest_fidelity_of(const std::vector<RunResult>& runs) {
  Fidelity finest = Fidelity::functional;
  for (const RunResult& run : runs) finest = std::max(finest, run.request.fidelity);
  return finest;
}

std::string finest_fidelity_text(const std::vector<RunResult>& runs) {
  const Fidelity finest = finest_fidelity_of(runs);
  const auto first =
      std::find_if(runs.begin(), runs.end(), [&](const RunResult& run) { return run.request.fidelity == finest; });
  return first == runs.end() ? vrpipe::name_of(finest) : fidelity_of(first->request);
}

bool is_finest(const RunRequest& request) {
  return request.fidelity == finest_fidelity(request.variant) && !request.sampling;
}

bool are_of_several_platforms(const std::vector<RunResult>& runs) {
  return std::any_of(runs.begin(), runs.end(),
                     [&](const RunResult& run) { return run.request.platform != runs.front().request.platform; });
}

std::size_t place_of_run(const std::vector<RunRequest>& requests, const std::string& name, const std::string& option) {
  if (name.empty()) return 0;
  std::vector<std::string> names;
  for (const RunRequest& request : requests) {
    if (name_of(request) == name) return names.size();
    names.push_back(name_of(request));
  }
  throw UserError("unknown run '" + name + "'", option, "it is none of those that are compared",
                  suggestion(name, names));
}

}  // namespace vrpipe::tools
