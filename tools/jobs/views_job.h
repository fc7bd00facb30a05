#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/scene.h>

#include "jobs/distribution.h"
#include "jobs/journal.h"
#include "jobs/simulation_job.h"

namespace vrpipe::tools {

/// What --views and --journal say.
struct ViewsChoice {
  std::optional<std::size_t> count;              ///< none: all cameras of the file
  std::optional<std::filesystem::path> journal;  ///< file; none: one in the user's cache folder

  static constexpr const char* option = "--views";
  static constexpr const char* journal_option = "--journal";
};

/// A camera that the scene is drawn with, and what came of it.
struct ViewResult {
  std::size_t index = 0;  ///< in its file, or on the orbit
  Viewpoint viewpoint;
  SceneSummary scene;           ///< without name
  std::vector<RunResult> runs;  ///< of each variant; without statistics, units, effects and draws
  std::vector<std::optional<ImageFiles>> images;
};

/// What reports and JSON are made from.
struct ViewsResult {
  std::string schema;  ///< of the JSON
  Provenance provenance;
  std::string scene;                       ///< as SceneSummary has it
  std::uint64_t gaussians_total = 0;       ///< visible or not
  std::optional<std::string> camera_file;  ///< none: an orbit
  std::size_t cameras = 0;                 ///< in the file, or on the orbit
  std::vector<Setting> preprocessing;      ///< what --set changed of it
  /// `preprocess.NAME` and value of every parameter of preprocessing.
  std::vector<std::pair<std::string, std::string>> preprocess_parameters;
  std::uint32_t passes = 1;       ///< FrameDescription::passes
  std::size_t baseline = 0;       ///< of the runs of a view, over which speed-ups are
  std::vector<ViewResult> views;  ///< by index
  std::size_t done_before = 0;    ///< of the views, in the journal
  unsigned processes = 1;
  double load_seconds = 0;           ///< wall time of reading the scene
  double simulate_seconds = 0;       ///< wall time of all simulations of this run together
  std::shared_ptr<Journal> journal;  ///< to be finished when the results are safe
};

/// Those of a file, or round the view that the scene was opened with. Throws UserError.
std::vector<Viewpoint> all_cameras(const SimulationJob& job, const ViewsChoice& choice, const OpenedScene& scene);

/// The views that are drawn of so many cameras: all, or every n-th, from the first on.
/// Throws UserError when there are fewer cameras, or none.
std::vector<std::size_t> chosen_views(const ViewsChoice& choice, std::size_t cameras, const std::string& file);

/// The folder of a view's images in that of --output: its index, with as many digits as the last camera's.
std::string view_folder(std::size_t index, std::size_t cameras);

/// Draws a scene from many cameras, those of a file or of an orbit, and simulates all variants of each view, in processes
/// of their own. At any time the draws of one view more than there are processes are in memory. What is done is in the
/// journal at once; how much of it was done before is said on stderr. Throws UserError, CommandFailure or a fault.
ViewsResult simulate_views(const SimulationJob& job, const ViewsChoice& choice);

/// Over the views: of the speed-ups of a variant, and of early-termination ratios. None where no view has one.
std::optional<Distribution> speedup_distribution(const ViewsResult& result, std::size_t variant);
std::optional<Distribution> ratio_distribution(const ViewsResult& result);

}  // namespace vrpipe::tools
