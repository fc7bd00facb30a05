#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/accelerator.h>
#include <vrpipe/platforms/software.h>

#include "image/picture.h"
#include "jobs/frame_energy.h"
#include "jobs/simulation_job.h"
#include "jobs/views_job.h"

namespace vrpipe::tools {

/// One way to draw a whole frame.
struct FramePath {
  std::string path;  ///< software, hardware, multi-pass, in-shader, vr-pipe, imitation, accelerator
  std::string name;  ///< of the render kernel, the variant, the passes, the lock or the accelerator
  Fidelity fidelity = Fidelity::functional;  ///< of an accelerator `lt` where `cycle` was asked for
  // Simulated milliseconds; none where the fidelity has no time.
  std::optional<double> preprocess;  ///< and of a draw list
  std::optional<double> sort;        ///< all that orders
  std::optional<double> raster;
  std::optional<double> frame;  ///< the sum; of an accelerator, whose stages overlap, less
  /// Least from frame to frame where several are in flight, the next one prepared beside this one's draw: the longest that a frame
  /// takes of what all of them share, the SM array, the memory and the graphics pipeline, or stages of an accelerator.
  std::optional<double> interval;
  FrameEnergy energy;
  std::vector<std::pair<std::string, std::uint64_t>>
      bytes;                                     ///< to and from memory, by kernel or stage; of a draw, DRAM's
  std::string bound_by;                          ///< the longest part, and what bounds that; empty without time
  std::optional<double> expected_error_percent;  ///< of the frame's time against a GPU; none where unknown
  std::vector<std::pair<std::string, std::uint64_t>> counts;
  std::vector<KernelReport> kernels;                                 ///< and stages, in order, the draw left out
  std::vector<std::pair<std::string, std::string>> implementations;  ///< of kernels
  std::vector<std::pair<std::string, std::string>> parameters;       ///< and what they are set to
  std::string result_hash;
  std::optional<ImageFiles> images;  ///< none where they could not be written, or were not asked for
  double host_seconds = 0;

  std::string label() const { return path + " (" + name + ")"; }
  /// None where nothing is counted by this name.
  std::optional<std::uint64_t> count(const std::string& of) const;
};

double milliseconds_of(std::uint64_t cycles, double frequency_mhz);
/// Of a frame in software, and by an accelerator; without energy and images.
FramePath software_path(const SoftwareResult& result);
FramePath accelerator_path(const AcceleratorResult& result);

/// Of the path `imitation` (Imitation).
struct ImitationReport {
  double paired_quads = 0, discarded_quads = 0;
  std::uint64_t pixels_short = 0;
  std::optional<Range> efficiency;  ///< imitated_efficiency(), of the draws alone; none where energy is not known
};

struct FramesResult {
  Provenance provenance;
  SceneSummary scene;
  std::optional<Viewpoint> viewpoint;  ///< none for draw lists
  std::vector<Setting> preprocessing;
  std::uint32_t width = 0, height = 0;
  unsigned processes = 1;
  std::vector<FramePath> paths;
  std::optional<ImitationReport> imitation;
  std::string process;            ///< for which the GPU's energies hold
  std::string energy_leaves_out;  ///< of the GPU's, e.g. "idle power"; empty: nothing
  std::vector<RunResult> runs;    ///< the draws by hardware
  // For the page, none where it was not asked for: the software path by `render=endless`, unless that is what was asked for; and
  // the path `in-shader` without a lock.
  std::optional<FramePath> without_termination, without_lock;
  std::vector<Picture> pictures;  ///< one for each path, over the background; for the page
  ResultFiles files;              ///< written so far: images
};

/// Frames of one scene from many cameras.
struct FrameViewsResult {
  std::optional<std::string> camera_file;  ///< none: an orbit
  std::size_t cameras = 0;                 ///< in the file, or on the orbit
  std::vector<std::size_t> indices;        ///< of the views, among these
  std::vector<FramesResult> views;
};

/// Draws the frame of a job in software, by hardware and by an accelerator: of its requests `baseline` is the path `hardware`,
/// in several passes `multi-pass`, with a shader that blends `in-shader`, `het+qm` `vr-pipe`. Throws UserError, CommandFailure or a fault.
FramesResult perform_frames(const SimulationJob& job);

/// The same of many cameras, one after the other; images of a view are in a folder of its own.
FrameViewsResult perform_frame_views(const SimulationJob& job, const ViewsChoice& choice);

/// Over the views, of a path: milliseconds of a frame, and these over the path `hardware`. None without time.
std::optional<Distribution> frame_distribution(const FrameViewsResult& result, std::size_t path);
std::optional<Distribution> over_hardware_distribution(const FrameViewsResult& result, std::size_t path);

}  // namespace vrpipe::tools
