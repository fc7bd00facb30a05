#include <vrpipe/platforms/accelerator.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>

#include "accelerator/flow.h"
#include "run/chosen_kernel.h"
#include "run/result_hash.h"
#include "run/statistics.h"

#include <vrpipe/component/error.h>
#include <vrpipe/pipeline/slots/accelerator.h>

namespace vrpipe {

namespace {

constexpr const char* accelerator_name = "accelerator";

std::uint64_t whole_cycles(std::uint64_t thousandths) { return (thousandths + 999) / 1000; }

void check_accelerator_timing(const ChosenKernel& unit, const AcceleratorBehaviour::TimingParameters& timing) {
  const bool has_names =
      std::all_of(timing.units.begin(), timing.units.end(), [](const char* each) { return each != nullptr; });
  if (timing.frequency_mhz == 0 || timing.memory_mb_per_second == 0 || timing.buffers == 0 || !has_names) {
    unit.fail("no clock, no memory, no buffers or no names in its timing");
  }
}

/// That time fits into 64 bits, whatever a unit and its parameters make of a frame.
void check_accelerator_steps(const ChosenKernel& unit, const std::vector<AcceleratorStep>& steps,
                             const AcceleratorBehaviour::TimingParameters& timing) {
  constexpr double most = 4e18;  // thousandths of a cycle
  const double of_a_byte = 1000.0 * timing.frequency_mhz / timing.memory_mb_per_second;
  double sum = 0;
  for (const AcceleratorStep& step : steps) {
    for (const AcceleratorStep::Part& part : step.parts) {
      sum += 1000 * static_cast<double>(part.cycles) + of_a_byte * static_cast<double>(part.bytes);
    }
  }
  if (sum < most) return;
  throw UserError("cannot draw by an accelerator", unit.name(), "a frame takes longer than can be told",
                  "take fewer bytes and cycles, or a lower frequency");
}

KernelReport stage_report(const char* name, AcceleratorStage stage, const std::vector<AcceleratorStep>& steps,
                          const AcceleratorBehaviour::TimingParameters& timing, bool has_time) {
  KernelReport report;
  report.name = name;
  std::uint64_t cycles = 0;
  for (const AcceleratorStep& step : steps) {
    report.items += step.of(stage).items;
    report.bytes += step.of(stage).bytes;
    cycles += step.of(stage).cycles;
  }
  if (!has_time) return report;
  const std::uint64_t moving = whole_cycles(AcceleratorFlow(timing).memory_time(report.bytes));
  report.cycles = std::max(cycles, moving);
  report.bound_by = cycles < moving ? "memory" : timing.units[static_cast<std::size_t>(stage)];
  return report;
}

}  // namespace

AcceleratorResult simulate_accelerator(const RunRequest& request, const Frame& frame,
                                       std::optional<std::uint64_t> gaussians) {
  if (request.fidelity == Fidelity::cycle) {
    throw UserError("cannot draw by an accelerator", "fidelity cycle", "it has none of its units",
                    "take functional, bound or lt");
  }
  check_is_of_splats(frame, "cannot draw by an accelerator");
  const ChosenKernel unit = choose_kernel(accelerator_name, request);
  const bool has_time = request.fidelity != Fidelity::functional;
  RenderContext context;
  context.frame = std::make_shared<Frame>(frame);
  AcceleratorResult result;
  result.request = request;
  result.name = unit.implementation->name;
  result.framebuffer = Framebuffer(frame, ColorFormat::rgba32f);
  const auto start = std::chrono::steady_clock::now();

  const auto behaviour = unit.make<AcceleratorBehaviour>(context);
  behaviour->use_surfaces(result.framebuffer);
  const auto timing = unit.call("timing", [&] { return behaviour->timing(); });
  check_accelerator_timing(unit, timing);
  const std::vector<AcceleratorStep> steps = unit.call("draw", [&] { return behaviour->draw(gaussians); });
  check_accelerator_steps(unit, steps, timing);
  behaviour->check_end();

  result.frequency_mhz = timing.frequency_mhz;
  if (gaussians) result.preprocess = stage_report("preprocess", AcceleratorStage::conversion, steps, timing, has_time);
  result.sort = stage_report("sort", AcceleratorStage::sorting, steps, timing, has_time);
  result.raster = stage_report("raster", AcceleratorStage::rendering, steps, timing, has_time);
  if (has_time) {
    const AcceleratorFlow flow(timing);
    result.cycles = whole_cycles(request.fidelity == Fidelity::bound ? flow.bound(steps) : flow.end(steps));
    std::uint64_t bytes = 0, longest = 0;
    for (const KernelReport* stage :
         {result.preprocess ? &*result.preprocess : nullptr, &result.sort, &result.raster}) {
      if (stage == nullptr) continue;
      bytes += stage->bytes;
      if (*stage->cycles < longest) continue;
      longest = *stage->cycles;
      result.bound_by = stage->name + ": " + stage->bound_by;
    }
    const std::uint64_t moving = whole_cycles(flow.memory_time(bytes));
    if (moving > longest) result.bound_by = "memory";
    result.interval_cycles = std::max(longest, moving);
  }
  result.host_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  StatisticCollector statistics;
  statistics.add(accelerator_name, accelerator_name, behaviour->unit());
  result.statistics = statistics.reports();
  behaviour->unit().add_to(result.counts, CountOf());
  result.result_hash = hash_of(result.statistics, result.cycles, result.framebuffer.color);
  unit.add_parameters_to(result.parameters);
  return result;
}

}  // namespace vrpipe
