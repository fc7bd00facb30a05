#include "jobs/accuracy_job.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <utility>

#include <vrpipe/component/error.h>
#include <vrpipe/platforms/software.h>
#include <vrpipe/platforms/stress.h>
#include <vrpipe/workloads/exact_image.h>
#include <vrpipe/workloads/scene.h>

#include "host/output_file.h"
#include "host/stopwatch.h"
#include "jobs/comparison.h"
#include "jobs/loaded_frame.h"
#include "jobs/processes.h"
#include "jobs/settings.h"

namespace vrpipe::tools {
namespace {

/// A quick look takes the middle of the image, of which both sides are smaller by this.
constexpr std::uint32_t quick_divisor = 3;
// Of the part of the image that the stress configurations draw, pixels.
constexpr std::uint32_t stress_side = 96;
// Of pictures on the page, at most.
constexpr std::uint32_t picture_width = 280;
constexpr std::uint32_t reference_width = 560;
constexpr const char* reference_name = "reference";

class Stopwatch {
 public:
  double seconds() const { return seconds_since(start_); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

double percent_above(double value, double reference) { return reference > 0 ? 100 * (value / reference - 1) : 0; }

std::optional<double> error_percent(const std::optional<double>& value, const std::optional<double>& reference) {
  if (!value || !reference) return std::nullopt;
  return percent_above(*value, *reference);
}

std::optional<double> cycles_of(const RunResult& run) {
  return run.cycles ? std::optional<double>(static_cast<double>(*run.cycles)) : std::nullopt;
}

/// The scene, and the one frame that most runs share.
struct Workload {
  OpenedScene scene;
  PreprocessOptions options;
  FrameDescription description;
  LoadedFrame frame;
  LoadedFrame stress_frame;  ///< the middle of it

  std::shared_ptr<const Draw> draw_with(const PreprocessOptions& wanted) const {
    if (wanted == options || scene.draw_list) return frame.geometry.front();
    return std::make_shared<const Draw>(preprocess_scene(scene, wanted).draw);
  }
  std::shared_ptr<const Frame> frame_with(const RunRequest& request, const PreprocessOptions& wanted) const {
    LoadedFrame loaded = frame;
    loaded.geometry.front() = draw_with(wanted);
    return make_frame(request, description, loaded);
  }
};

Workload load(const AccuracyJob& job, AccuracyResult& result) {
  Workload workload;
  workload.scene = open_scene(job.simulation.scene);
  if (!workload.scene.meshes.empty())
    result.precision_left_out = "the scene has meshes, and an exact image is of splats alone";
  workload.options = job.simulation.scene.preprocess;
  if (workload.scene.draw_list) {
    result.full_width = workload.scene.draw_list->draw.width;
    result.full_height = workload.scene.draw_list->draw.height;
  } else {
    Camera& camera = workload.scene.viewpoint.camera;
    result.full_width = camera.width;
    result.full_height = camera.height;
    // A part of the image, not a smaller one: splats keep their size, and so the units their share of the work.
    if (job.quick && !job.simulation.scene.size) {
      camera.width = std::max(1U, camera.width / quick_divisor);
      camera.height = std::max(1U, camera.height / quick_divisor);
    }
  }
  workload.description = frame_of_scene(job.simulation.scene.scene);
  workload.frame = load_frame(workload.description, workload.scene, workload.options);
  result.scene = workload.frame.summary;
  result.viewpoint = workload.frame.viewpoint;
  result.preprocessing = job.simulation.preprocessing;
  result.width = workload.frame.width;
  result.height = workload.frame.height;
  workload.stress_frame = workload.frame;
  if (!workload.scene.draw_list) {
    Camera& camera = workload.scene.viewpoint.camera;
    const Camera whole = camera;
    camera.width = std::min(camera.width, stress_side);
    camera.height = std::min(camera.height, stress_side);
    workload.stress_frame = load_frame(workload.description, workload.scene, workload.options);
    camera = whole;
  }
  return workload;
}

void write_image(const AccuracyJob& job, AccuracyResult& result, const std::string& name, const SharedImage& image) {
  const ImageFiles files = image_files(job.simulation, image_name(result.scene.name, name));
  result.files.write(files.png, encode_png(image, job.simulation.background), "--output");
  result.files.write(files.exr, encode_exr(image), "--output");
}

/// What errors are measured against: the image with all bands in exact order, and what is proved of each run.
struct Reference {
  ShownImage image;
  std::vector<std::uint32_t> fragments;     ///< of each pixel
  std::vector<std::vector<double>> proved;  ///< of each run, of each pixel as it is shown; empty where nothing is
};

/// Runs that draw the same splats, by their indices, and the precision that a bound is proved by.
using ProvedRuns = std::vector<std::pair<std::size_t, DrawnPrecision>>;

/// The exact image of a draw as it is shown; adds what is proved of runs that draw it. `reference`, if it is another draw's: then a
/// pixel is off by what the exact images differ, and by what the run is off its own.
ShownImage prove(const Draw& draw, const ProvedRuns& runs, const std::array<float, 3>& background,
                 const ShownImage* reference, BoundedImage& bounded, std::vector<std::vector<double>>& proved) {
  std::vector<DrawnPrecision> precisions;
  for (const auto& [run, precision] : runs) precisions.push_back(precision);
  bounded = render_with_bounds(draw, precisions);
  ShownImage own = shown(bounded.exact, background);
  // What alpha lets through is background.
  const double brightest = *std::max_element(background.begin(), background.end());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::vector<double>& of_run = proved[runs[i].first];
    for (std::size_t pixel = 0; pixel < bounded.bounds[i].size(); ++pixel) {
      double apart = 0;
      for (std::size_t value = 3 * pixel; reference != nullptr && value < 3 * pixel + 3; ++value)
        apart = std::max(apart, std::fabs(own.rgb[value] - reference->rgb[value]));
      const PixelBound& bound = bounded.bounds[i][pixel];
      of_run.push_back(std::min(1.0, apart + bound.color + brightest * bound.alpha));
    }
  }
  return own;
}

Reference make_reference(const AccuracyJob& job, const Workload& workload,
                         const std::vector<PrecisionSettings>& settings, AccuracyResult& result) {
  const Stopwatch watch;
  const PreprocessOptions exact = workload.options.exact();
  std::map<PreprocessOptions, ProvedRuns> runs;
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const std::optional<DrawnPrecision> precision = drawn_precision(settings[i].request);
    if (precision) runs[workload.scene.draw_list ? exact : settings[i].preprocess].emplace_back(i, *precision);
  }
  Reference reference;
  reference.proved.resize(settings.size());
  const auto& background = job.simulation.background;
  BoundedImage bounded;
  reference.image = prove(*workload.draw_with(exact), runs[exact], background, nullptr, bounded, reference.proved);
  reference.fragments = std::move(bounded.fragments);
  if (job.simulation.output) {
    SharedImage image(bounded.exact.width, bounded.exact.height);
    float* value = image.values();
    for (const std::array<double, 4>& pixel : bounded.exact.rgba) {
      value = std::transform(pixel.begin(), pixel.end(), value, [](double x) { return static_cast<float>(x); });
    }
    write_image(job, result, reference_name, image);
  }
  if (job.html) result.reference = picture_of(reference.image, reference_width);
  for (const auto& [options, of_draw] : runs) {
    if (!(options == exact))
      prove(*workload.draw_with(options), of_draw, background, &reference.image, bounded, reference.proved);
  }
  result.reference_seconds = watch.seconds();
  return reference;
}

/// A precision run's name as part of a file's.
std::string file_name(std::string run) {
  std::replace(run.begin(), run.end(), '=', '-');
  return run;
}

using ChosenValues = std::vector<std::pair<std::string, std::string>>;
std::string name_of_values(const ChosenValues& values) {
  std::string name;
  for (const auto& [knob, value] : values) name += (name.empty() ? "" : ",") + knob + "=" + value;
  return name;
}

/// All images that a job may write; values that are not tried are among them.
std::vector<std::string> images_of(const AccuracyJob& job) {
  const std::string scene = scene_name(job.simulation.scene.scene);
  std::vector<std::string> images{image_name(scene, reference_name), image_name(scene, "default")};
  for (const PrecisionKnob& knob : precision_knobs()) {
    for (const std::string& value : knob.values)
      images.push_back(image_name(scene, file_name(knob.name + "=" + value)));
  }
  for (const ChosenValues& values : precision_crossings())
    images.push_back(image_name(scene, file_name(name_of_values(values))));
  return images;
}

/// Compares the levels of a variant, the first of which is the most exact.
void compare_rungs(FidelityLevel* levels, std::size_t count) {
  const FidelityLevel& exact = levels[0];
  std::vector<FidelityLevel*> timed;
  std::vector<TradeOff> trade_offs;
  for (FidelityLevel* level = levels; level != levels + count; ++level) {
    level->fragments_blended_error_percent = percent_above(static_cast<double>(level->run.counts.fragments_blended),
                                                           static_cast<double>(exact.run.counts.fragments_blended));
    level->cycles_error_percent = error_percent(cycles_of(level->run), cycles_of(exact.run));
    level->speedup_error_percent = error_percent(level->speedup, exact.speedup);
    if (level->cpu_seconds > 0) level->times_as_fast = exact.cpu_seconds / level->cpu_seconds;
    if (level->host_seconds > 0) level->times_as_fast_elapsed = exact.host_seconds / level->host_seconds;
    if (!level->run.cycles) continue;
    timed.push_back(level);
    trade_offs.push_back({level->cpu_seconds, std::fabs(level->cycles_error_percent.value_or(0))});
  }
  const std::vector<bool> beaten = dominated(trade_offs, fidelity_tolerance);
  // Without the most exact, nobody knows how exact the others are.
  for (std::size_t i = 1; i < timed.size(); ++i) timed[i]->dominated = beaten[i];
}

bool can_be(const RunRequest& request) {
  try {
    check_configuration(request);
  } catch (const UserError&) {
    return false;
  }
  return true;
}

bool is_of_pipeline(const RunRequest& request) { return request.variant.is_of_pipeline(); }

/// The runs of the fidelity ladder: for each variant from the most exact fidelity on, so that its image is there to
/// compare with.
std::vector<RunRequest> fidelity_requests(const AccuracyJob& job, const Workload& workload) {
  std::vector<RunRequest> requests;
  for (const RunRequest& request : job.simulation.requests) {
    const Variant& variant = request.variant;
    if (job.quick && variant.quad_merging != variant.early_termination) continue;  // pipelines alone have either
    for (auto fidelity = fidelities().rbegin(); fidelity != fidelities().rend(); ++fidelity) {
      if (*fidelity > finest_fidelity(variant)) continue;
      RunRequest level = request;
      level.fidelity = *fidelity;
      if (*fidelity == Fidelity::lt && variant.is_of_pipeline()) {
        for (const std::vector<std::string>& units : job.units_at_cycle) {
          level.units_at_cycle = units;
          if (can_be(level)) requests.push_back(level);
        }
      }
      level.units_at_cycle.clear();
      requests.push_back(level);
      if (*fidelity != Fidelity::cycle) continue;
      level.sampling.emplace();
      if (takes_windows(level, *make_frame(level, workload.description, workload.frame)))
        requests.push_back(std::move(level));
    }
  }
  return requests;
}

void climb_fidelities(const AccuracyJob& job, const Workload& workload, const std::vector<RunRequest>& requests,
                      const BatchPlace& place, AccuracyResult& result, ProgressLine& progress) {
  std::vector<Task> tasks;
  for (unsigned round = 0; round < job.repeat; ++round) {
    for (const RunRequest& request : requests) {
      tasks.push_back({request.variant.name + " " + fidelity_of(request), request, [&workload](const RunRequest& own) {
                         return make_frame(own, workload.description, workload.frame);
                       }});
    }
  }
  result.fidelity.resize(requests.size());
  std::vector<std::vector<double>> host_seconds(requests.size());
  std::vector<std::vector<double>> cpu_seconds(requests.size());
  ShownImage most_exact;
  // One at a time, so that none takes cache or memory from another.
  run_tasks(tasks, true, 1, place, progress, [&](std::size_t index, Simulated&& simulated) {
    const std::size_t rung_index = index % requests.size();
    host_seconds[rung_index].push_back(simulated.result.host_seconds);
    cpu_seconds[rung_index].push_back(simulated.result.cpu_seconds);
    if (index >= requests.size()) return;
    FidelityLevel& level = result.fidelity[rung_index];
    level.run = std::move(simulated.result);
    ShownImage image = shown(*simulated.image, job.simulation.background);
    if (is_finest(level.run.request)) most_exact = image;
    level.image = image_error(image, most_exact);
  });

  for (std::size_t i = 0; i < requests.size(); ++i) {
    FidelityLevel& level = result.fidelity[i];
    level.host_seconds = median(host_seconds[i]);
    level.cpu_seconds = median(cpu_seconds[i]);
    const auto quads = static_cast<double>(level.run.counts.quads_rasterized);
    level.quads_per_second = level.cpu_seconds > 0 ? quads / level.cpu_seconds : 0;
    for (const FidelityLevel& other : result.fidelity) {
      const RunRequest& baseline = other.run.request;
      if (baseline.variant.name != requests.front().variant.name ||
          fidelity_of(baseline) != fidelity_of(level.run.request))
        continue;
      level.speedup = speedup(other.run, level.run);
    }
  }
  for (std::size_t first = 0; first < requests.size();) {
    std::size_t end = first + 1;
    while (end < requests.size() && !is_finest(requests[end])) ++end;
    compare_rungs(&result.fidelity[first], end - first);
    std::reverse(result.fidelity.begin() + static_cast<std::ptrdiff_t>(first),
                 result.fidelity.begin() + static_cast<std::ptrdiff_t>(end));
    first = end;
  }
}

constexpr std::array stress_rungs{Fidelity::bound, Fidelity::lt, Fidelity::cycle};

/// The first variant and the last of what was asked for under every stress configuration, at each of `stress_rungs`, in the
/// middle of the image.
std::vector<Task> stress_tasks(const AccuracyJob& job, const Workload& workload, AccuracyResult& result) {
  std::vector<RunRequest> all, variants;
  std::copy_if(job.simulation.requests.begin(), job.simulation.requests.end(), std::back_inserter(all), is_of_pipeline);
  std::vector<Task> tasks;
  if (all.empty()) return tasks;
  variants.push_back(all.front());
  if (all.size() > 1) variants.push_back(all.back());
  for (const StressConfiguration& configuration : stress_configurations()) {
    if (job.quick && !configuration.quick) continue;
    std::vector<RunRequest> requests;
    try {
      for (const RunRequest& variant : variants) {
        requests.push_back(stressed(of_variant_alone(variant), configuration));
        requests.back().units_at_cycle.clear();
      }
    } catch (const UserError& error) {
      result.stress_left_out.push_back({configuration.name, error.what()});
      continue;
    }
    for (RunRequest& request : requests) {
      result.stress.push_back({configuration.name, request.variant.name, 0, {}});
      for (const Fidelity fidelity : stress_rungs) {
        request.fidelity = fidelity;
        tasks.push_back(
            {configuration.name + " " + vrpipe::name_of(fidelity), request, [&workload](const RunRequest& own) {
               return make_frame(own, workload.description, workload.stress_frame);
             }});
      }
    }
  }
  return tasks;
}

void climb_stress(const AccuracyJob& job, const std::vector<Task>& tasks, const BatchPlace& place,
                  AccuracyResult& result, ProgressLine& progress) {
  if (tasks.empty()) return;
  std::vector<double> cycles(tasks.size());
  const unsigned processes = std::min(job.simulation.processes, static_cast<unsigned>(tasks.size()));
  run_tasks(tasks, false, processes, place, progress,
            [&](std::size_t index, Simulated&& simulated) { cycles[index] = cycles_of(simulated.result).value_or(0); });
  for (std::size_t i = 0; i < result.stress.size(); ++i) {
    const double* const of_row = &cycles[i * stress_rungs.size()];
    const double exact = of_row[stress_rungs.size() - 1];
    result.stress[i].cycles = static_cast<std::uint64_t>(exact);
    for (std::size_t level = 0; level + 1 < stress_rungs.size(); ++level) {
      result.stress[i].error_percent.emplace_back(stress_rungs[level], percent_above(of_row[level], exact));
    }
  }
}

/// All knobs' values, and the settings of the runs that they need; the default is the first run.
std::vector<PrecisionSettings> choose_values(const AccuracyJob& job, bool is_draw_list, AccuracyResult& result) {
  std::vector<PrecisionSettings> settings{{result.base, job.simulation.scene.preprocess}};
  result.runs.resize(1);
  result.runs.front().name = "default";
  for (const PrecisionKnob& knob : precision_knobs()) {
    if (job.quick && knob.quick_value.empty()) continue;
    if (knob.is_preprocessing && is_draw_list) {
      result.knobs_left_out.push_back(knob.name);
      continue;
    }
    if (knob.is_of_pipeline && !result.base.variant.is_of_pipeline()) {
      result.knobs_without_pipeline.push_back(knob.name);
      continue;
    }
    const std::string chosen = knob.value(settings.front());
    std::vector<std::string> values = job.quick ? std::vector<std::string>{knob.quick_value} : knob.values;
    if (std::find(values.begin(), values.end(), chosen) == values.end()) values.insert(values.begin(), chosen);
    for (const std::string& value : values) {
      if (value == chosen) {
        result.precision.push_back({&knob, value, 0});
        continue;
      }
      PrecisionSettings tried = settings.front();
      knob.set(tried, value);
      if (!can_round(tried)) {
        result.values_never_measured.push_back(knob.name + "=" + value);
        continue;
      }
      result.precision.push_back({&knob, value, settings.size()});
      settings.push_back(std::move(tried));
      result.runs.emplace_back();
      result.runs.back().name = knob.name + "=" + value;
    }
  }
  if (job.quick || !result.base.variant.is_of_pipeline()) return settings;
  for (const auto& values : precision_crossings()) {
    PrecisionSettings crossed = settings.front();
    ChosenValues changed;
    for (const auto& [name, value] : values) {
      const auto knob = std::find_if(precision_knobs().begin(), precision_knobs().end(),
                                     [&, name = name](const PrecisionKnob& each) { return each.name == name; });
      if (knob->value(settings.front()) == value) continue;
      knob->set(crossed, value);
      changed.emplace_back(name, value);
    }
    if (!can_round(crossed)) continue;
    std::size_t run = changed.empty() ? 0 : settings.size();
    for (const PrecisionRow& row : result.precision) {
      if (changed.size() == 1 && row.knob->name == changed.front().first && row.value == changed.front().second)
        run = row.run;
    }
    result.crossed.push_back({values, run});
    if (run < settings.size()) continue;
    settings.push_back(std::move(crossed));
    result.runs.emplace_back();
    result.runs.back().name = name_of_values(changed);
  }
  return settings;
}

void climb_precisions(const AccuracyJob& job, const Workload& workload, const std::vector<PrecisionSettings>& settings,
                      const Reference& reference, const BatchPlace& place, AccuracyResult& result,
                      ProgressLine& progress) {
  const EnergyTable& energies = shipped_energies();
  // The runs with one change come first.
  std::size_t single = 1;
  for (const PrecisionRow& row : result.precision) single = std::max(single, row.run + 1);
  std::vector<Task> tasks;
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const PreprocessOptions options = settings[i].preprocess;
    tasks.push_back({result.runs[i].name, settings[i].request,
                     [&workload, options](const RunRequest& own) { return workload.frame_with(own, options); }});
  }
  result.processes = std::min(job.simulation.processes, static_cast<unsigned>(tasks.size()));
  run_tasks(tasks, true, result.processes, place, progress, [&](std::size_t index, Simulated&& simulated) {
    PrecisionRun& run = result.runs[index];
    run.run = std::move(simulated.result);
    const ShownImage image = shown(*simulated.image, job.simulation.background);
    run.error = image_error(image, reference.image);
    const std::vector<double>& proved = reference.proved[index];
    run.by_fragments = error_by_fragments(image, reference.image, reference.fragments, proved);
    if (!proved.empty()) run.proved_max_error = *std::max_element(proved.begin(), proved.end());
    run.l2_bytes = memory_bytes_moved(run.run.statistics, "l2");
    run.dram_bytes = memory_bytes_moved(run.run.statistics, "dram");
    const EnergyAmounts amounts = energy_amounts(run.run, energies);
    if (amounts.is_known) run.millijoules = energy_report(amounts, energies).total;
    if (const StatisticReport* const stuck = statistic_named(run.run.statistics, "crop.pixels_stuck"))
      run.pixels_stuck = stuck->value;
    if (job.html) {
      run.picture = picture_of(image, picture_width);
      run.error_map = error_map(image, reference.image, picture_width);
    }
    if (!job.simulation.output) return;
    // What several choices come to is called by all of them, whatever the default is.
    const auto crossed = std::find_if(result.crossed.begin(), result.crossed.end(),
                                      [&](const CrossedRow& row) { return index >= single && row.run == index; });
    const std::string name = crossed == result.crossed.end() ? run.name : name_of_values(crossed->values);
    write_image(job, result, file_name(name), *simulated.image);
  });

  std::vector<TradeOff> trade_offs;
  for (PrecisionRun& run : result.runs)
    run.cycles_change_percent = error_percent(cycles_of(run.run), cycles_of(result.runs.front().run));
  for (std::size_t i = 0; i < single; ++i)
    trade_offs.push_back({cycles_of(result.runs[i].run).value_or(0), -result.runs[i].error.psnr_db});
  if (!result.runs.front().run.cycles) return;
  const std::vector<bool> front = pareto_front(trade_offs, precision_tolerance);
  for (std::size_t i = 0; i < front.size(); ++i) result.runs[i].on_front = front[i];
}

/// Two near views, at `functional`: images depend on time in paper termination alone, and by no more than the threshold leaves.
void measure_popping(const AccuracyJob& job, const Workload& workload, const std::vector<PrecisionSettings>& settings,
                     const ShownImage& reference, const BatchPlace& place, AccuracyResult& result,
                     ProgressLine& progress) {
  if (workload.scene.draw_list || !result.base.variant.is_of_pipeline()) return;
  const std::shared_ptr<const Draw> exact_draw = workload.draw_with(workload.options.exact());
  if (exact_draw->splats.empty()) return;
  // Splats go from the nearest to the farthest.
  const auto depth = static_cast<double>(exact_draw->splats[exact_draw->splats.size() / 2].depth);
  Workload next = workload;
  Camera& camera = next.scene.viewpoint.camera;
  const double near = camera.near_plane;
  const double far = camera.far_plane;
  // By which window positions are divided there: camera z, of its window depth, and 1 without perspective.
  const double divisor = camera.projection == Projection::perspective ? near * far / (far - depth * (far - near)) : 1.0;
  for (std::size_t axis = 0; axis < 3; ++axis) camera.eye[axis] += camera.rotation[axis].x * divisor / camera.fx;
  next.frame = load_frame(next.description, next.scene, next.options);
  const ShownImage next_reference =
      shown(render_exactly(*next.draw_with(next.options.exact())), job.simulation.background);

  std::vector<Task> tasks;
  const auto compare_views = [&](std::size_t run) {
    result.popping.push_back({result.runs[run].name});
    PrecisionSettings chosen = settings[run];
    chosen.request.fidelity = Fidelity::functional;
    for (const Workload* const view : {&workload, static_cast<const Workload*>(&next)}) {
      tasks.push_back(
          {result.popping.back().run, chosen.request,
           [view, options = chosen.preprocess](const RunRequest& own) { return view->frame_with(own, options); }});
    }
  };
  compare_views(0);
  const std::vector<std::string> knobs{"depth_key_bits", "format", "attributes", "shading"};
  for (const PrecisionRow& row : result.precision) {
    if (row.run != 0 && std::find(knobs.begin(), knobs.end(), row.knob->name) != knobs.end()) compare_views(row.run);
  }
  std::vector<ShownImage> images(tasks.size());
  const unsigned processes = std::min(job.simulation.processes, static_cast<unsigned>(tasks.size()));
  run_tasks(tasks, true, processes, place, progress, [&](std::size_t index, Simulated&& simulated) {
    images[index] = shown(*simulated.image, job.simulation.background);
  });
  for (std::size_t i = 0; i < result.popping.size(); ++i) {
    PoppingRow& row = result.popping[i];
    std::size_t popped = 0;
    double squares = 0;
    for (std::size_t pixel = 0; pixel < reference.rgb.size() / 3; ++pixel) {
      double largest = 0;
      for (std::size_t value = 3 * pixel; value < 3 * pixel + 3; ++value) {
        const double change = images[2 * i + 1].rgb[value] - images[2 * i].rgb[value];
        const double off = change - (next_reference.rgb[value] - reference.rgb[value]);
        squares += off * off;
        largest = std::max(largest, std::fabs(off));
      }
      row.max_abs = std::max(row.max_abs, largest);
      popped += largest > 1 / 255.0 ? 1 : 0;
    }
    const auto values = static_cast<double>(reference.rgb.size());
    row.rms = std::sqrt(squares / values);
    row.share_of_pixels = 3 * static_cast<double>(popped) / values;
  }
}

}  // namespace

AccuracyResult measure_accuracy(const AccuracyJob& job, ProgressLine& progress) {
  std::vector<NamedFile> page;
  if (job.html) page.push_back({"--html", *job.html});
  check_outputs(job.simulation, images_of(job), page);
  const Stopwatch watch;
  AccuracyResult result;
  result.provenance = job.simulation.provenance;
  result.quick = job.quick;
  result.repeat = job.repeat;
  const std::vector<RunRequest>& requests = job.simulation.requests;
  const auto base = std::find_if(requests.rbegin(), requests.rend(), is_of_pipeline);  // with all that the paper adds
  result.base = base != requests.rend() ? *base : requests.back();
  progress.show("loading the scene");
  const Workload workload = load(job, result);
  for (const RunRequest& request : requests)
    check_drawable(request, *make_frame(request, workload.description, workload.frame));
  if (job.simulation.output) {
    if (!result.precision_left_out.empty()) {
      throw UserError("cannot write images", "--output",
                      "they are those of the precision ladder, which there is none of: " + result.precision_left_out,
                      "leave out --output");
    }
    create_output_folder(*job.simulation.output, "--output");
  }
  save_draw(job.simulation, workload.frame);
  const bool has_precision = result.precision_left_out.empty();
  std::vector<PrecisionSettings> values;
  Reference reference;
  if (has_precision) {
    values = choose_values(job, workload.scene.draw_list.has_value(), result);
    progress.show("rendering the exact image");
    reference = make_reference(job, workload, values, result);
  }

  const std::vector<RunRequest> levels = fidelity_requests(job, workload);
  const std::vector<Task> stress = stress_tasks(job, workload, result);
  const std::size_t climbs = job.repeat * levels.size();
  const Stopwatch ladders;
  climb_fidelities(job, workload, levels, {"fidelity ", 0, stress.size() + values.size(), 0}, result, progress);
  climb_stress(job, stress, {"stress ", climbs, values.size(), ladders.seconds()}, result, progress);
  if (has_precision) {
    climb_precisions(job, workload, values, reference, {"precision ", climbs + stress.size(), 0, ladders.seconds()},
                     result, progress);
    measure_popping(job, workload, values, reference.image,
                    {"near views ", climbs + stress.size() + values.size(), 0, ladders.seconds()}, result, progress);
  } else {
    result.runs.resize(1);
    for (const FidelityLevel& level : result.fidelity) {
      if (level.run.request.variant.name == result.base.variant.name) result.runs.front().run = level.run;
    }
  }
  if (!workload.scene.draw_list) {
    for (PrecisionRun& run : result.runs)
      add_preprocess_parameters(job.simulation.preprocess_parameters, result.scene, run.run);
  }
  result.seconds = watch.seconds();
  return result;
}

}  // namespace vrpipe::tools
