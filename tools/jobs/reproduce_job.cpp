#include "jobs/reproduce_job.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <stdexcept>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>

#include "jobs/identity.h"
#include "jobs/imitation.h"
#include "jobs/loaded_frame.h"
#include "jobs/microbench_record.h"
#include "jobs/processes.h"
#include "jobs/result_encoding.h"

namespace vrpipe::tools {
namespace {

using SteadyClock = std::chrono::steady_clock;

Camera cut(Camera camera, Extent extent) {
  constexpr std::uint32_t column = 8;
  const auto smaller = [&](std::uint32_t by) {
    return resized(camera, {std::max(1U, camera.width / by), std::max(1U, camera.height / by)});
  };
  switch (extent) {
    case Extent::full: break;
    case Extent::column: camera.width = std::max(1U, camera.width / column); break;
    case Extent::half: return smaller(2);
    case Extent::quarter: return smaller(4);
  }
  return camera;
}

/// Opens scenes and preprocesses them when they are asked for, and holds the last.
class PointFrames {
 public:
  PointFrames(const ReproduceJob& job, const ReproducePlan& plan) : job_(job), plan_(plan) {}

  std::shared_ptr<const Frame> frame(const PointKey& key, const RunRequest& request) {
    FrameDescription description = frame_of_scene(plan_.scenes[key.scene].request);
    description.passes = key.passes;
    return make_frame(request, description, loaded(key));
  }

  const LoadedFrame& loaded(const PointKey& key) {
    const auto what = std::make_tuple(key.scene, key.extent, key.view);
    if (held_ == what) return frame_;
    held_.reset();
    frame_ = LoadedFrame();
    open(key.scene);
    OpenedScene& scene = *scene_;
    scene.viewpoint = camera_of(key.view);
    scene.viewpoint.camera = cut(scene.viewpoint.camera, key.extent);
    frame_ = load_frame(frame_of_scene(plan_.scenes[key.scene].request), scene, PreprocessOptions());
    held_ = what;
    return frame_;
  }

 private:
  void open(std::size_t scene) {
    if (scene_ && opened_ == scene) return;
    scene_.reset();
    SceneRequest request;
    request.scene = plan_.scenes[scene].request;
    request.camera = plan_.scenes[scene].camera;
    request.lenses = job_.options.lenses;
    request.size = job_.size;
    scene_ = open_scene(request);
    own_ = scene_->viewpoint;
    opened_ = scene;
  }

  /// Of the file that the scene's camera is of, evenly spaced, or round the scene.
  Viewpoint camera_of(std::size_t view) const {
    if (view == 0) return own_;
    const ImageSize size{own_.camera.width, own_.camera.height};
    if (own_.view) return {look_at(orbit_views(*own_.view, plan_.views)[view], size), {}, {}};
    const std::vector<Camera> cameras = load_cameras(own_.file->file, job_.options.lenses);
    return {resized(cameras[view * cameras.size() / plan_.views], size), {}, {}};
  }

  const ReproduceJob& job_;
  const ReproducePlan& plan_;
  std::optional<OpenedScene> scene_;
  std::size_t opened_ = 0;
  Viewpoint own_;
  LoadedFrame frame_;
  std::optional<std::tuple<std::size_t, Extent, std::size_t>> held_;
};

/// All that the results depend on.
nlohmann::json reproduce_identity(const ReproduceJob& job, const ReproducePlan& plan) {
  nlohmann::json scenes = nlohmann::json::array();
  for (const PlannedScene& scene : plan.scenes) {
    nlohmann::json cameras;
    if (scene.camera) {
      const CameraChoice choice = camera_choice(*scene.camera);
      cameras = {{"files", file_identity(choice.file)},
                 {"camera", valid_utf8(choice.camera.value_or("0"))},
                 {"lenses", job.options.lenses}};
    }
    scenes.push_back({{"scene", scene_identity(scene.request)}, {"cameras", std::move(cameras)}});
  }
  std::string points;
  for (const ReproducePoint& point : plan.points) points += point.key.name(plan.scenes) + "\n";
  const RunRequest& base = job.options.base;
  nlohmann::json settings = nlohmann::json::array();
  for (const Setting& setting : base.settings) {
    settings.push_back(valid_utf8(setting.unit + "." + setting.parameter + "=" + setting.value));
  }
  nlohmann::json units = nlohmann::json::array(), plugins = nlohmann::json::array();
  for (const UnitChoice& unit : base.units) units.push_back(valid_utf8(unit.slot + "=" + unit.implementation));
  for (const PluginFile& plugin : job.provenance.plugins) plugins.push_back(plugin.sha256);
  return {{"schema", "vrpipe.reproduce-journal/1"},
          {"version", VRPIPE_VERSION},
          {"build", build_identity()},
          {"scenes", scenes},
          {"size", job.size ? nlohmann::json{job.size->width, job.size->height} : nlohmann::json()},
          {"platform", base.platform->name},
          {"set", settings},
          {"units", units},
          {"plugins", plugins},
          {"views", plan.views},
          {"points", {{"count", plan.points.size()}, {"sha256", sha256(points)}}}};
}

Journal open_reproduce_journal(const ReproduceJob& job, const ReproducePlan& plan) {
  const nlohmann::json head = reproduce_identity(job, plan);
  if (job.journal) return Journal::in_file(*job.journal, head, ReproduceJob::journal_option);
  return Journal::in_cache("reproduce-" + sha256(head.dump()).substr(0, 16) + ".jsonl", head,
                           ReproduceJob::journal_option);
}

nlohmann::json energy_to_json(const EnergyAmounts& amounts) {
  return {{"events", amounts.events},           {"powers", amounts.powers},
          {"seconds", amounts.seconds.value()}, {"fragments_blended", amounts.fragments_blended},
          {"not_counted", amounts.not_counted}, {"missing", amounts.missing}};
}

EnergyAmounts energy_from_json(const nlohmann::json& record) {
  EnergyAmounts amounts;
  record.at("events").get_to(amounts.events);
  record.at("powers").get_to(amounts.powers);
  amounts.seconds = record.at("seconds").get<double>();
  record.at("fragments_blended").get_to(amounts.fragments_blended);
  record.at("not_counted").get_to(amounts.not_counted);
  record.at("missing").get_to(amounts.missing);
  const EnergyTable& table = shipped_energies();
  if (amounts.events.size() != table.events.size() || amounts.powers.size() != table.powers.size()) {
    throw std::runtime_error("a record of other energies");
  }
  return amounts;
}

nlohmann::json to_reproduce_record(const std::string& name, const PointResult& point) {
  return {{"point", name},
          {"run", encode(point.run)},
          {"gaussians", {point.gaussians_total, point.gaussians_visible}},
          {"fragments_of_back_quads", point.fragments_of_back_quads},
          {"fragments_blended_late", point.fragments_blended_late},
          {"size", {point.width, point.height}},
          {"map", point.map ? to_json(*point.map) : nlohmann::json()},
          {"energy", point.energy ? energy_to_json(*point.energy) : nlohmann::json()}};
}

/// Throws std::runtime_error or json::exception for what to_record() cannot have made.
PointResult reproduce_from_record(const nlohmann::json& record, const ReproducePoint& planned) {
  PointResult point;
  point.run = decode(with_binaries(record.at("run")), planned.request);
  point.run.framebuffer.color = ColorSurface(1, 1, planned.request.format);
  point.run.framebuffer.depth_stencil = DepthStencilSurface(1, 1);
  record.at("gaussians").at(0).get_to(point.gaussians_total);
  record.at("gaussians").at(1).get_to(point.gaussians_visible);
  record.at("fragments_of_back_quads").get_to(point.fragments_of_back_quads);
  record.at("fragments_blended_late").get_to(point.fragments_blended_late);
  record.at("size").at(0).get_to(point.width);
  record.at("size").at(1).get_to(point.height);
  if (!record.at("map").is_null()) point.map = heat_map_from_json(record.at("map"));
  if (!record.at("energy").is_null()) point.energy = energy_from_json(record.at("energy"));
  if (point.map.has_value() != planned.with_map) throw std::runtime_error("a record of another plan");
  return point;
}

/// Which points are done; those of a journal are taken from it.
std::vector<bool> take_done_points(const Journal& journal, ReproduceResult& result) {
  const std::vector<ReproducePoint>& points = result.plan.points;
  const std::map<std::string, std::size_t>& places = result.plan.places;
  std::vector<bool> is_done(points.size());
  for (const nlohmann::json& record : journal.records()) {
    try {
      const auto found = places.find(record.at("point").get<std::string>());
      if (found == places.end()) continue;
      result.points[found->second] = reproduce_from_record(record, points[found->second]);
      is_done[found->second] = true;
    } catch (const nlohmann::json::exception&) {
      continue;  // damaged: the point is simulated again
    } catch (const std::runtime_error&) {
      continue;
    }
  }
  return is_done;
}

void strip_point(RunResult& run, bool keeps_parameters) {
  run.units.clear();
  run.statistics.clear();
  run.effects.clear();
  run.draws.clear();
  run.implementations.clear();
  run.host_seconds = run.cpu_seconds = 0;  // so that what is done again is the same
  if (!keeps_parameters) run.parameters.clear();
}

void simulate_points(const ReproduceJob& job, const std::vector<bool>& is_done, ReproduceResult& result,
                     ProgressLine& progress) {
  const ReproducePlan& plan = result.plan;
  PointFrames frames(job, plan);
  std::vector<std::size_t> missing;
  std::vector<Task> tasks;
  std::map<std::size_t, FragmentCounter> counters;
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (is_done[i]) continue;
    const ReproducePoint& point = plan.points[i];
    const std::size_t task = missing.size();
    missing.push_back(i);
    const auto frame = [&, i, task](const RunRequest& request) {
      const ReproducePoint& drawn = plan.points[i];
      progress.show("preparing " + drawn.key.name(plan.scenes));
      std::shared_ptr<const Frame> made = frames.frame(drawn.key, request);
      if (drawn.key.variant == PointKey::imitated_variant) {
        const Imitation imitation =
            imitation_of(request, frames.loaded(drawn.key).geometry.front(), made->draws().front().state);
        tasks[task].request = imitation.request;
        made = imitation.frame;
      }
      const LoadedFrame& loaded = frames.loaded(drawn.key);
      PointResult& of = result.points[i];
      of.gaussians_total = loaded.summary.gaussians_total;
      of.gaussians_visible = loaded.summary.gaussians_visible;
      of.width = loaded.width;
      of.height = loaded.height;
      if (drawn.with_map) {
        const auto counter = counters.try_emplace(i, loaded.width, loaded.height).first;
        tasks[task].request.observers = counter->second.observers();
      }
      return made;
    };
    tasks.push_back({point.key.name(plan.scenes), point.request, frame});
  }
  const auto finished = [&](std::size_t task, Simulated&& simulated) {
    const std::size_t i = missing[task];
    PointResult& point = result.points[i];
    point.run = std::move(simulated.result);
    point.run.request = plan.points[i].request;
    if (plan.points[i].key.settings.empty() && point.run.cycles)
      point.energy = energy_amounts(point.run, shipped_energies());
    const auto take = [&](const char* name, std::uint64_t& value) {
      if (const StatisticReport* const found = statistic_named(point.run.statistics, name)) value = found->value;
    };
    take("sm.fragments_of_back_quads", point.fragments_of_back_quads);
    take("crop.fragments_blended_late", point.fragments_blended_late);
    result.cpu_seconds += point.run.cpu_seconds;
    strip_point(point.run, i == 0);
    tasks[task].request.observers.reset();
    if (const auto counter = counters.find(i); counter != counters.end()) {
      point.map = counter->second.map();
      counters.erase(counter);
      if (point.map->sum != point.run.counts.fragments_blended) {
        throw std::logic_error(fmt::format("the heat map of {} has {} fragments, and {} were blended", tasks[task].name,
                                           point.map->sum, point.run.counts.fragments_blended));
      }
    }
    progress.erase();
    result.journal->append(to_reproduce_record(tasks[task].name, point));
  };
  if (!tasks.empty()) run_tasks(tasks, false, job.processes, {"", 0, 0, 0}, progress, finished);
}

void simulate_whole_frames(const ReproduceJob& job, ReproduceResult& result, ProgressLine& progress) {
  const ReproducePlan& plan = result.plan;
  std::map<std::string, WholeFrame> done;
  for (const nlohmann::json& record : result.journal->records()) {
    try {
      if (record.contains("whole frame")) done[record.at("whole frame")] = record.at("of").get<WholeFrame>();
    } catch (const nlohmann::json::exception&) {
      continue;  // damaged: it is simulated again
    }
  }
  PointFrames frames(job, plan);
  result.frames.resize(plan.scenes.size());
  if (plan.quick) return;
  for (const std::size_t scene : plan.scenes_of(PlannedScene::Role::six)) {
    const std::string& name = plan.scenes[scene].name;
    auto found = done.find(name);
    if (found == done.end()) {
      progress.show(name + " in software");
      PointKey key;
      key.scene = scene;
      const std::shared_ptr<const Frame> frame = frames.frame(key, job.options.base);
      const LoadedFrame& loaded = frames.loaded(key);
      const auto gaussians = loaded.preprocessed_here ? std::optional(loaded.summary.gaussians_total) : std::nullopt;
      found = done.emplace(name, simulate_whole_frame(job.options.base, *frame, gaussians)).first;
      progress.erase();
      result.journal->append({{"whole frame", name}, {"of", found->second}});
    }
    result.frames[scene] = found->second;
  }
}

/// After the points: they fork as well, and show their own progress.
void run_microbenches(const ReproduceJob& job, ReproduceResult& result) {
  std::map<std::string, MicrobenchResult> done;
  for (const nlohmann::json& record : result.journal->records()) {
    try {
      if (!record.contains("microbench")) continue;
      MicrobenchResult found = microbench_from_json(record.at("microbench"));
      done[found.name] = std::move(found);
    } catch (const nlohmann::json::exception&) {
      continue;  // damaged: it is run again
    }
  }
  RunRequest request = job.options.base;
  request.variant = variant_named("baseline");
  request.fidelity = result.plan.fidelity;
  for (const std::string& name : microbench_names()) {
    auto found = done.find(name);
    if (found == done.end()) {
      const nlohmann::json record = to_json(run_microbench(name, request, job.processes));
      result.journal->append({{"microbench", record}});
      // As it comes back from a journal, so that it does not matter which it was.
      found = done.emplace(name, microbench_from_json(record)).first;
    }
    result.microbenches.push_back(found->second);
  }
}

void check_outputs(const ReproduceJob& job) {
  std::vector<NamedFile> outputs;
  if (job.json && *job.json != "-") outputs.push_back({"--json", *job.json});
  if (job.html) outputs.push_back({"--html", *job.html});
  if (job.markdown) outputs.push_back({"--markdown", *job.markdown});
  if (job.journal) outputs.push_back({ReproduceJob::journal_option, *job.journal});
  for (const NamedFile& output : outputs) check_output_file(output.path, output.option, job.output);
  check_files_differ(job.inputs, outputs);
  if (job.output) check_output_folder(*job.output, "--output");
}

}  // namespace

const PointResult& ReproduceResult::at(const PointKey& key) const {
  const std::string name = key.name(plan.scenes);
  const auto place = plan.places.find(name);
  if (place != plan.places.end()) return points[place->second];
  throw std::logic_error("nothing was simulated for " + name);
}

ReproduceResult simulate_reproduction(const ReproduceJob& job, ProgressLine& progress) {
  check_outputs(job);
  ReproduceResult result;
  result.plan = plan_reproduction(job.options);
  result.provenance = job.provenance;
  result.processes = job.processes;
  result.points.resize(result.plan.points.size());
  result.journal = std::make_shared<Journal>(open_reproduce_journal(job, result.plan));
  const std::vector<bool> is_done = take_done_points(*result.journal, result);
  result.done_before = static_cast<std::size_t>(std::count(is_done.begin(), is_done.end(), true));
  if (result.done_before > 0) {
    fmt::print(stderr, "{} of {} simulations were done before\n", result.done_before, result.points.size());
  }
  const auto start = SteadyClock::now();
  simulate_points(job, is_done, result, progress);
  run_microbenches(job, result);
  simulate_whole_frames(job, result, progress);
  result.seconds = std::chrono::duration<double>(SteadyClock::now() - start).count();
  if (job.output) create_output_folder(*job.output, "--output");
  return result;
}

}  // namespace vrpipe::tools
