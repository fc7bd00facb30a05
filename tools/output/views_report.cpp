#include "output/views_report.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/component/printable.h>

#include "jobs/comparison.h"
#include "output/machines_text.h"
#include "output/report.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

std::string view_ratio(const std::optional<double>& ratio, const char* suffix) {
  return ratio ? fmt::format("{:.2f}{}", *ratio, suffix) : std::string("-");
}

const std::string& image_of(const ViewResult& view) {
  static const std::string none;
  return view.viewpoint.file ? view.viewpoint.file->image : none;
}

std::string count_of(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string views_heading(const ViewsResult& result, const TextStyle& style) {
  const auto size_of = [](const ViewResult& view) {
    return fmt::format("{}x{}", view.viewpoint.camera.width, view.viewpoint.camera.height);
  };
  const std::string size = size_of(result.views.front());
  const bool is_one_size = std::all_of(result.views.begin(), result.views.end(),
                                       [&](const ViewResult& view) { return size_of(view) == size; });
  std::string text =
      style.bold(fmt::format("{}, {}, {}", printable(result.scene), is_one_size ? size : std::string("several sizes"),
                             count_of(result.views.size(), "view")));
  text += result.camera_file
              ? fmt::format(", of the {} in {}", count_of(result.cameras, "camera"), printable(*result.camera_file))
              : std::string(" round the scene");
  text += fmt::format(": {} Gaussians\n", grouped(result.gaussians_total));
  return text + machines_text(result.views.front().runs, result.preprocessing, result.passes, style) + "\n";
}

void add_distribution(TextTable& table, const std::string& name, const std::optional<Distribution>& of,
                      const char* suffix, const ViewsResult& result) {
  std::vector<std::string> cells{name};
  if (of) {
    for (const double value :
         {of->minimum, of->lower_quartile, of->median, of->upper_quartile, of->maximum, of->geometric_mean}) {
      cells.push_back(view_ratio(value, suffix));
    }
    for (const std::size_t view : {of->least, of->most}) cells.push_back(std::to_string(result.views[view].index));
  } else {
    cells.resize(9, "-");
  }
  table.row(std::move(cells));
}

std::string distributions(const ViewsResult& result, const TextStyle& style) {
  TextTable table({"", "minimum", "lower quartile", "median", "upper quartile", "maximum", "geometric mean",
                   "view of min", "view of max"});
  const std::vector<RunResult>& runs = result.views.front().runs;
  if (runs.front().cycles) {
    table.group("speed-up over " + name_of(runs[result.baseline].request));
    for (std::size_t i = 0; i < runs.size(); ++i) {
      if (i == result.baseline) continue;
      add_distribution(table, name_of(runs[i].request), speedup_distribution(result, i), "x", result);
    }
  }
  table.group("early termination");
  add_distribution(table, "ratio", ratio_distribution(result), "", result);
  return table.text(style);
}

std::string views(const ViewsResult& result, const TextStyle& style) {
  const std::vector<RunResult>& first = result.views.front().runs;
  const bool timed = first.front().cycles.has_value();
  const bool named = std::any_of(result.views.begin(), result.views.end(),
                                 [](const ViewResult& view) { return !image_of(view).empty(); });
  std::vector<std::string> columns{"view"};
  if (named) columns.emplace_back("image");
  columns.emplace_back("visible");
  if (timed) {
    columns.push_back("cycles, " + name_of(first[result.baseline].request));
    for (std::size_t i = 0; i < first.size(); ++i)
      if (i != result.baseline) columns.push_back(name_of(first[i].request));
  }
  columns.emplace_back("ratio");
  TextTable table(std::move(columns));
  if (named) table.left(1);
  for (const ViewResult& view : result.views) {
    std::vector<std::string> cells{std::to_string(view.index)};
    if (named) cells.push_back(printable(image_of(view)));
    cells.push_back(grouped(view.scene.gaussians_visible));
    if (timed) {
      const RunResult& baseline = view.runs[result.baseline];
      cells.push_back(grouped(baseline.cycles.value_or(0)));
      for (const RunResult& run : view.runs) {
        if (&run != &baseline) cells.push_back(view_ratio(speedup(baseline, run), "x"));
      }
    }
    cells.push_back(view_ratio(early_termination_ratio(view.runs), ""));
    table.row(std::move(cells));
  }
  return table.text(style);
}

/// Where cycles may be farther off than the documentation says, and in how many views.
std::string views_validated_text(const ViewsResult& result) {
  std::map<std::string, std::size_t> reasons;
  for (const ViewResult& view : result.views) {
    for (const std::string& reason : view.runs.front().outside_validated_range) ++reasons[reason];
  }
  const std::string fidelity = fidelity_of(result.views.front().runs.front().request);
  std::string text;
  for (const auto& [reason, count] : reasons) {
    text += fmt::format("{} may be off in {}: {}; confirm at cycle\n", fidelity, count_of(count, "view"), reason);
  }
  return text;
}

std::string view_remarks(const ViewsResult& result) {
  std::string text =
      "quartiles are interpolated between views; the ratio is that of fragments blended without over with "
      "termination\n";
  std::size_t empty = 0;
  for (const ViewResult& view : result.views) empty += draws_nothing(view.runs.front(), view.scene) ? 1U : 0U;
  if (empty > 0) text += fmt::format("{} with nothing visible, without speed-up and ratio\n", count_of(empty, "view"));
  text += fidelities_text(result.views.front().runs) + views_validated_text(result);
  // Cameras of a file have notes of their own.
  std::vector<std::string> said;
  for (const ViewResult& view : result.views) {
    for (const std::string& note : view.scene.notes) {
      if (std::find(said.begin(), said.end(), note) != said.end()) continue;
      said.push_back(note);
      text += "note: " + printable(note) + "\n";
    }
  }
  text += fmt::format("took {:.1f} s to load the scene, {:.1f} s to simulate {}", result.load_seconds,
                      result.simulate_seconds, count_of(result.views.size() - result.done_before, "view"));
  text += fmt::format(" in {} process{}", result.processes, result.processes == 1 ? "" : "es at a time");
  if (result.done_before > 0) text += fmt::format("; {} done before", result.done_before);
  text += "\n";
  const std::optional<ImageFiles>& images = result.views.front().images.front();
  if (images) {
    text += fmt::format("images: {} and .exr, and so on\n", printable(images->png));
  }
  if (const auto journal = result.journal->path()) {
    if (result.journal->is_named()) text += fmt::format("journal: {}\n", printable(journal->string()));
  }
  return text;
}

}  // namespace

std::string views_report(const ViewsResult& result, const TextStyle& style) {
  return views_heading(result, style) + distributions(result, style) + "\n" + views(result, style) + "\n" +
         view_remarks(result);
}

}  // namespace vrpipe::tools
