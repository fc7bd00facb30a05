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
  EnergyAmounts sort = of_kernel(result.binning.front());
  for (std::size_t i = 1; i < result.binning.size(); ++i) sort += of_kernel(result.binning[i]);
  EnergyAmounts raster = of_kernel(result.render);
  for (const StatisticReport& statistic : result.statistics) {
    if (statistic.name == "render.lanes_blending") raster.fragments_blended = statistic.value;
  }
  return of_parts(preprocess, sort, raster);
}

FrameEnergy FrameEnergies::of_draw(const RunResult& draw, const HardwarePreparation& prepared) const {
  std::optional<EnergyAmounts> preprocess;
  if (prepared.preprocess) preprocess = of_kernel(*prepared.preprocess);
  return of_parts(preprocess, of_kernel(prepared.sort), energy_amounts(draw, table_));
}

FrameEnergy FrameEnergies::of_accelerator(const AcceleratorResult& result) const {
  FrameEnergy energy;
  const std::optional<double> watts = published_watts(result.parameters);
  if (!watts || !result.cycles) return energy;
  std::uint64_t bytes = result.sort.bytes + result.raster.bytes;
  if (result.preprocess) bytes += result.preprocess->bytes;
  Range frame = energy_report(energy_amounts_of_dram(bytes, table_), table_).moving;
  const double milliseconds = static_cast<double>(*result.cycles) / (result.frequency_mhz * 1e3);
  const double of_units = *watts * milliseconds;
  frame += {of_units, of_units, of_units};
  energy.frame = frame;
  if (const std::optional<Range>& over = hardware_.frame; over && over->low > 0) {
    energy.over_hardware = Range{frame.low / over->high, frame.nominal / over->nominal, frame.high / over->low};
  }
  return energy;
}

}  // namespace vrpipe::tools
