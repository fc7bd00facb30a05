#include <vrpipe/platforms/simulation.h>

#include <algorithm>

#include "run/add_statistics.h"
#include "run/conservation.h"
#include "run/outside_pipeline.h"
#include "run/pipeline_run.h"
#include "run/sampled_run.h"
#include "run/statistic_sampler.h"

#include <vrpipe/pipeline/slots/qru.h>
#include <vrpipe/pipeline/slots/tgc.h>
#include <vrpipe/platforms/gpu.h>
#include <vrpipe/platforms/observers.h>

namespace vrpipe {

RunResult simulate(const RunRequest& request, const Draw& draw, std::atomic<float>* progress) {
  return simulate(request, *Frame::of(draw, draw_state_of(request)), progress);
}

RunResult simulate(const RunRequest& request, const Frame& frame, std::atomic<float>* progress) {
  check_error(request);
  const auto by_the_way = [&] {
    if (request.error_percent > 0) return simulate_within(request, frame, progress);
    if (request.sampling) return simulate_sampled(request, frame, progress);
    return request.variant.is_of_pipeline() ? simulate_pipeline(request, frame, progress)
                                            : simulate_outside_pipeline(request, frame);
  };
  RunResult result = by_the_way();
  if (!result.stopped) check_conservation(result.counts);
  if (request.observers != nullptr) request.observers->end(result);
  return result;
}

namespace {
/// Gives a function the sampler of a platform that is elaborated for it alone.
template <class Look>
void with_sampler(const Configuration& configuration, Look&& look) {
  fresh_simulation();
  {
    Framebuffer framebuffer(configuration.frame(), configuration.request().format);
    const Gpu gpu(configuration, framebuffer);
    StatisticSampler sampler;
    add_statistics(gpu, sampler);
    look(sampler);
  }
  fresh_simulation();
}

/// What a frame calls for that is not there yet is not known.
RunRequest with_all_effects(RunRequest request) {
  request.effects.base = EffectChoice::Base::all;
  return request;
}
}  // namespace

void check_configuration(const RunRequest& request) {
  Frame empty(1, 1);
  empty.set_depth_format(depth_format_of(request));
  check_sampling_has_time(request);
  check_may_stop(request);
  check_error(request);
  if (request.sampling && request.error_percent == 0) check_may_sample(request);
  RunRequest of_pipeline = with_all_effects(request);
  if (!request.variant.is_of_pipeline()) {
    check_outside_pipeline(request);
    of_pipeline = of_pipeline_alone(std::move(of_pipeline));
    of_pipeline.observers = nullptr;
  }
  const Configuration configuration(of_pipeline, empty);
  for (const Instance& instance : configuration.netlist().instances()) configuration.make(instance);
  if (!samples_statistics(of_pipeline)) return;
  with_sampler(configuration, [&](StatisticSampler& sampler) { sampler.find(*request.observers); });
}

std::vector<std::string> sampled_statistics(const RunRequest& request) {
  std::vector<std::string> names;
  if (!has_time(request.fidelity) || !request.variant.is_of_pipeline()) return names;
  const Frame empty(1, 1);
  const Configuration configuration(with_all_effects(request), empty);
  with_sampler(configuration, [&](const StatisticSampler& sampler) { names = sampler.names(); });
  return names;
}

std::vector<std::string> counted_statistics(const RunRequest& request) {
  return request.variant.is_of_pipeline() ? sampled_statistics(request) : statistics_outside_pipeline(request);
}

std::vector<ParameterListing> list_parameters(const Platform* platform) {
  std::vector<ParameterListing> listings;
  const auto apply = [&](const std::vector<std::string>& names, ParameterSet& set) {
    if (platform == nullptr) return;
    for (const Setting& setting : platform->settings) {
      if (std::find(names.begin(), names.end(), setting.unit) != names.end())
        set.set(setting.unit, setting.parameter, setting.value);
    }
  };
  for (const Implementation* implementation : Registry::instance().all()) {
    ParameterListing listing{implementation->slot, implementation->name, implementation->description,
                             implementation->pass_through, implementation->make_parameters()};
    const Slot& slot = Registry::instance().slot(implementation->slot);
    if (implementation == &default_implementation(slot, variant_named("het+qm"))) {
      apply({implementation->slot}, *listing.parameters);
    }
    listings.push_back(std::move(listing));
  }
  const Platform& wired = platform != nullptr ? *platform : platforms().front();
  Netlist netlist(wired.gpcs);
  wired.wire(netlist);
  std::vector<std::string> listed;
  for (const Link& link : netlist.links()) {
    const std::string name = "link." + without_gpc(link.name());
    if (std::find(listed.begin(), listed.end(), name) != listed.end()) continue;
    listed.push_back(name);
    auto parameters = std::make_unique<LinkParameters>(link.parameters->depth, link.parameters->latency_cycles);
    apply({name, "link." + link.name()}, *parameters);
    listings.push_back(
        {name, "", without_gpc(link.from) + " to " + without_gpc(link.to), false, std::move(parameters)});
  }

  listings.push_back({"platform", "gpu", "the GPU as a whole", false, std::make_unique<PlatformParameters>(wired)});
  listings.push_back({"state", "draw-state", "the draw's state and the precision of the fixed-function hardware", false,
                      std::make_unique<StateParameters>()});
  apply({"state"}, *listings.back().parameters);
  return listings;
}

StorageReport quad_merging_storage(const RunRequest& request) {
  const Frame empty(1, 1);
  RunRequest merging = of_pipeline_alone(request);
  merging.variant.quad_merging = true;
  merging.effects = EffectChoice::everything();
  const Configuration configuration(merging, empty);
  StorageReport report;
  for (const Instance& instance : configuration.netlist().instances()) {
    if (instance.gpc != 0) continue;
    if (instance.slot == "tgc") report.tgc_bytes += configuration.make_as<TgcBehaviour>(instance)->storage_bytes();
    if (instance.slot == "qru") report.qru_bytes += configuration.make_as<QruBehaviour>(instance)->storage_bytes();
  }
  return report;
}

void fresh_simulation() {
  sc_core::sc_curr_simcontext = new sc_core::sc_simcontext();
  sc_core::sc_default_global_context = sc_core::sc_curr_simcontext;
}

}  // namespace vrpipe
