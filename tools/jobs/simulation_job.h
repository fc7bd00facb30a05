#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/scene.h>

#include "host/output_file.h"
#include "host/provenance.h"
#include "jobs/effect_costs.h"
#include "jobs/energy_table.h"
#include "jobs/event_log.h"
#include "jobs/frame_file.h"
#include "jobs/heat_maps.h"
#include "jobs/loaded_frame.h"
#include "jobs/page_material.h"
#include "jobs/trace.h"

namespace vrpipe::tools {

/// Everything that `run` or `compare` is asked to do, checked as far as that is possible without reading scenes.
struct SimulationJob {
  std::string schema;  ///< of the JSON of `run` or `compare`
  Provenance provenance;
  SceneRequest scene;                    ///< --scene, and how scenes are looked at
  FrameDescription frame;                ///< of --frame, or --scene as its one draw
  std::vector<RunRequest> requests;      ///< one for each platform and variant, alike in everything else
  std::size_t baseline = 0;              ///< of `requests`, over which speed-ups are
  std::vector<Setting> kernel_settings;  ///< of --set, and of --unit, what is for kernels: in no request
  std::vector<UnitChoice> kernel_units;
  /// SLOT.PARAMETER and value of every parameter of kernels; empty where none are asked for.
  std::vector<std::pair<std::string, std::string>> kernel_parameters;
  std::vector<Setting> preprocessing;  ///< of --set, for the report; `scene` has them
  /// `preprocess.NAME` and value of every parameter of preprocessing.
  std::vector<std::pair<std::string, std::string>> preprocess_parameters;
  std::array<float, 3> background{};
  std::vector<NamedFile> inputs;                      ///< that the options name; outputs must not be among them
  std::optional<std::filesystem::path> output;        ///< folder for images
  std::optional<std::string> json;                    ///< file, or "-" for stdout
  std::optional<std::filesystem::path> html;          ///< file of a page
  bool intervals_for_page = false;                    ///< whether requests record intervals for the page alone
  std::optional<std::filesystem::path> save_draw;     ///< file
  std::optional<std::filesystem::path> interval_csv;  ///< file
  std::shared_ptr<Trace> trace;                       ///< of the only request, which has its observers; null for none
  std::shared_ptr<EventLog> log;                      ///< likewise
  bool heat_maps = false;                             ///< beside the images
  bool explain_effects = false;                       ///< measures what each effect that a run omits would cost
  std::shared_ptr<const EnergyTable> energies;        ///< by which energy is reported; null if it is not
  bool imitation = false;                             ///< of `frames`: a path for what the paper measured energy by
  unsigned processes = 1;                             ///< simulations at a time
};

/// The image files of one run.
struct ImageFiles {
  std::string png;
  std::string exr;
};

/// What reports and JSON are made from.
struct JobResult {
  std::string schema;  ///< of the JSON
  Provenance provenance;
  SceneSummary scene;
  std::optional<Viewpoint> viewpoint;  ///< none for draw lists
  std::vector<Setting> preprocessing;  ///< what --set changed of it
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t passes = 1;  ///< FrameDescription::passes
  std::vector<RunResult> runs;
  std::size_t baseline = 0;                       ///< of `runs`, over which speed-ups are
  std::vector<std::optional<ImageFiles>> images;  ///< one for each run; none where they could not be written
  std::vector<EffectCosts> effect_costs;          ///< one for each run, if they were asked for
  std::shared_ptr<const EnergyTable> energies;    ///< SimulationJob::energies
  PageMaterial page;                              ///< empty without SimulationJob::html
  bool intervals_for_page = false;                ///< SimulationJob::intervals_for_page
  unsigned processes = 1;
  double load_seconds = 0;      ///< wall time of reading and preprocessing scenes
  double simulate_seconds = 0;  ///< wall time of all simulations together
  ResultFiles files;            ///< written so far: images, heat maps, the trace and the log
};

/// Name of the images of a run, without folder and extension: SCENE-VARIANT, or SCENE-PLATFORM-VARIANT.
/// @param run  its name_of()
std::string image_name(const std::string& scene, const std::string& run);

/// Checks, before anything is read, that all files that a job will write can be written, and overwrite neither what it
/// reads nor each other.
/// @param images   `image_name` of every image that --output will write
/// @param outputs  other files
/// Throws UserError.
void check_outputs(const SimulationJob& job, const std::vector<std::string>& images,
                   std::vector<NamedFile> outputs = {});

/// Where an image goes.
ImageFiles image_files(const SimulationJob& job, const std::string& name);

/// Writes the draw list of --save-draw, if there is one, of a frame of one scene. Throws UserError.
void save_draw(const SimulationJob& job, const LoadedFrame& frame);

/// Loads what is drawn, simulates, and writes the images and the draw list that the user asked for. One request is
/// simulated in this process, several, and those that measure effects, in processes of their own. Throws UserError, CommandFailure or a fault.
JobResult perform(const SimulationJob& job);

}  // namespace vrpipe::tools
