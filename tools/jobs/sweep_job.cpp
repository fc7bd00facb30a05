#include "jobs/sweep_job.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>
#include <thread>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>
#include <vrpipe/platforms/software.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/exact_image.h>
#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/scene_substitution.h>

#include "image/image_error.h"
#include "jobs/energy.h"
#include "jobs/identity.h"
#include "jobs/loaded_frame.h"
#include "jobs/optional_json.h"
#include "jobs/processes.h"
#include "jobs/ranks.h"
#include "jobs/result_encoding.h"
#include "jobs/settings.h"
#include "jobs/toml_file.h"

namespace vrpipe::tools {
namespace {

using SteadyClock = std::chrono::steady_clock;

const std::string& value_on(const Study& study, const StudiedPoint& point, const std::string& axis,
                            const std::string& otherwise) {
  const auto found = study.axis(axis);
  return found ? text_of(study.axes[*found], point.values[*found]) : otherwise;
}

bool is_parameter(const std::string& axis) { return axis.find('.') != std::string::npos; }

/// What a point draws: points that draw the same come one after another.
struct Drawn {
  std::string scene, view, size;
  std::vector<std::string> preprocess;  ///< settings

  auto key() const { return std::tie(scene, view, size, preprocess); }
};

Drawn drawn_by(const SweepJob& job, const StudiedPoint& point) {
  static const std::string none;
  const Study& study = job.study;
  const std::string& scene = value_on(study, point, "scene", none);
  Drawn drawn{scene.empty() ? job.common.scene.scene : scene_of_axis(job, scene),
              value_on(study, point, "view", none),
              value_on(study, point, "size", none),
              {}};
  for (std::size_t i = 0; i < study.axes.size(); ++i) {
    const std::string& name = study.axes[i].name;
    if (name.rfind("preprocess.", 0) == 0)
      drawn.preprocess.push_back(name + "=" + text_of(study.axes[i], point.values[i]));
  }
  return drawn;
}

ImageSize size_of(const std::string& text) {
  unsigned width = 0, height = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%5ux%5u%c", &width, &height, &rest) != 2 || width < 1 || height < 1 ||
      width > kMaxImageSize || height > kMaxImageSize) {
    throw UserError("bad value '" + text + "'", "axis size", "it is not WIDTHxHEIGHT in whole pixels",
                    "give e.g. 1280x720");
  }
  return {width, height};
}

/// Loads scenes when their points are asked for, each once while its points are run, and holds the last.
class StudyFrames {
 public:
  explicit StudyFrames(const SweepJob& job) : job_(job) {}

  PreprocessOptions options_of(const Drawn& drawn) const {
    std::vector<Setting> settings = job_.common.preprocessing;
    for (const std::string& text : drawn.preprocess) {
      const std::size_t equals = text.find('=');
      settings.push_back({"preprocess", text.substr(11, equals - 11), text.substr(equals + 1)});
    }
    return sort_settings(settings).preprocess;
  }

  /// The draw of what a point draws, in exact order and with all that the scene has.
  std::shared_ptr<const Draw> exact_draw(const Drawn& drawn) {
    load(drawn, options_of(drawn).exact());
    held_.reset();
    if (!frame_.meshes.front().empty()) {
      throw UserError("cannot measure images", "columns", "they are measured against an exact image of splats alone",
                      "leave out meshes, or columns of image");
    }
    return frame_.geometry.front();
  }

  /// Of the last frame.
  DrawnScene drawn() const {
    const SceneSummary& scene = frame_.summary;
    return {valid_utf8(scene.name), scene.gaussians_total, scene.gaussians_visible, frame_.width, frame_.height};
  }

  std::shared_ptr<const Frame> frame(const StudiedPoint& point, const RunRequest& request) {
    const Drawn drawn = drawn_by(job_, point);
    if (!held_ || held_->key() != drawn.key()) load(drawn, options_of(drawn));
    FrameDescription description = frame_of_scene(drawn.scene);
    const std::string passes = value_on(job_.study, point, "multi-pass", std::to_string(job_.common.frame.passes));
    description.passes = static_cast<std::uint32_t>(std::stoul(passes));
    return make_frame(request, description, frame_);
  }

 private:
  void load(const Drawn& drawn, const PreprocessOptions& preprocess) {
    held_.reset();
    frame_ = LoadedFrame();
    SceneRequest request = job_.common.scene;
    request.scene = drawn.scene;
    if (!drawn.size.empty()) request.size = size_of(drawn.size);
    request.preprocess = preprocess;
    if (drawn.view.empty()) {
      frame_ = load_frame(frame_of_scene(drawn.scene), request);
    } else if (request.camera) {
      request.camera = camera_choice(*request.camera).file + "#" + drawn.view;
      frame_ = load_frame(frame_of_scene(drawn.scene), request);
    } else {
      load_from_orbit(drawn, request);
    }
    held_ = drawn;
  }

  /// Views go round the scene, of as many as the study names, or one more than the largest.
  void load_from_orbit(const Drawn& drawn, const SceneRequest& request) {
    std::size_t views = 1;
    for (const StudyAxis& axis : job_.study.axes) {
      if (axis.name != "view") continue;
      for (const std::string& value : axis.values) views = std::max<std::size_t>(views, std::stoul(value) + 1);
    }
    OpenedScene scene = open_scene(request);
    const Camera camera = scene.viewpoint.camera;
    if (!scene.viewpoint.view)
      throw UserError("no views of " + drawn.scene, "axis view", "it has no orbit", "give --camera FILE");
    const View view = orbit_views(*scene.viewpoint.view, views)[std::stoul(drawn.view)];
    scene.viewpoint = {look_at(view, {camera.width, camera.height}), view, {}};
    frame_ = load_frame(frame_of_scene(drawn.scene), scene, request.preprocess);
  }

  const SweepJob& job_;
  std::optional<Drawn> held_;
  LoadedFrame frame_;
};

// Columns that are not statistics: of the image against the exact one.
constexpr const char* psnr_column = "image.psnr_db";
constexpr const char* ssim_column = "image.ssim";
constexpr const char* max_error_column = "image.max_abs_error";
constexpr std::array<const char*, 3> image_columns{psnr_column, ssim_column, max_error_column};

bool is_of_image(const std::string& column) {
  return std::find(image_columns.begin(), image_columns.end(), column) != image_columns.end();
}
bool measures_images(const Study& study) {
  return std::any_of(study.columns.begin(), study.columns.end(), is_of_image);
}

/// The exact images of what points draw, each while there are such points.
class ExactImages {
 public:
  ExactImages(const SweepJob& job, const std::vector<std::size_t>& points) : job_(job), frames_(job) {
    for (const std::size_t point : points) ++of(point).points_left;
  }
  ImageError error(std::size_t point, const SharedImage& image) {
    OfScene& scene = of(point);
    if (scene.image.rgb.empty())
      scene.image = shown(render_exactly(*frames_.exact_draw(drawn_by(job_, job_.study.points[point]))), background_);
    const ImageError error = image_error(shown(image, background_), scene.image);
    if (--scene.points_left == 0) scene.image = {};
    return error;
  }

 private:
  struct OfScene {
    ShownImage image;
    std::size_t points_left = 0;
  };
  /// Of points that differ in precision alone there is one.
  OfScene& of(std::size_t point) {
    const Drawn drawn = drawn_by(job_, job_.study.points[point]);
    return scenes_[{drawn.scene, drawn.view, drawn.size, frames_.options_of(drawn).exact()}];
  }

  const SweepJob& job_;
  StudyFrames frames_;
  const std::array<float, 3> background_{};
  std::map<std::tuple<std::string, std::string, std::string, PreprocessOptions>, OfScene> scenes_;
};

/// Throws UserError for one that is not there, before others are drawn.
void check_scene(const SweepJob& job, const std::string& value) {
  SceneRequest request;
  request.scene = scene_file(scene_of_axis(job, value));
  std::error_code ignored;
  if (const auto builtin = builtin_name_of(request.scene)) {
    builtin_scene_named(*builtin);
  } else if (!std::filesystem::exists(gaussian_file_path(request.scene), ignored)) {
    open_scene(request);
  }
}

void check_views(const SweepJob& job) {
  for (const StudyAxis& axis : job.study.axes) {
    for (const std::string& value : axis.values) {
      const bool is_count =
          !value.empty() && value.size() < 7 && value.find_first_not_of("0123456789") == std::string::npos;
      if (axis.name == "view" && !job.common.scene.camera && !is_count) {
        throw UserError("bad value '" + value + "'", "axis view", "it is no whole number, and there is no camera file",
                        "give 0, 1, ... round the scene, or camera = FILE");
      }
      if (axis.name == "size") static_cast<void>(size_of(value));
      if (axis.name == "scene") check_scene(job, value);
      if (axis.name == "multi-pass" && (!is_count || std::stoul(value) < 1))
        throw UserError("bad value '" + value + "'", "axis multi-pass", "it is no whole number from 1", "give e.g. 8");
    }
  }
}

// The journal.

std::string point_text(const Study& study, const StudiedPoint& point) {
  std::string text;
  for (std::size_t i = 0; i < study.axes.size(); ++i) {
    if (point.values[i] == no_value) continue;
    text += (text.empty() ? "" : ", ") + study.axes[i].name + "=" + text_of(study.axes[i], point.values[i]);
  }
  return text;
}

nlohmann::json point_key(const Study& study, std::size_t point) {
  nlohmann::json key = nlohmann::json::array();
  for (std::size_t i = 0; i < study.axes.size(); ++i)
    key.push_back(valid_utf8(study.axes[i].name + "=" + text_of(study.axes[i], study.points[point].values[i])));
  return key;
}

/// All that results depend on but the points, which may become more: a study that grows keeps what is done.
nlohmann::json sweep_identity(const SweepJob& job) {
  const SimulationJob& common = job.common;
  nlohmann::json scenes = nlohmann::json::array();
  const auto add_scene = [&](const std::string& scene) { scenes.push_back(scene_identity(scene)); };
  add_scene(common.scene.scene);
  for (const StudyAxis& axis : job.study.axes) {
    if (axis.name != "scene") continue;
    for (const std::string& scene : axis.values) add_scene(scene_of_axis(job, scene));
  }
  nlohmann::json cameras, meshes = nlohmann::json::array(), plugins = nlohmann::json::array(),
                          variants = nlohmann::json::array();
  if (common.scene.camera)
    cameras = {{"files", file_identity(camera_choice(*common.scene.camera).file)},
               {"camera", valid_utf8(*common.scene.camera)},
               {"lenses", common.scene.lenses}};
  for (const std::string& mesh : common.scene.meshes) meshes.push_back(file_identity(mesh));
  for (const PluginFile& plugin : common.provenance.plugins) plugins.push_back(plugin.sha256);
  for (const Variant& variant : vrpipe::variants()) {
    RunRequest request = common.requests.front();
    request.variant = variant;
    if (!variant.base.empty()) variants.push_back(request_identity(request)["variant"]);
  }
  const SceneRequest& scene = common.scene;
  const auto numbers = [](const auto& triple) {
    return triple ? nlohmann::json({triple->x, triple->y, triple->z}) : nlohmann::json();
  };
  return {{"schema", "vrpipe.sweep-journal/1"},
          {"version", VRPIPE_VERSION},
          {"build", build_identity()},
          {"plugins", plugins},
          {"scenes", scenes},
          {"meshes", meshes},
          {"cameras", cameras},
          {"view",
           {numbers(scene.eye), numbers(scene.look_at), numbers(scene.up),
            scene.fovy_degrees ? nlohmann::json(*scene.fovy_degrees) : nlohmann::json(),
            scene.orthographic_height ? nlohmann::json(*scene.orthographic_height) : nlohmann::json()}},
          {"size", scene.size ? nlohmann::json{scene.size->width, scene.size->height} : nlohmann::json()},
          {"common", request_identity(common.requests.front())},
          {"variants", variants},
          {"preprocessing", settings_identity(common.preprocessing)},
          {"multi_pass", common.frame.passes},
          {"columns", job.study.columns}};
}

std::filesystem::path shard_journal(const std::filesystem::path& journal, const Shard& shard) {
  return journal.string() + fmt::format(".{}-of-{}", shard.index, shard.count);
}

Journal open_sweep_journal(const SweepJob& job) {
  const nlohmann::json head = sweep_identity(job);
  if (job.journal) {
    return Journal::in_file(job.shard ? shard_journal(*job.journal, *job.shard) : *job.journal, head,
                            SweepJob::journal_option);
  }
  return Journal::in_cache("sweep-" + sha256(head.dump()).substr(0, 16) + ".jsonl", head, SweepJob::journal_option);
}

nlohmann::json to_sweep_record(const Study& study, std::size_t place, const PointOutcome& point) {
  if (!point.fault.empty()) return {{"point", point_key(study, place)}, {"fault", valid_utf8(point.fault)}};
  nlohmann::json columns = nlohmann::json::array();
  for (const std::optional<double>& value : point.columns) columns.push_back(nlohmann::json(column_json(value)));
  return {{"point", point_key(study, place)},
          {"run", encode(point.run)},
          {"energy", point.energy ? nlohmann::json{point.energy->low, point.energy->nominal, point.energy->high}
                                  : nlohmann::json()},
          {"columns", columns},
          {"cpu_seconds", point.cpu_seconds},
          {"drawn",
           {point.drawn.name, point.drawn.gaussians_total, point.drawn.gaussians_visible, point.drawn.width,
            point.drawn.height}}};
}

/// Columns are statistics of some point. Throws UserError.
void check_columns(const SweepJob& job, const std::vector<RunRequest>& requests) {
  std::set<std::string> known(image_columns.begin(), image_columns.end());
  std::set<std::tuple<std::string, unsigned, std::string>> seen;  // platforms, GPCs and variants
  for (RunRequest request : requests) {
    if (job.study.columns.empty()) break;
    if (!seen.emplace(request.platform->name, gpcs_of(request), request.variant.name).second) continue;
    request.fidelity = finest_fidelity(request.variant);
    // Those of all GPCs: of one, gpc1.crop.quads_blended, there is no column.
    for (const std::string& name : counted_statistics(of_variant_alone(request))) {
      if (name.rfind("gpc", 0) != 0) known.insert(name);
    }
  }
  for (const std::string& column : job.study.columns) {
    if (known.count(column) > 0) continue;
    throw UserError("unknown statistic '" + column + "'", "columns", "no point has one of that name",
                    suggestion(column, {known.begin(), known.end()}, "`vrpipe units` lists them"));
  }
}

std::vector<std::optional<double>> columns_of(const RunResult& run, const std::optional<ImageError>& error,
                                              const Study& study) {
  std::vector<std::optional<double>> values;
  for (const std::string& column : study.columns) {
    if (error && column == psnr_column) values.emplace_back(error->psnr_db);
    if (error && column == ssim_column) values.emplace_back(error->ssim);
    if (error && column == max_error_column) values.emplace_back(error->max_abs_error);
    if (is_of_image(column)) continue;
    const StatisticReport* const found = statistic_named(run.statistics, column);
    std::optional<double>& value = values.emplace_back();
    if (found == nullptr) continue;
    value = found->denominator ? found->quotient() : static_cast<double>(found->value);
  }
  return values;
}

std::uint64_t storage_of(const RunRequest& request) {
  if (!request.variant.quad_merging) return 0;
  const StorageReport storage = quad_merging_storage(request);
  return storage.tgc_bytes + storage.qru_bytes;
}

/// Throws std::runtime_error or json::exception for what to_record() cannot have made.
PointOutcome sweep_from_record(const nlohmann::json& record, const RunRequest& request) {
  PointOutcome point;
  if (record.contains("fault")) {
    record.at("fault").get_to(point.fault);
    point.run.request = request;
    return point;
  }
  point.run = decode(with_binaries(record.at("run")), request);
  point.run.framebuffer.color = ColorSurface(1, 1, request.format);
  point.run.framebuffer.depth_stencil = DepthStencilSurface(1, 1);
  const nlohmann::json& energy = record.at("energy");
  if (!energy.is_null())
    point.energy = Range{energy.at(0).get<double>(), energy.at(1).get<double>(), energy.at(2).get<double>()};
  point.storage_bytes = storage_of(request);
  for (const nlohmann::json& value : record.at("columns"))
    point.columns.push_back(value.is_null()     ? std::nullopt
                            : value.is_string() ? std::optional(std::numeric_limits<double>::infinity())
                                                : std::optional(value.get<double>()));
  record.at("cpu_seconds").get_to(point.cpu_seconds);
  const nlohmann::json& drawn = record.at("drawn");
  drawn.at(0).get_to(point.drawn.name);
  drawn.at(1).get_to(point.drawn.gaussians_total);
  drawn.at(2).get_to(point.drawn.gaussians_visible);
  drawn.at(3).get_to(point.drawn.width);
  drawn.at(4).get_to(point.drawn.height);
  return point;
}

/// How many points were taken.
std::size_t take_records(const std::vector<nlohmann::json>& records, const std::vector<RunRequest>& requests,
                         SweepResult& result) {
  std::size_t taken = 0;
  std::map<std::string, std::size_t> places;
  for (std::size_t i = 0; i < result.study.points.size(); ++i) places.emplace(point_key(result.study, i).dump(), i);
  for (const nlohmann::json& record : records) {
    try {
      const auto found = places.find(record.at("point").dump());
      if (found == places.end() || result.points[found->second]) continue;
      result.points[found->second] = sweep_from_record(record, requests[found->second]);
      ++taken;
    } catch (const nlohmann::json::exception&) {
      continue;  // damaged: the point is simulated again
    } catch (const std::runtime_error&) {
      continue;
    }
  }
  return taken;
}

/// Of shards that are there, whatever number of them there was; how many points were taken.
std::size_t take_shards(const SweepJob& job, const std::vector<RunRequest>& requests, SweepResult& result) {
  if (!job.journal || job.shard) return 0;
  std::size_t taken = 0;
  const std::filesystem::path folder = job.journal->has_parent_path() ? job.journal->parent_path() : ".";
  const std::string prefix = job.journal->filename().string() + ".";
  std::vector<std::filesystem::path> files;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind(prefix, 0) == 0 && name.find("-of-") != std::string::npos) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (const std::filesystem::path& file : files) {
    const Journal shard = Journal::in_file(file, sweep_identity(job), SweepJob::journal_option);
    taken += take_records(shard.records(), requests, result);
  }
  return taken;
}

/// The time that is left, by what points took so far; warns once of a long study.
class Foresight {
 public:
  Foresight(std::size_t points, unsigned processes, ProgressLine& progress)
      : points_(points), processes_(processes), progress_(progress) {}

  void done(double cpu_seconds) {
    constexpr double hour = 3600;
    seconds_ += cpu_seconds;
    ++done_;
    const std::size_t enough = std::min<std::size_t>(points_, std::max<std::size_t>(2, 2 * processes_));
    if (warned_ || done_ < enough) return;
    warned_ = true;
    const double left = seconds_ / static_cast<double>(done_) * static_cast<double>(points_ - done_) / processes_;
    if (left < hour) return;
    progress_.erase();
    fmt::print(stderr,
               "sweep: the {} points that are left will take about {:.1f} hours; interrupted, the same command goes "
               "on where it was\n",
               points_ - done_, left / hour);
  }

 private:
  std::size_t points_, done_ = 0;
  unsigned processes_;
  double seconds_ = 0;
  bool warned_ = false;
  ProgressLine& progress_;
};

void strip_row(RunResult& run) {
  run.units.clear();
  run.kernels.clear();
  run.statistics.clear();
  run.effects.clear();
  run.draws.clear();
  run.implementations.clear();
  run.parameters.clear();
  run.host_seconds = run.cpu_seconds = 0;
}

/// Simulates the missing points that are this process's, and gives each to `store`.
template <class IsMine, class Store>
void simulate_rows(const SweepJob& job, const std::vector<RunRequest>& requests, SweepResult& result, BatchPlace place,
                   ProgressLine& progress, const IsMine& is_mine, const Store& store) {
  const Study& study = job.study;
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < study.points.size(); ++i) {
    if (!result.points[i] && is_mine(i)) missing.push_back(i);
  }
  // Each scene is loaded once.
  std::stable_sort(missing.begin(), missing.end(), [&](std::size_t a, std::size_t b) {
    return drawn_by(job, study.points[a]).key() < drawn_by(job, study.points[b]).key();
  });
  StudyFrames frames(job);
  std::vector<Task> tasks;
  std::map<std::size_t, DrawnScene> drawn;
  for (const std::size_t i : missing) {
    const auto frame = [&frames, &study, &drawn, i](const RunRequest& request) {
      std::shared_ptr<const Frame> of_point = frames.frame(study.points[i], request);
      drawn[i] = frames.drawn();
      return of_point;
    };
    tasks.push_back({fmt::format("point {}", i), requests[i], frame});
  }
  std::optional<ExactImages> exact_images;
  if (measures_images(study)) exact_images.emplace(job, missing);
  Foresight foresight(missing.size(), result.processes, progress);
  const auto finished = [&](std::size_t task, Simulated&& simulated) {
    const std::size_t i = missing[task];
    PointOutcome point;
    point.run = std::move(simulated.result);
    point.cpu_seconds = point.run.cpu_seconds;
    point.drawn = std::move(drawn[i]);
    // A sum that misses something is none to rank GPUs by.
    const EnergyAmounts amounts = energy_amounts(point.run, shipped_energies());
    if (amounts.missing.empty()) point.energy = energy_report(amounts, shipped_energies()).total;
    std::optional<ImageError> error;
    if (exact_images) {
      progress.show("comparing with the exact image");
      error = exact_images->error(i, *simulated.image);
    }
    point.columns = columns_of(point.run, error, study);
    strip_row(point.run);
    point.storage_bytes = storage_of(requests[i]);
    progress.erase();
    store(to_sweep_record(study, i, point));
    foresight.done(point.cpu_seconds);
    result.points[i] = std::move(point);
  };
  place.failed = [&](std::size_t task, const std::string& fault) {
    const std::size_t i = missing[task];
    PointOutcome point;
    point.fault = fault;
    point.run.request = requests[i];
    progress.erase();
    store(to_sweep_record(study, i, point));
    result.points[i] = std::move(point);
  };
  place.title = "sweep  ";
  if (!tasks.empty()) run_tasks(tasks, exact_images.has_value(), result.processes, place, progress, finished);
}

/// @param requests  of the points
std::vector<RunResult> machines_of(const SweepJob& job, const std::vector<RunRequest>& requests) {
  const Study& study = job.study;
  std::vector<RunResult> machines;
  std::set<std::pair<std::size_t, std::size_t>> seen;
  for (std::size_t i = 0; i < requests.size(); ++i) {
    if (!seen.insert(study.machine_of(study.points[i].values)).second) continue;
    RunResult& machine = machines.emplace_back();
    machine.request = job.common.requests.front();
    machine.request.platform = requests[i].platform;
    machine.request.variant = requests[i].variant;
    machine.request.name = requests[i].name;
    machine.request.fidelity = std::min(machine.request.fidelity, finest_fidelity(requests[i].variant));
    // Of the first such point, whose settings are known to go together.
    machine.parameters = requests[i].variant.is_of_pipeline() ? final_parameters(requests[i])
                                                              : check_software(of_variant_alone(requests[i]));
    const auto& preprocess = job.common.preprocess_parameters;
    machine.parameters.insert(machine.parameters.end(), preprocess.begin(), preprocess.end());
  }
  return machines;
}

std::string to_message(const nlohmann::json& record) {
  const std::vector<std::uint8_t> bytes = nlohmann::json::to_cbor(record);
  return {bytes.begin(), bytes.end()};
}

/// One rank of several: the first keeps the journal and collects what the leaders of other machines send it.
void simulate_as_rank(const SweepJob& job, const std::vector<RunRequest>& requests, Ranks& ranks, SweepResult& result,
                      ProgressLine& progress) {
  std::string done(result.points.size(), '0');
  for (std::size_t i = 0; i < done.size(); ++i) done[i] = result.points[i] ? '1' : '0';
  done = ranks.broadcast(done);
  const auto missing = static_cast<std::size_t>(std::count(done.begin(), done.end(), '0'));
  std::size_t collected = 0;
  const auto is_mine = [&](std::size_t i) {
    const std::size_t slot = i % ranks.all_slots();
    return done[i] == '0' && slot >= ranks.first_slot() && slot < ranks.first_slot() + ranks.slots();
  };
  BatchPlace place;
  if (!ranks.is_first()) {
    if (ranks.is_leader()) {
      simulate_rows(job, requests, result, place, progress, is_mine,
                    [&](const nlohmann::json& record) { ranks.send(to_message(record)); });
    }
    return ranks.wait_for_all();
  }
  place.meanwhile = [&] {
    while (const auto message = ranks.receive()) {
      const nlohmann::json record = nlohmann::json::from_cbor(*message);
      result.journal->append(record);
      collected += take_records({record}, requests, result);
    }
  };
  simulate_rows(job, requests, result, place, progress, is_mine, [&](const nlohmann::json& record) {
    result.journal->append(record);
    ++collected;
  });
  while (collected < missing) {
    place.meanwhile();
    progress.show(fmt::format("sweep  {} of {} points, other machines are at work", collected, missing));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  progress.erase();
  ranks.wait_for_all();
}

}  // namespace

std::string scene_of_axis(const SweepJob& job, const std::string& value) {
  return with_file(value, true,
                   [&](const std::filesystem::path& file) { return in_folder(job.study_file.parent_path(), file); });
}

RunRequest request_of(const SweepJob& job, const StudiedPoint& point) {
  RunRequest request = job.common.requests.front();
  request.reads_statistics = request.reads_statistics || !job.study.columns.empty();
  for (std::size_t i = 0; i < job.study.axes.size(); ++i) {
    const std::string& axis = job.study.axes[i].name;
    if (point.values[i] == no_value) continue;
    const std::string& value = job.study.axes[i].values[point.values[i]];
    if (axis == "platform") request.platform = &platform_named(value);
    if (axis == "variant") request.variant = variant_named(value);
    if (axis == "fidelity") choose_fidelity(request, value);
    if (axis == "format") request.format = color_format_named(value);
    if (axis == "termination") request.termination = termination_named(value);
    if (!is_parameter(axis) || axis.rfind("preprocess.", 0) == 0) continue;
    const std::size_t dot = axis.rfind('.');
    request.settings.push_back({axis.substr(0, dot), axis.substr(dot + 1), value});
  }
  request.name = request.variant.name;
  // What an axis says stands, and is refused if it cannot be.
  if (!job.study.axis("fidelity")) request.fidelity = std::min(request.fidelity, finest_fidelity(request.variant));
  for (std::size_t i = 0; i < job.study.axes.size(); ++i) {
    const std::string& axis = job.study.axes[i].name;
    const std::string slot = axis.substr(0, axis.rfind('.'));
    if (point.values[i] == no_value || !is_outside_pipeline(slot) || draws_with(request.variant, slot)) continue;
    throw UserError("axis " + axis + " changes nothing", "variant " + request.variant.name,
                    "no variant of the study draws with " + slot, "add variant = [\"software\"] or [\"accelerator\"]");
  }
  for (const Setting& own : request.variant.changed_settings) {
    const std::string name = own.unit + "." + own.parameter;
    for (const StudyAxis& axis : job.study.axes) {
      if (axis.name == name)
        throw UserError("axis " + name + " changes nothing", "variant " + request.variant.name,
                        "it sets " + name + " itself", "leave it out of the variant, or of the axes");
    }
  }
  return request;
}

void leave_out_absent(SweepJob& job) {
  Study& study = job.study;
  std::set<std::pair<std::size_t, std::size_t>> machines;
  for (const StudiedPoint& point : study.points) machines.insert(study.machine_of(point.values));
  for (std::size_t i = 0; i < study.axes.size(); ++i) {
    const std::string& name = study.axes[i].name;
    if (!is_parameter(name) || follows_the_point(name)) continue;
    std::set<std::pair<std::size_t, std::size_t>> without;
    for (const auto& machine : machines) {
      RunRequest request = job.common.requests.front();
      if (const auto axis = study.axis("platform"))
        request.platform = &platform_named(study.axes[*axis].values[machine.first]);
      if (const auto axis = study.axis("variant"))
        request.variant = variant_named(study.axes[*axis].values[machine.second]);
      if (!declares(request, name)) without.insert(machine);
    }
    // What none has is a mistake.
    if (without.size() == machines.size()) continue;
    for (const auto& machine : without) study.absent[machine].insert(i);
  }
  study.leave_out_absent();
}

void choose_references(SweepJob& job) {
  RunRequest usual = job.common.requests.front();
  const auto place_of = [](const StudyAxis& axis, const std::string& value) {
    const auto found = std::find(axis.values.begin(), axis.values.end(), value);
    return found == axis.values.end() ? std::size_t{0} : static_cast<std::size_t>(found - axis.values.begin());
  };
  for (StudyAxis& axis : job.study.axes) {
    if (axis.name == "variant") axis.reference = place_of(axis, "baseline");
    if (axis.name == "format") axis.reference = place_of(axis, name_of(usual.format));
    if (axis.name == "termination") axis.reference = place_of(axis, name_of(usual.termination));
    if (axis.name == "platform") usual.platform = &platform_named(axis.values.front());
  }
  usual.variant = variant_named("het+qm");
  for (StudyAxis& axis : job.study.axes) {
    if (!is_parameter(axis.name) || follows_the_point(axis.name)) continue;
    const std::size_t dot = axis.name.rfind('.');
    const auto value_in = [&](const RunRequest& request) {
      const bool is_outside = is_outside_pipeline(axis.name.substr(0, dot));
      for (const auto& [name, value] : is_outside ? check_software(request) : final_parameters(request)) {
        if (name == axis.name) return value;
      }
      return std::string();
    };
    try {
      const std::string own = value_in(usual);
      for (std::size_t i = axis.values.size(); i-- > 0 && !own.empty();) {
        RunRequest set = usual;
        set.settings.push_back({axis.name.substr(0, dot), axis.name.substr(dot + 1), axis.values[i]});
        if (value_in(set) == own) axis.reference = i;
      }
    } catch (const UserError&) {
      // Said of the point that has it.
    }
  }
}

SweepResult run_sweep(const SweepJob& job) {
  SweepResult result;
  result.provenance = job.common.provenance;
  result.options = job.options;
  result.preprocessing = job.common.preprocessing;
  result.passes = job.common.frame.passes;
  result.study = job.study;
  result.points.resize(job.study.points.size());
  result.processes = job.common.processes;
  check_views(job);
  std::vector<RunRequest> requests;
  for (const StudiedPoint& point : job.study.points) {
    try {
      requests.push_back(request_of(job, point));
      check_configuration(of_variant_alone(requests.back()));
    } catch (const UserError& error) {
      throw error.also_in("of the point " + point_text(job.study, point));
    }
  }
  check_columns(job, requests);
  result.machines = machines_of(job, requests);
  ProgressLine progress;
  const auto start = SteadyClock::now();
  const std::unique_ptr<Ranks> ranks = join_ranks();
  if (ranks && job.shard)
    throw UserError("cannot use option", "--shard", "mpirun shares the study already", "leave out this or mpirun");
  if (ranks) result.processes = ranks->slots();
  result.is_elsewhere = ranks && !ranks->is_first();
  if (!result.is_elsewhere) {
    result.journal = std::make_shared<Journal>(open_sweep_journal(job));
    result.done_before = take_records(result.journal->records(), requests, result) + take_shards(job, requests, result);
    if (result.done_before > 0)
      fmt::print(stderr, "sweep: {} of {} points were done before\n", result.done_before, result.points.size());
  }
  if (ranks) {
    simulate_as_rank(job, requests, *ranks, result, progress);
  } else {
    simulate_rows(
        job, requests, result, {}, progress, [&](std::size_t i) { return !job.shard || job.shard->has(i); },
        [&](const nlohmann::json& record) { result.journal->append(record); });
  }
  result.seconds = std::chrono::duration<double>(SteadyClock::now() - start).count();
  return result;
}

}  // namespace vrpipe::tools
