#include "simulation_job.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <future>
#include <iostream>
#include <utility>

#include <vrpipe/workloads/draw_list.h>
#include <vrpipe/workloads/scene.h>

#include "output_file.h"
#include "processes.h"
#include "progress_line.h"
#include "report.h"
#include "result_json.h"
#include "terminal.h"

namespace vrpipe::tools {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Writes the images of all runs, side by side: compression takes longer than the disk.
void write_images(const SimulationJob& job, const std::vector<Simulated>& simulated, JobResult& result) {
  std::vector<std::future<void>> writing;
  for (const Simulated& run : simulated) {
    const std::filesystem::path stem = *job.output / image_name(result.scene.name, run.result.request.variant.name);
    const ImageFiles files{stem.string() + ".png", stem.string() + ".exr"};
    writing.push_back(std::async(std::launch::async, [&job, &run, files] {
      write_output_file(files.png, encode_png(*run.image, job.background), "--output");
      write_output_file(files.exr, encode_exr(*run.image), "--output");
    }));
    result.images.emplace_back(files);
  }
  for (std::future<void>& one : writing) one.get();
}

}  // namespace

std::string image_name(const std::string& scene, const std::string& variant) {
  const std::string builtin = "builtin:";
  const std::string name =
      scene.rfind(builtin, 0) == 0 ? scene.substr(builtin.size()) : std::filesystem::path(scene).stem().string();
  return name + "-" + variant;
}

void perform(const SimulationJob& job) {
  JobResult result;
  ProgressLine progress;
  std::vector<Simulated> simulated;
  bool preprocessed_here = false;
  {
    progress.show("loading " + (job.scene.scene.empty() ? std::string("the built-in scene") : job.scene.scene));
    const auto start = std::chrono::steady_clock::now();
    LoadedScene loaded = load_scene(job.scene);
    result.load_seconds = seconds_since(start);
    progress.erase();
    result.scene = loaded.summary;
    result.preprocessing = job.preprocessing;
    preprocessed_here = loaded.preprocessed_here;
    result.width = loaded.draw.width;
    result.height = loaded.draw.height;
    if (job.output) create_output_folder(*job.output, "--output");
    if (job.save_draw) write_draw_list(*job.save_draw, loaded.draw);

    const auto simulation_start = std::chrono::steady_clock::now();
    if (job.requests.size() == 1) {
      simulated.push_back(simulate_here(job.requests.front(), loaded.draw, job.output.has_value(), progress));
    } else {
      simulated = simulate_in_processes(job.requests, loaded.draw, job.output.has_value(), job.processes, progress);
    }
    result.simulate_seconds = seconds_since(simulation_start);
    result.processes = std::min(job.processes, static_cast<unsigned>(job.requests.size()));
  }

  if (job.output) {
    progress.show("writing images");
    write_images(job, simulated, result);
    progress.erase();
  } else {
    result.images.resize(simulated.size());
  }
  for (Simulated& run : simulated) {
    if (preprocessed_here) {
      run.result.parameters.insert(run.result.parameters.end(), job.preprocess_parameters.begin(),
                                   job.preprocess_parameters.end());
    }
    result.runs.push_back(std::move(run.result));
  }
  simulated.clear();

  if (job.json) {
    const std::string json = result_json(result).dump(2) + "\n";
    if (*job.json == "-") {
      std::cout << json;
      return;
    }
    write_output_file(*job.json, json, "--json");
  }
  std::cout << report(result, stdout_style());
  if (job.json) std::cout << "result: " << *job.json << '\n';
  if (job.save_draw) std::cout << "draw: " << job.save_draw->string() << '\n';
}

}  // namespace vrpipe::tools
