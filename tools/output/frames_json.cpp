#include "output/frames_json.h"

#include <utility>

#include <nlohmann/json.hpp>

#include "jobs/optional_json.h"
#include "jobs/settings.h"
#include "output/energy_report.h"
#include "output/views_json.h"

namespace vrpipe::tools {
namespace {

Json kernel_parameters_json(const FramePath& path, const Platform& platform) {
  const std::vector<ParameterListing> listings = all_parameters(&platform);
  Json values = Json::object();
  for (const auto& [name, value] : path.parameters) {
    const Parameter* declared = nullptr;
    for (const ParameterListing& listing : listings) {
      const bool is_used = std::find(path.implementations.begin(), path.implementations.end(),
                                     std::pair{listing.unit, listing.implementation}) != path.implementations.end();
      for (const Parameter* parameter : listing.parameters->parameters()) {
        if (is_used && name == listing.unit + "." + parameter->name()) declared = parameter;
      }
    }
    values[name] = declared != nullptr ? typed_value(*declared, value) : Json(value);
  }
  return values;
}

Json frame_energy_json(const FrameEnergy& energy) {
  if (!energy.frame) return {};
  Json json = range_json(energy.frame);
  json.update({{"preprocess", range_json(energy.preprocess)},
               {"sort", range_json(energy.sort)},
               {"raster", range_json(energy.raster)},
               {"over_hardware", range_json(energy.over_hardware)}});
  return json;
}

Json path_json(const FramePath& path, const Platform& platform) {
  Json implementations = Json::object();
  for (const auto& [slot, name] : path.implementations) implementations[slot] = name;
  return {{"path", path.path},
          {"name", path.name},
          {"fidelity", vrpipe::name_of(path.fidelity)},
          {"milliseconds",
           {{"preprocess", optional_json(path.preprocess)},
            {"sort", optional_json(path.sort)},
            {"raster", optional_json(path.raster)},
            {"frame", optional_json(path.frame)},
            {"interval", optional_json(path.interval)}}},
          {"millijoules", frame_energy_json(path.energy)},
          {"bytes", counts_json(path.bytes)},
          {"bound_by", path.bound_by.empty() ? Json() : Json(path.bound_by)},
          {"expected_error_percent", optional_json(path.expected_error_percent)},
          {"counts", counts_json(path.counts)},
          {"kernels", kernels_json(path.kernels)},
          {"implementations", std::move(implementations)},
          {"parameters", kernel_parameters_json(path, platform)},
          {"result_hash", path.result_hash},
          {"images",
           {{"png", path.images ? Json(path.images->png) : Json()},
            {"exr", path.images ? Json(path.images->exr) : Json()}}},
          {"host_seconds", path.host_seconds}};
}

Json paths_json(const FramesResult& result) {
  Json frames = Json::array();
  for (const FramePath& path : result.paths) frames.push_back(path_json(path, *result.runs.front().request.platform));
  return frames;
}

/// What all views have in common.
Json machine_json(const char* schema, const FramesResult& result) {
  const RunRequest& request = result.runs.front().request;
  Json json = head_json(schema, result.provenance, result.processes);
  json.update({{"platform", platform_json(result.runs, result.preprocessing, result.provenance)},
               {"fidelity", vrpipe::name_of(request.fidelity)},
               {"format", vrpipe::name_of(request.format)},
               {"termination", vrpipe::name_of(request.termination)}});
  return json;
}

Json imitation_json(const std::optional<ImitationReport>& imitation) {
  if (!imitation) return {};
  return {{"paired_quads", imitation->paired_quads},
          {"discarded_quads", imitation->discarded_quads},
          {"pixels_short", imitation->pixels_short},
          {"efficiency", range_json(imitation->efficiency)}};
}

}  // namespace

Json frames_json(const FramesResult& result) {
  Json json = machine_json("vrpipe.frames/1", result);
  const auto beside = [&](const std::optional<FramePath>& path) {
    return path ? path_json(*path, *result.runs.front().request.platform) : Json();
  };
  json.update({{"scene", scene_json(result.scene, result.width, result.height)},
               {"camera", camera_json(result.viewpoint)},
               {"frames", paths_json(result)},
               {"imitation", imitation_json(result.imitation)},
               {"without_termination", beside(result.without_termination)},
               {"without_lock", beside(result.without_lock)}});
  return json;
}

Json frames_json(const FrameViewsResult& result) {
  Json json = machine_json("vrpipe.frame-views/1", result.views.front());
  Json views = Json::array(), distributions = Json::object();
  for (std::size_t i = 0; i < result.views.size(); ++i) {
    const FramesResult& view = result.views[i];
    views.push_back({{"index", result.indices[i]},
                     {"camera", camera_json(view.viewpoint)},
                     {"scene", scene_json(view.scene, view.width, view.height)},
                     {"frames", paths_json(view)}});
  }
  const std::vector<FramePath>& paths = result.views.front().paths;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    distributions[paths[i].path] = {{"milliseconds", distribution_json(frame_distribution(result, i), result.indices)},
                                    {"over_hardware",
                                     distribution_json(over_hardware_distribution(result, i), result.indices)}};
  }
  json.update({{"cameras",
                {{"file", result.camera_file ? Json(*result.camera_file) : Json()},
                 {"count", result.cameras},
                 {"orbit", !result.camera_file}}},
               {"views", std::move(views)},
               {"distribution", std::move(distributions)}});
  return json;
}

}  // namespace vrpipe::tools
