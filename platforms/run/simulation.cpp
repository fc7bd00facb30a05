#include <vrpipe/platforms/simulation.h>

#include <algorithm>
#include <map>
#include <optional>

#include "bound/work_counter.h"
#include "elaboration/untimed_gpu.h"
#include "run/frame_sampler.h"
#include "run/host_timer.h"
#include "run/outside_pipeline.h"
#include "run/pipeline_run.h"
#include "run/result_hash.h"
#include "run/sampled_run.h"
#include "run/statistic_sampler.h"
#include "run/statistics.h"

#include <fmt/format.h>
#include <boost/algorithm/string/classification.hpp>
#include <boost/algorithm/string/split.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/names.h>
#include <vrpipe/component/printable.h>
#include <vrpipe/pipeline/checked_behaviours.h>
#include <vrpipe/pipeline/slots/qru.h>
#include <vrpipe/pipeline/slots/tgc.h>
#include <vrpipe/platforms/gpu.h>
#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/software.h>
#include <vrpipe/platforms/validated_range.h>

namespace vrpipe {

const char* name_of(Fidelity fidelity) {
  switch (fidelity) {
    case Fidelity::functional: return "functional";
    case Fidelity::bound: return "bound";
    case Fidelity::lt: return "lt";
    case Fidelity::cycle: return "cycle";
  }
  return "";
}

/// At lt. A draw takes at least as long as its busiest resource works, which lt knows; where that never rests, no order of events
/// matters. What was measured of the rest: benchmarks/lt_errors.
double expected_error_percent(double occupancy) {
  const double undecided = 1 - occupancy;
  return 0.2 + 2 * undecided / (undecided + 0.1);
}

namespace {
constexpr const char* sampled_name = "sampled";
}  // namespace

const std::vector<Fidelity>& fidelities() {
  static const std::vector<Fidelity> all{Fidelity::functional, Fidelity::bound, Fidelity::lt, Fidelity::cycle};
  return all;
}

namespace {
/// @param names  all that may stand there
Fidelity fidelity_among(const std::string& name, const std::vector<std::string>& names) {
  for (const Fidelity fidelity : fidelities()) {
    if (name == name_of(fidelity)) return fidelity;
  }
  throw UserError("unknown fidelity '" + name + "'", "--fidelity", "this build has no such fidelity",
                  suggestion(name, names));
}
}  // namespace

Fidelity fidelity_named(const std::string& name) {
  std::vector<std::string> names = fidelity_names();
  names.pop_back();  // which is none of a whole run's
  return fidelity_among(name, names);
}

std::vector<std::string> fidelity_names() {
  std::vector<std::string> names;
  for (const Fidelity fidelity : fidelities()) names.emplace_back(name_of(fidelity));
  names.emplace_back(sampled_name);
  return names;
}

void choose_fidelity(RunRequest& request, const std::string& text) {
  std::vector<std::string> words;
  boost::split(words, text, boost::is_any_of(","));
  request.units_at_cycle.clear();
  request.sampling.reset();
  if (words.front() == sampled_name) {
    if (words.size() > 1) {
      throw UserError("unknown fidelity '" + text + "'", "--fidelity", "a sampled run has no units at another fidelity",
                      "write sampled alone");
    }
    request.fidelity = Fidelity::cycle;
    request.sampling.emplace();
    return;
  }
  request.fidelity = fidelity_among(words.front(), fidelity_names());
  for (auto word = words.begin() + 1; word != words.end(); ++word) {
    const std::size_t sign = word->find('=');
    if (request.fidelity != Fidelity::lt || sign == std::string::npos || word->substr(sign + 1) != "cycle") {
      throw UserError("unknown fidelity of a unit '" + *word + "'", "--fidelity " + text,
                      "units can be at cycle among others at lt", "write UNIT=cycle behind lt, as in lt,crop=cycle");
    }
    request.units_at_cycle.push_back(word->substr(0, sign));
  }
}

bool has_time(Fidelity fidelity) { return fidelity != Fidelity::functional && fidelity != Fidelity::bound; }
bool has_course(const RunRequest& request) { return has_time(request.fidelity) && !request.sampling; }

RunRequest as_taken(const RunRequest& request, const std::optional<WayReport>& way) {
  RunRequest taken = request;
  if (!way) return taken;
  const Sampling asked = request.sampling.value_or(Sampling());
  choose_fidelity(taken, way->fidelity);
  if (taken.sampling) taken.sampling->seed = asked.seed;
  return taken;
}

std::string fidelity_of(const RunRequest& request) {
  if (request.sampling) return sampled_name;
  std::string text = name_of(request.fidelity);
  if (request.fidelity != Fidelity::lt || !request.variant.is_of_pipeline()) return text;
  for (const std::string& unit : request.units_at_cycle) text += "," + unit + "=cycle";
  return text;
}

namespace {
std::vector<Variant>& variant_list() {
  static std::vector<Variant> all{{"baseline", false, false},
                                  {"qm", true, false},
                                  {"het", false, true},
                                  {"het+qm", true, true}};
  return all;
}
}  // namespace

const std::string& name_of(const RunRequest& request) {
  return request.name.empty() ? request.variant.name : request.name;
}

const std::vector<Variant>& variants() { return variant_list(); }

const std::vector<Variant>& more_variants() {
  // A splat's program of 76 instructions, since without a lock a warp takes 5.1 cycles of a GH100's 4 SMs, of 4 schedulers
  // each: 24 as with a colour ROP, and address, load, blend and store. Colours do not pass PROP: its widest path is no limit.
  static const auto in_shader = [](const char* name, const char* lock) {
    Variant variant;
    variant.name = name;
    variant.changed_units = {{"crop", "in-shader"}};
    variant.changed_settings = {{"crop", "lock", lock},
                                {"sm", "fragment_instructions", "76"},
                                {"prop", "color_bytes_per_cycle", "256"}};
    return variant;
  };
  const auto outside = [](const char* name, DrawnBy drawn_by) {
    Variant variant;
    variant.name = name;
    variant.drawn_by = drawn_by;
    return variant;
  };
  static const std::vector<Variant> all{in_shader("in-shader", "ordered"), in_shader("in-shader-no-lock", "none"),
                                        outside("software", DrawnBy::software),
                                        outside("accelerator", DrawnBy::accelerator)};
  return all;
}

void add_variant(Variant variant) {
  const auto has_name = [&](const Variant& each) { return each.name == variant.name; };
  const bool taken = std::any_of(variants().begin(), variants().end(), has_name) ||
                     std::any_of(more_variants().begin(), more_variants().end(), has_name);
  const auto refuse = [&](const std::string& why, const std::string& remedy) {
    if (!is_loading_plugin())
      throw UserError("cannot add variant '" + printable(variant.name) + "'", "add_variant", why, remedy);
    Registry::instance().add_problem({"variant '" + printable(variant.name) + "': " + why, remedy});
  };
  if (taken) return refuse("there is one of that name", "choose another name");
  if (!is_good_name(variant.name))
    return refuse(std::string("its name is not ") + good_name_rule, "choose another name");
  for (std::size_t i = 0; i < variant.settings.size(); ++i) {
    const Setting& setting = variant.settings[i];
    const auto is_same = [&](const Setting& other) {
      return other.unit == setting.unit && other.parameter == setting.parameter;
    };
    if (std::any_of(variant.settings.begin(), variant.settings.begin() + static_cast<std::ptrdiff_t>(i), is_same))
      return refuse("it sets " + setting.unit + "." + setting.parameter + " twice", "set it once");
  }
  variant_list().push_back(std::move(variant));
  Registry::instance().count_registration();
}

const Variant& variant_named(const std::string& name) {
  std::vector<std::string> names;
  for (const std::vector<Variant>* const list : {&variants(), &more_variants()}) {
    for (const Variant& variant : *list) {
      if (variant.name == name) return variant;
      names.push_back(variant.name);
    }
  }
  throw UserError("unknown variant '" + name + "'", "--variant", "there is no such variant", suggestion(name, names));
}

namespace {

/// The functional models of all units.
using BehaviourList = std::vector<Behaviour*>;

// Statistics go to a StatisticCollector at the end of a run, to a StatisticSampler in its course.

/// Those of a unit: of its functional model, and of the one that gives it ports and time.
template <class Statistics>
void add_statistics(const Instance& instance, const Behaviour& behaviour, const Component& unit,
                    Statistics& statistics) {
  statistics.add(instance.slot, instance.path, behaviour.unit());
  statistics.add(instance.slot, instance.path, unit);
}

/// Those of a memory of another make that has any.
template <class Statistics>
void add_statistics(const std::string& path, const sc_core::sc_module& memory, Statistics& statistics) {
  if (const auto* const set = dynamic_cast<const StatisticSet*>(&memory)) statistics.add(path, path, *set);
}

template <class Statistics>
void add_statistics(const Gpu& gpu, Statistics& statistics) {
  for (const Gpu::Placed& placed : gpu.units()) {
    add_statistics(*placed.instance, *placed.behaviour, *placed.unit, statistics);
  }
  for (const Gpu::PlacedMemory& placed : gpu.memories()) {
    const Instance& instance = *placed.instance;
    statistics.add(instance.slot, instance.path, placed.memory->behaviour().unit());
    statistics.add(instance.slot, instance.path, placed.memory->statistics());
  }
  for (const Gpu::PlacedForeign& placed : gpu.foreign_memories()) {
    add_statistics(placed.instance->path, *placed.module, statistics);
  }
}

bool samples_statistics(const RunRequest& request) {
  return request.observers != nullptr && !request.observers->of_statistics().empty();
}

void check_may_stop(const RunRequest& request) {
  if (request.stop_at == 0 || request.fidelity == Fidelity::cycle) return;
  throw UserError("cannot stop at a cycle", std::string("fidelity ") + name_of(request.fidelity),
                  "what it has done by a cycle is not what the GPU has", "use cycle");
}

}  // namespace

void check_sampling_has_time(const RunRequest& request) {
  if (!samples_statistics(request) || has_course(request)) return;
  throw UserError("cannot sample statistics", "--fidelity " + fidelity_of(request),
                  request.sampling                      ? "most of its course has no time"
                  : request.fidelity == Fidelity::bound ? "its cycles follow from all the work, no work has a cycle"
                                                        : "it has no time",
                  "use lt or cycle");
}

namespace {

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

void check_conservation(const Counts& c) {
  const auto check = [](const char* what, std::uint64_t in, std::uint64_t out) {
    if (in == out) return;
    throw SimulationFault("conservation", 0, fmt::format("{}: {} went in, {} came out", what, in, out));
  };
  check("quads rasterized = depth_stencil_failed + terminated + unshaded + shaded", c.quads_rasterized,
        c.quads_depth_stencil_failed + c.quads_terminated + c.quads_unshaded + c.quads_shaded);
  check("fragments rasterized = depth_stencil_failed + terminated + unshaded + shaded", c.fragments_rasterized,
        c.fragments_depth_stencil_failed + c.fragments_terminated + c.fragments_unshaded + c.fragments_shaded);
  check("quads shaded = pruned + merged + dropped_late + late_failed + unblended + blended", c.quads_shaded,
        c.quads_pruned + c.quads_merged + c.quads_dropped_late + c.quads_late_failed + c.quads_unblended +
            c.quads_blended);
  check("fragments shaded = pruned + merged + dropped_late + late_failed + unblended + blended", c.fragments_shaded,
        c.fragments_pruned + c.fragments_merged + c.fragments_dropped_late + c.fragments_late_failed +
            c.fragments_unblended + c.fragments_blended);
}

/// What units and memories have asked a memory for is what it delivered. `asked_by` gives that of a path.
template <class AskedBy>
void check_conservation(const Netlist& netlist, const std::string& memory, const MemoryBytes& delivered,
                        const AskedBy& asked_by) {
  MemoryBytes asked;
  for (const std::string& path : netlist.bound_to(memory)) asked += asked_by(path);
  const auto check = [&](const char* what, std::uint64_t wanted, std::uint64_t moved) {
    if (wanted == moved) return;
    throw SimulationFault("conservation", 0,
                          fmt::format("bytes {} {}: {} asked for, {} delivered", what, memory, wanted, moved));
  };
  check("read from", asked.read, delivered.read);
  check("written to", asked.written, delivered.written);
}

void check_conservation(const Gpu& gpu, const Netlist& netlist) {
  const auto asked_by = [&](const std::string& path) -> MemoryBytes {
    for (const Gpu::Placed& placed : gpu.units()) {
      if (placed.instance->path == path) return placed.unit->memory_bytes();
    }
    for (const Gpu::PlacedMemory& placed : gpu.memories()) {
      if (placed.instance->path == path) return placed.memory->memory_bytes();
    }
    return {};
  };
  for (const Gpu::PlacedMemory& placed : gpu.memories()) {
    check_conservation(netlist, placed.instance->path, placed.memory->delivered(), asked_by);
  }
}

void check_conservation(const UntimedGpu& gpu, const Netlist& netlist) {
  const auto asked_by = [&](const std::string& path) -> MemoryBytes {
    for (const UntimedGpu::Placed& placed : gpu.units()) {
      if (placed.instance->path == path && placed.unit->memory_port() != nullptr)
        return placed.unit->memory_port()->moved();
    }
    for (const UntimedGpu::PlacedMemory& placed : gpu.memories()) {
      if (placed.instance->path == path) return placed.memory->memory_bytes();
    }
    return {};
  };
  for (const UntimedGpu::PlacedMemory& placed : gpu.memories()) {
    check_conservation(netlist, placed.instance->path, placed.memory->delivered(), asked_by);
  }
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

/// At lt, of what was measured: benchmarks/lt_errors. A memory that is the bottleneck, or whose requests wait for one another, gets
/// them in the order of calls, and answers later ones as if those before were all.
std::optional<double> expected_error_of(const Gpu& gpu, const RunResult& result) {
  if (!result.bottleneck || !result.outside_validated_range.empty()) return std::nullopt;
  const bool is_ordered_by_memory = std::any_of(gpu.memories().begin(), gpu.memories().end(), [&](const auto& placed) {
    return placed.memory->depends_on_order() || placed.instance->path == result.bottleneck->unit;
  });
  return is_ordered_by_memory ? 10 : expected_error_percent(result.bottleneck->occupancy);
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
      configuration.request().fidelity == Fidelity::cycle ? 0 : expected_error_of(gpu, result);
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
}  // namespace

namespace {
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
