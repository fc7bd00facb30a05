#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>

#include "jobs/energy_table.h"
#include "jobs/journal.h"
#include "jobs/simulation_job.h"
#include "jobs/study.h"

namespace vrpipe::tools {

/// The points I, I + N, I + 2 N, ... of a study, for batch systems.
struct Shard {
  std::size_t index = 1, count = 1;  ///< index from 1

  bool has(std::size_t point) const { return point % count == index - 1; }
};

using GivenOptions = std::vector<std::pair<std::string, std::vector<std::string>>>;

/// What a sweep is asked for.
struct SweepJob {
  SimulationJob common;  ///< what all points share; of `requests` there is one
  Study study;
  std::filesystem::path study_file;
  std::optional<Shard> shard;
  std::optional<std::filesystem::path> journal;  ///< none: one in the user's cache folder
  std::optional<std::filesystem::path> csv, jsonl, html;

  /// What the command line and the study say of options, by name without dashes, of which results depend.
  GivenOptions options;

  static constexpr const char* journal_option = "--journal";
};

/// A scene as a point drew it.
struct DrawnScene {
  std::string name;  ///< SceneSummary::name
  std::uint64_t gaussians_total = 0, gaussians_visible = 0;
  std::uint32_t width = 0, height = 0;  ///< pixels
};

/// What came of a point, without what the host made of it: the same however it was run.
struct PointOutcome {
  std::string fault;                ///< by which its simulation ended: then there is nothing else; else empty
  RunResult run;                    ///< without units, statistics, effects and draws
  std::optional<Range> energy;      ///< mJ; none without time
  std::uint64_t storage_bytes = 0;  ///< of TGC and QRU; 0 in variants without quad merging
  std::vector<std::optional<double>>
      columns;             ///< of Study::columns; none where the point has no such statistic, or no value
  double cpu_seconds = 0;  ///< of whoever ran it; in no result
  DrawnScene drawn;
};

struct SweepResult {
  Provenance provenance;
  GivenOptions options;
  /// For each platform and variant of the study a request without other axes, and the parameters of its first point.
  std::vector<RunResult> machines;
  std::vector<Setting> preprocessing;  ///< what --set changed of it
  std::uint32_t passes = 1;            ///< of points without such an axis
  Study study;
  std::vector<std::optional<PointOutcome>> points;  ///< by point of the study; none of other shards
  std::size_t done_before = 0;
  unsigned processes = 1;
  double seconds = 0;                ///< wall time of the simulations of this run
  std::shared_ptr<Journal> journal;  ///< to be finished when the results are safe; null where `is_elsewhere`
  bool is_elsewhere = false;         ///< another process, of those that mpirun started, has the results
};

/// A value of the axis `scene`, from where vrpipe runs: names of files are relative to the study's folder.
std::string scene_of_axis(const SweepJob& job, const std::string& value);

/// Takes from points the values of parameters that their units do not have: of these there is one.
void leave_out_absent(SweepJob& job);

/// Makes the reference of each axis what is so without the study, where the axis has it: the baseline, the platform's own
/// value of a parameter, the format and termination of the other options.
void choose_references(SweepJob& job);

/// The request of a point. Throws UserError for what does not exist, and for a parameter that the point's variant sets
/// itself: its axis would change nothing.
RunRequest request_of(const SweepJob& job, const StudiedPoint& point);

/// Simulates what is not done yet, in processes of their own; a record is in the journal as soon as a point is done. Takes
/// in the records of all shards. Started by mpirun, the ranks of a machine are as many processes of its first, which sends
/// what is done to the first of all. Warns on stderr of a study that will take more than an hour.
/// A point whose simulation ends in a fault has an outcome that says so, and is not simulated again.
/// Throws UserError, CommandFailure or a fault.
SweepResult run_sweep(const SweepJob& job);

}  // namespace vrpipe::tools
