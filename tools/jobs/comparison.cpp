#include "jobs/comparison.h"

namespace vrpipe::tools {

std::optional<double> speedup(const RunResult& baseline, const RunResult& run) {
  if (!baseline.cycles || !run.cycles || *run.cycles == 0) return std::nullopt;
  if (baseline.counts.fragments_rasterized == 0) return std::nullopt;
  return static_cast<double>(*baseline.cycles) / static_cast<double>(*run.cycles);
}

std::optional<double> early_termination_ratio(const std::vector<RunResult>& runs) {
  const RunResult* without = nullptr;
  const RunResult* with = nullptr;
  for (const RunResult& run : runs) {
    if (run.request.variant.quad_merging) continue;
    (run.request.variant.early_termination ? with : without) = &run;
  }
  if (without == nullptr || with == nullptr || with->counts.fragments_blended == 0) return std::nullopt;
  return static_cast<double>(without->counts.fragments_blended) / static_cast<double>(with->counts.fragments_blended);
}

}  // namespace vrpipe::tools
