#include "jobs/views_job.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <map>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>
#include <vrpipe/workloads/gaussian_file.h>

#include "for_each_chunk.h"
#include "host/progress_line.h"
#include "host/stopwatch.h"
#include "jobs/comparison.h"
#include "jobs/identity.h"
#include "jobs/loaded_frame.h"
#include "jobs/processes.h"
#include "jobs/result_encoding.h"

namespace vrpipe::tools {
namespace {

namespace fs = std::filesystem;
using SteadyClock = std::chrono::steady_clock;

// What is drawn.

/// Preprocesses views when they are asked for, and holds the last of them.
class ViewFrames {
 public:
  ViewFrames(const SimulationJob& job, OpenedScene scene) : job_(job), scene_(std::move(scene)) {}

  std::shared_ptr<const Frame> frame(const ViewResult& view, const RunRequest& request) {
    return make_frame(request, job_.frame, loaded(view));
  }
  const LoadedFrame& loaded(const ViewResult& view) {
    if (held_ != view.index) {
      frame_ = LoadedFrame();
      held_.reset();
      scene_.viewpoint = view.viewpoint;
      frame_ = load_frame(job_.frame, scene_, job_.scene.preprocess);
      held_ = view.index;
    }
    return frame_;
  }

 private:
  const SimulationJob& job_;
  OpenedScene scene_;
  LoadedFrame frame_;
  std::optional<std::size_t> held_;
};

// What a journal belongs to.

nlohmann::json numbers(const Vec3& v) { return {v.x, v.y, v.z}; }

/// Which cameras, to the last bit.
nlohmann::json cameras_identity(const ViewsResult& result) {
  nlohmann::json all = nlohmann::json::array();
  for (const ViewResult& view : result.views) {
    const Camera& camera = view.viewpoint.camera;
    all.push_back({view.index, valid_utf8(camera.name), numbers(camera.eye), numbers(camera.rotation[0]),
                   numbers(camera.rotation[1]), numbers(camera.rotation[2]), camera.fx, camera.fy, camera.cx(),
                   camera.cy(), camera.projection, camera.width, camera.height, camera.near_plane, camera.far_plane,
                   valid_utf8(fmt::format("{}", fmt::join(camera.notes, "; ")))});
  }
  std::error_code ignored;
  const nlohmann::json file =
      result.camera_file ? nlohmann::json(valid_utf8(fs::weakly_canonical(*result.camera_file, ignored).string()))
                         : nlohmann::json();
  return {{"file", file}, {"views", result.views.size()}, {"sha256", sha256(all.dump())}};
}

nlohmann::json runs_identity(const SimulationJob& job) {
  nlohmann::json common = request_identity(job.requests.front());
  common.erase("platform");
  common.erase("variant");
  nlohmann::json runs = nlohmann::json::array();
  for (const RunRequest& request : job.requests) {
    const nlohmann::json each = request_identity(request);
    runs.push_back({each["platform"], each["variant"]});
  }
  common.update(
      {{"runs", runs}, {"preprocessing", settings_identity(job.preprocessing)}, {"multi_pass", job.frame.passes}});
  return common;
}

/// All that the results of views depend on.
nlohmann::json views_identity(const SimulationJob& job, const ViewsResult& result) {
  nlohmann::json plugins = nlohmann::json::array();
  for (const PluginFile& plugin : job.provenance.plugins) plugins.push_back(plugin.sha256);
  nlohmann::json meshes = nlohmann::json::array();
  for (const std::string& mesh : job.scene.meshes) meshes.push_back(file_identity(mesh));
  nlohmann::json images;
  if (job.output) {
    std::error_code ignored;
    const std::string folder = fs::weakly_canonical(*job.output, ignored).string();
    images = {{"folder", valid_utf8(folder)}, {"background", job.background}};
  }
  return {{"schema", "vrpipe.views-journal/1"},
          {"version", VRPIPE_VERSION},
          {"build", build_identity()},
          {"plugins", plugins},
          {"scene", scene_identity(job.scene.scene)},
          {"meshes", meshes},
          {"cameras", cameras_identity(result)},
          {"settings", runs_identity(job)},
          {"images", images}};
}

Journal open_views_journal(const SimulationJob& job, const ViewsChoice& choice, const ViewsResult& result) {
  const nlohmann::json head = views_identity(job, result);
  if (choice.journal) return Journal::in_file(*choice.journal, head, ViewsChoice::journal_option);
  const std::string key = sha256(head.dump()).substr(0, 16);
  return Journal::in_cache("views-" + key + ".jsonl", head, ViewsChoice::option);
}

// What is in a journal.

nlohmann::json to_views_record(const ViewResult& view) {
  nlohmann::json runs = nlohmann::json::array();
  for (const RunResult& run : view.runs) runs.push_back(encode(run));
  const SceneSummary& scene = view.scene;
  return {{"view", view.index},
          {"scene",
           {{"gaussians_total", scene.gaussians_total},
            {"gaussians_visible", scene.gaussians_visible},
            {"gaussians_compensated", scene.gaussians_compensated},
            {"not_finite", scene.rejected.not_finite},
            {"zero_quaternion", scene.rejected.zero_quaternion},
            {"triangles", scene.triangles},
            {"triangles_rejected", scene.triangles_rejected},
            {"notes", scene.notes}}},
          {"runs", runs}};
}

/// Throws std::runtime_error or json::exception for what to_record() cannot have made.
void views_from_record(const nlohmann::json& record, const std::vector<RunRequest>& requests, ViewResult& view) {
  const nlohmann::json& scene = record.at("scene");
  const nlohmann::json& runs = record.at("runs");
  if (runs.size() != requests.size()) throw std::runtime_error("a record of other variants");
  SceneSummary summary;
  scene.at("gaussians_total").get_to(summary.gaussians_total);
  scene.at("gaussians_visible").get_to(summary.gaussians_visible);
  scene.at("gaussians_compensated").get_to(summary.gaussians_compensated);
  scene.at("not_finite").get_to(summary.rejected.not_finite);
  scene.at("zero_quaternion").get_to(summary.rejected.zero_quaternion);
  scene.at("triangles").get_to(summary.triangles);
  scene.at("triangles_rejected").get_to(summary.triangles_rejected);
  scene.at("notes").get_to(summary.notes);
  std::vector<RunResult> results;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    results.push_back(decode(with_binaries(runs[i]), requests[i]));
    results.back().framebuffer.color = ColorSurface(1, 1, requests[i].format);
    results.back().framebuffer.depth_stencil = DepthStencilSurface(1, 1);
  }
  view.scene = summary;
  view.runs = std::move(results);
}

/// Takes the views that are done from a journal; their images have to be there still.
void take_done_views(const Journal& journal, const std::vector<RunRequest>& requests, ViewsResult& result) {
  std::map<std::size_t, ViewResult*> views;
  for (ViewResult& view : result.views) views.emplace(view.index, &view);
  for (const nlohmann::json& record : journal.records()) {
    try {
      const auto found = views.find(record.at("view").get<std::size_t>());
      if (found == views.end()) continue;
      const auto is_there = [](const std::optional<ImageFiles>& images) {
        std::error_code ignored;
        return !images || (fs::is_regular_file(images->png, ignored) && fs::is_regular_file(images->exr, ignored));
      };
      ViewResult& view = *found->second;
      if (std::all_of(view.images.begin(), view.images.end(), is_there)) views_from_record(record, requests, view);
    } catch (const nlohmann::json::exception&) {
      continue;  // damaged: the view is simulated again
    } catch (const std::runtime_error&) {
      continue;
    }
  }
  for (const ViewResult& view : result.views) result.done_before += view.runs.empty() ? 0U : 1U;
}

// Output.

/// Before anything is simulated: that files can be written, and overwrite neither what is read nor each other.
void check_view_outputs(const SimulationJob& job, const ViewsChoice& choice, const ViewsResult& result) {
  std::vector<NamedFile> outputs;
  if (job.json && *job.json != "-") outputs.push_back({"--json", *job.json});
  if (choice.journal) outputs.push_back({ViewsChoice::journal_option, *choice.journal});
  for (const NamedFile& output : outputs) check_output_file(output.path, output.option, job.output);
  for (const ViewResult& view : result.views) {
    for (const std::optional<ImageFiles>& images : view.images) {
      if (!images) continue;
      const fs::path folder = fs::path(images->png).parent_path();
      check_output_folder(folder, "--output");
      for (const std::string& file : {images->png, images->exr}) {
        check_output_file(file, "--output", folder);
        outputs.push_back({"--output", file});
      }
    }
  }
  check_files_differ(job.inputs, outputs);
}

void write_view_images(const SimulationJob& job, const ImageFiles& files, const SharedImage& image) {
  create_output_folder(fs::path(files.png).parent_path(), "--output");
  for_each_chunk(2, job.processes, [&](std::uint64_t i) {
    if (i == 0) write_output_file(files.png, encode_png(image, job.background), "--output");
    if (i == 1) write_output_file(files.exr, encode_exr(image), "--output");
  });
}

/// What many views would fill memory and journal with, and nobody reads.
void strip_view(RunResult& run) {
  run.units.clear();
  run.kernels.clear();
  run.statistics.clear();
  run.effects.clear();
  run.draws.clear();
}

void simulate_views(const SimulationJob& job, ViewFrames& frames, ViewsResult& result, ProgressLine& progress) {
  const std::size_t variants = job.requests.size();
  std::vector<Task> tasks;
  std::vector<ViewResult*> views;
  for (ViewResult& view : result.views) {
    if (!view.runs.empty()) continue;
    views.push_back(&view);
    for (const RunRequest& request : job.requests) {
      const auto frame = [&frames, &view](const RunRequest& of) {
        std::shared_ptr<const Frame> made = frames.frame(view, of);
        view.scene = frames.loaded(view).summary;
        return made;
      };
      tasks.push_back({fmt::format("view {} {}", view.index, name_of(request)), request, frame});
    }
  }
  std::vector<std::vector<RunResult>> runs(views.size(), std::vector<RunResult>(variants));
  std::vector<std::size_t> missing(views.size(), variants);
  std::size_t done = result.done_before;
  BatchPlace place;
  const auto say_done = [&] { place.title = fmt::format("{} of {} views  ", done, result.views.size()); };
  say_done();
  const auto finished = [&](std::size_t index, Simulated&& simulated) {
    const std::size_t i = index / variants, variant = index % variants;
    ViewResult& view = *views[i];
    if (simulated.image) write_view_images(job, *view.images[variant], *simulated.image);
    runs[i][variant] = std::move(simulated.result);
    strip_view(runs[i][variant]);
    if (--missing[i] > 0) return;
    view.runs = std::move(runs[i]);
    progress.erase();
    result.journal->append(to_views_record(view));
    ++done;
    say_done();
  };
  if (!tasks.empty()) run_tasks(tasks, job.output.has_value(), job.processes, place, progress, finished);
}

}  // namespace

std::vector<Viewpoint> all_cameras(const SimulationJob& job, const ViewsChoice& choice, const OpenedScene& scene) {
  std::vector<Viewpoint> cameras;
  const std::optional<ImageSize>& size = job.scene.size;
  if (job.scene.camera) {
    const std::string file = camera_choice(*job.scene.camera).file;
    for (Camera& camera : load_cameras(file, job.scene.lenses)) {
      CameraName name{file, cameras.size(), camera.name};
      cameras.push_back({size ? resized(camera, *size) : std::move(camera), {}, std::move(name)});
    }
    return cameras;
  }
  const Camera& first = scene.viewpoint.camera;
  for (const View& view : orbit_views(*scene.viewpoint.view, choice.count.value())) {
    cameras.push_back({look_at(view, {first.width, first.height}), view, {}});
  }
  return cameras;
}

std::vector<std::size_t> chosen_views(const ViewsChoice& choice, std::size_t cameras, const std::string& file) {
  const std::size_t count = choice.count.value_or(cameras);
  if (count > cameras || count == 0) {
    throw UserError("cannot choose views",
                    fmt::format("{} {}", ViewsChoice::option, choice.count ? std::to_string(count) : "all"),
                    fmt::format("{} has {} camera{}", file, cameras, cameras == 1 ? "" : "s"),
                    cameras == 0 ? std::string("use another file") : fmt::format("give 1 to {}, or all", cameras));
  }
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < count; ++i) indices.push_back(i * cameras / count);
  return indices;
}

std::string view_folder(std::size_t index, std::size_t cameras) {
  return fmt::format("{:0{}}", index, std::to_string(cameras - 1).size());
}

ViewsResult simulate_views(const SimulationJob& job, const ViewsChoice& choice) {
  ViewsResult result;
  result.schema = job.schema;
  result.provenance = job.provenance;
  result.preprocessing = job.preprocessing;
  result.preprocess_parameters = job.preprocess_parameters;
  result.passes = job.frame.passes;
  result.baseline = job.baseline;
  ProgressLine progress;
  progress.show("loading " + job.frame.name);
  const auto start = SteadyClock::now();
  OpenedScene scene = open_scene(job.scene);
  result.scene = scene.name;
  result.gaussians_total = scene.gaussians.size();
  std::vector<Viewpoint> cameras = all_cameras(job, choice, scene);
  result.cameras = cameras.size();
  if (job.scene.camera) result.camera_file = camera_choice(*job.scene.camera).file;
  for (const std::size_t index : chosen_views(choice, cameras.size(), result.camera_file.value_or("the orbit"))) {
    ViewResult view;
    view.index = index;
    view.viewpoint = std::move(cameras[index]);
    for (const RunRequest& request : job.requests) {
      view.images.emplace_back();
      if (!job.output) continue;
      const std::string name = image_name(job.frame.name, name_of(request));
      view.images.back() = image_files(job, (fs::path(view_folder(index, result.cameras)) / name).string());
    }
    result.views.push_back(std::move(view));
  }
  result.load_seconds = seconds_since(start);
  progress.erase();
  check_view_outputs(job, choice, result);

  ViewFrames frames(job, std::move(scene));
  // What cannot be drawn is refused before anything is written.
  for (const RunRequest& request : job.requests) static_cast<void>(frames.frame(result.views.front(), request));
  if (job.output) create_output_folder(*job.output, "--output");
  result.journal = std::make_shared<Journal>(open_views_journal(job, choice, result));
  take_done_views(*result.journal, job.requests, result);
  if (result.done_before > 0) {
    fmt::print(stderr, "{}: {} of {} views were done before\n", ViewsChoice::option, result.done_before,
               result.views.size());
  }
  const auto simulation_start = SteadyClock::now();
  simulate_views(job, frames, result, progress);
  result.simulate_seconds = seconds_since(simulation_start);
  result.processes =
      static_cast<unsigned>(std::min<std::size_t>(job.processes, result.views.size() * job.requests.size()));
  return result;
}

std::optional<Distribution> speedup_distribution(const ViewsResult& result, std::size_t variant) {
  std::vector<std::optional<double>> values;
  for (const ViewResult& view : result.views) values.push_back(speedup(view.runs[result.baseline], view.runs[variant]));
  return distribution_of(values);
}

std::optional<Distribution> ratio_distribution(const ViewsResult& result) {
  std::vector<std::optional<double>> values;
  for (const ViewResult& view : result.views) values.push_back(early_termination_ratio(view.runs));
  return distribution_of(values);
}

}  // namespace vrpipe::tools
