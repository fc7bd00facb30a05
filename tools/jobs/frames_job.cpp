#include "jobs/frames_job.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

#include "host/output_file.h"
#include "host/progress_line.h"
#include "host/stdout_to_stderr.h"
#include "image/images.h"
#include "jobs/imitation.h"
#include "jobs/loaded_frame.h"
#include "jobs/microbench_job.h"
#include "jobs/page_material.h"
#include "jobs/processes.h"

namespace vrpipe::tools {
namespace {

namespace fs = std::filesystem;

// What frames were found to be off, with the shipped units: on a real GPU in software (docs/software.md), drawn as they are, in
// their order, and by a shader that blends under a lock (docs/silicon.md); by an accelerator of which a frame is published
// (docs/accelerator.md).
constexpr double software_error_percent = 4, hardware_error_percent = 5, in_shader_error_percent = 6;
constexpr double accelerator_error_percent = 100;

bool is_as_shipped(const RunRequest& request) { return request.settings.empty() && request.units.empty(); }

/// A part of a frame, and what bounds it.
struct Part {
  std::string name;
  std::optional<double> milliseconds;
  std::string bound_by;
};

std::string longest(const std::vector<Part>& parts) {
  const auto found = std::max_element(parts.begin(), parts.end(), [](const Part& a, const Part& b) {
    return a.milliseconds.value_or(-1) < b.milliseconds.value_or(-1);
  });
  return found->milliseconds ? found->name + ": " + found->bound_by : "";
}

std::optional<double> sum(const std::vector<std::optional<double>>& values) {
  double all = 0;
  bool any = false;
  for (const std::optional<double>& value : values) {
    all += value.value_or(0);
    any = any || value;
  }
  return any ? std::optional(all) : std::nullopt;
}

/// A draw by hardware.
struct HardwareDraw {
  std::string path, variant, name;
};

/// With the kernels that the job says.
RunRequest with_kernels(RunRequest request, const SimulationJob& job) {
  request.settings.insert(request.settings.end(), job.kernel_settings.begin(), job.kernel_settings.end());
  request.units.insert(request.units.end(), job.kernel_units.begin(), job.kernel_units.end());
  return request;
}

std::optional<ImageFiles> write_image(const SimulationJob& job, const std::string& name, const SharedImage& image,
                                      ResultFiles& written) {
  const ImageFiles files = image_files(job, name);
  const bool has_png = written.write(files.png, encode_png(image, job.background), "--output");
  const bool has_exr = written.write(files.exr, encode_exr(image), "--output");
  return has_png && has_exr ? std::optional(files) : std::nullopt;
}

class PathMaker {
 public:
  explicit PathMaker(double frequency_mhz) : frequency_mhz_(frequency_mhz) {}

  FramePath of_software(const SoftwareResult& result) const {
    FramePath path = begin("software", result.implementations.back().second, result.request.fidelity);
    std::vector<Part> parts;
    std::vector<std::optional<double>> sorting;
    if (result.preprocess) path.preprocess = add(*result.preprocess, path, parts);
    for (const KernelReport& kernel : result.binning) sorting.push_back(add(kernel, path, parts));
    path.sort = sum(sorting);
    path.raster = add(result.render, path, parts);
    path.frame = sum({path.preprocess, path.sort, path.raster});
    if (path.frame) path.interval = longest_of_shared(path, 0, 0);
    path.bound_by = longest(parts);
    const bool is_as_measured = result.request.platform->name == measured_platform &&
                                result.request.fidelity >= Fidelity::lt && result.as_shipped;
    if (is_as_measured) path.expected_error_percent = software_error_percent;
    add_counters(result.statistics, path);
    path.implementations = result.implementations;
    path.parameters = result.parameters;
    path.result_hash = result.result_hash;
    path.host_seconds = result.host_seconds;
    return path;
  }

  FramePath of_hardware(const HardwareDraw& draw, const RunResult& run, const HardwarePreparation& prepared) const {
    FramePath path = begin(draw.path, draw.name, run.request.fidelity);
    std::vector<Part> parts;
    if (prepared.preprocess) path.preprocess = add(*prepared.preprocess, path, parts);
    path.sort = add(prepared.sort, path, parts);
    if (run.cycles) path.raster = run.milliseconds;
    path.frame = sum({path.preprocess, path.sort, path.raster});
    if (run.request.platform->name == measured_platform && run.request.fidelity >= Fidelity::lt &&
        is_as_shipped(run.request)) {
      if (draw.path == "hardware") path.expected_error_percent = hardware_error_percent;
      if (draw.path == "in-shader") path.expected_error_percent = in_shader_error_percent;
    }
    if (path.raster) {
      path.interval = std::max(*path.raster, longest_of_shared(path, *path.raster * utilization_of(run, "sm"),
                                                               *path.raster * utilization_of(run, "dram")));
    }
    parts.push_back({"draw", path.raster, run.bottleneck ? run.bottleneck->unit : "nothing"});
    path.bound_by = longest(parts);
    path.counts = run.counts.named();
    if (const auto moved = memory_bytes_moved(run.statistics, "dram")) path.bytes.emplace_back("draw", *moved);
    path.result_hash = run.result_hash;
    path.host_seconds = run.host_seconds;
    return path;
  }

  /// Its cycles are of a clock of its own.
  static FramePath of_accelerator(const AcceleratorResult& result) {
    const PathMaker of_its_clock(result.frequency_mhz);
    FramePath path = begin("accelerator", result.name, result.request.fidelity);
    std::vector<Part> stages;
    if (result.preprocess) path.preprocess = of_its_clock.add(*result.preprocess, path, stages);
    path.sort = of_its_clock.add(result.sort, path, stages);
    path.raster = of_its_clock.add(result.raster, path, stages);
    if (result.cycles) path.frame = milliseconds_of(*result.cycles, result.frequency_mhz);
    if (result.name == "gscore" && result.request.fidelity == Fidelity::lt && is_as_shipped(result.request))
      path.expected_error_percent = accelerator_error_percent;
    if (result.interval_cycles) path.interval = milliseconds_of(*result.interval_cycles, result.frequency_mhz);
    path.bound_by = result.bound_by;
    add_counters(result.statistics, path);
    path.implementations = {{"accelerator", result.name}};
    path.parameters = result.parameters;
    path.result_hash = result.result_hash;
    path.host_seconds = result.host_seconds;
    return path;
  }

 private:
  static FramePath begin(const std::string& path, const std::string& name, Fidelity fidelity) {
    FramePath begun;
    begun.path = path;
    begun.name = name;
    begun.fidelity = fidelity;
    return begun;
  }
  static void add_counters(const std::vector<StatisticReport>& statistics, FramePath& path) {
    for (const StatisticReport& statistic : statistics) {
      if (statistic.kind == "counter")
        path.counts.emplace_back(statistic.name.substr(statistic.name.find('.') + 1), statistic.value);
    }
  }
  /// Its milliseconds.
  std::optional<double> add(const KernelReport& kernel, FramePath& path, std::vector<Part>& parts) const {
    std::optional<double> milliseconds;
    if (kernel.cycles) milliseconds = milliseconds_of(*kernel.cycles, frequency_mhz_);
    parts.push_back({kernel.name, milliseconds, kernel.bound_by});
    path.bytes.emplace_back(kernel.name, kernel.bytes);
    path.kernels.push_back(kernel);
    return milliseconds;
  }
  static double utilization_of(const RunResult& run, const char* slot) {
    for (const auto& [name, share] : run.utilization) {
      if (name == slot) return share;
    }
    return 0;
  }
  /// Milliseconds of the SM array or of the memory, whichever a frame takes longer, with what its draw takes of them.
  double longest_of_shared(const FramePath& path, double sm_of_draw, double memory_of_draw) const {
    double sm = sm_of_draw, memory = memory_of_draw;
    for (const KernelReport& kernel : path.kernels) {
      sm += milliseconds_of(kernel.sm_cycles, frequency_mhz_);
      memory += milliseconds_of(kernel.memory_cycles, frequency_mhz_);
    }
    return std::max(sm, memory);
  }
  double frequency_mhz_;
};

/// The draws by hardware of a job.
std::vector<HardwareDraw> hardware_draws(const SimulationJob& job) {
  std::vector<HardwareDraw> draws{{"hardware", "baseline", "baseline"}};
  if (job.frame.passes > 1) draws.push_back({"multi-pass", "baseline", fmt::format("{} passes", job.frame.passes)});
  draws.push_back({"in-shader", "in-shader", "ordered lock"});
  draws.push_back({"vr-pipe", "het+qm", "het+qm"});
  if (job.imitation) draws.push_back({"imitation", "baseline", "stencil, shuffles"});
  return draws;
}

/// Names of the images of all paths, in their order.
std::vector<std::string> path_images(const SimulationJob& job, const fs::path& folder) {
  std::vector<std::string> names{"software"};
  for (const HardwareDraw& draw : hardware_draws(job)) names.push_back(draw.path);
  names.emplace_back("accelerator");
  for (std::string& name : names) name = (folder / image_name(job.frame.name, name)).string();
  return names;
}

/// Draws what was loaded on every path.
/// @param folder  of its images, in that of --output
FramesResult frames_of(const SimulationJob& job, const LoadedFrame& loaded, const fs::path& folder,
                       ProgressLine& progress) {
  std::vector<HardwareDraw> draws = hardware_draws(job);
  const std::size_t paths = draws.size();
  if (job.html) draws.push_back({"in-shader", "in-shader-no-lock", "no lock"});
  FramesResult result;
  result.provenance = job.provenance;
  result.preprocessing = job.preprocessing;
  result.processes = job.processes;
  if (!loaded.meshes.front().empty()) {
    throw UserError("cannot render in software", job.frame.name, "the scene has meshes, and software renders splats",
                    "take a scene without meshes");
  }
  result.scene = loaded.summary;
  result.viewpoint = loaded.viewpoint;
  result.width = loaded.width;
  result.height = loaded.height;
  std::optional<std::uint64_t> gaussians;
  if (loaded.preprocessed_here) gaussians = loaded.summary.gaussians_total;

  std::vector<RunRequest> requests;
  for (const HardwareDraw& draw : draws) {
    const auto found = std::find_if(job.requests.begin(), job.requests.end(),
                                    [&](const RunRequest& each) { return each.variant.name == draw.variant; });
    requests.push_back(found != job.requests.end() ? *found : job.requests.front());
    requests.back().variant = variant_named(draw.variant);
    requests.back().name = draw.path;
    requests.back().reads_statistics = true;
  }
  FrameDescription in_one_pass = job.frame;
  in_one_pass.passes = 1;
  const auto place_of = [&](const char* path) {
    return static_cast<std::size_t>(
        std::find_if(draws.begin(), draws.end(), [&](const HardwareDraw& draw) { return draw.path == path; }) -
        draws.begin());
  };
  std::optional<Imitation> imitation;
  const auto frame_of = [&](const RunRequest& request) {
    if (request.name == "imitation") return imitation->frame;
    return make_frame(request, request.name == "multi-pass" ? job.frame : in_one_pass, loaded);
  };
  if (job.imitation) {
    progress.show("counting what is imitated");
    const DrawState state = frame_of(requests.front())->draws().front().state;
    imitation = imitation_of(requests.front(), loaded.geometry.front(), state);
    RunRequest& request = requests[place_of("imitation")];
    imitation->request.name = request.name;
    request = imitation->request;
    progress.erase();
  }
  if (job.output) create_output_folder(*job.output / folder, "--output");
  std::vector<Simulated> simulated =
      simulate_in_processes(requests, frame_of, job.output || job.html, job.processes, progress);

  const PathMaker make(requests.front().platform->frequency_mhz);
  RunRequest request = with_kernels(requests.front(), job);
  const std::shared_ptr<const Frame> frame = frame_of(requests.front());
  const StdoutToStderr redirected;  // units of plugins may print
  progress.show("rendering in software");
  const SoftwareResult software = simulate_software(request, *frame, gaussians);
  result.paths.push_back(make.of_software(software));
  if (job.html && software.implementations.back().second != "endless") {
    RunRequest endless = request;
    endless.units.push_back({"render", "endless"});
    result.without_termination = make.of_software(simulate_software(endless, *frame, gaussians));
  }
  const HardwarePreparation prepared = prepare_for_hardware(request, *frame, gaussians);
  const EnergyTable& table = job.energies ? *job.energies : shipped_energies();
  const FrameEnergies energies(table, simulated.front().result, prepared);
  result.paths.back().energy = energies.of_software(software);
  for (std::size_t i = 0; i < draws.size(); ++i) {
    FramePath path = make.of_hardware(draws[i], simulated[i].result, prepared);
    path.energy = energies.of_draw(simulated[i].result, prepared);
    if (i < paths) {
      result.paths.push_back(std::move(path));
    } else {
      result.without_lock = std::move(path);
    }
  }
  if (imitation) {
    const std::size_t place = place_of("imitation");
    const RunResult &baseline = simulated.front().result, &imitated = simulated[place].result;
    const bool is_known = result.paths[place + 1].energy.frame.has_value();  // software is the first path
    result.imitation = {imitation->paired_quads, imitation->discarded_quads, imitation->pixels_short,
                        is_known ? imitated_efficiency(baseline, imitated, table) : std::nullopt};
  }
  simulated.resize(paths);
  const GpuProcess& process = table.processes[table.process_of(request.platform->name)];
  result.process = process.name;
  result.energy_leaves_out = process.leaves_out;
  progress.show("drawing by an accelerator");
  request.fidelity = std::min(request.fidelity, Fidelity::lt);  // its units have no cycles of their own
  const AcceleratorResult accelerator = simulate_accelerator(request, *frame, gaussians);
  result.paths.push_back(PathMaker::of_accelerator(accelerator));
  result.paths.back().energy = energies.of_accelerator(accelerator);
  progress.erase();
  if (job.output || job.html) {
    progress.show("writing images");
    SharedImage in_software(result.width, result.height), by_accelerator(result.width, result.height);
    in_software.copy_from(software.framebuffer.color);
    by_accelerator.copy_from(accelerator.framebuffer.color);
    std::vector<const SharedImage*> drawn{&in_software};
    for (const Simulated& run : simulated) drawn.push_back(&*run.image);
    drawn.push_back(&by_accelerator);
    const std::vector<std::string> images = path_images(job, folder);
    for (std::size_t i = 0; i < result.paths.size(); ++i) {
      if (job.output) result.paths[i].images = write_image(job, images[i], *drawn[i], result.files);
      if (job.html)
        result.pictures.push_back(picture_of(shown(*drawn[i], job.background), PageMaterial::largest_width));
    }
    progress.erase();
  }
  for (Simulated& run : simulated) result.runs.push_back(std::move(run.result));
  return result;
}

std::optional<Distribution> over_views(const FrameViewsResult& result,
                                       const std::function<std::optional<double>(const FramesResult&)>& value) {
  std::vector<std::optional<double>> values;
  for (const FramesResult& view : result.views) values.push_back(value(view));
  return distribution_of(values);
}

}  // namespace

std::optional<std::uint64_t> FramePath::count(const std::string& of) const {
  const auto found = std::find_if(counts.begin(), counts.end(), [&](const auto& each) { return each.first == of; });
  return found == counts.end() ? std::nullopt : std::optional(found->second);
}

double milliseconds_of(std::uint64_t cycles, double frequency_mhz) {
  return static_cast<double>(cycles) / (frequency_mhz * 1000);
}

FramePath software_path(const SoftwareResult& result) {
  return PathMaker(result.request.platform->frequency_mhz).of_software(result);
}

FramePath accelerator_path(const AcceleratorResult& result) { return PathMaker::of_accelerator(result); }

FramesResult perform_frames(const SimulationJob& job) {
  check_outputs(job, path_images(job, ""));
  ProgressLine progress;
  progress.show("loading " + job.frame.name);
  const LoadedFrame loaded = load_frame(job.frame, job.scene);
  progress.erase();
  return frames_of(job, loaded, "", progress);
}

FrameViewsResult perform_frame_views(const SimulationJob& job, const ViewsChoice& choice) {
  FrameViewsResult result;
  ProgressLine progress;
  progress.show("loading " + job.frame.name);
  OpenedScene scene = open_scene(job.scene);
  const std::vector<Viewpoint> cameras = all_cameras(job, choice, scene);
  result.cameras = cameras.size();
  if (job.scene.camera) result.camera_file = camera_choice(*job.scene.camera).file;
  result.indices = chosen_views(choice, cameras.size(), result.camera_file.value_or("the orbit"));
  std::vector<std::string> images;
  for (const std::size_t index : result.indices) {
    const fs::path folder = view_folder(index, cameras.size());
    if (job.output) check_output_folder(*job.output / folder, "--output");
    for (std::string& name : path_images(job, folder)) images.push_back(std::move(name));
  }
  progress.erase();
  check_outputs(job, images);
  for (const std::size_t index : result.indices) {
    progress.show(fmt::format("preparing view {}, {} of {}", index, result.views.size() + 1, result.indices.size()));
    scene.viewpoint = cameras[index];
    const LoadedFrame loaded = load_frame(job.frame, scene, job.scene.preprocess);
    progress.erase();
    result.views.push_back(frames_of(job, loaded, view_folder(index, cameras.size()), progress));
  }
  return result;
}

std::optional<Distribution> frame_distribution(const FrameViewsResult& result, std::size_t path) {
  return over_views(result, [path](const FramesResult& view) { return view.paths[path].frame; });
}

std::optional<Distribution> over_hardware_distribution(const FrameViewsResult& result, std::size_t path) {
  constexpr std::size_t hardware = 1;
  return over_views(result, [path](const FramesResult& view) -> std::optional<double> {
    const std::optional<double>&own = view.paths[path].frame, &other = view.paths[hardware].frame;
    return own && other && *other > 0 ? std::optional(*own / *other) : std::nullopt;
  });
}

}  // namespace vrpipe::tools
