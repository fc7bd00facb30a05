#include <algorithm>

#include <fmt/format.h>

#include "output/compare_sections.h"
#include "output/page_parts.h"
#include "output/report.h"
#include "output/svg_plot.h"

namespace vrpipe::tools {
namespace {

using CountOf = std::uint64_t Counts::*;

/// What is taken away on the way to a stage, of quads or of fragments.
struct FunnelStep {
  const char* name;
  std::vector<CountOf> taken;
  bool always;  ///< also where nothing is taken in any run
};

struct Funnel {
  const char* what;
  CountOf first;
  std::vector<FunnelStep> steps;
};

const Funnel& quad_funnel() {
  static const Funnel funnel{
      "quads",
      &Counts::quads_rasterized,
      {{"after depth and stencil", {&Counts::quads_depth_stencil_failed}, false},
       {"after termination", {&Counts::quads_terminated}, true},
       {"shaded", {&Counts::quads_unshaded}, true},
       {"after pruning", {&Counts::quads_pruned}, true},
       {"after merging", {&Counts::quads_merged}, true},
       {"blended", {&Counts::quads_dropped_late, &Counts::quads_late_failed, &Counts::quads_unblended}, true}}};
  return funnel;
}

const Funnel& fragment_funnel() {
  static const Funnel funnel{"fragments",
                             &Counts::fragments_rasterized,
                             {{"after depth and stencil", {&Counts::fragments_depth_stencil_failed}, false},
                              {"after termination", {&Counts::fragments_terminated}, true},
                              {"shaded", {&Counts::fragments_unshaded}, true},
                              {"after pruning", {&Counts::fragments_pruned}, true},
                              {"after merging", {&Counts::fragments_merged}, true},
                              {"blended",
                               {&Counts::fragments_dropped_late, &Counts::fragments_late_failed,
                                &Counts::fragments_unblended},
                               true}}};
  return funnel;
}

std::uint64_t taken(const FunnelStep& step, const Counts& counts) {
  std::uint64_t sum = 0;
  for (const CountOf count : step.taken) sum += counts.*count;
  return sum;
}

struct FunnelStage {
  std::string name;
  std::vector<std::uint64_t> of_run;
};

std::vector<FunnelStage> stages_of(const Funnel& funnel, const std::vector<RunResult>& runs) {
  std::vector<FunnelStage> stages{{"rasterized", {}}};
  for (const RunResult& run : runs) stages.front().of_run.push_back(run.counts.*funnel.first);
  for (const FunnelStep& step : funnel.steps) {
    FunnelStage stage{step.name, stages.back().of_run};
    bool takes = step.always;
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const std::uint64_t less = taken(step, runs[i].counts);
      stage.of_run[i] -= std::min(less, stage.of_run[i]);
      takes = takes || less > 0;
    }
    if (takes) stages.push_back(std::move(stage));
  }
  return stages;
}

std::string amount(std::uint64_t value) {
  if (value >= 1000000) return fmt::format("{:.2f} M", static_cast<double>(value) * 1e-6);
  if (value >= 10000) return fmt::format("{:.1f} k", static_cast<double>(value) * 1e-3);
  return fmt::format("{}", value);
}

// Pixels of the drawing.
constexpr double funnel_width = 1040;
constexpr double funnel_left = 160;
constexpr double funnel_right = 1024;
constexpr double funnel_room = 64;  // of a column, for what stands beside a bar
constexpr double stage_height = 26;
constexpr double stage_step = 42;
constexpr double funnel_heading = 30;
constexpr std::size_t most_columns = 4;
constexpr const char* stage_color = "#b4cbe0";
constexpr const char* last_color = "#123a5c";

/// One run: a bar for each stage, in the middle, with what narrows it between.
std::string funnel_column(const std::string& run, const std::vector<FunnelStage>& stages, std::size_t index, double x,
                          double y, double column, double greatest) {
  const double middle = x + column / 2;
  const auto half = [&](std::uint64_t value) {
    return greatest > 0 ? static_cast<double>(value) / greatest * (column - funnel_room) / 2 : 0;
  };
  std::string text =
      fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"axis strong\">{}</text>\n", middle,
                  y + 14, html_escaped(run));
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const std::uint64_t value = stages[i].of_run[index];
    const std::uint64_t first = stages.front().of_run[index];
    const double top = y + funnel_heading + stage_step * static_cast<double>(i);
    const double share = first > 0 ? 100 * static_cast<double>(value) / static_cast<double>(first) : 0;
    if (i > 0) {
      const double above = half(stages[i - 1].of_run[index]);
      const double begin = top - stage_step + stage_height;
      text +=
          fmt::format("<polygon points=\"{:.1f},{:.1f} {:.1f},{:.1f} {:.1f},{:.1f} {:.1f},{:.1f}\" class=\"flow\"/>\n",
                      middle - above, begin, middle + above, begin, middle + half(value), top, middle - half(value),
                      top);
    }
    text += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{}\" fill=\"{}\" class=\"piece\"><title>{}, {}: {}, "
        "{:.1f} % of those rasterized</title></rect>\n",
        middle - half(value), top, std::max(1.0, 2 * half(value)), stage_height,
        i + 1 == stages.size() ? last_color : stage_color, html_escaped(run), html_escaped(stages[i].name),
        grouped(value), share);
    const std::string label = i == 0 ? amount(value) : fmt::format("{}, {:.0f} %", amount(value), share);
    const bool fits = 2 * half(value) > 6.1 * static_cast<double>(label.size()) + 8;
    const bool is_light = fits && i + 1 == stages.size();
    text += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" class=\"small {}\">{}</text>\n",
                        fits ? middle : middle + half(value) + 5, top + stage_height / 2 + 4, fits ? "middle" : "start",
                        is_light ? "light"
                        : fits   ? ""
                                 : "label",
                        label);
  }
  return text;
}

std::string funnel_svg(const char* what, const std::vector<FunnelStage>& stages, const std::vector<RunResult>& runs) {
  const std::size_t columns = std::min(runs.size(), most_columns);
  const double column = std::min(300.0, (funnel_right - funnel_left) / static_cast<double>(columns));
  const double panel = funnel_heading + stage_step * static_cast<double>(stages.size());
  const std::size_t panels = (runs.size() + columns - 1) / columns;
  const double greatest =
      static_cast<double>(*std::max_element(stages.front().of_run.begin(), stages.front().of_run.end()));
  std::string text = fmt::format(
      "<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"what became of {}\" "
      "xmlns=\"http://www.w3.org/2000/svg\">\n",
      funnel_width, panel * static_cast<double>(panels), what);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const double y = panel * static_cast<double>(i / columns);
    if (i % columns == 0) {
      for (std::size_t k = 0; k < stages.size(); ++k) {
        text += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n", funnel_left - 8,
                            y + funnel_heading + stage_step * static_cast<double>(k) + stage_height / 2 + 4,
                            html_escaped(stages[k].name));
      }
    }
    text += funnel_column(name_of(runs[i].request), stages, i, funnel_left + column * static_cast<double>(i % columns),
                          y, column, greatest);
  }
  return text + "</svg>\n";
}

std::string counts_csv(const std::vector<RunResult>& runs) {
  std::vector<std::string> names{"run"};
  for (const auto& count : runs.front().counts.named()) names.push_back(count.first);
  CsvText csv(names);
  for (const RunResult& run : runs) {
    std::vector<std::string> cells{name_of(run.request)};
    for (const auto& count : run.counts.named()) cells.push_back(fmt::format("{}", count.second));
    csv.row(cells);
  }
  return csv.text();
}

}  // namespace

std::string funnels_section(const JobResult& result) {
  const std::string csv = counts_csv(result.runs);
  std::string text;
  for (const Funnel* funnel : {&quad_funnel(), &fragment_funnel()}) {
    const std::vector<FunnelStage> stages = stages_of(*funnel, result.runs);
    text += html(PageFigure{
        funnel->what,
        fmt::format("What becomes of {}, from what is rasterized to what is blended; shares are of those rasterized.",
                    funnel->what),
        funnel_svg(funnel->what, stages, result.runs), csv});
  }
  return text;
}

}  // namespace vrpipe::tools
