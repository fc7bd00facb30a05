#pragma once

#include <optional>
#include <vector>

#include <vrpipe/platforms/accelerator.h>
#include <vrpipe/platforms/software.h>

#include "jobs/energy.h"

namespace vrpipe::tools {

/// mJ of a whole frame and of its parts. None of it is known without time, on a platform of which the table has no powers, or
/// where a unit does not count what it spends.
struct FrameEnergy {
  std::optional<Range> preprocess, sort, raster;  ///< of an accelerator, whose stages overlap, none
  std::optional<Range> frame;
  std::optional<Range> over_hardware;    ///< the frame's over the hardware path's; the same figures in both
  std::optional<EnergyAmounts> amounts;  ///< none of an accelerator, whose figures are its own
};

/// What frames spend on one platform, all by one table.
class FrameEnergies {
 public:
  /// @param hardware  whose draw it is; both outlive this
  FrameEnergies(const EnergyTable& table, const RunResult& draw, const HardwarePreparation& hardware);

  FrameEnergy of_software(const SoftwareResult& result) const;
  FrameEnergy of_draw(const RunResult& draw, const HardwarePreparation& prepared) const;
  /// Its published power over the frame's time, and the bytes of its DRAM by the table's.
  FrameEnergy of_accelerator(const AcceleratorResult& result) const;

 private:
  EnergyAmounts of_kernel(const KernelReport& kernel) const { return energy_amounts(kernel, machine_, table_); }
  FrameEnergy of_parts(const std::optional<EnergyAmounts>& preprocess, const EnergyAmounts& sort,
                       const EnergyAmounts& raster) const;
  std::optional<Range> total(const EnergyAmounts& amounts) const;

  const EnergyTable& table_;
  const RunResult& machine_;
  FrameEnergy hardware_;
};

}  // namespace vrpipe::tools
