#include "output/views_json.h"

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "jobs/comparison.h"
#include "jobs/optional_json.h"
#include "jobs/settings.h"

namespace vrpipe::tools {
namespace {

Json view_run_json(const RunResult& run, const std::optional<ImageFiles>& images) {
  const bool timed = run.cycles.has_value();
  return {{"variant", run.request.variant.name},
          {"name", name_of(run.request)},
          {"platform", run.request.platform->name},
          {"cycles", timed ? Json(*run.cycles) : Json()},
          {"milliseconds", timed ? Json(run.milliseconds) : Json()},
          {"host_seconds", run.host_seconds},
          {"cpu_seconds", run.cpu_seconds},
          {"counts", counts_json(run.counts.named())},
          {"bottleneck", bottleneck_json(run)},
          {"utilization", utilization_json(run)},
          {"result_hash", run.result_hash},
          {"images", {{"png", images ? Json(images->png) : Json()}, {"exr", images ? Json(images->exr) : Json()}}},
          {"outside_validated_range", run.outside_validated_range},
          {"expected_error_percent", optional_json(run.expected_error_percent)}};
}

Json view_json(const ViewResult& view, std::size_t baseline) {
  const Camera& camera = view.viewpoint.camera;
  Json scene = scene_json(view.scene, camera.width, camera.height);
  scene.erase("name");
  scene.erase("gaussians_total");
  Json runs = Json::array();
  Json speedups = Json::object();
  for (std::size_t i = 0; i < view.runs.size(); ++i) {
    runs.push_back(view_run_json(view.runs[i], view.images[i]));
    if (i == baseline) continue;
    speedups[name_of(view.runs[i].request)] = optional_json(speedup(view.runs[baseline], view.runs[i]));
  }
  const std::optional<CameraName>& file = view.viewpoint.file;
  return {{"index", view.index},
          {"name", file && !file->image.empty() ? Json(file->image) : Json()},
          {"camera", camera_json(view.viewpoint)},
          {"scene", std::move(scene)},
          {"runs", std::move(runs)},
          {"speedup", std::move(speedups)},
          {"early_termination_ratio", optional_json(early_termination_ratio(view.runs))}};
}

}  // namespace

Json distribution_json(const std::optional<Distribution>& of, const std::vector<std::size_t>& indices) {
  if (!of) return {};
  return {{"views", of->count},
          {"minimum", of->minimum},
          {"lower_quartile", of->lower_quartile},
          {"median", of->median},
          {"upper_quartile", of->upper_quartile},
          {"maximum", of->maximum},
          {"geometric_mean", of->geometric_mean},
          {"minimum_in_view", indices[of->least]},
          {"maximum_in_view", indices[of->most]}};
}

Json views_json(const ViewsResult& result) {
  std::vector<std::size_t> indices;
  for (const ViewResult& view : result.views) indices.push_back(view.index);
  std::vector<RunResult> runs = result.views.front().runs;
  const RunRequest& request = runs.front().request;
  for (RunResult& run : runs) add_preprocess_parameters(result.preprocess_parameters, result.views.front().scene, run);
  Json views = Json::array();
  for (const ViewResult& view : result.views) views.push_back(view_json(view, result.baseline));
  Json speedups = Json::object();
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (i == result.baseline) continue;
    speedups[name_of(runs[i].request)] = distribution_json(speedup_distribution(result, i), indices);
  }
  const StorageReport storage = quad_merging_storage(request);
  Json json = head_json(result.schema, result.provenance, result.processes);
  json.update({{"seed", request.stall_seed},
               {"scene", {{"name", result.scene}, {"gaussians_total", result.gaussians_total}}},
               {"cameras",
                {{"file", result.camera_file ? Json(*result.camera_file) : Json()},
                 {"count", result.cameras},
                 {"orbit", !result.camera_file}}},
               {"platform", platform_json(runs, result.preprocessing, result.provenance)},
               {"implementations", Json::object()},
               {"fidelity", finest_fidelity_text(runs)},
               {"format", vrpipe::name_of(request.format)},
               {"termination", name_of(request.termination)},
               {"effects", request.effects.text()},
               {"passes", result.passes},
               {"relative_to", name_of(runs[result.baseline].request)},
               {"views", std::move(views)},
               {"distribution",
                {{"speedup", std::move(speedups)},
                 {"early_termination_ratio", distribution_json(ratio_distribution(result), indices)}}},
               {"quad_merging_storage_bytes", {{"tgc", storage.tgc_bytes}, {"qru", storage.qru_bytes}}}});
  for (const RunResult& run : runs) json["implementations"][name_of(run.request)] = implementations_json(run);
  return json;
}

}  // namespace vrpipe::tools
