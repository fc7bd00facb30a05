#include "output/reproduce_json.h"

#include <cmath>
#include <cstddef>
#include <utility>

#include <nlohmann/json.hpp>

#include "jobs/microbench_record.h"
#include "output/reproduce_answers.h"

namespace vrpipe::tools {
namespace {

Json finite_json(double value) { return std::isfinite(value) ? Json(value) : Json(); }
Json finite_json(const std::optional<double>& value) { return value ? finite_json(*value) : Json(); }
Json text_or_null(const std::string& text) { return text.empty() ? Json() : Json(text); }
Json mean_json(const Mean& mean) {
  return {{"arithmetic", finite_json(mean.arithmetic)}, {"geometric", finite_json(mean.geometric)}};
}

Json row_json(const RowFinding& finding) {
  const PaperRow& row = *finding.row;
  const bool is_number = row.relation != Relation::claim;
  Json tried = Json::array();
  for (const TriedReason& each : finding.tried) {
    tried.push_back({{"reason", each.reason->text},
                     {"setting", text_or_null(each.reason->setting)},
                     {"measure", text_or_null(each.reason->measure)},
                     {"row", text_or_null(each.reason->row)},
                     {"measured", each.measured},
                     {"is_shown", each.is_shown}});
  }
  return {{"id", row.id},
          {"what", row.what},
          {"section", row.section},
          {"paper", row.says},
          {"paper_number", is_number ? Json(row.number()) : Json()},
          {"tolerance_percent", is_number ? Json(row.tolerance_percent) : Json()},
          {"how", text_or_null(row.how)},
          {"measured", text_or_null(finding.measured)},
          {"measured_number", finite_json(finding.number)},
          {"difference_percent", finite_json(finding.difference_percent)},
          {"verdict", name_of(finding.verdict)},
          {"reason", text_or_null(finding.reason)},
          {"tried", std::move(tried)}};
}

Json point_json(const PointResult& point) {
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

Json preparation_json(const WholeFrame::Preparation& by) {
  return {{"software", by.software}, {"projection", by.projection}, {"sort", by.sort}};
}

Json frame_json(const WholeFrame& frame) {
  return {{"milliseconds",
           {{"preparation",
             {{"published", preparation_json(frame.measured)}, {"papers-orin", preparation_json(frame.papers)}}},
            {"lists", frame.lists},
            {"render", frame.render},
            {"render_without_termination", frame.endless_render},
            {"accelerator", frame.accelerator}}},
          {"lanes", frame.lanes},
          {"fragments_blended", frame.fragments_blended},
          {"fragments_blended_without_termination", frame.endless_fragments_blended}};
}

Json finding_json(const Reproduction& of, const SceneFinding& scene) {
  const PlannedScene& planned = of.result.plan.scenes[scene.scene];
  const Gains& gains = scene.gains;
  Json runs = Json::array();
  for (const PointResult* run : scene.runs) runs.push_back(point_json(*run));
  Json ratios = Json::array(), passes = Json::array();
  for (const double ratio : scene.ratios) ratios.push_back(finite_json(ratio));
  for (std::size_t i = 0; i < scene.passes.size(); ++i) {
    passes.push_back({{"passes", planned_passes(of.result.plan.quick)[i]}, {"speedup", finite_json(scene.passes[i])}});
  }
  Json json{{"name", planned.name},
            {"scene", planned.request},
            {"gaussians_total", scene.runs[0]->gaussians_total},
            {"gaussians_visible", scene.runs[0]->gaussians_visible},
            {"width", scene.runs[0]->width},
            {"height", scene.runs[0]->height},
            {"speedup",
             {{"qm", finite_json(gains.qm)}, {"het", finite_json(gains.het)}, {"het+qm", finite_json(gains.het_qm)}}},
            {"fragments_blended",
             {{"het", finite_json(gains.fragments_het)},
              {"qm_on_het", finite_json(gains.fragments_merging)},
              {"qm_on_het_second_quads_whole", finite_json(gains.fragments_merging_whole)}}},
            {"quads_blended", {{"het", finite_json(gains.quads_het)}, {"qm_on_het", finite_json(gains.quads_merging)}}},
            {"runs", std::move(runs)}};
  if (planned.role == PlannedScene::Role::six) {
    json.update(
        {{"early_termination_ratios", std::move(ratios)},
         {"fragments_per_pixel", {{"without", map_json(*scene.map_without)}, {"with", map_json(*scene.map_with)}}},
         {"passes", std::move(passes)},
         {"whole_frame", scene.frame == nullptr ? Json() : frame_json(*scene.frame)},
         {"het_beside_passes", finite_json(scene.het_beside_passes)}});
  }
  return json;
}

Json study_json(const StudyPoint& point) {
  return {{"settings", point.settings},
          {"qm", mean_json(point.qm)},
          {"het", mean_json(point.het)},
          {"het+qm", mean_json(point.het_qm)},
          {"qm_best", finite_json(point.qm_best)},
          {"quads_het", finite_json(point.quads_het)},
          {"quads_het+qm", finite_json(point.quads_het_qm)}};
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
  const auto scene = [&](const SceneFinding& finding) { return finding_json(of, finding); };
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
          {"scenes_beside", each(of.findings.beside, scene)},
          {"main", study_json(of.findings.main)},
          {"front_ends", each(of.front_ends,
                              [&](const Reproduction::FrontEnd& front_end) -> Json {
                                return {{"name", front_end.name},
                                        {"rows", each(front_end.rows, row_json)},
                                        {"agree", front_end.agree()},
                                        {"means", study_json(front_end.means)}};
                              })},
          {"sensitivity",
           {{"fidelity", vrpipe::name_of(sensitivity_fidelity)},
            {"scenes", std::move(studied)},
            {"parameters", each(of.findings.sensitivity,
                                [&](const SensitivityFinding& finding) -> Json {
                                  return {{"name", finding.parameter.name},
                                          {"extent", name_of(ReproducePlan::extent_of(finding.parameter.breadth))},
                                          {"spread_percent", finite_json(finding.spread_percent)},
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
                                                {"fragments", finite_json(finding.fragments)},
                                                {"quads", finite_json(finding.quads)},
                                                {"fall_percent", finite_json(finding.fall_percent)},
                                                {"fragments_none_late", finite_json(finding.fragments_in_time)},
                                                {"fall_percent_none_late", finite_json(finding.fall_percent_in_time)}};
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
