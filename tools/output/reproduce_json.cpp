#include "output/reproduce_json.h"

#include <cmath>
#include <cstddef>
#include <utility>

#include <nlohmann/json.hpp>

#include "jobs/microbench_record.h"
#include "output/reproduce_answers.h"

namespace vrpipe::tools {
namespace {

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }
Json number(const std::optional<double>& value) { return value ? number(*value) : Json(); }
Json mean_json(const Mean& mean) {
  return {{"arithmetic", number(mean.arithmetic)}, {"geometric", number(mean.geometric)}};
}

Json row_json(const RowFinding& finding) {
  const PaperRow& row = *finding.row;
  const bool is_number = row.relation != Relation::claim;
  return {{"id", row.id},
          {"what", row.what},
          {"section", row.where},
          {"paper", row.value},
          {"paper_number", is_number ? Json(row.number) : Json()},
          {"tolerance_percent", is_number ? Json(row.tolerance_percent) : Json()},
          {"how", row.how},
          {"measured", finding.measured.empty() ? Json() : Json(finding.measured)},
          {"measured_number", number(finding.number)},
          {"difference_percent", number(finding.difference_percent)},
          {"verdict", name_of(finding.verdict)},
          {"reason", finding.reason.empty() ? Json() : Json(finding.reason)}};
}

Json run_json(const PointResult& point) {
  Json utilization = Json::object();
  for (const auto& [unit, value] : point.run.utilization) utilization[unit] = value;
  return {{"variant", point.run.request.variant.name}, {"cycles", point.run.cycles ? Json(*point.run.cycles) : Json()},
          {"milliseconds", point.run.milliseconds},    {"counts", counts_json(point.run.counts.named())},
          {"bottleneck", bottleneck_json(point.run)},  {"utilization", std::move(utilization)},
          {"result_hash", point.run.result_hash}};
}

Json map_json(const PointResult& point) {
  if (!point.map) return {};
  return {{"fragments", point.map->sum}, {"largest", point.map->largest}};
}

Json scene_json(const Reproduction& of, const SceneFinding& scene) {
  const PlannedScene& planned = of.result.plan.scenes[scene.scene];
  const Gains& gains = scene.gains;
  Json runs = Json::array();
  for (const PointResult* run : scene.runs) runs.push_back(run_json(*run));
  Json ratios = Json::array(), passes = Json::array();
  for (const double ratio : scene.ratios) ratios.push_back(number(ratio));
  for (std::size_t i = 0; i < scene.passes.size(); ++i) {
    passes.push_back({{"passes", planned_passes(of.result.plan.quick)[i]}, {"speedup", number(scene.passes[i])}});
  }
  Json json{{"name", planned.name},
            {"scene", planned.request},
            {"gaussians_total", scene.runs[0]->gaussians_total},
            {"gaussians_visible", scene.runs[0]->gaussians_visible},
            {"width", scene.runs[0]->width},
            {"height", scene.runs[0]->height},
            {"speedup", {{"qm", number(gains.qm)}, {"het", number(gains.het)}, {"het+qm", number(gains.het_qm)}}},
            {"fragments_blended",
             {{"het", number(gains.fragments_het)}, {"qm_on_het", number(gains.fragments_merging)}}},
            {"quads_blended", {{"het", number(gains.quads_het)}, {"qm_on_het", number(gains.quads_merging)}}},
            {"runs", std::move(runs)}};
  if (!planned.is_large) {
    json.update(
        {{"early_termination_ratios", std::move(ratios)},
         {"fragments_per_pixel", {{"without", map_json(*scene.map_without)}, {"with", map_json(*scene.map_with)}}},
         {"passes", std::move(passes)},
         {"het_beside_passes", number(scene.het_beside_passes)}});
  }
  return json;
}

Json study_json(const StudyPoint& point) {
  return {{"settings", point.settings},
          {"qm", mean_json(point.qm)},
          {"het", mean_json(point.het)},
          {"het+qm", mean_json(point.het_qm)},
          {"qm_best", number(point.qm_best)},
          {"quads_het", number(point.quads_het)},
          {"quads_het+qm", number(point.quads_het_qm)}};
}

}  // namespace

Json reproduction_json(const Reproduction& of) {
  const ReproducePlan& plan = of.result.plan;
  const RunRequest& base = plan.points.front().request;
  const auto each = [](const auto& values, const auto& make) {
    Json json = Json::array();
    for (const auto& value : values) json.push_back(make(value));
    return json;
  };
  const auto scene = [&](const SceneFinding& finding) { return scene_json(of, finding); };
  Json parameters = Json::object();
  for (const auto& [name, value] : of.result.points.front().run.parameters) parameters[name] = value;
  Json studied = Json::array();
  for (const std::size_t index : plan.studied) studied.push_back(plan.scenes[index].name);
  return {{"schema", "vrpipe.reproduce/1"},
          {"version", VRPIPE_VERSION},
          {"command", of.result.provenance.command},
          {"quick", plan.quick},
          {"platform",
           {{"name", base.platform->name},
            {"frequency_mhz", base.platform->frequency_mhz},
            {"parameters", std::move(parameters)}}},
          {"fidelity", vrpipe::name_of(plan.fidelity)},
          {"format", vrpipe::name_of(base.format)},
          {"simulations", plan.points.size()},
          {"rows", each(of.rows, row_json)},
          {"scenes", each(of.findings.scenes, scene)},
          {"large_scenes", each(of.findings.large, scene)},
          {"main", study_json(of.findings.main)},
          {"sensitivity",
           {{"fidelity", vrpipe::name_of(sensitivity_fidelity)},
            {"scenes", std::move(studied)},
            {"parameters", each(of.findings.sensitivity,
                                [&](const SensitivityFinding& finding) -> Json {
                                  return {{"name", finding.parameter.name},
                                          {"base", finding.parameter.base},
                                          {"extent", name_of(ReproducePlan::extent_of(finding.parameter.breadth))},
                                          {"spread_percent", number(finding.spread_percent)},
                                          {"default", study_json(finding.at_default)},
                                          {"values", each(finding.values, study_json)}};
                                })},
            {"checks", each(of.findings.checks,
                            [](const CheckFinding& check) -> Json {
                              return {{"settings", check.settings},
                                      {"sensitivity", study_json(check.quick)},
                                      {"main", study_json(check.exact)}};
                            })},
            {"not_tried", each(plan.skipped,
                               [](const SkippedSetting& skipped) -> Json {
                                 return {{"settings", skipped.settings}, {"reason", skipped.reason}};
                               })}}},
          {"fragments_per_quad", each(of.findings.fragments,
                                      [](const FragmentFinding& finding) -> Json {
                                        return {{"what", finding.settings},
                                                {"fragments", number(finding.fragments)},
                                                {"quads", number(finding.quads)},
                                                {"fall_percent", number(finding.fall_percent)}};
                                      })},
          {"microbenchmarks",
           each(of.result.microbenches, [](const MicrobenchResult& result) { return Json(to_json(result)); })},
          {"efficiency", each(of.findings.efficiency, study_json)},
          {"efficiency_indoor", each(of.findings.indoor_efficiency, study_json)},
          {"answers", each(answers(of), [](const Answer& answer) -> Json {
             return {{"question", answer.question}, {"answer", answer.text}};
           })}};
}

}  // namespace vrpipe::tools
