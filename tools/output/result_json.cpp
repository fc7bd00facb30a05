#include "output/result_json.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include <vrpipe/arithmetic/blend.h>
#include <vrpipe/kernel/accounting.h>
#include <vrpipe/platforms/netlist.h>

#include "jobs/comparison.h"
#include "jobs/optional_json.h"
#include "jobs/settings.h"
#include "output/effects_report.h"
#include "output/energy_report.h"
#include "output/interval_report.h"
#include "output/report.h"

namespace vrpipe::tools {
namespace {

template <class Number>
Json number_or_null(const std::string& text) {
  Number value{};
  const char* const end = text.data() + text.size();
  const std::from_chars_result read = std::from_chars(text.data(), end, value);
  return read.ec == std::errc() && read.ptr == end ? Json(value) : Json(text);
}

/// The declaration of UNIT.PARAMETER or PATH.PARAMETER, in the implementation that the request puts into the slot.
const Parameter* declaration(const std::vector<ParameterListing>& listings, const RunRequest& request,
                             const std::string& key) {
  const std::size_t dot = key.rfind('.');
  const std::string unit = without_gpc(key.substr(0, dot));
  const std::string name = key.substr(dot + 1);
  const Parameter* found = nullptr;
  for (const ParameterListing& listing : listings) {
    if (listing.unit != unit) continue;
    const auto is_this = [&](const UnitChoice& choice) {
      return choice.slot == unit && choice.implementation == listing.implementation;
    };
    const std::vector<UnitChoice>& own = request.variant.changed_units;
    const bool chosen = std::any_of(request.units.begin(), request.units.end(), is_this) ||
                        std::any_of(own.begin(), own.end(), is_this);
    for (const Parameter* parameter : listing.parameters->parameters()) {
      if (name == parameter->name() && (found == nullptr || chosen)) found = parameter;
    }
  }
  return found;
}

/// Values with their types.
Json parameters_json(const RunResult& run) {
  const std::vector<ParameterListing> listings = all_parameters(run.request.platform);
  Json values = Json::object();
  for (const auto& [key, value] : run.parameters) {
    const Parameter* const parameter = declaration(listings, run.request, key);
    values[key] = parameter != nullptr ? typed_value(*parameter, value) : Json(value);
  }
  return values;
}

/// Of the runs on the first platform, those of variants that change others last: which units they have differs.
Json common_parameters_json(const std::vector<RunResult>& runs) {
  Json values = Json::object();
  for (const bool of_changes : {false, true}) {
    for (const RunResult& run : runs) {
      if (run.request.platform != runs.front().request.platform || run.request.variant.base.empty() == of_changes)
        continue;
      const Json parameters = parameters_json(run);
      for (const auto& [key, value] : parameters.items()) {
        if (!values.contains(key)) values[key] = value;
      }
    }
  }
  return values;
}

Json shares_json(const std::vector<std::pair<std::string, double>>& shares) {
  Json json = Json::object();
  for (const auto& [name, share] : shares) json[name] = share;
  return json;
}

/// Where the value of each of these parameters comes from. The command line comes after the file, which comes after the
/// platform, and wins.
Json origins_json(const Json& parameters, const RunRequest& request, const std::vector<Setting>& preprocessing,
                  const std::vector<std::string>& of_file) {
  const std::string given = "command line";
  Json origins = Json::object();
  for (const auto& [key, value] : parameters.items())
    origins[key] = origin_unless_set(key, value.is_string() ? value.get<std::string>() : value.dump());
  const auto mark = [&](const std::vector<Setting>& settings, const std::string& origin) {
    for (const Setting& setting : settings) {
      const std::string key = setting.unit + "." + setting.parameter;
      if (!origins.contains(key)) continue;
      const bool is_of_file = std::find(of_file.begin(), of_file.end(), key) != of_file.end();
      origins[key] = is_of_file && origin == given ? "file" : origin;
    }
  };
  mark(request.platform->settings, "platform");
  mark(request.settings, given);
  mark(preprocessing, given);
  return origins;
}

Json vector_json(const Vec3& vector) { return {vector.x, vector.y, vector.z}; }

Json units_json(const RunResult& run) {
  Json units = Json::array();
  for (const UnitReport& unit : run.units) {
    Json cycles = Json::object();
    for (unsigned state = 0; state < unit_states; ++state) {
      cycles[vrpipe::name_of(static_cast<UnitState>(state))] = unit.cycles[state];
    }
    units.push_back({{"name", unit.name},
                     {"cycles", std::move(cycles)},
                     {"occupancy", unit.occupancy},
                     {"parts", shares_json(unit.parts)}});
  }
  return units;
}

/// Of a statistic, or of one at an instance: a count, or a quotient where there is one.
template <class Statistic>
Json value_json(const Statistic& statistic) {
  if (!statistic.denominator) return statistic.value;
  const std::optional<double> quotient = statistic.quotient();
  return quotient ? Json(*quotient) : Json();
}

Json histogram_json(const StatisticReport& statistic) {
  if (!statistic.histogram) return {};
  const auto number_or_null = [](const std::optional<std::uint64_t>& value) { return value ? Json(*value) : Json(); };
  Json buckets = Json::array();
  for (const HistogramBucket& bucket : statistic.histogram->buckets) {
    buckets.push_back({{"from", bucket.from}, {"to", number_or_null(bucket.to)}, {"count", bucket.count}});
  }
  return {{"count", number_or_null(statistic.denominator)},
          {"sum", statistic.value},
          {"smallest", number_or_null(statistic.histogram->smallest)},
          {"largest", number_or_null(statistic.histogram->largest)},
          {"buckets", std::move(buckets)}};
}

Json statistics_json(const RunResult& run) {
  Json statistics = Json::array();
  for (const StatisticReport& statistic : run.statistics) {
    Json instances;
    for (const InstanceStatistic& instance : statistic.instances) instances[instance.path] = value_json(instance);
    statistics.push_back({{"name", statistic.name},
                          {"kind", statistic.kind},
                          {"value", value_json(statistic)},
                          {"unit", statistic.unit},
                          {"meaning", statistic.meaning},
                          {"formula", statistic.formula.empty() ? Json() : Json(statistic.formula)},
                          {"histogram", histogram_json(statistic)},
                          {"instances", std::move(instances)}});
  }
  return statistics;
}

Json draws_json(const RunResult& run) {
  Json draws;
  for (const DrawReport& draw : run.draws) {
    draws.push_back({{"name", draw.name},
                     {"counts", counts_json(draw.counts)},
                     {"end", draw.end ? Json(*draw.end) : Json()},
                     {"cycles", draw.cycles ? Json(*draw.cycles) : Json()}});
  }
  return draws;
}

Json addresses_json(const AddressMap& addresses) {
  const auto region = [](const MemoryRegion& memory) {
    return Json{{"address", memory.address}, {"bytes", memory.bytes}};
  };
  return {{"color", region(addresses.color)},
          {"depth_stencil", region(addresses.depth_stencil)},
          {"vertices", region(addresses.vertices)},
          {"primitives", region(addresses.primitives)},
          {"attributes", region(addresses.attributes)}};
}

/// `costs`: null where they were not asked for.
Json effects_json(const RunResult& run, const EffectCosts* costs) {
  const auto seconds = [&](const std::optional<double>& with) {
    return with ? Json{{"with", *with}, {"without", costs->without}} : Json();
  };
  Json effects = Json::array();
  for (const EffectReport& effect : run.effects) {
    const std::optional<EffectProof> proof = proof_of(run, effect);
    effects.push_back({{"name", effect.name},
                       {"state", effect.omitted ? "omitted" : "active"},
                       {"proof", proof ? Json(vrpipe::name_of(*proof)) : Json()},
                       {"reason", effect.reason}});
    if (costs != nullptr) effects.back()["host_seconds"] = seconds(costs->with_effect(effect.name));
  }
  return effects;
}

/// Of a variant that changes another; null for one that does not.
Json changes_json(const Variant& variant) {
  if (variant.base.empty()) return {};
  Json units = Json::object(), settings = Json::object();
  for (const UnitChoice& unit : variant.changed_units) units[unit.slot] = unit.implementation;
  for (const Setting& setting : variant.changed_settings)
    settings[setting.unit + "." + setting.parameter] = setting.value;
  return {{"base", variant.base}, {"unit", std::move(units)}, {"set", std::move(settings)}};
}

Json storage_json(const RunRequest& request) {
  const StorageReport storage = quad_merging_storage(request);
  return {{"tgc", storage.tgc_bytes}, {"qru", storage.qru_bytes}};
}

Json sampling_json(const SamplingReport& sampling) {
  return {{"windows", sampling.windows},
          {"seed", sampling.seed},
          {"measured_share", sampling.measured_share},
          {"warm_up_share", sampling.warm_up_share},
          {"half_interval_percent", sampling.half_interval_percent},
          {"delay_growth_percent", sampling.delay_growth_percent},
          {"lead_growth_percent", sampling.lead_growth_percent},
          {"whole_because", sampling.windows == 0 ? Json(sampling.whole_because) : Json()},
          {"confidence_percent", SamplingReport::confidence_percent}};
}

/// @param parameters  of platform_json()
Json run_json(const RunResult& run, const std::optional<ImageFiles>& images, const EffectCosts* costs,
              const Json& parameters) {
  const bool timed = run.cycles.has_value();
  Json json = {{"variant", run.request.variant.name},
               {"name", name_of(run.request)},
               {"platform", run.request.platform->name},
               {"frequency_mhz", run.request.platform->frequency_mhz},
               {"changes", changes_json(run.request.variant)},
               {"parameters", changed_parameters_json(run, parameters)},
               {"cycles", timed ? Json(*run.cycles) : Json()},
               {"stopped", run.stopped},
               {"milliseconds", timed ? Json(run.milliseconds) : Json()},
               {"host_seconds", run.host_seconds},
               {"cpu_seconds", run.cpu_seconds},
               {"implementations", implementations_json(run)},
               {"counts", counts_json(run.counts.named())},
               {"draws", draws_json(run)},
               {"bottleneck", bottleneck_json(run)},
               {"utilization", utilization_json(run)},
               {"effects", effects_json(run, costs)},
               {"result_hash", run.result_hash},
               {"images", {{"png", images ? Json(images->png) : Json()}, {"exr", images ? Json(images->exr) : Json()}}},
               {"units", units_json(run)},
               {"statistics", statistics_json(run)},
               {"quad_merging_storage_bytes", run.request.variant.quad_merging ? storage_json(run.request) : Json()},
               {"kernel_events", run.kernel_events},
               {"outside_validated_range", run.outside_validated_range},
               {"expected_error_percent", optional_json(run.expected_error_percent)}};
  if (!run.request.variant.is_of_pipeline()) {
    json["fidelity"] = fidelity_of(run.request);
    json["kernels"] = kernels_json(run.kernels);
  }
  if (run.way) {
    json["fidelity"] = run.way->fidelity;
    json["error"] = {{"asked_percent", run.request.error_percent}, {"way", run.way->fidelity}, {"why", run.way->why}};
  }
  if (run.sampling) {
    json["sampling"] = sampling_json(*run.sampling);
    // What only the time of the whole frame tells.
    if (run.sampling->windows != 0) {
      for (const char* const key : {"bottleneck", "utilization", "units", "stopped"}) json.erase(key);
    }
  }
  if (run.intervals) json["intervals"] = intervals_json(*run.intervals);
  if (costs != nullptr) json["all_effects"]["host_seconds"] = {{"with", costs->with_all}, {"without", costs->without}};
  return json;
}

}  // namespace

Json kernels_json(const std::vector<KernelReport>& reports) {
  Json kernels = Json::array();
  for (const KernelReport& kernel : reports) {
    kernels.push_back({{"name", kernel.name},
                       {"items", kernel.items},
                       {"bytes", kernel.bytes},
                       {"cycles", kernel.cycles ? Json(*kernel.cycles) : Json()},
                       {"bound_by", kernel.cycles ? Json(kernel.bound_by) : Json()}});
  }
  return kernels;
}

Json typed_value(const Parameter& parameter, const std::string& value) {
  if (dynamic_cast<const Integer*>(&parameter) != nullptr) return number_or_null<std::uint64_t>(value);
  if (dynamic_cast<const Real*>(&parameter) != nullptr) return number_or_null<double>(value);
  if (dynamic_cast<const Switch*>(&parameter) != nullptr) return value == "on";
  return value;
}

Json head_json(const std::string& schema, const Provenance& provenance, unsigned processes) {
  Json plugins = Json::array();
  for (const PluginFile& plugin : provenance.plugins) {
    plugins.push_back({{"path", plugin.path}, {"sha256", plugin.sha256}});
  }
  return {{"schema", schema},
          {"version", VRPIPE_VERSION},
          {"command", provenance.command},
          {"config", provenance.config.empty() ? Json() : Json(provenance.config)},
          {"plugins", std::move(plugins)},
          {"host", {{"processes", processes}, {"load_average", provenance.load_average}}}};
}

Json camera_json(const std::optional<Viewpoint>& viewpoint) {
  if (!viewpoint) return {};
  const auto& [camera, view, file] = *viewpoint;
  const auto column = [&rows = camera.rotation](glm::length_t i) {
    return vector_json({rows[0][i], rows[1][i], rows[2][i]});
  };
  const bool is_perspective = camera.projection == Projection::perspective;
  constexpr double degrees = 57.29577951308232;
  return {{"file", file ? Json(file->file) : Json()},
          {"index", file ? Json(file->index) : Json()},
          {"name", file && !file->image.empty() ? Json(file->image) : Json()},
          {"eye", vector_json(camera.eye)},
          {"look_at", view ? vector_json(view->look_at) : Json()},
          {"up", view ? vector_json(view->up) : Json()},
          {"projection", is_perspective ? "perspective" : "orthographic"},
          {"fovy_degrees", is_perspective ? Json(2 * degrees * std::atan(0.5 * camera.height / camera.fy)) : Json()},
          {"orthographic_height", is_perspective ? Json() : Json(camera.height / camera.fy)},
          {"right", column(0)},
          {"down", column(1)},
          {"forward", column(2)},
          {"focal_pixels", {camera.fx, camera.fy}},
          {"principal_point", {camera.cx(), camera.cy()}},
          {"near_plane", camera.near_plane}};
}

Json bottleneck_json(const RunResult& run) {
  if (!run.bottleneck) return {};
  return {{"unit", run.bottleneck->unit},
          {"occupancy", run.bottleneck->occupancy},
          {"parts", shares_json(run.bottleneck->parts)}};
}

Json counts_json(const std::vector<std::pair<std::string, std::uint64_t>>& counts) {
  Json json = Json::object();
  for (const auto& [name, value] : counts) json[name] = value;
  return json;
}

Json utilization_json(const RunResult& run) {
  // Without time there is no utilization, and the keys are still there.
  Json utilization = Json::object();
  for (const char* unit : {"raster", "zrop", "prop", "sm", "crop", "l2", "dram"}) utilization[unit] = nullptr;
  for (const auto& [name, share] : run.utilization) utilization[name] = share;
  return utilization;
}

Json implementations_json(const RunResult& run) {
  Json implementations = Json::object();
  for (const auto& [slot, name] : run.implementations) implementations[slot] = name;
  return implementations;
}

Json scene_json(const SceneSummary& scene, std::uint32_t width, std::uint32_t height) {
  return {{"name", scene.name},
          {"gaussians_total", scene.gaussians_total},
          {"gaussians_visible", scene.gaussians_visible},
          {"gaussians_compensated", scene.gaussians_compensated},
          {"gaussians_rejected", scene.rejected.total()},
          {"triangles", scene.triangles},
          {"triangles_rejected", scene.triangles_rejected},
          {"width", width},
          {"height", height},
          {"notes", scene.notes},
          {"rejected_by_reason",
           {{"not_finite", scene.rejected.not_finite}, {"zero_quaternion", scene.rejected.zero_quaternion}}}};
}

Json changed_parameters_json(const RunResult& run, const Json& parameters) {
  const Json all = parameters_json(run);
  Json changed = Json::object();
  for (const auto& [key, value] : all.items()) {
    if (!parameters.contains(key) || parameters[key] != value) changed[key] = value;
  }
  return changed;
}

Json platform_json(const std::vector<RunResult>& runs, const std::vector<Setting>& preprocessing,
                   const Provenance& provenance) {
  const RunRequest& request = runs.front().request;
  Json parameters = common_parameters_json(runs);
  Json origins = origins_json(parameters, request, preprocessing, provenance.config_settings);
  return {{"name", request.platform->name},
          {"frequency_mhz", request.platform->frequency_mhz},
          {"parameters", std::move(parameters)},
          {"origins", std::move(origins)}};
}

Json result_json(const JobResult& result) {
  const RunRequest& request = result.runs.front().request;
  Json platform = platform_json(result.runs, result.preprocessing, result.provenance);
  const RunResult& baseline = result.runs[result.baseline];
  Json runs = Json::array();
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    const EffectCosts* const costs = result.effect_costs.empty() ? nullptr : &result.effect_costs[i];
    runs.push_back(run_json(result.runs[i], result.images[i], costs, platform["parameters"]));
    if (result.intervals_for_page) runs.back().erase("intervals");
    if (!result.energies) continue;
    const RunResult* const over = result.runs.size() > 1 ? &baseline : nullptr;
    runs.back()["energy"] = energy_json(result.runs[i], over, *result.energies);
  }
  Json json = head_json(result.schema, result.provenance, result.processes);
  json.update({{"seed", request.stall_seed},
               {"scene", scene_json(result.scene, result.width, result.height)},
               {"camera", camera_json(result.viewpoint)},
               {"platform", std::move(platform)},
               {"fidelity", finest_fidelity_text(result.runs)},
               {"format", vrpipe::name_of(request.format)},
               {"termination", name_of(request.termination)},
               {"effects", request.effects.text()},
               {"passes", result.passes},
               {"addresses", addresses_json(result.runs.front().framebuffer.addresses)},
               {"runs", std::move(runs)}});
  if (result.runs.size() > 1) {
    Json speedups = Json::object();
    for (const RunResult& run : result.runs) {
      if (&run == &baseline) continue;
      const std::optional<double> gain = speedup(baseline, run);
      speedups[name_of(run.request)] = gain ? Json(*gain) : Json();
    }
    json["relative_to"] = name_of(baseline.request);
    json["speedup"] = std::move(speedups);
    const std::optional<double> ratio = early_termination_ratio(result.runs);
    json["early_termination_ratio"] = ratio ? Json(*ratio) : Json();
  }
  json["quad_merging_storage_bytes"] = storage_json(request);
  return json;
}

}  // namespace vrpipe::tools
