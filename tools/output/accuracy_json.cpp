#include "output/accuracy_json.h"

#include <cmath>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include <vrpipe/arithmetic/blend.h>

#include "jobs/optional_json.h"
#include "output/energy_report.h"

namespace vrpipe::tools {
namespace {

Json cycles_json(const RunResult& run) { return run.cycles ? Json(*run.cycles) : Json(); }
Json decibels_json(double psnr) { return std::isinf(psnr) ? Json() : Json(psnr); }

Json fidelity_json(const FidelityLevel& level) {
  return {{"fidelity", fidelity_of(level.run.request)},
          {"variant", level.run.request.variant.name},
          {"cycles", cycles_json(level.run)},
          {"cycles_error_percent", optional_json(level.cycles_error_percent)},
          {"expected_error_percent", optional_json(level.run.expected_error_percent)},
          {"speedup", optional_json(level.speedup)},
          {"speedup_error_percent", optional_json(level.speedup_error_percent)},
          {"host_seconds", level.host_seconds},
          {"cpu_seconds", level.cpu_seconds},
          {"times_as_fast", level.times_as_fast},
          {"times_as_fast_elapsed", level.times_as_fast_elapsed},
          {"quads_per_second", level.quads_per_second},
          {"kernel_events", level.run.kernel_events},
          {"dominated", level.dominated},
          {"fragments_blended", level.run.counts.fragments_blended},
          {"fragments_blended_error_percent", level.fragments_blended_error_percent},
          {"image_equal", std::isinf(level.image.psnr_db)},
          {"image_psnr_db", decibels_json(level.image.psnr_db)},
          {"image_max_abs_difference", level.image.max_abs_error},
          {"result_hash", level.run.result_hash}};
}

Json precision_json(const PrecisionRow& row, const PrecisionRun& run) {
  const bool free = run.cycles_change_percent && *run.cycles_change_percent == 0;
  Json by_fragments = Json::array();
  for (const ErrorOfRange& range : run.by_fragments) {
    by_fragments.push_back({{"from", range.from},
                            {"to", range.to},
                            {"pixels", range.pixels},
                            {"mean_abs_error", range.mean_abs_error},
                            {"max_abs_error", range.max_abs_error},
                            {"proved_max_abs_error", optional_json(range.proved_max_error)}});
  }
  return {{"knob", row.knob->name},
          {"value", row.value},
          {"option", row.knob->option},
          {"meaning", row.knob->meaning},
          {"charged", row.knob->is_charged},
          {"default", row.run == 0},
          {"variant", run.run.request.variant.name},
          {"psnr_db", decibels_json(run.error.psnr_db)},
          {"ssim", run.error.ssim},
          {"max_abs_error", run.error.max_abs_error},
          {"proved_max_abs_error", optional_json(run.proved_max_error)},
          {"pixels_differing_8bit", run.error.pixels_differing},
          {"share_differing_8bit", run.error.share_differing},
          {"pixels_stuck", run.pixels_stuck},
          {"cycles", cycles_json(run.run)},
          {"cycles_change_percent", optional_json(run.cycles_change_percent)},
          {"l2_bytes", run.l2_bytes ? Json(*run.l2_bytes) : Json()},
          {"dram_bytes", run.dram_bytes ? Json(*run.dram_bytes) : Json()},
          {"millijoules", range_json(run.millijoules)},
          {"by_fragments", std::move(by_fragments)},
          {"costs_no_time", run.cycles_change_percent ? Json(free) : Json()},
          {"host_seconds", run.run.host_seconds},
          {"cpu_seconds", run.run.cpu_seconds},
          {"pareto_front", run.on_front},
          {"result_hash", run.run.result_hash}};
}

}  // namespace

Json accuracy_json(const AccuracyResult& result) {
  Json fidelity = Json::array();
  for (const FidelityLevel& level : result.fidelity) fidelity.push_back(fidelity_json(level));
  Json stress = Json::array();
  for (const StressRow& row : result.stress) {
    stress.push_back({{"configuration", row.configuration},
                      {"platform", result.base.platform->name},
                      {"format", vrpipe::name_of(result.base.format)},
                      {"termination", name_of(result.base.termination)},
                      {"variant", row.variant},
                      {"cycles", row.cycles}});
    for (const auto& [level, error] : row.error_percent) {
      stress.back()[std::string(vrpipe::name_of(level)) + "_error_percent"] = error;
    }
  }
  Json stress_left_out = Json::array();
  for (const StressLeftOut& left_out : result.stress_left_out)
    stress_left_out.push_back({{"configuration", left_out.configuration}, {"reason", left_out.reason}});
  Json precision = Json::array();
  for (const PrecisionRow& row : result.precision) precision.push_back(precision_json(row, result.runs[row.run]));
  Json crossed = Json::array();
  for (const CrossedRow& row : result.crossed) {
    const PrecisionRun& run = result.runs[row.run];
    Json values = Json::object();
    for (const auto& [knob, value] : row.values) values[knob] = value;
    crossed.push_back({{"values", std::move(values)},
                       {"psnr_db", decibels_json(run.error.psnr_db)},
                       {"max_abs_error", run.error.max_abs_error},
                       {"proved_max_abs_error", optional_json(run.proved_max_error)},
                       {"pixels_stuck", run.pixels_stuck},
                       {"cycles", cycles_json(run.run)},
                       {"millijoules", range_json(run.millijoules)}});
  }
  Json popping = Json::array();
  for (const PoppingRow& row : result.popping) {
    popping.push_back(
        {{"run", row.run}, {"rms", row.rms}, {"max_abs", row.max_abs}, {"share_over_8bit_level", row.share_of_pixels}});
  }
  std::vector<std::string> left_out = result.knobs_left_out;
  left_out.insert(left_out.end(), result.knobs_without_pipeline.begin(), result.knobs_without_pipeline.end());
  Json json = head_json("vrpipe.accuracy/1", result.provenance, result.processes);
  json.update({{"scene", scene_json(result.scene, result.width, result.height)},
               {"camera", camera_json(result.viewpoint)},
               {"platform", platform_json({result.runs.front().run}, result.preprocessing, result.provenance)},
               {"implementations", implementations_json(result.runs.front().run)},
               {"format", vrpipe::name_of(result.base.format)},
               {"termination", name_of(result.base.termination)},
               {"effects", result.base.effects.text()},
               {"quick", result.quick},
               {"repeat", result.repeat},
               {"precision_variant", result.base.variant.name},
               {"precision_fidelity", fidelity_of(result.base)},
               {"precision_processes", result.processes},
               {"precision_left_out", result.precision_left_out.empty() ? Json() : Json(result.precision_left_out)},
               {"knobs_left_out", left_out},
               {"values_never_measured", result.values_never_measured},
               {"tolerances",
                {{"cpu_seconds_percent", 100 * fidelity_tolerance.cost_share},
                 {"cycles_error_percent", fidelity_tolerance.error},
                 {"cycles_percent", 100 * precision_tolerance.cost_share},
                 {"psnr_db", precision_tolerance.error}}},
               {"fidelity", std::move(fidelity)},
               {"stress", std::move(stress)},
               {"stress_left_out", std::move(stress_left_out)},
               {"precision", std::move(precision)},
               {"crossed", std::move(crossed)},
               {"popping", std::move(popping)}});
  return json;
}

}  // namespace vrpipe::tools
