#include "jobs/frame_energy.h"

#include <algorithm>
#include <string>

namespace vrpipe::tools {
FrameEnergies::FrameEnergies(const EnergyTable& table, const RunResult& draw, const HardwarePreparation& hardware)
    : table_(table), machine_(draw) {
  hardware_ = of_draw(draw, hardware);
}

std::optional<Range> FrameEnergies::total(const EnergyAmounts& amounts) const {
  const bool is_known =
      amounts.missing.empty() && powers_of_other_platforms(table_, *machine_.request.platform).empty();
  return is_known ? energy_report(amounts, table_).total : std::nullopt;
}

FrameEnergy FrameEnergies::of_parts(const std::optional<EnergyAmounts>& preprocess, const EnergyAmounts& sort,
                                    const EnergyAmounts& raster) const {
  FrameEnergy energy;
  EnergyAmounts all = sort;
  all += raster;
  if (preprocess) {
    all += *preprocess;
    energy.preprocess = total(*preprocess);
  }
  energy.sort = total(sort);
  energy.raster = total(raster);
  energy.frame = total(all);
  energy.amounts = all;
  if (energy.frame && hardware_.frame) energy.over_hardware = energy_ratio(all, *hardware_.amounts, table_);
  return energy;
}

FrameEnergy FrameEnergies::of_software(const SoftwareResult& result) const {
  std::optional<EnergyAmounts> preprocess;
  if (result.preprocess) preprocess = of_kernel(*result.preprocess);
  EnergyAmounts raster = of_kernel(result.render);
  if (const StatisticReport* const blended = statistic_named(result.statistics, "render.lanes_blending"))
    raster.fragments_blended = blended->value;
  return of_parts(preprocess, energy_amounts(result.binning, machine_, table_), raster);
}

FrameEnergy FrameEnergies::of_draw(const RunResult& draw, const HardwarePreparation& prepared) const {
  std::optional<EnergyAmounts> preprocess;
  if (prepared.preprocess) preprocess = of_kernel(*prepared.preprocess);
  return of_parts(preprocess, of_kernel(prepared.sort), energy_amounts(draw, table_));
}

FrameEnergy FrameEnergies::of_accelerator(const AcceleratorResult& result) const {
  FrameEnergy energy;
  std::vector<KernelReport> stages{result.sort, result.raster};
  if (result.preprocess) stages.push_back(*result.preprocess);
  std::optional<double> milliseconds;
  if (result.cycles) milliseconds = static_cast<double>(*result.cycles) / (result.frequency_mhz * 1e3);
  const EnergyAmounts amounts = accelerator_amounts(stages, result.parameters, milliseconds, table_);
  if (!amounts.is_known) return energy;
  const Range frame = *energy_report(amounts, table_).total;
  energy.frame = frame;
  if (const std::optional<Range>& over = hardware_.frame; over && over->low > 0) {
    energy.over_hardware = Range{frame.low / over->high, frame.nominal / over->nominal, frame.high / over->low};
  }
  return energy;
}

}  // namespace vrpipe::tools
