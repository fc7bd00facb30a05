#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/component/parameter.h>
#include <vrpipe/kernel/accounting.h>
#include <vrpipe/pipeline/counts.h>
#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/effects.h>
#include <vrpipe/pipeline/frame.h>
#include <vrpipe/pipeline/framebuffer.h>
#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

class Netlist;
class Observers;

/// How exact a run is about time.
enum class Fidelity : std::uint8_t { functional, bound, lt, cycle };
const char* name_of(Fidelity fidelity);
/// All, the least exact first.
const std::vector<Fidelity>& fidelities();
/// One of `fidelities()`. Throws UserError naming those that exist.
Fidelity fidelity_named(const std::string& name);

/// `--set UNIT.PARAMETER=VALUE`.
struct Setting {
  std::string unit;  ///< a slot, or a unit's path; link.NAME; l2; state
  std::string parameter;
  std::string value;
};

/// `--unit SLOT=IMPLEMENTATION`.
struct UnitChoice {
  std::string slot;  ///< or a unit's path
  std::string implementation;
};

/// What draws a frame: the graphics pipeline, kernels on the platform's SM array (software.h), or a unit beside the GPU
/// (accelerator.h).
enum class DrawnBy : std::uint8_t { pipeline, software, accelerator };

/// Which of the paper's two extensions a run has, and perhaps units and settings of its own, which come before those of
/// the run.
struct Variant {
  std::string name;  ///< baseline, qm, het, het+qm, of a plugin or of the user
  bool quad_merging = false;
  bool early_termination = false;
  std::vector<UnitChoice> units = {};
  std::vector<Setting> settings = {};
  std::string base = {};  ///< of which variant it is a change; empty for one that stands for itself
  /// What makes it another than `base`: they come after units and settings of the run, so that runs that are alike in
  /// everything else differ in them.
  std::vector<UnitChoice> changed_units = {};
  std::vector<Setting> changed_settings = {};
  DrawnBy drawn_by = DrawnBy::pipeline;

  bool is_of_pipeline() const { return drawn_by == DrawnBy::pipeline; }
};
/// The paper's four, then those that were added.
const std::vector<Variant>& variants();
/// Others that are known by name: the shader blends, with an ordered lock and without any; software; an accelerator.
const std::vector<Variant>& more_variants();
/// The most exact that there is of what a variant draws with: `cycle`, of an accelerator `lt`.
Fidelity finest_fidelity(const Variant& variant);
/// Adds one of your own, as `add_platform` does a platform. Throws UserError for a name that is taken or no name (names.h), and
/// for a parameter that it sets twice.
void add_variant(Variant variant);
/// Throws UserError naming those that exist.
const Variant& variant_named(const std::string& name);

/// A GPU: units and the links between them.
struct Platform {
  std::string name;
  std::string description;  ///< one line
  unsigned gpcs = 1;        ///< unless `platform.gpcs` says otherwise (gpcs_of)
  double frequency_mhz = 0;
  std::vector<Setting> settings;               ///< where it differs from the units' defaults
  std::function<void(Netlist& netlist)> wire;  ///< adds the units and links
};

/// All named platforms, the default first.
const std::vector<Platform>& platforms();
/// Adds one of your own: in a program before it is used, in a plugin from a static initialiser. Throws UserError for a name that
/// is taken or no name (names.h), a description of several lines, no GPC or more than `most_gpcs`, a frequency outside
/// 0.001 to 1,000,000 MHz, and a platform without wiring; while a plugin is loaded, when nothing may be thrown, `load_plugin`
/// does.
void add_platform(Platform platform);
/// Throws UserError naming the nearest.
const Platform& platform_named(const std::string& name);

/// Cycles by windows of the frame that are simulated at `cycle`, while all of it is drawn without time.
struct Sampling {
  std::uint64_t windows = 0;  ///< beside the first and the last; at least 16. 0: what is usual
  std::uint64_t seed = 1;     ///< of where they are
};

/// One simulation.
struct RunRequest {
  const Platform* platform = nullptr;
  Variant variant;
  std::string name;  ///< what reports call it; empty for the variant's
  Fidelity fidelity = Fidelity::cycle;
  /// At fidelity `lt`: slots, or paths of units, that are simulated at `cycle` all the same. At others it says nothing.
  std::vector<std::string> units_at_cycle;
  /// At fidelity `cycle`, where one GPC draws splats in one draw: not all is simulated. The image, counts and statistics are those
  /// of `functional`. A frame that windows would cover half of is simulated whole.
  std::optional<Sampling> sampling;
  /// The run takes the cheapest way to cycles that are within so many percent: `lt`, if it says so of itself; as many windows as
  /// that needs; or all at `cycle`. The fidelity of the request says nothing then, of its sampling the seed alone counts. 0: as
  /// asked for.
  double error_percent = 0;
  ColorFormat format = ColorFormat::rgba16f;
  Termination termination = Termination::paper;
  std::vector<Setting> settings;
  std::vector<UnitChoice> units;
  /// What is simulated of what there is: by default what the frame calls for.
  EffectChoice effects;
  /// Whether anybody looks at statistics that take the host's time to follow. What is sampled is followed in any case.
  bool reads_statistics = true;
  /// Seen from outside in this process; null for nothing.
  std::shared_ptr<Observers> observers;

  /// At fidelity `cycle`: the run stops there, with what is done by then, unless its frame ends earlier; at least 1. 0: it
  /// does not.
  std::uint64_t stop_at = 0;

  /// For tests: a seed and a share of cycles (of 256) in which ports stall at random; 0 for none.
  std::uint64_t stall_seed = 0;
  unsigned stall_per_256 = 0;
  /// For tests: ticks units in a random order drawn from this seed; 0 for the order of wiring.
  std::uint64_t tick_order_seed = 0;
};
/// Sets what `--fidelity` says: one for all; lt and units that are at cycle: lt,crop=cycle,gpc0.zrop=cycle; or sampled. Throws
/// UserError.
void choose_fidelity(RunRequest& request, const std::string& text);
/// The names of all that choose_fidelity takes, but for units.
std::vector<std::string> fidelity_names();
/// The same of a run: lt, lt,crop=cycle or sampled.
std::string fidelity_of(const RunRequest& request);
/// The way that a run took to an error that it was asked for.
struct WayReport {
  std::string fidelity;  ///< as fidelity_of has it
  std::string why;       ///< one line
};
/// A request as its run has taken it: of one that was asked for an error, at the fidelity of its way.
RunRequest as_taken(const RunRequest& request, const std::optional<WayReport>& way);
/// Whether work has cycles.
bool has_time(Fidelity fidelity);
/// Whether it is known of a run what is when, from its beginning to its end.
bool has_course(const RunRequest& request);
/// GPCs of the platform, by its settings, those of the variant and of the run. Throws UserError for a number that cannot be.
unsigned gpcs_of(const RunRequest& request);
/// The GPC that owns a screen tile, as the platform's crossbar has it; 0 where there is one GPC.
std::function<unsigned(TileId)> tile_map_of(const RunRequest& request);
/// What reports call a run, also in file names.
const std::string& name_of(const RunRequest& request);

/// The cycles of one unit by state; they sum to the run's cycles.
struct UnitReport {
  std::string name;  ///< e.g. "gpc0.crop"
  std::array<std::uint64_t, unit_states> cycles{};
  double occupancy = 0;  ///< of the busiest of its resources, in [0, 1]
  /// What it spends time on: shares of the run's cycles, in [0, 1]. Those of one resource add up.
  std::vector<std::pair<std::string, double>> parts;
};

/// The unit that is occupied the most, and what occupies it; the parts sum to the occupancy.
struct Bottleneck {
  std::string unit;  ///< as in UnitReport, or "l2"
  double occupancy = 0;
  std::vector<std::pair<std::string, double>> parts;
};

/// What a histogram says of values from one to another, both included.
struct HistogramBucket {
  std::uint64_t from = 0;
  std::optional<std::uint64_t> to;  ///< none for the last, which takes whatever is larger
  std::uint64_t count = 0;
};
struct HistogramReport {
  std::optional<std::uint64_t> smallest, largest;  ///< of the values seen; none if there were none
  std::vector<HistogramBucket> buckets;            ///< without gap, from that of the smallest to that of the largest
};

/// A statistic of one component. Value and denominator are as in StatisticReport.
struct InstanceStatistic {
  std::string path;  ///< of the component, e.g. gpc1.crop, or of its part: gpc1.crop.cache
  std::uint64_t value = 0;
  std::optional<std::uint64_t> denominator;
  std::optional<double> quotient() const;
};

/// What components of a kind declared, over all of them: counters summed, the largest or smallest of extremes, all that
/// histograms saw, quotients of the sums.
struct StatisticReport {
  std::string name;  ///< e.g. crop.quads_blended; crop.cache.sector_hits, in a part of the component
  std::string unit;
  std::string meaning;
  std::uint64_t value = 0;  ///< of a ratio the numerator, of a histogram the sum of the values seen
  std::string kind;         ///< counter, largest, smallest, histogram, ratio
  std::string formula;      ///< of a ratio, by the names of counters: "hits / (hits + misses)"; empty otherwise
  std::optional<std::uint64_t> denominator;  ///< of a ratio, of a histogram the number of values seen; none otherwise
  std::optional<HistogramReport> histogram;
  std::vector<InstanceStatistic> instances;  ///< where the platform has several components of the kind
  /// Of a ratio, or the mean of a histogram: value over denominator; none where there is none, or it is 0.
  std::optional<double> quotient() const;
};

/// Null where nothing of that name was declared.
const StatisticReport* statistic_named(const std::vector<StatisticReport>& statistics, const std::string& name);
/// Read from a memory, l2 or dram, and written to it; none where it counts nothing.
std::optional<std::uint64_t> memory_bytes_moved(const std::vector<StatisticReport>& statistics,
                                                const std::string& memory);

/// What was counted of one draw: of `Counts`, what is a draw's own. Over all draws of a frame each sums to the frame's.
/// A merged quad is blended for the draw of its front quad, and counted as merged for that of its back quad.
struct DrawReport {
  std::string name;
  std::vector<std::pair<std::string, std::uint64_t>> counts;
  /// The cycle after the last of its quads has been blended or dropped; none without quads, or without time.
  std::optional<std::uint64_t> end;
  /// From the end of the draws before it to its own, 0 if they end later: over all draws these sum to the frame's. None
  /// without time.
  std::optional<std::uint64_t> cycles;
};

/// What a unit spent the cycles of intervals on: by state, one number an interval.
struct UnitIntervals {
  std::string name;
  std::array<std::vector<std::uint64_t>, unit_states> cycles;
};
/// A statistic over intervals, with one number for each. Of a ratio numerators, of a histogram sums.
struct StatisticIntervals {
  std::string name;
  std::string kind;  ///< as in StatisticReport
  /// What was counted in each; of an extreme, as it was at its end, none before anything was seen.
  std::vector<std::optional<std::uint64_t>> values;
  std::vector<std::uint64_t> denominators;  ///< of ratios and histograms, as in StatisticReport; empty otherwise
  /// Of an interval, as StatisticReport::quotient().
  std::optional<double> quotient(std::size_t interval) const;
};
/// A run in intervals of so many cycles, of which the last may be shorter: by record_intervals (intervals.h).
struct IntervalReport {
  std::uint64_t every = 0;
  std::vector<std::uint64_t> from;  ///< first cycle of each
  std::vector<UnitIntervals> units;
  std::vector<StatisticIntervals> statistics;
};

/// A kernel that has run, or a stage of an accelerator.
struct KernelReport {
  std::string name;
  std::uint64_t items = 0;              ///< as in KernelWork; of the render kernel, tiles
  std::uint64_t bytes = 0;              ///< read from memory and written to it
  std::optional<std::uint64_t> cycles;  ///< of the platform; none where the fidelity has no time
  std::string bound_by;                 ///< "sm", "memory", "launch" or, of the render kernel, "longest tile"
  /// Cycles of a whole SM array, and of all of the memory's bandwidth, that it takes; 0 without time, and of an accelerator.
  std::uint64_t sm_cycles = 0, memory_cycles = 0;
  // What it spends energy on; none where a kernel does not say, in an accelerator, and cycles without time.
  std::optional<double> warp_instructions;
  std::optional<double> lane_instructions;  ///< of the lanes that take part in these
  std::optional<double> core_cycles;        ///< in which a core has warps, of all cores
};

/// How the cycles of a sampled run were come by.
struct SamplingReport {
  std::uint64_t windows = 0;  ///< 0: all was simulated
  std::uint64_t seed = 0;     ///< of where they are
  double measured_share = 1;  ///< of the cycles: those in windows
  double warm_up_share = 0;   ///< those before them, until each was as the whole frame is there, in the same unit
  /// The cycles of `cycle` are so near in `confidence_percent` frames and seeds of 100.
  double half_interval_percent = 0;
  /// How much longer quads are on their way from the rasteriser to the end at the end of a window than at its beginning, in percent
  /// of its time, and how much farther the front end is ahead of the rasteriser, in percent of its quads: much, where queues go on
  /// to fill. Then windows warm up for longer, or all is simulated.
  double delay_growth_percent = 0, lead_growth_percent = 0;
  std::string whole_because;  ///< all was simulated
  static constexpr double confidence_percent = 95;
};

struct RunResult {
  RunRequest request;
  std::optional<std::uint64_t> cycles;  ///< none where the fidelity has no time
  /// Its frame goes on after RunRequest::stop_at: all is as it was then, and `cycles` is that, or a few more that what was
  /// under way is known to take.
  bool stopped = false;
  double milliseconds = 0;  ///< simulated, at the platform's clock
  double host_seconds = 0;  ///< wall time of the simulation alone
  double cpu_seconds = 0;   ///< processor time of this process over the same; what the simulation costs
  Counts counts;
  /// raster zrop prop sm crop l2 dram, in [0, 1]; empty without time. DRAM is 0 while L2 is all the memory there is.
  std::vector<std::pair<std::string, double>> utilization;
  std::vector<UnitReport> units;         ///< of a frame drawn outside the pipeline, its kernels or stages
  std::optional<Bottleneck> bottleneck;  ///< none without time, or without work
  std::vector<KernelReport> kernels;     ///< of a frame drawn outside the pipeline: lists and rendering, or stages
  std::vector<StatisticReport> statistics;
  /// Slot and name of the implementation in it, as the variant has it, in the order of the pipeline.
  std::vector<std::pair<std::string, std::string>> implementations;
  /// UNIT.PARAMETER and value of everything that could be set, pass-through units left out.
  std::vector<std::pair<std::string, std::string>> parameters;
  /// Reasons why cycles of lt, or a bound, may be farther off than documented; empty at the other fidelities.
  std::vector<std::string> outside_validated_range;
  /// How far the cycles may be off those of `cycle`, percent: of runs whose bottleneck and memory were as busy, over random
  /// configurations of all platforms, nine of ten were within. 0 where they are exact; none where that is not known, as outside of
  /// what was validated.
  std::optional<double> expected_error_percent;
  /// All that the platform's components declare, by name, and what became of each in this run.
  std::vector<EffectReport> effects;
  /// Of a run that was sampled. Units and utilization are empty then, unless all was simulated.
  std::optional<SamplingReport> sampling;
  /// Of a run that was asked for an error; `request` is as it was taken then.
  std::optional<WayReport> way;
  std::string result_hash;          ///< of counts, cycles and the stored bits of the image, 16 hex digits
  std::uint64_t kernel_events = 0;  ///< activations of the SystemC kernel's processes
  Framebuffer framebuffer;
  std::vector<DrawReport> draws;            ///< in a frame of several
  std::optional<IntervalReport> intervals;  ///< if they were asked for
};

/// The state that a request gives to a draw with these settings of its own, of unit `state`; what is the hardware's
/// precision among them is not used. Early termination is on: it takes the variant's units to have it.
/// Throws UserError for an unknown parameter or value.
DrawState draw_state_of(const RunRequest& request, const std::vector<Setting>& own = {});
/// Of the depth target of a frame that is made for a request: `state.depth_format`.
DepthFormat depth_format_of(const RunRequest& request);
/// How exactly its hardware computes.
DevicePrecision device_precision_of(const RunRequest& request);

/// Runs one variant. What draws outside the pipeline draws what is projected already, in a target of its own, RGBA32F, and
/// terminates by its own rule; its time is that of lists and rendering, in cycles of the platform. Checks conservation,
/// order per pixel and that the states of each unit sum to the cycles; throws SimulationFault if one is broken and UserError
/// for a configuration that does not exist. With time, one simulation per process is the safe way; tests run several with
/// `fresh_simulation()`.
/// `progress`, if given, goes from 0 to 1.
RunResult simulate(const RunRequest& request, const Frame& frame, std::atomic<float>* progress = nullptr);
/// A frame of one draw, of the state that the request gives.
RunResult simulate(const RunRequest& request, const Draw& draw, std::atomic<float>* progress = nullptr);

/// Whether a run with a sampling takes windows: of a frame that it can have them of, and that is not so small that all is simulated.
bool takes_windows(const RunRequest& request, const Frame& frame);

/// Checks settings, unit choices and what is to be observed against a platform without running anything; throws
/// UserError. With statistics to be sampled, not while a simulation of this process is elaborated.
void check_configuration(const RunRequest& request);

/// The names that Observers::on_statistics takes in a run of this request; none where it has no time. Throws UserError.
/// Not while a simulation of this process is elaborated.
std::vector<std::string> sampled_statistics(const RunRequest& request);

/// The same, and of what is drawn outside the pipeline, which is not sampled, the names of its statistics.
std::vector<std::string> counted_statistics(const RunRequest& request);

/// What can be set by --set, per unit, with the platform's settings applied. For `vrpipe units` and the reference.
struct ParameterListing {
  std::string unit;            ///< a slot, l2, state, or link.NAME
  std::string implementation;  ///< empty for a link
  std::string description;
  bool pass_through = false;
  std::unique_ptr<ParameterSet> parameters;
};
std::vector<ParameterListing> list_parameters(const Platform* platform);
/// What the component of a listing counts, at any fidelity. Not while a simulation of this process is elaborated.
std::vector<StatisticReport> list_statistics(const ParameterListing& listing);

/// The hardware that QM adds, from the configured sizes.
struct StorageReport {
  std::uint64_t tgc_bytes = 0;
  std::uint64_t qru_bytes = 0;
};
StorageReport quad_merging_storage(const RunRequest& request);

/// Replaces the SystemC context, so that the next simulation of this process starts at time 0. The old one leaks.
void fresh_simulation();

}  // namespace vrpipe
