#include "run/pipeline_run.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bound/work_counter.h"
#include "elaboration/untimed_gpu.h"
#include "run/add_statistics.h"
#include "run/conservation.h"
#include "run/expected_error.h"
#include "run/frame_sampler.h"
#include "run/host_timer.h"
#include "run/result_hash.h"
#include "run/statistic_sampler.h"
#include "run/statistics.h"

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/checked_behaviours.h>
#include <vrpipe/platforms/gpu.h>
#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/validated_range.h>

namespace vrpipe {

bool samples_statistics(const RunRequest& request) {
  return request.observers != nullptr && !request.observers->of_statistics().empty();
}

void check_may_stop(const RunRequest& request) {
  if (request.stop_at == 0 || request.fidelity == Fidelity::cycle) return;
  throw UserError("cannot stop at a cycle", std::string("fidelity ") + name_of(request.fidelity),
                  "what it has done by a cycle is not what the GPU has", "use cycle");
}

void check_sampling_has_time(const RunRequest& request) {
  if (!samples_statistics(request) || has_course(request)) return;
  throw UserError("cannot sample statistics", "--fidelity " + fidelity_of(request),
                  request.sampling                      ? "most of its course has no time"
                  : request.fidelity == Fidelity::bound ? "its cycles follow from all the work, no work has a cycle"
                                                        : "it has no time",
                  "use lt or cycle");
}

namespace {

/// The functional models of all units.
using BehaviourList = std::vector<Behaviour*>;

/// What all units count, of the frame or of a draw.
Counts counts_from(const BehaviourList& behaviours, const CountOf& of) {
  Counts counts;
  for (Behaviour* const behaviour : behaviours) behaviour->unit().add_to(counts, of);
  return counts;
}

/// By draw, in a frame of several.
std::vector<DrawReport> draw_reports(const Frame& frame, const BehaviourList& behaviours) {
  std::vector<DrawReport> reports;
  if (frame.draws().size() < 2) return reports;
  for (std::size_t draw = 0; draw < frame.draws().size(); ++draw) {
    DrawReport& report = reports.emplace_back();
    report.name = frame.draws()[draw].name;
    const Counts counts = counts_from(behaviours, CountOf(draw));
    for (const CountField& field : Counts::fields()) {
      if (!field.is_shared) report.counts.emplace_back(field.name, counts.*field.value);
    }
  }
  return reports;
}

/// Of draws that are told apart. The frame ends with the last of them: what keeps it up beyond that, as far as lt knows, is
/// of a quad of that draw.
void set_draw_times(std::vector<Cycle> ends, Cycle cycles, std::vector<DrawReport>& draws) {
  const auto last = std::max_element(ends.begin(), ends.end());
  if (last != ends.end() && *last > 0) *last = cycles;
  Cycle before = 0;
  for (std::size_t draw = 0; draw < ends.size(); ++draw) {
    if (ends[draw] > 0) draws[draw].end = ends[draw];
    draws[draw].cycles = ends[draw] - std::min(ends[draw], before);
    before = std::max(before, ends[draw]);
  }
}

/// What the units counted, once a checked unit's counters are what went through it.
void report_counts(const Configuration& configuration, const BehaviourList& behaviours,
                   const StatisticCollector& statistics, RunResult& result) {
  for (Behaviour* const behaviour : behaviours) {
    check_counters(*behaviour);
    if (!result.stopped) behaviour->unit().check_end();
  }
  result.statistics = statistics.reports();
  result.counts = counts_from(behaviours, CountOf());
  result.draws = draw_reports(configuration.frame(), behaviours);
}

/// Units and what occupied them in a run of `cycles`. Also the bottleneck, and the utilization of the slots that have
/// one: the share of their throughput's time, over all GPCs.
class OccupancyReport {
 public:
  OccupancyReport(double cycles, RunResult& result) : cycles_(cycles), result_(result) {}

  void add(UnitReport report, const std::string& slot, const std::vector<OccupancyPart>& parts) {
    count(report, slot, parts);
    check_states(report);
    result_.units.push_back(std::move(report));
  }
  /// A memory has no states.
  void add_memory(UnitReport report, const std::string& slot, const std::vector<OccupancyPart>& parts) {
    count(report, slot, parts);
  }

  void finish() {
    for (const Slot& slot : Registry::instance().slots()) {
      const auto& [units, sum] = throughput_of_[slot.name];
      const bool is_there = slot.is_memory && units > 0;
      if (!slot.reports_utilization && !is_there) continue;
      result_.utilization.emplace_back(slot.name, units > 0 ? sum / units : 0.0);
    }
  }

 private:
  void count(UnitReport& report, const std::string& slot, const std::vector<OccupancyPart>& parts) {
    std::map<unsigned, Bottleneck> resources;
    double throughput = 0;
    for (const OccupancyPart& part : parts) {
      const double share = cycles_ > 0 ? part.cycles / cycles_ : 0.0;
      if (part.is_throughput) throughput += share;
      report.parts.emplace_back(part.name, share);
      Bottleneck& resource = resources[part.resource];
      resource.occupancy += share;
      if (share > 0) resource.parts.emplace_back(part.name, share);
    }
    for (auto& [index, resource] : resources) {
      report.occupancy = std::max(report.occupancy, resource.occupancy);
      resource.unit = report.name;
      if (resource.occupancy > (result_.bottleneck ? result_.bottleneck->occupancy : 0.0)) {
        result_.bottleneck = std::move(resource);
      }
    }
    // But for rounding of the shares themselves.
    if (report.occupancy > 1 + 1e-9) {
      throw SimulationFault(report.name, static_cast<Cycle>(cycles_),
                            fmt::format("it is occupied {} of its time", report.occupancy));
    }
    auto& [units, sum] = throughput_of_[slot];
    ++units;
    sum += throughput;
  }
  void check_states(const UnitReport& report) const {
    const auto cycles = static_cast<Cycle>(cycles_);
    std::uint64_t sum = 0;
    for (const std::uint64_t spent : report.cycles) {
      if (spent > cycles) throw SimulationFault(report.name, cycles, fmt::format("{} cycles in one state", spent));
      sum += spent;
    }
    if (sum != cycles) throw SimulationFault(report.name, cycles, fmt::format("its states sum to {} cycles", sum));
  }

  double cycles_;
  RunResult& result_;
  std::map<std::string, std::pair<unsigned, double>> throughput_of_;
};

void set_time(const Configuration& configuration, Cycle cycles, RunResult& result) {
  result.cycles = cycles;
  result.milliseconds = static_cast<double>(cycles) / (configuration.platform().frequency_mhz * 1e3);
}

void run_clocked(const Configuration& configuration, std::atomic<float>* progress, RunResult& result) {
  Gpu gpu(configuration, result.framebuffer);
  StatisticSampler sampler;
  if (samples_statistics(configuration.request())) {
    add_statistics(gpu, sampler);
    sampler.find(*configuration.request().observers);
    sampler.watch(gpu.clock());
  }
  const HostTimer timer;
  const Cycle cycles = gpu.run(progress);
  timer.stop(result);
  sampler.finish(cycles);
  set_time(configuration, cycles, result);
  result.stopped = gpu.stopped();
  result.kernel_events = gpu.clock().activations();

  BehaviourList behaviours;
  StatisticCollector statistics;
  add_statistics(gpu, statistics);
  OccupancyReport occupancy(static_cast<double>(cycles), result);
  for (const Gpu::Placed& placed : gpu.units()) {
    behaviours.push_back(placed.behaviour);
    UnitReport report;
    report.name = placed.instance->path;
    for (unsigned state = 0; state < unit_states; ++state) {
      report.cycles[state] = placed.unit->account().cycles(static_cast<UnitState>(state));
    }
    occupancy.add(std::move(report), placed.instance->slot, placed.unit->occupancy().parts(cycles));
  }
  for (const Gpu::PlacedMemory& placed : gpu.memories()) {
    UnitReport report;
    report.name = placed.instance->path;
    occupancy.add_memory(std::move(report), placed.instance->slot, placed.memory->parts(cycles));
  }
  occupancy.finish();
  result.expected_error_percent =
      configuration.request().fidelity == Fidelity::cycle ? 0 : expected_error_percent(gpu, result);
  if (!result.stopped) check_conservation(gpu, configuration.netlist());
  report_counts(configuration, behaviours, statistics, result);
  if (!result.stopped) set_draw_times(gpu.clock().frame_end().of_draws(), cycles, result.draws);
}

/// The bounds of all GPCs: the longest is the draw's.
void report_bound(const Configuration& configuration, const UntimedGpu& gpu, const std::vector<PhaseBound>& bounds,
                  const OtherSlots& others, RunResult& result) {
  double longest = 0;
  // A GPC without quads does not keep the draw up, unless there is none at all.
  const bool any_quads = std::any_of(bounds.begin(), bounds.end(), [](const auto& bound) { return bound.has_quads(); });
  for (const PhaseBound& bound : bounds) {
    if (bound.has_quads() || !any_quads) longest = std::max(longest, bound.cycles());
  }
  for (const UntimedGpu::Placed& placed : gpu.units()) {
    longest = std::max(longest, busiest(others.parts(placed.instance->path)));
  }
  // A memory works side by side with the units.
  const double period_ps = 1e6 / configuration.platform().frequency_mhz;
  for (const UntimedGpu::PlacedMemory& placed : gpu.memories()) {
    longest = std::max(longest, busiest(placed.memory->least_occupancy(period_ps)));
  }
  const auto cycles = static_cast<Cycle>(longest);
  set_time(configuration, cycles, result);
  OccupancyReport occupancy(longest, result);
  for (const UntimedGpu::Placed& placed : gpu.units()) {
    const Instance& instance = *placed.instance;
    const Pipeline::Place place = Pipeline::place_of(instance.slot);
    UnitReport unit;
    unit.name = instance.path;
    const std::vector<OccupancyPart> parts =
        place != Pipeline::places ? bounds[instance.gpc].parts(place) : others.parts(instance.path);
    const Cycle busy = std::min(cycles, static_cast<Cycle>(busiest(parts)));
    unit.cycles[static_cast<unsigned>(UnitState::busy)] = busy;
    unit.cycles[static_cast<unsigned>(UnitState::starved)] = cycles - busy;
    occupancy.add(std::move(unit), instance.slot, parts);
  }
  for (const UntimedGpu::PlacedMemory& placed : gpu.memories()) {
    UnitReport report;
    report.name = placed.instance->path;
    occupancy.add_memory(std::move(report), placed.instance->slot, placed.memory->least_occupancy(period_ps));
  }
  for (const std::string& path : configuration.netlist().used_memories()) {
    const Instance* const memory = configuration.netlist().find(path);
    if (memory == nullptr || gpu.memory(path) != nullptr) continue;
    UnitReport report;
    report.name = path;
    double moved = 0;
    for (const PhaseBound& bound : bounds) {
      if (bound.memory() == path) moved += bound.memory_cycles() / static_cast<double>(bounds.size());
    }
    occupancy.add_memory(std::move(report), memory->slot, {{"bytes", 0, moved, true}});
  }
  occupancy.finish();
}

/// Without time, or with the bound that follows from the work.
/// @param sampler  of its time; or null
void run_untimed(const Configuration& configuration, std::atomic<float>* progress, RunResult& result,
                 FrameSampler* sampler) {
  UntimedGpu gpu(configuration, result.framebuffer);
  std::vector<PhaseBound> bounds;
  std::vector<std::unique_ptr<WorkCounter>> counters;
  std::optional<OtherSlots> others;
  if (result.request.fidelity == Fidelity::bound) {
    for (const UntimedGpu::PlacedMemory& placed : gpu.memories()) placed.memory->count_least();
    const unsigned gpcs = configuration.netlist().gpcs();
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) bounds.emplace_back(configuration, gpu, gpc);
    others.emplace(gpu, configuration.frame().terminates_early() && bounds.front().terms().bins_vary);
    for (unsigned gpc = 0; gpc < gpcs; ++gpc) {
      counters.push_back(std::make_unique<WorkCounter>(configuration, gpc, bounds[gpc], *others));
    }
  }
  const HostTimer timer;
  if (sampler == nullptr) {
    gpu.run(progress);
  } else {
    sampler->begin(gpu, result.framebuffer);
    gpu.run(progress, [sampler] { sampler->passed(); });
    sampler->end();
  }
  for (const auto& counter : counters) counter->end_phase();
  timer.stop(result);

  BehaviourList behaviours;
  StatisticCollector statistics;
  for (const UntimedGpu::Placed& placed : gpu.units()) {
    Behaviour& behaviour = placed.unit->behaviour();
    behaviours.push_back(&behaviour);
    add_statistics(*placed.instance, behaviour, *placed.unit, statistics);
    placed.unit->check_work();
  }
  for (const UntimedGpu::PlacedMemory& placed : gpu.memories()) {
    statistics.add(placed.instance->slot, placed.instance->path, placed.memory->unit());
  }
  check_conservation(gpu, configuration.netlist());
  report_counts(configuration, behaviours, statistics, result);
  if (bounds.empty()) return;
  report_bound(configuration, gpu, bounds, *others, result);
  for (const std::string& reason : others->unknown()) result.outside_validated_range.push_back(reason);
}

}  // namespace

RunResult simulate_pipeline(const RunRequest& request, const Frame& frame, std::atomic<float>* progress,
                            FrameSampler* sampler) {
  check_sampling_has_time(request);
  check_may_stop(request);
  const Configuration configuration(request, frame);
  RunResult result;
  result.request = request;
  result.framebuffer = Framebuffer(configuration.frame(), request.format);
  result.implementations = configuration.implementations();
  result.parameters = configuration.parameters();
  if (request.fidelity == Fidelity::lt) {
    result.outside_validated_range = outside_validated_range(result.parameters);
    for (std::string& reason : outside_validated_range(configuration.netlist())) {
      result.outside_validated_range.push_back(std::move(reason));
    }
  }
  if (has_time(request.fidelity)) {
    run_clocked(configuration, progress, result);
  } else {
    run_untimed(configuration, progress, result, sampler);
  }
  result.effects = configuration.effects();
  result.result_hash = hash_of(result);
  return result;
}

}  // namespace vrpipe
