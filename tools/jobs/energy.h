#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/platforms/software.h>

#include "jobs/energy_table.h"

namespace vrpipe::tools {

/// What a run, a kernel or several of them have of everything in a table; all that their energy depends on.
struct EnergyAmounts {
  std::size_t process = 0;        ///< in EnergyTable::processes
  std::vector<double> events;     ///< how often, by EnergyTable::events
  std::vector<double> powers;     ///< how many, in the mean over the time, by EnergyTable::powers
  std::optional<double> seconds;  ///< simulated; none where the fidelity has no time
  double own_millijoules = 0;     ///< of an accelerator, by its published power, beside all of the table
  bool is_known = true;           ///< false: nobody knows what was spent
  std::uint64_t fragments_blended = 0;
  std::vector<std::string> not_counted;  ///< "UNIT: NAME" of events and powers of which the run has no counter
  /// What units of one's own do not say of themselves, e.g. "qru.pairs of qru=mine", or active cycles that a fidelity does not
  /// have: what was spent is more, by nobody knows how much.
  std::vector<std::string> missing;

  /// One after the other, on the same platform.
  EnergyAmounts& operator+=(const EnergyAmounts& next);
};

/// A unit that passes items through has no events. What draws in software spends what its kernels do, an accelerator its
/// published power and the bytes of its DRAM; without that power nothing is known.
EnergyAmounts energy_amounts(const RunResult& run, const EnergyTable& table);

/// Of a kernel of a frame, on the platform of a run: what there is of it is the run's.
EnergyAmounts energy_amounts(const KernelReport& kernel, const RunResult& machine, const EnergyTable& table);

/// Of kernels one after the other, of which there are some.
EnergyAmounts energy_amounts(const std::vector<KernelReport>& kernels, const RunResult& machine,
                             const EnergyTable& table);

/// Of so many bytes to and from a DRAM, of whomever; no time.
EnergyAmounts energy_amounts_of_dram(std::uint64_t bytes, const EnergyTable& table);

/// Of an accelerator: its published power over its time, and what its stages move to and from its DRAM.
/// @param parameters  its own, among them that power
EnergyAmounts accelerator_amounts(const std::vector<KernelReport>& stages,
                                  const std::vector<std::pair<std::string, std::string>>& parameters,
                                  const std::optional<double>& milliseconds, const EnergyTable& table);

struct UnitEnergy {
  std::string unit;
  Range millijoules;
};

/// Ranges are over every combination of the events' own; what needs the time is none without.
struct EnergyReport {
  std::vector<UnitEnergy> units;                 ///< in the order in which the table names them first
  Range moving;                                  ///< of all units, mJ
  std::optional<Range> constant;                 ///< of constant power, mJ
  std::optional<Range> total;                    ///< mJ
  std::optional<Range> watts;                    ///< mean of the total; none where nothing took time
  std::optional<Range> picojoules_per_fragment;  ///< the total for each blended; none of none
  std::optional<Range> quad_merging_share;       ///< of the units TGC and QRU, of the total; none of a part of it
};

EnergyReport energy_report(const EnergyAmounts& amounts, const EnergyTable& table);

/// Total of `baseline` over that of `run`, as a speed-up is of cycles; none without time, where the baseline blends nothing,
/// or where the least that may have been spent is nothing. Both have the same energies and powers, whatever these are: low
/// and high are the extremes over all that they may be. None where either misses something, or they are made in two
/// processes.
std::optional<Range> energy_ratio(const EnergyAmounts& baseline, const EnergyAmounts& run, const EnergyTable& table);

/// Powers that the platform takes, though the table says that they were found for others.
std::vector<std::string> powers_of_other_platforms(const EnergyTable& table, const Platform& platform);

}  // namespace vrpipe::tools
