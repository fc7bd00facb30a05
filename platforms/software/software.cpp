#include <vrpipe/platforms/software.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "run/chosen_kernel.h"
#include "run/result_hash.h"
#include "run/statistics.h"
#include "software/sm_array.h"

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/pipeline/slots/binning.h>
#include <vrpipe/pipeline/slots/checks.h>
#include <vrpipe/pipeline/slots/memory.h>
#include <vrpipe/pipeline/slots/preparation.h>
#include <vrpipe/pipeline/slots/render.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/platforms/observers.h>

namespace vrpipe {

namespace {

constexpr const char* preparation_name = "preparation";
constexpr const char* binning_name = "binning";
constexpr const char* render_name = "render";
constexpr const char* sm_part = "sm";
constexpr const char* memory_part = "memory";

/// The parts of a GPU that kernels take.
class SoftwareMachine {
 public:
  SoftwareMachine(const RunRequest& request, const Frame& frame)
      : configuration_(whole(request), frame), has_time_(request.fidelity != Fidelity::functional) {
    std::uint32_t cores = 0;
    for (const Instance& instance : configuration_.netlist().instances()) {
      if (instance.slot == "sm") {
        array_ = configuration_.make_as<SmBehaviour>(instance)->time();
        cores += array_->cores;
      } else if (instance.slot == "dram") {
        bytes_per_cycle_ += configuration_.make_as<MemoryBehaviour>(instance)->timing().bytes_per_cycle;
      }
    }
    if (cores == 0) {
      throw UserError("cannot render in software", "platform " + request.platform->name, "it has no SM array",
                      "take another platform");
    }
    array_->cores = cores;
  }

  const RenderContext& context() const { return configuration_.context_of(0); }
  const SmTime& array() const { return *array_; }
  double cycles_of(double microseconds) const { return microseconds * configuration_.platform().frequency_mhz; }
  /// Of moving bytes; 0 where no memory is modelled.
  double memory_cycles(std::uint64_t bytes) const {
    return bytes_per_cycle_ == 0 ? 0 : static_cast<double>(bytes) / static_cast<double>(bytes_per_cycle_);
  }

  KernelReport report(const KernelWork& work) const {
    constexpr double issue_of_an_sm = 4;  // as KernelWork has it
    const double sm_cycles = work.sm_cycles * issue_of_an_sm / array_->instructions_per_cycle();
    const double memory = memory_cycles(work.bytes);
    KernelReport reported = report(work.name, work.items, work.bytes, {{sm_part, sm_cycles}, {memory_part, memory}},
                                   work.launch_microseconds);
    reported.warp_instructions = work.warp_instructions;
    if (work.warp_instructions) reported.lane_instructions = 32 * *work.warp_instructions;
    if (reported.cycles) reported.core_cycles = array_->cores * std::max(sm_cycles, memory);
    return reported;
  }
  /// The longest of what goes side by side, and launching.
  KernelReport report(const char* name, std::uint64_t items, std::uint64_t bytes,
                      const std::vector<std::pair<const char*, double>>& parts, double launch_microseconds,
                      double at_least = 0) const {
    KernelReport report;
    report.name = name;
    report.items = items;
    report.bytes = bytes;
    if (!has_time_) return report;
    const auto longest =
        std::max_element(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    const double launch = cycles_of(launch_microseconds);
    report.cycles = static_cast<std::uint64_t>(std::ceil(std::max(longest->second, at_least) + launch));
    report.bound_by = longest->second < launch ? "launch" : longest->first;
    for (const auto& [part, cycles] : parts) {
      if (part == std::string_view(sm_part)) report.sm_cycles = static_cast<std::uint64_t>(std::ceil(cycles));
      if (part == std::string_view(memory_part)) report.memory_cycles = static_cast<std::uint64_t>(std::ceil(cycles));
    }
    return report;
  }

 private:
  /// With all that the platform has, whatever the draw by hardware would do without.
  static RunRequest whole(const RunRequest& request) {
    RunRequest of_machine = of_pipeline_alone(request);
    of_machine.effects = EffectChoice::everything();
    of_machine.observers = nullptr;
    return of_machine;
  }

  const Configuration configuration_;
  const bool has_time_;
  std::optional<SmTime> array_;  ///< of all GPCs
  std::uint64_t bytes_per_cycle_ = 0;
};

/// What a unit gives, whoever wrote it.
void check_lists(const ChosenKernel& kernel, const TileLists& lists, const Frame& frame) {
  const std::size_t tiles = ScreenTiling(frame.width(), frame.height()).tiles();
  if (lists.tiles() != tiles) kernel.fail(fmt::format("{} lists for {} tiles", lists.tiles(), tiles));
  if (lists.begin.front() != 0 || lists.begin.back() != lists.splats.size() ||
      !std::is_sorted(lists.begin.begin(), lists.begin.end())) {
    kernel.fail("lists that do not follow one another");
  }
  for (const std::uint32_t splat : lists.splats) {
    if (splat >= frame.splats()) kernel.fail(fmt::format("splat {} of {} in a list", splat, frame.splats()));
  }
}

const KernelWork& checked(const ChosenKernel& kernel, const KernelWork& work) {
  constexpr double most = 1e18;
  const bool can_be = work.name != nullptr && work.sm_cycles >= 0 && work.sm_cycles < most &&
                      work.launch_microseconds >= 0 && work.launch_microseconds < most / 1e6 &&
                      work.warp_instructions.value_or(0) >= 0 && work.warp_instructions.value_or(0) < most;
  if (!can_be) kernel.fail("a kernel without a name or with a time that cannot be");
  return work;
}

void check_block(const ChosenKernel& kernel, const BlockWork& block, std::size_t tile) {
  if (block.instructions.empty()) return;
  if (block.warps == 0 || block.instructions.size() % block.warps != 0) {
    kernel.fail(fmt::format("tile {} has instructions of {} warps and batches, and {} warps", tile,
                            block.instructions.size(), block.warps));
  }
}

void check_timing(const ChosenKernel& kernel, const RenderBehaviour::TimingParameters& timing) {
  if (timing.blocks_per_core == 0 || timing.blocks_per_core > 4096 || timing.issue_thousandths == 0 ||
      timing.warp_interval_cycles == 0 || !(timing.launch_microseconds >= 0 && timing.launch_microseconds < 1e12)) {
    kernel.fail("no blocks, no rate or no interval in its timing");
  }
}

/// Cycles of the render kernel; 0 where what binds it is all that is known.
/// @param core_cycles  in which a core has blocks, of all cores; as it was where that is not known
double time_of(const std::vector<BlockWork>& blocks, const SmArray& array, Fidelity fidelity, double& core_cycles) {
  switch (fidelity) {
    case Fidelity::functional:
    case Fidelity::bound: return 0;
    case Fidelity::lt: return array.fluid(blocks, &core_cycles);
    case Fidelity::cycle: return static_cast<double>(array.clocked(blocks, &core_cycles));
  }
  return 0;
}

void add_instructions(const std::vector<BlockWork>& blocks, KernelReport& report) {
  double warps = 0, lanes = 0;
  for (const BlockWork& block : blocks) {
    double of_block = 0;
    for (const std::uint64_t instructions : block.instructions) of_block += static_cast<double>(instructions);
    warps += of_block;
    lanes += block.lane_instructions == 0 ? 32 * of_block : static_cast<double>(block.lane_instructions);
  }
  report.warp_instructions = warps / 1000;
  report.lane_instructions = lanes / 1000;
}

KernelReport preprocess_by(const ChosenKernel& preparation, const SoftwareMachine& machine,
                           PreparationBehaviour::Path path, std::uint64_t gaussians) {
  const auto unit = preparation.make<PreparationBehaviour>(machine.context());
  const std::uint64_t visible = machine.context().frame->splats();
  const KernelWork work = preparation.call("project", [&] { return unit->project(path, gaussians, visible); });
  return machine.report(checked(preparation, work));
}

}  // namespace

bool is_outside_pipeline(const std::string& unit) {
  const Registry& registry = Registry::instance();
  return registry.has_slot(unit) && registry.slot(unit).is_outside_pipeline;
}

RunRequest of_pipeline_alone(RunRequest request) {
  const auto leave_out = [](std::vector<Setting>& settings, std::vector<UnitChoice>& units) {
    settings.erase(std::remove_if(settings.begin(), settings.end(),
                                  [](const Setting& setting) { return is_outside_pipeline(setting.unit); }),
                   settings.end());
    units.erase(std::remove_if(units.begin(), units.end(),
                               [](const UnitChoice& choice) { return is_outside_pipeline(choice.slot); }),
                units.end());
  };
  leave_out(request.settings, request.units);
  leave_out(request.variant.settings, request.variant.units);
  leave_out(request.variant.changed_settings, request.variant.changed_units);
  return request;
}

std::vector<std::pair<std::string, std::string>> check_software(const RunRequest& request) {
  RenderContext context;
  context.frame = std::make_shared<Frame>(1, 1);
  std::vector<std::pair<std::string, std::string>> parameters;
  for (const Slot& slot : Registry::instance().slots()) {
    if (!slot.is_outside_pipeline) continue;
    const ChosenKernel kernel = choose_kernel(slot.name, request);
    kernel.implementation->make_behaviour(*kernel.parameters, context);
    kernel.add_parameters_to(parameters);
  }
  return parameters;
}

SoftwareResult simulate_software(const RunRequest& request, const Frame& frame,
                                 std::optional<std::uint64_t> gaussians) {
  check_is_of_splats(frame, "cannot render in software");
  const ChosenKernel preparation = choose_kernel(preparation_name, request);
  const ChosenKernel binning = choose_kernel(binning_name, request);
  const ChosenKernel render = choose_kernel(render_name, request);
  const SoftwareMachine machine(request, frame);
  SoftwareResult result;
  result.request = request;
  result.framebuffer = Framebuffer(frame, ColorFormat::rgba32f);
  const auto start = std::chrono::steady_clock::now();

  if (gaussians) {
    result.preprocess = preprocess_by(preparation, machine, PreparationBehaviour::Path::software, *gaussians);
  }
  const auto lists_by = binning.make<BinningBehaviour>(machine.context());
  const TileLists lists = binning.call("make_lists", [&] { return lists_by->make_lists(); });
  check_lists(binning, lists, frame);
  lists_by->count(lists);
  for (const KernelWork& work : binning.call("kernels", [&] { return lists_by->kernels(); })) {
    result.binning.push_back(machine.report(checked(binning, work)));
  }

  RenderContext seen = machine.context();
  if (request.observers != nullptr) seen.fragments = request.observers->of_fragments();
  const auto tiles_by = render.make<RenderBehaviour>(seen);
  tiles_by->use_surfaces(result.framebuffer);
  std::vector<BlockWork> blocks(lists.tiles());
  render.call("render", [&] {
    for (std::size_t tile = 0; tile < lists.tiles(); ++tile) {
      tiles_by->render(tile, lists.of(tile), lists.length(tile), blocks[tile]);
      check_block(render, blocks[tile], tile);
    }
  });
  tiles_by->check_end();
  const auto timing = render.call("timing", [&] { return tiles_by->timing(); });
  check_timing(render, timing);
  const SmArray array(machine.array(), timing);
  const SmArray::Least least = array.least(blocks);
  const std::uint64_t bytes = render.call("bytes", [&] { return tiles_by->bytes(); });
  double core_cycles = least.issue * machine.array().cores;
  const double time = time_of(blocks, array, request.fidelity, core_cycles);
  result.render = machine.report("render", lists.tiles(), bytes,
                                 {{sm_part, least.issue},
                                  {"longest tile", least.longest_block},
                                  {memory_part, machine.memory_cycles(bytes)}},
                                 timing.launch_microseconds, time);
  add_instructions(blocks, result.render);
  if (result.render.cycles) result.render.core_cycles = core_cycles;

  if (request.fidelity != Fidelity::functional) {
    result.cycles = *result.render.cycles + (result.preprocess ? *result.preprocess->cycles : 0);
    for (const KernelReport& kernel : result.binning) *result.cycles += *kernel.cycles;
  }
  result.host_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  StatisticCollector statistics;
  statistics.add(binning_name, binning_name, lists_by->unit());
  statistics.add(render_name, render_name, tiles_by->unit());
  result.statistics = statistics.reports();
  tiles_by->unit().add_to(result.counts, CountOf());
  result.result_hash = hash_of(result.statistics, result.cycles, result.framebuffer.color);
  for (const ChosenKernel* kernel : {&preparation, &binning, &render}) {
    const Implementation& implementation = *kernel->implementation;
    result.implementations.emplace_back(implementation.slot, implementation.name);
    kernel->add_parameters_to(result.parameters);
    result.as_shipped = result.as_shipped && kernel->is_as_shipped();
  }
  return result;
}

HardwarePreparation prepare_for_hardware(const RunRequest& request, const Frame& frame,
                                         std::optional<std::uint64_t> gaussians) {
  const ChosenKernel preparation = choose_kernel(preparation_name, request);
  const SoftwareMachine machine(request, frame);
  HardwarePreparation prepared;
  if (gaussians) {
    prepared.preprocess = preprocess_by(preparation, machine, PreparationBehaviour::Path::hardware, *gaussians);
  }
  const auto unit = preparation.make<PreparationBehaviour>(machine.context());
  const KernelWork work = preparation.call("sort_by_depth", [&] { return unit->sort_by_depth(frame.splats()); });
  prepared.sort = machine.report(checked(preparation, work));
  return prepared;
}

}  // namespace vrpipe
