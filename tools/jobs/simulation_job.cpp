#include "jobs/simulation_job.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/software.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/draw_list.h>

#include "for_each_chunk.h"
#include "host/output_file.h"
#include "host/process_setup.h"
#include "host/progress_line.h"
#include "host/stopwatch.h"
#include "jobs/loaded_frame.h"
#include "jobs/processes.h"
#include "jobs/settings.h"

namespace vrpipe::tools {
namespace {

/// Writes the images of all runs, encoded side by side: compression takes longer than the disk.
void write_images(const SimulationJob& job, const std::vector<Simulated>& simulated, JobResult& result) {
  std::vector<std::pair<std::string, std::string>> encoded(simulated.size());
  for_each_chunk(simulated.size(), job.processes, [&](std::uint64_t i) {
    const SharedImage& image = *simulated[i].image;
    encoded[i] = {encode_png(image, job.background), encode_exr(image)};
  });
  for (std::size_t i = 0; i < encoded.size(); ++i) {
    const ImageFiles files = image_files(job, image_name(result.scene.name, name_of(result.runs[i].request)));
    const bool has_png = result.files.write(files.png, encoded[i].first, "--output");
    const bool has_exr = result.files.write(files.exr, encoded[i].second, "--output");
    result.images.push_back(has_png && has_exr ? std::optional(files) : std::nullopt);
  }
}

/// Adds observers to requests; gives what they fill in.
std::vector<std::unique_ptr<HeatMaps>> observe_heat(std::vector<RunRequest>& requests, std::uint32_t width,
                                                    std::uint32_t height) {
  std::vector<std::unique_ptr<HeatMaps>> maps;
  for (RunRequest& request : requests) {
    if (request.observers == nullptr) request.observers = std::make_shared<Observers>();
    maps.push_back(std::make_unique<HeatMaps>(width, height, request));
    if (request.variant.drawn_by != DrawnBy::accelerator)
      maps.back()->attach(*request.observers, request.variant.early_termination);
  }
  return maps;
}

}  // namespace

std::string image_name(const std::string& scene, const std::string& run) {
  std::string name = builtin_name_of(scene).value_or(std::filesystem::path(scene).stem().string());
  name += "-" + run;
  std::replace(name.end() - static_cast<std::ptrdiff_t>(run.size()), name.end(), '/', '-');
  return name;
}

ImageFiles image_files(const SimulationJob& job, const std::string& name) {
  const std::string stem = (*job.output / name).string();
  return {stem + ".png", stem + ".exr"};
}

void check_outputs(const SimulationJob& job, const std::vector<std::string>& images, std::vector<NamedFile> outputs) {
  if (job.json && *job.json != "-") outputs.push_back({"--json", *job.json});
  if (job.html) outputs.push_back({"--html", *job.html});
  if (job.save_draw) outputs.push_back({"--save-draw", *job.save_draw});
  if (job.interval_csv) outputs.push_back({"--interval-csv", *job.interval_csv});
  if (job.trace) outputs.push_back({Trace::option, job.trace->path()});
  if (job.log && job.log->file()) outputs.push_back({EventLog::file_option, *job.log->file()});
  if (job.output) {
    for (const std::string& name : images) {
      const ImageFiles files = image_files(job, name);
      outputs.push_back({"--output", files.png});
      outputs.push_back({"--output", files.exr});
      if (!job.heat_maps) continue;
      const std::string stem = (*job.output / name).string();
      for (const auto& map : HeatMaps::files(stem, job.requests.front().fidelity)) {
        outputs.push_back({HeatMaps::option, map});
      }
    }
  }
  for (const NamedFile& output : outputs) {
    // An image's folder, which may be one of several in that of --output, is made for it.
    const bool is_image = output.option == "--output";
    check_output_file(output.path, output.option,
                      is_image ? std::filesystem::path(output.path).parent_path() : job.output);
  }
  check_files_differ(job.inputs, outputs);
}

void save_draw(const SimulationJob& job, const LoadedFrame& frame) {
  if (!job.save_draw) return;
  if (!frame.meshes.front().empty()) {
    throw UserError("cannot save the draw", "--save-draw", "a draw list has splats alone, and the scene has meshes",
                    "leave out --save-draw, or take a scene without meshes");
  }
  write_draw_list(*job.save_draw, *frame.geometry.front());
  note_written(job.save_draw->string());
}

JobResult perform(const SimulationJob& job) {
  std::vector<std::string> images;
  for (const RunRequest& request : job.requests) {
    images.push_back(image_name(job.frame.name, name_of(request)));
  }
  check_outputs(job, images);
  JobResult result;
  result.schema = job.schema;
  result.provenance = job.provenance;
  result.baseline = job.baseline;
  result.energies = job.energies;
  ProgressLine progress;
  std::vector<Simulated> simulated;
  std::vector<std::unique_ptr<HeatMaps>> heat_maps;
  bool preprocessed_here = false;
  {
    progress.show("loading " + job.frame.name);
    const auto start = std::chrono::steady_clock::now();
    const LoadedFrame loaded = load_frame(job.frame, job.scene);
    result.load_seconds = seconds_since(start);
    progress.erase();
    result.scene = loaded.summary;
    result.viewpoint = loaded.viewpoint;
    result.preprocessing = job.preprocessing;
    preprocessed_here = loaded.preprocessed_here;
    result.width = loaded.width;
    result.height = loaded.height;
    result.passes = job.frame.passes;
    const auto frame_of = [&](const RunRequest& request) { return make_frame(request, job.frame, loaded); };
    // What cannot be drawn is refused before anything is written.
    for (const RunRequest& request : job.requests) check_drawable(request, *frame_of(request));
    if (job.output) create_output_folder(*job.output, "--output");
    save_draw(job, loaded);

    std::vector<RunRequest> requests = job.requests;
    // Measuring effects repeats runs, and observers are of one.
    if (job.heat_maps || (job.html && !job.explain_effects))
      heat_maps = observe_heat(requests, result.width, result.height);
    const auto simulation_start = std::chrono::steady_clock::now();
    const bool with_images = job.output || job.html;
    if (requests.size() == 1 && !job.explain_effects) {
      const RunRequest& request = requests.front();
      simulated.push_back(simulate_here(request, *frame_of(request), with_images, progress));
    } else {
      simulated = simulate_in_processes(requests, frame_of, with_images, job.processes, progress);
    }
    for (Simulated& run : simulated) result.runs.push_back(std::move(run.result));
    result.simulate_seconds = seconds_since(simulation_start);
    if (job.trace) result.files.finish(job.trace->path(), Trace::option, [&] { job.trace->finish(); });
    if (job.log && job.log->file())
      result.files.finish(*job.log->file(), EventLog::file_option, [&] { job.log->finish(); });
    result.processes = std::min(job.processes, static_cast<unsigned>(job.requests.size()));
    if (job.explain_effects) result.effect_costs = measure_effects(result.runs, frame_of, progress);
  }

  if (job.html) {
    progress.show("making pictures");
    result.page = page_material(simulated, job.baseline, job.background, heat_maps, job.processes);
    result.intervals_for_page = job.intervals_for_page;
    progress.erase();
  }
  if (job.output) {
    progress.show("writing images");
    write_images(job, simulated, result);
    for (std::size_t i = 0; job.heat_maps && i < heat_maps.size(); ++i)
      heat_maps[i]->write((*job.output / images[i]).string(), result.files);
    progress.erase();
  } else {
    result.images.resize(simulated.size());
  }
  for (RunResult& run : result.runs) {
    if (preprocessed_here) add_preprocess_parameters(job.preprocess_parameters, result.scene, run);
  }
  return result;
}

}  // namespace vrpipe::tools
