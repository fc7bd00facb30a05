#include "jobs/whole_frame.h"

#include <nlohmann/json.hpp>

#include "host/stdout_to_stderr.h"
#include "jobs/frames_job.h"

namespace vrpipe::tools {
namespace {

constexpr std::uint64_t lanes_of_a_warp = 32;

}  // namespace

WholeFrame simulate_whole_frame(const RunRequest& base, const Frame& frame, std::optional<std::uint64_t> gaussians) {
  const StdoutToStderr redirected;  // units of plugins may print
  WholeFrame whole;
  RunRequest request = base;
  request.variant = variant_named("baseline");
  request.fidelity = Fidelity::lt;
  const auto with = [&request](const char* preparation, const char* render) {
    RunRequest chosen = request;
    chosen.units.insert(chosen.units.end(), {{"preparation", preparation}, {"render", render}});
    return chosen;
  };
  const auto prepared = [&](const RunRequest& by, const FramePath& software) {
    const HardwarePreparation hardware = prepare_for_hardware(by, frame, gaussians);
    const auto milliseconds = [&](const KernelReport& kernel) {
      return milliseconds_of(kernel.cycles.value(), base.platform->frequency_mhz);
    };
    return WholeFrame::Preparation{software.preprocess.value_or(0),
                                   hardware.preprocess ? milliseconds(*hardware.preprocess) : 0,
                                   milliseconds(hardware.sort)};
  };
  {
    const RunRequest published = with("published", "published");
    const FramePath software = software_path(simulate_software(published, frame, gaussians));
    whole.measured = prepared(published, software);
    whole.lists = software.sort.value();
    whole.render = software.raster.value();
    whole.fragments_blended = software.count("lanes_blending").value();
    whole.lanes = lanes_of_a_warp * software.count("warp_iterations").value();
  }
  {
    const RunRequest endless = with("papers-orin", "endless");
    const FramePath software = software_path(simulate_software(endless, frame, gaussians));
    whole.papers = prepared(endless, software);
    whole.endless_render = software.raster.value();
    whole.endless_fragments_blended = software.count("lanes_blending").value();
  }
  request.units.push_back({"accelerator", "gscore"});
  whole.accelerator = accelerator_path(simulate_accelerator(request, frame, gaussians)).frame.value();
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
