#include "jobs/microbench_job.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

#include "host/stopwatch.h"
#include "jobs/microbench_bench.h"
#include "jobs/published_figures.h"

namespace vrpipe {

namespace tools {

void MicrobenchBench::run(bool with_images) {
  const std::size_t first = done_.size();
  const std::vector<Task> tasks(tasks_.begin() + static_cast<std::ptrdiff_t>(first), tasks_.end());
  done_.resize(tasks_.size());
  BatchPlace place;
  place.title = definition_.name;
  run_tasks(tasks, with_images, processes_, place, progress_,
            [&](std::size_t index, Simulated&& simulated) { done_[first + index] = std::move(simulated); });
  progress_.erase();
  result_.parameters = done_.front().result.parameters;
}

void MicrobenchBench::figure(const std::string& name, double measured, const std::string& note) {
  add_figure(published_figure(definition_.name, name), name, {}, measured, note);
}

void MicrobenchBench::law(const std::string& group, const std::string& label, double measured, double gpu,
                          const char* unit, const std::string& source) {
  // Of all laws alike: what is further off is shown to differ.
  constexpr double tolerance_percent = 5;
  const std::string name = fmt::format("{}: {}", group, label);
  add_figure({definition_.name, name.c_str(), unit, std::nullopt, gpu, GpuScope::gpc, tolerance_percent, source.c_str(),
              ""},
             name, group, measured, {});
}

void MicrobenchBench::add_figure(const PublishedFigure& published, const std::string& name, const std::string& group,
                                 double measured, const std::string& note) {
  const std::string& platform = request_.platform->name;
  const bool is_real_gpus = platform == measured_platform;
  const bool is_papers = platform.rfind("agx-orin", 0) == 0;
  MicrobenchFigure figure;
  figure.name = name;
  figure.group = group;
  figure.unit = published.unit;
  figure.paper = published.paper;
  figure.gpu = published.gpu;
  figure.measured = measured;
  figure.tolerance_percent = published.tolerance_percent;
  figure.source = published.source;
  if (!is_real_gpus && published.gpu && published.scope == GpuScope::partition) figure.gpu_is_of = one_partition;
  if (!is_real_gpus && published.gpu && published.scope == GpuScope::gpc) figure.gpu_is_of = one_gpc;
  const bool is_same = published.scope == GpuScope::any;
  const bool papers_holds = published.paper && (is_papers || is_same);
  if (published.gpu && (is_real_gpus || (is_same && !papers_holds))) {
    figure.reference = published.gpu;
    figure.reference_is = "real GPU";
  } else if (papers_holds) {
    figure.reference = published.paper;
    figure.reference_is = "paper";
  }
  figure.note = note;
  if (note.empty() && !figure.agrees() && figure.reference) figure.note = published.why;
  result_.figures.push_back(std::move(figure));
}

}  // namespace tools

namespace {

const std::vector<tools::MicrobenchDefinition>& definitions() {
  static const std::vector<tools::MicrobenchDefinition> all{
      {"tile-binning",
       "How many screen tiles are binned at a time, which bin goes for another, and when does one time out?", false,
       tools::measure_tile_binning},
      {"rop-throughput", "How many pixels a clock does CROP write or blend, by format, in its cache and beyond it?",
       true, tools::measure_rop_throughput},
      {"quad-coverage", "Does a quad with fewer live pixels take less time?", true, tools::measure_quad_coverage},
      {"crop-cache", "What does the colour cache hold, and what does a line cost that comes back?", true,
       tools::measure_crop_cache},
      {"blend-order", "Are pixels blended in the order of primitives, whatever delays the shaders?", false,
       tools::measure_blend_order},
      {"front-end",
       "How many clocks does a primitive take, or a (primitive, screen tile) pair, when nothing is shaded?", true,
       tools::measure_front_end},
      {"kill-rate", "How many quads a clock do stencil, depth, Hi-Z and the shader kill?", true,
       tools::measure_kill_rate},
      {"strips", "How long does CROP take for rectangles whose lines it has to fetch and to write back?", true,
       tools::measure_strips, true},
      {"equal-splats", "How long does a splat of one size take, by what becomes of it?", true,
       tools::measure_equal_splats, true},
      {"same-place", "How long does a quad wait for the one before on the same place?", true, tools::measure_same_place,
       true},
      {"returning-lines", "How long does a line wait that has left the cache and comes back?", true,
       tools::measure_returning_lines, true},
  };
  return all;
}

std::vector<std::string> names_of(bool laws) {
  std::vector<std::string> names;
  for (const tools::MicrobenchDefinition& each : definitions()) {
    if (each.is_law == laws) names.emplace_back(each.name);
  }
  return names;
}

const tools::MicrobenchDefinition& definition_named(const std::string& name) {
  const std::vector<tools::MicrobenchDefinition>& all = definitions();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const tools::MicrobenchDefinition& each) { return each.name == name; });
  if (found != all.end()) return *found;
  const std::vector<std::string> papers = microbench_names();
  const std::vector<std::string> laws = law_names();
  std::vector<std::string> known = papers;
  known.insert(known.end(), laws.begin(), laws.end());
  throw UserError("unknown microbenchmark '" + name + "'", "vrpipe microbench", "there is no such one",
                  suggestion(name, known,
                             fmt::format("there are {}, and all; {}, and laws", fmt::join(papers, ", "),
                                         fmt::join(laws, ", "))));
}

}  // namespace

std::optional<double> MicrobenchFigure::difference_percent() const {
  if (!reference) return std::nullopt;
  if (measured == *reference) return 0;
  if (*reference == 0) return std::nullopt;
  return 100 * (measured / *reference - 1);
}

bool MicrobenchFigure::agrees() const {
  const std::optional<double> difference = difference_percent();
  return difference && std::fabs(*difference) <= std::max(tolerance_percent, 0.0);
}

std::string MicrobenchFigure::label() const { return group.empty() ? name : name.substr(group.size() + 2); }

std::vector<MicrobenchGroup> MicrobenchResult::groups() const {
  std::vector<MicrobenchGroup> groups;
  MicrobenchGroup all;
  all.name = "all";
  const auto add = [](MicrobenchGroup& group, const MicrobenchFigure& figure, double percent) {
    group.mean_percent += (std::fabs(percent) - group.mean_percent) / ++group.figures;
    if (group.figures > 1 && std::fabs(percent) <= std::fabs(group.worst_percent)) return;
    group.worst_percent = percent;
    group.worst = figure.name;
  };
  for (const MicrobenchFigure& figure : figures) {
    const std::optional<double> percent = figure.difference_percent();
    if (figure.group.empty() || !percent) continue;
    auto group =
        std::find_if(groups.begin(), groups.end(), [&](const auto& each) { return each.name == figure.group; });
    if (group == groups.end()) {
      groups.emplace_back().name = figure.group;
      group = groups.end() - 1;
    }
    add(*group, figure, *percent);
    add(all, figure, *percent);
  }
  if (groups.size() > 1) groups.push_back(std::move(all));
  return groups;
}

std::vector<std::string> microbench_names() { return names_of(false); }
std::vector<std::string> law_names() { return names_of(true); }

void check_microbench_name(const std::string& name) { definition_named(name); }

void check_microbench_state(const RunRequest& request) {
  for (const Setting& setting : request.settings) {
    const std::string& of = setting.parameter;
    if (setting.unit != "state" || of == "blend_rounding" || of == "exponential" || of == "subpixel_bits") continue;
    throw UserError("cannot set state." + of, "--set state." + of, "the draw's state is the microbenchmark's own",
                    "of state.* set blend_rounding, exponential or subpixel_bits");
  }
}

void check_microbench(const std::string& name, const RunRequest& request) {
  if (!definition_named(name).needs_time || request.fidelity != Fidelity::functional) return;
  throw UserError("cannot measure " + name, "--fidelity functional", "it measures time, and this fidelity has none",
                  "use bound, lt or cycle");
}

MicrobenchResult run_microbench(const std::string& name, const RunRequest& request, unsigned processes) {
  const tools::MicrobenchDefinition& definition = definition_named(name);
  check_microbench(name, request);
  MicrobenchResult result;
  result.name = name;
  result.question = definition.question;
  result.platform = request.platform->name;
  // The real GPU has neither extension.
  RunRequest baseline = request;
  baseline.variant = variant_named("baseline");
  if (processes == 0) processes = std::max(1U, std::thread::hardware_concurrency());
  const auto start = std::chrono::steady_clock::now();
  tools::MicrobenchBench bench(definition, baseline, processes, result);
  definition.run(bench);
  result.seconds = tools::seconds_since(start);
  return result;
}

}  // namespace vrpipe
