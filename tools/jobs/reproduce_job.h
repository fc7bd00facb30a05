#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/scene.h>

#include "host/output_file.h"
#include "host/progress_line.h"
#include "host/provenance.h"
#include "jobs/energy.h"
#include "jobs/heat_map.h"
#include "jobs/journal.h"
#include "jobs/microbench_job.h"
#include "jobs/reproduce_plan.h"
#include "jobs/whole_frame.h"

namespace vrpipe::tools {

/// What `vrpipe reproduce` is asked to do.
struct ReproduceJob {
  ReproduceOptions options;
  Provenance provenance;
  std::optional<ImageSize> size;  ///< of every scene, in place of its own
  std::vector<NamedFile> inputs;
  std::optional<std::string> json;                      ///< file, or "-" for stdout
  std::optional<std::filesystem::path> html, markdown;  ///< files
  std::optional<std::filesystem::path> output;          ///< folder for heat maps
  std::optional<std::filesystem::path> journal;         ///< file; none: one in the user's cache folder
  unsigned processes = 1;

  static constexpr const char* journal_option = "--journal";
};

/// What came of a point.
struct PointResult {
  RunResult run;  ///< without statistics, units, effects, draws and pixels
  std::uint64_t gaussians_total = 0, gaussians_visible = 0;
  std::uint64_t fragments_of_back_quads = 0;  ///< sm.fragments_of_back_quads
  std::uint64_t fragments_blended_late = 0;   ///< crop.fragments_blended_late
  std::uint32_t width = 0, height = 0;        ///< pixels
  std::optional<HeatMap> map;
  std::optional<EnergyAmounts> energy;  ///< by shipped_energies(); of points that have time, at the default settings
};

struct ReproduceResult {
  ReproducePlan plan;
  std::vector<PointResult> points;  ///< of each point of the plan
  std::vector<std::optional<WholeFrame>>
      frames;  ///< of each scene of the plan; of the six alone, and of none in a quick look
  std::vector<MicrobenchResult> microbenches;  ///< in the order of microbench_names(), without curves
  Provenance provenance;
  std::size_t done_before = 0;  ///< of the points, in the journal
  double seconds = 0;           ///< wall time of all simulations of this run together
  double cpu_seconds = 0;       ///< and their processor time, whole frames and microbenchmarks left out
  unsigned processes = 1;
  std::shared_ptr<Journal> journal;  ///< to be finished when the results are safe

  /// Throws std::logic_error for one that is not in the plan.
  const PointResult& at(const PointKey& key) const;
};

/// Simulates all points, in processes of their own. What is done is in the journal at once; how much of it was done before
/// is said on stderr. Throws UserError, CommandFailure or a fault.
ReproduceResult simulate_reproduction(const ReproduceJob& job, ProgressLine& progress);

}  // namespace vrpipe::tools
