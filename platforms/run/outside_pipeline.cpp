#include "run/outside_pipeline.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "run/chosen_kernel.h"
#include "run/host_timer.h"
#include "run/statistics.h"

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/accelerator.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/software.h>

namespace vrpipe {

namespace {

std::string draws_by(const RunRequest& request) {
  return request.variant.drawn_by == DrawnBy::software ? "software" : "an accelerator";
}

/// What there is of the pipeline alone.
void check_has_no_pipeline(const RunRequest& request) {
  const auto refuse = [&](const std::string& what, const std::string& why) {
    throw UserError(what, "variant " + request.variant.name, why, "take a variant of the graphics pipeline");
  };
  const std::string who = draws_by(request);
  if (request.stop_at != 0) refuse("cannot stop at a cycle", who + " has no state at a cycle");
  if (request.stall_seed != 0 || request.tick_order_seed != 0) refuse("cannot stall", who + " has no ports");
  if (request.observers == nullptr) return;
  if (request.observers->sees_units()) refuse("cannot be observed", who + " has no links, states or samples");
  if (request.observers->of_fragments() != nullptr && request.variant.drawn_by == DrawnBy::accelerator)
    refuse("cannot be observed", "an accelerator does not tell of its fragments");
}

void check_own_changes(const Variant& variant) {
  const auto check = [&](const std::string& slot, const std::string& change) {
    if (!is_without(variant, slot)) return;
    throw UserError("cannot change '" + change + "'", "variant " + variant.name, "it does not draw with " + slot,
                    "leave it out");
  };
  for (const auto* settings : {&variant.settings, &variant.changed_settings}) {
    for (const Setting& setting : *settings) check(setting.unit, setting.unit + "." + setting.parameter);
  }
  for (const auto* units : {&variant.units, &variant.changed_units}) {
    for (const UnitChoice& choice : *units) check(choice.slot, choice.slot);
  }
}

void set_platform_time(std::uint64_t cycles, RunResult& result) {
  result.cycles = cycles;
  result.milliseconds = static_cast<double>(cycles) / (result.request.platform->frequency_mhz * 1e3);
}

double share_of_run(std::uint64_t cycles, const RunResult& result) {
  return *result.cycles == 0 ? 0 : std::min(1.0, static_cast<double>(cycles) / static_cast<double>(*result.cycles));
}

/// Kernels, or stages, as units: busy, and starved while others are at work.
void report_units(RunResult& result) {
  if (!result.cycles) return;
  for (const KernelReport& kernel : result.kernels) {
    const std::uint64_t busy = std::min(*kernel.cycles, *result.cycles);
    UnitReport& unit = result.units.emplace_back();
    unit.name = kernel.name;
    unit.cycles[static_cast<unsigned>(UnitState::busy)] = busy;
    unit.cycles[static_cast<unsigned>(UnitState::starved)] = *result.cycles - busy;
    unit.occupancy = share_of_run(busy, result);
    unit.parts = {{kernel.bound_by, unit.occupancy}};
    if (unit.occupancy > (result.bottleneck ? result.bottleneck->occupancy : 0))
      result.bottleneck = Bottleneck{unit.name, unit.occupancy, unit.parts};
  }
}

void draw_in_software(const RunRequest& request, const Frame& frame, RunResult& result) {
  const HostTimer timer;
  SoftwareResult drawn = simulate_software(request, frame, std::nullopt);
  timer.stop(result);
  result.kernels = std::move(drawn.binning);
  result.kernels.push_back(std::move(drawn.render));
  if (drawn.cycles) {
    set_platform_time(*drawn.cycles, result);
    std::uint64_t sm = 0, memory = 0;
    for (const KernelReport& kernel : result.kernels) {
      sm += kernel.sm_cycles;
      memory += kernel.memory_cycles;
    }
    result.utilization = {{"sm", share_of_run(sm, result)}, {"dram", share_of_run(memory, result)}};
  }
  result.counts = drawn.counts;
  result.statistics = std::move(drawn.statistics);
  result.implementations = std::move(drawn.implementations);
  result.parameters = std::move(drawn.parameters);
  const auto is_unused = [&](const auto& of_slot) {
    return !draws_with(request.variant, of_slot.first.substr(0, of_slot.first.find('.')));
  };
  for (auto* all : {&result.implementations, &result.parameters})
    all->erase(std::remove_if(all->begin(), all->end(), is_unused), all->end());
  result.framebuffer = std::move(drawn.framebuffer);
  result.result_hash = std::move(drawn.result_hash);
}

void draw_by_accelerator(const RunRequest& request, const Frame& frame, RunResult& result) {
  const HostTimer timer;
  AcceleratorResult drawn = simulate_accelerator(request, frame, std::nullopt);
  timer.stop(result);
  const auto of_platform = [&](std::uint64_t cycles) {
    const double exact = static_cast<double>(cycles) * request.platform->frequency_mhz;
    return static_cast<std::uint64_t>(std::ceil(exact / drawn.frequency_mhz));
  };
  result.kernels = {std::move(drawn.sort), std::move(drawn.raster)};
  for (KernelReport& stage : result.kernels) {
    if (stage.cycles) stage.cycles = of_platform(*stage.cycles);
  }
  if (drawn.cycles) set_platform_time(of_platform(*drawn.cycles), result);
  result.counts = drawn.counts;
  result.statistics = std::move(drawn.statistics);
  result.implementations = {{"accelerator", drawn.name}};
  result.parameters = std::move(drawn.parameters);
  result.framebuffer = std::move(drawn.framebuffer);
  result.result_hash = std::move(drawn.result_hash);
  report_units(result);
  if (drawn.cycles && drawn.bound_by == "memory") {
    const double share = share_of_run(of_platform(*drawn.interval_cycles), result);
    result.bottleneck = Bottleneck{"memory", share, {{"bytes", share}}};
  }
}

/// Of the platform, what software draws with.
void add_machine_parameters(const RunRequest& request, RunResult& result) {
  RunRequest machine = of_pipeline_alone(request);
  machine.effects = EffectChoice::everything();
  machine.observers = nullptr;
  for (auto& parameter : Configuration(machine, Frame(1, 1)).parameters()) {
    const std::string slot = without_gpc(parameter.first.substr(0, parameter.first.rfind('.')));
    if (slot == "platform" || draws_with(request.variant, slot)) result.parameters.push_back(std::move(parameter));
  }
}

}  // namespace

Fidelity finest_fidelity(const Variant& variant) {
  return variant.drawn_by == DrawnBy::accelerator ? Fidelity::lt : Fidelity::cycle;
}

bool draws_with(const Variant& variant, const std::string& slot) {
  switch (variant.drawn_by) {
    case DrawnBy::pipeline: return !is_outside_pipeline(slot);
    case DrawnBy::software: return slot == "binning" || slot == "render" || slot == "sm" || slot == "dram";
    case DrawnBy::accelerator: return slot == "accelerator";
  }
  return false;
}

bool is_without(const Variant& variant, const std::string& unit) {
  const std::string slot = without_gpc(unit);
  const bool is_known = Registry::instance().has_slot(slot) || unit.rfind("link.", 0) == 0;
  return is_known && !draws_with(variant, slot);
}

void check_drawable(const RunRequest& request, const Frame& frame) {
  if (request.variant.is_of_pipeline()) return;
  check_is_of_splats(frame, ("cannot draw by variant '" + request.variant.name + "'").c_str());
}

RunRequest of_variant_alone(RunRequest request) {
  const auto is_others = [&](const std::string& slot) {
    return is_outside_pipeline(slot) && !draws_with(request.variant, slot);
  };
  std::vector<Setting>& settings = request.settings;
  settings.erase(std::remove_if(settings.begin(), settings.end(),
                                [&](const Setting& setting) { return is_others(setting.unit); }),
                 settings.end());
  std::vector<UnitChoice>& units = request.units;
  units.erase(std::remove_if(units.begin(), units.end(),
                             [&](const UnitChoice& choice) { return is_others(choice.slot); }),
              units.end());
  return request;
}

void check_outside_pipeline(const RunRequest& request) {
  check_has_no_pipeline(request);
  check_own_changes(request.variant);
  if (request.fidelity > finest_fidelity(request.variant)) {
    throw UserError("no such fidelity", std::string("fidelity ") + name_of(request.fidelity),
                    draws_by(request) + " has none of its units",
                    std::string("take ") + name_of(finest_fidelity(request.variant)) + ", or less");
  }
  RenderContext context;
  context.frame = std::make_shared<Frame>(1, 1);
  for (const Slot& slot : Registry::instance().slots()) {
    if (!slot.is_outside_pipeline || !draws_with(request.variant, slot.name)) continue;
    const ChosenKernel kernel = choose_kernel(slot.name, request);
    kernel.implementation->make_behaviour(*kernel.parameters, context);
  }
}

std::vector<std::string> statistics_outside_pipeline(const RunRequest& request) {
  RenderContext context;
  context.frame = std::make_shared<Frame>(1, 1);
  StatisticCollector collector(StatisticCollector::Take::all);
  for (const Slot& slot : Registry::instance().slots()) {
    if (!slot.is_outside_pipeline || !draws_with(request.variant, slot.name)) continue;
    const ChosenKernel kernel = choose_kernel(slot.name, request);
    const auto behaviour = kernel.implementation->make_behaviour(*kernel.parameters, context);
    collector.add(slot.name, slot.name, behaviour->unit());
  }
  std::vector<std::string> names;
  for (const StatisticReport& report : collector.reports()) names.push_back(report.name);
  return names;
}

RunResult simulate_outside_pipeline(const RunRequest& request, const Frame& frame) {
  check_outside_pipeline(request);
  RunResult result;
  result.request = request;
  if (request.variant.drawn_by == DrawnBy::software) {
    draw_in_software(request, frame, result);
    report_units(result);
    add_machine_parameters(request, result);
  } else {
    draw_by_accelerator(request, frame, result);
  }
  return result;
}

}  // namespace vrpipe
