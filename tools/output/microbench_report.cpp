#include "output/microbench_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "output/machines_text.h"
#include "output/report.h"
#include "output/text_plot.h"
#include "output/text_table.h"

namespace vrpipe::tools {

namespace {

constexpr unsigned chart_width = 64;
constexpr unsigned chart_height = 12;
constexpr std::size_t finding_width = 110;
constexpr char of_simulator = '*';
constexpr char of_gpu = 'o';
constexpr char of_paper = '#';

std::string optional_text(const std::optional<double>& value) { return value ? number_text(*value) : "-"; }

/// "2.3 %", of a size.
std::string percent_text(double percent) {
  const double size = std::fabs(percent);
  return fmt::format("{:.{}f} % {}", size, size < 10 ? 1 : 0, percent < 0 ? "less" : "more");
}

std::string plot(const MicrobenchCurve& curve) {
  std::string text = fmt::format("{}: {}, by {}\n", curve.name, curve.y_label, curve.x_label);
  text += text_plot({{of_simulator, curve.measured}, {of_paper, curve.paper}, {of_gpu, curve.gpu}}, chart_width,
                    chart_height);
  text += fmt::format("{} simulator", of_simulator);
  if (!curve.paper.empty()) text += fmt::format(", {} paper", of_paper);
  if (!curve.gpu.empty()) text += fmt::format(", {} real GPU", of_gpu);
  return text + '\n';
}

std::string figures_table(const MicrobenchResult& result, const TextStyle& style) {
  TextTable figures_table({"", "paper", "real GPU", "simulator", "unit"});
  figures_table.left(4);
  for (const MicrobenchFigure& figure : result.figures) {
    figures_table.row(
        {figure.name, optional_text(figure.paper), gpu_text(figure), number_text(figure.measured), figure.unit});
  }
  std::string text = figures_table.text(style);
  const auto of_a_part = [](const MicrobenchFigure& figure) { return figure.gpu_is_of == one_partition; };
  if (std::any_of(result.figures.begin(), result.figures.end(), of_a_part))
    text += "the real GPU's graphics GPC has one ROP partition, the paper's two\n";
  return text;
}

/// Of figures that are judged in groups.
std::string groups_table(const MicrobenchResult& result, const TextStyle& style) {
  TextTable table({"", "real GPU", "simulator", "ratio", "unit"});
  table.left(4);
  std::string group;
  for (const MicrobenchFigure& figure : result.figures) {
    if (figure.group != group) table.group(figure.group);
    group = figure.group;
    const std::string ratio = figure.reference ? fmt::format("{:.3f}", figure.measured / *figure.reference) : "-";
    table.row({figure.label(), gpu_text(figure), number_text(figure.measured), ratio, figure.unit});
  }
  return table.text(style);
}

std::string plural(unsigned count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace

std::string finding(const MicrobenchGroup& group) {
  const bool is_own = group.worst.rfind(group.name + ": ", 0) == 0;
  return fmt::format("{}: {}, off by {:.1f} % in the mean, by {:+.1f} % at most ({})", group.name,
                     plural(group.figures, "figure"), group.mean_percent, group.worst_percent,
                     is_own ? group.worst.substr(group.name.size() + 2) : group.worst);
}

std::vector<std::string> findings(const MicrobenchResult& result) {
  std::vector<std::string> all;
  for (const MicrobenchFigure& figure : result.figures) {
    if (figure.group.empty()) all.push_back(finding(figure));
  }
  for (const MicrobenchGroup& group : result.groups()) all.push_back(finding(group));
  return all;
}

std::string number_text(double value) {
  if (!std::isfinite(value)) return "none";
  if (value == std::floor(value) && std::fabs(value) < 1e6) return fmt::format("{:.0f}", value);
  return fmt::format("{:.{}f}", value, std::fabs(value) < 10 ? 3 : 1);
}

std::string gpu_text(const MicrobenchFigure& figure) {
  if (!figure.gpu) return "-";
  return figure.gpu_is_of.empty() ? number_text(*figure.gpu)
                                  : fmt::format("{} ({})", number_text(*figure.gpu), figure.gpu_is_of);
}

std::string finding(const MicrobenchFigure& figure) {
  std::string text = fmt::format("{}: {} {}", figure.name, number_text(figure.measured), figure.unit);
  if (!figure.reference) {
    if (figure.gpu) text += fmt::format("; the real GPU has {}", gpu_text(figure));
  } else {
    const std::string whom = fmt::format("the {}'s {}", figure.reference_is, number_text(*figure.reference));
    const std::optional<double> difference = figure.difference_percent();
    if (figure.tolerance_percent < 0) {
      text += ", beside " + whom;
    } else if (figure.agrees()) {
      text += ", agrees with " + whom;
      if (*difference != 0) text += ": " + percent_text(*difference);
    } else {
      text +=
          difference ? fmt::format(", differs from {}: {}", whom, percent_text(*difference)) : ", differs from " + whom;
    }
  }
  if (!figure.note.empty()) text += "; " + figure.note;
  return text;
}

std::string microbench_text(const MicrobenchRun& run, const TextStyle& style) {
  std::string text = machine_text(run.request, style);
  for (const MicrobenchResult& result : run.results) {
    const bool in_groups = !result.figures.empty() && !result.figures.front().group.empty();
    text += fmt::format("\n{}: {}\n\n", result.name, result.question) +
            (in_groups ? groups_table(result, style) : figures_table(result, style));
    for (const MicrobenchCurve& curve : result.curves) text += '\n' + plot(curve);
    text += '\n';
    for (const std::string& each : findings(result)) {
      const std::vector<std::string> lines = wrapped(each, finding_width);
      for (std::size_t i = 0; i < lines.size(); ++i) text += (i == 0 ? "" : "  ") + lines[i] + '\n';
    }
    text += fmt::format("took {:.1f} s in {} process{} at a time\n", result.seconds, run.processes,
                        run.processes == 1 ? "" : "es");
  }
  return text;
}

}  // namespace vrpipe::tools
