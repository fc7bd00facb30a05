#pragma once

#include <string>

#include "host/terminal.h"
#include "jobs/sweep_analysis.h"
#include "output/result_json.h"

namespace vrpipe::tools {

/// What a sweep found, ready to be told.
struct SweepFindings {
  const SweepResult& result;
  SweepTable table;
  AxisEffects effects;
  std::vector<IdleAxis> idle;
  CommonScene scene;
  std::optional<GroupedMeans> grouped;
  std::optional<ParetoTable> pareto;
};
/// The result outlives it.
SweepFindings sweep_findings(const SweepResult& result);

/// For a person: what matters, the Pareto table, and the points if they are few.
std::string sweep_text(const SweepFindings& findings, const TextStyle& style);
/// RFC 4180, a row for each point.
std::string sweep_csv(const SweepTable& table);
/// A line of JSON for each point.
std::string sweep_jsonl(const SweepTable& table);
/// Schema vrpipe.sweep/1.
Json sweep_json(const SweepFindings& findings);
/// What speed-ups are over, in words; empty if no axis says it.
std::string reference_text(const Study& study);
/// How many points there are, and of how many combinations.
std::string points_line(const Study& study);
/// machines_text() of the points, but for what axes say.
std::string study_machines_text(const SweepResult& result, const TextStyle& style);
/// Scene and size, as far as all points have the same; else empty.
std::string scene_line(const CommonScene& scene);
/// Of an axis, what it changes, in words: "1.24x", or "no effect".
std::string effect_words(const SweepFindings& findings, const AxisEffect& effect);
/// Whether any point has a speed-up.
bool has_speedups(const SweepTable& table);
/// A page that needs no network.
std::string sweep_page(const SweepFindings& findings);

}  // namespace vrpipe::tools
