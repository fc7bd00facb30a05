#include "jobs/whole_frame.h"

#include <stdexcept>
#include <string>

#include <nlohmann/json.hpp>

#include <vrpipe/platforms/accelerator.h>
#include <vrpipe/platforms/software.h>

#include "host/stdout_to_stderr.h"

namespace vrpipe::tools {
namespace {

constexpr std::uint64_t lanes_of_a_warp = 32;

double milliseconds(const KernelReport& kernel, double frequency_mhz) {
  return static_cast<double>(kernel.cycles.value()) / (1e3 * frequency_mhz);
}

double milliseconds(const std::optional<KernelReport>& kernel, double frequency_mhz) {
  return kernel ? milliseconds(*kernel, frequency_mhz) : 0;
}

std::uint64_t counter(const SoftwareResult& result, const std::string& name) {
  for (const StatisticReport& statistic : result.statistics) {
    if (statistic.name == name) return statistic.value;
  }
  throw std::logic_error("rendering in software counts no " + name);
}

}  // namespace

WholeFrame simulate_whole_frame(const RunRequest& base, const Frame& frame, std::optional<std::uint64_t> gaussians) {
  const StdoutToStderr redirected;  // units of plugins may print
  const double frequency_mhz = base.platform->frequency_mhz;
  WholeFrame whole;
  RunRequest request = base;
  request.variant = variant_named("baseline");
  request.fidelity = Fidelity::lt;
  const auto with = [&request](const char* preparation, const char* render) {
    RunRequest chosen = request;
    chosen.units.insert(chosen.units.end(), {{"preparation", preparation}, {"render", render}});
    return chosen;
  };
  const auto prepare = [&](const RunRequest& by, const SoftwareResult& software) {
    const HardwarePreparation hardware = prepare_for_hardware(by, frame, gaussians);
    return WholeFrame::Preparation{milliseconds(software.preprocess, frequency_mhz),
                                   milliseconds(hardware.preprocess, frequency_mhz),
                                   milliseconds(hardware.sort, frequency_mhz)};
  };
  {
    const RunRequest published = with("published", "published");
    const SoftwareResult software = simulate_software(published, frame, gaussians);
    whole.measured = prepare(published, software);
    for (const KernelReport& kernel : software.binning) whole.lists += milliseconds(kernel, frequency_mhz);
    whole.render = milliseconds(software.render, frequency_mhz);
    whole.fragments_blended = counter(software, "render.lanes_blending");
    whole.lanes = lanes_of_a_warp * counter(software, "render.warp_iterations");
  }
  {
    const RunRequest endless = with("papers-orin", "endless");
    const SoftwareResult software = simulate_software(endless, frame, gaussians);
    whole.papers = prepare(endless, software);
    whole.endless_render = milliseconds(software.render, frequency_mhz);
    whole.endless_fragments_blended = counter(software, "render.lanes_blending");
  }
  request.units.push_back({"accelerator", "gscore"});
  const AcceleratorResult accelerator = simulate_accelerator(request, frame, gaussians);
  whole.accelerator = static_cast<double>(accelerator.cycles.value()) / (1e3 * accelerator.frequency_mhz);
  return whole;
}

namespace {

nlohmann::json preparation_json(const WholeFrame::Preparation& by) { return {by.software, by.projection, by.sort}; }

WholeFrame::Preparation preparation_of(const nlohmann::json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

}  // namespace

void to_json(nlohmann::json& json, const WholeFrame& frame) {
  json = {{"measured", preparation_json(frame.measured)},
          {"papers", preparation_json(frame.papers)},
          {"lists", frame.lists},
          {"render", {frame.render, frame.endless_render}},
          {"blended", {frame.fragments_blended, frame.endless_fragments_blended}},
          {"lanes", frame.lanes},
          {"accelerator", frame.accelerator}};
}

void from_json(const nlohmann::json& json, WholeFrame& frame) {
  frame.measured = preparation_of(json.at("measured"));
  frame.papers = preparation_of(json.at("papers"));
  json.at("lists").get_to(frame.lists);
  json.at("render").at(0).get_to(frame.render);
  json.at("render").at(1).get_to(frame.endless_render);
  json.at("blended").at(0).get_to(frame.fragments_blended);
  json.at("blended").at(1).get_to(frame.endless_fragments_blended);
  json.at("lanes").get_to(frame.lanes);
  json.at("accelerator").get_to(frame.accelerator);
}

}  // namespace vrpipe::tools
