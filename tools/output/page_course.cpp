#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/kernel/accounting.h>

#include "output/compare_sections.h"
#include "output/page_parts.h"
#include "output/plot_fill.h"
#include "output/svg_plot.h"
#include "output/svg_stacks.h"
#include "output/unit_shares.h"

namespace vrpipe::tools {
namespace {

/// A span of time, of one or several intervals.
struct CourseSlice {
  std::uint64_t from = 0, to = 0;  ///< cycles, `to` excluded
  std::vector<UnitShares> units;
  std::string most_engaged = {};  ///< a unit; empty where none does anything
};

/// Says which unit is the most engaged in each slice: one that is goes on until another is so clearly more.
void find_most_engaged(std::vector<CourseSlice>& slices) {
  constexpr double clearly = 0.02;
  std::string last;
  for (CourseSlice& slice : slices) {
    const UnitShares* found = nullptr;
    const UnitShares* before = nullptr;
    for (const UnitShares& unit : slice.units) {
      // Of equals the last: what is before it waits for it.
      if (found == nullptr || engaged(unit) >= engaged(*found)) found = &unit;
      if (unit.unit == last) before = &unit;
    }
    if (before != nullptr && engaged(*before) + clearly >= engaged(*found)) found = before;
    if (found != nullptr && engaged(*found) > 0) slice.most_engaged = found->unit;
    last = slice.most_engaged;
  }
}

/// No more than there is room for.
std::vector<CourseSlice> slices_of(const RunResult& run, std::uint64_t longest) {
  constexpr std::uint64_t most_slices = 240;
  const IntervalReport& intervals = *run.intervals;
  const std::uint64_t wanted = (longest + most_slices - 1) / most_slices;
  const std::size_t together = std::max<std::uint64_t>(1, (wanted + intervals.every - 1) / intervals.every);
  std::vector<CourseSlice> slices;
  for (std::size_t begin = 0; begin < intervals.from.size(); begin += together) {
    const std::size_t end = std::min(intervals.from.size(), begin + together);
    const std::uint64_t to = end < intervals.from.size() ? intervals.from[end] : run.cycles.value_or(0);
    if (to <= intervals.from[begin]) continue;
    slices.push_back({intervals.from[begin], to, unit_shares(intervals, begin, end)});
  }
  find_most_engaged(slices);
  return slices;
}

constexpr UnitState drawn_states[] = {UnitState::busy, UnitState::memory, UnitState::latency, UnitState::blocked};

// Pixels of the drawing.
constexpr double course_width = 1040;
constexpr double course_left = 110;
constexpr double course_right = 1025;
constexpr double course_heading = 26;
constexpr double strip_height = 18;
constexpr double unit_height = 22;
constexpr double unit_step = 26;
constexpr double panel_gap = 22;

/// Time along a drawing: cycles, or milliseconds where clocks differ.
struct CourseScale {
  bool in_milliseconds = false;
  double longest = 0;
  double x(const RunResult& run, std::uint64_t cycle) const {
    return course_left + of(run, cycle) / longest * (course_right - course_left);
  }
  double of(const RunResult& run, std::uint64_t cycle) const {
    const double cycles = static_cast<double>(cycle);
    return in_milliseconds ? cycles / (1e3 * run.request.platform->frequency_mhz) : cycles;
  }
};

/// Areas over one another, as steps.
std::string unit_areas(const std::string& id, const RunResult& run, const std::vector<CourseSlice>& slices,
                       std::size_t unit, const CourseScale& scale, double top) {
  std::string text =
      fmt::format("<rect x=\"{}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{}\" fill=\"{}\" class=\"piece\"/>\n",
                  course_left, top, scale.x(run, slices.back().to) - course_left, unit_height,
                  fill_text(id, fill_of(UnitState::starved)));
  std::vector<double> below(slices.size(), 0.0);
  for (const UnitState state : drawn_states) {
    std::string upper;
    std::string lower;
    double most = 0;
    for (std::size_t i = 0; i < slices.size(); ++i) {
      const double share = slices[i].units[unit].shares[static_cast<unsigned>(state)];
      most = std::max(most, share);
      const auto corner = [&](std::uint64_t cycle, double height) {
        return fmt::format("{:.1f},{:.1f} ", scale.x(run, cycle), top + unit_height * (1 - height));
      };
      lower = corner(slices[i].to, below[i]) + corner(slices[i].from, below[i]) + lower;
      below[i] += share;
      upper += corner(slices[i].from, below[i]) + corner(slices[i].to, below[i]);
    }
    if (most < 0.002) continue;
    text += fmt::format("<polygon points=\"{}{}\" fill=\"{}\"/>\n", upper, lower, fill_text(id, fill_of(state)));
  }
  return text;
}

/// Which unit is the most engaged, one piece for as long as it is the same.
std::string engaged_strip(const RunResult& run, const std::vector<CourseSlice>& slices, const CourseScale& scale,
                          double top) {
  std::string text;
  for (std::size_t i = 0; i < slices.size();) {
    const std::string& name = slices[i].most_engaged;
    std::size_t end = i + 1;
    while (end < slices.size() && slices[end].most_engaged == name) ++end;
    const double from = scale.x(run, slices[i].from);
    const double to = scale.x(run, slices[end - 1].to);
    text += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{}\" fill=\"#fff\" class=\"piece\"><title>{}, "
        "cycles {} "
        "to {}</title></rect>\n",
        from, top, to - from, strip_height, html_escaped(name.empty() ? "none" : name), slices[i].from,
        slices[end - 1].to);
    if (to - from > 7.0 * static_cast<double>(name.size()) + 4) {
      text += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"small strong\">{}</text>\n",
                          (from + to) / 2, top + 13, html_escaped(name));
    }
    i = end;
  }
  return text;
}

std::string time_axis(const CourseScale& scale, double y) {
  const double rough = scale.longest / 8;
  const double power = std::pow(10, std::floor(std::log10(rough)));
  double step = 10 * power;
  for (const double digit : {5.0, 2.0, 1.0}) {
    if (digit * power >= rough) step = digit * power;
  }
  const double unit = scale.in_milliseconds ? 1 : scale.longest >= 2e6 ? 1e6 : scale.longest >= 2e3 ? 1e3 : 1;
  std::string text;
  for (double k = 0; k * step <= scale.longest; ++k) {
    const double x = course_left + k * step / scale.longest * (course_right - course_left);
    text += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\" stroke=\"#aab3bd\"/>\n"
        "<text x=\"{0:.1f}\" y=\"{3:.1f}\" text-anchor=\"middle\">{4:.6g}</text>\n",
        x, y, y + 5, y + 18, k * step / unit);
  }
  return text + fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"middle\" class=\"axis\">{}</text>\n",
                            (course_left + course_right) / 2, y + 37,
                            scale.in_milliseconds ? "milliseconds"
                            : unit == 1e6         ? "cycles, millions"
                            : unit == 1e3         ? "cycles, thousands"
                                                  : "cycles");
}

std::string slices_csv(const std::vector<RunResult>& runs, const std::vector<std::vector<CourseSlice>>& slices) {
  std::vector<std::string> columns{"run", "from", "to", "most_engaged", "unit"};
  for (unsigned state = 0; state < unit_states; ++state)
    columns.emplace_back(vrpipe::name_of(static_cast<UnitState>(state)));
  CsvText csv(columns);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    for (const CourseSlice& slice : slices[i]) {
      for (const UnitShares& unit : slice.units) {
        std::vector<std::string> cells{name_of(runs[i].request), fmt::format("{}", slice.from),
                                       fmt::format("{}", slice.to), slice.most_engaged, unit.unit};
        for (const double share : unit.shares) cells.push_back(fmt::format("{:.6g}", share));
        csv.row(cells);
      }
    }
  }
  return csv.text();
}

}  // namespace

std::string course_section(const JobResult& result) {
  std::vector<RunResult> runs;
  for (const RunResult& run : result.runs) {
    if (run.request.variant.is_of_pipeline()) runs.push_back(run);
  }
  const auto has_course = [](const RunResult& run) { return run.intervals && !run.intervals->from.empty(); };
  if (runs.empty() || !std::all_of(runs.begin(), runs.end(), has_course)) return {};
  CourseScale scale;
  std::uint64_t longest = 1;
  for (const RunResult& run : runs) {
    const double frequency = runs.front().request.platform->frequency_mhz;
    scale.in_milliseconds = scale.in_milliseconds || run.request.platform->frequency_mhz != frequency;
    longest = std::max(longest, run.cycles.value_or(0));
  }
  for (const RunResult& run : runs) scale.longest = std::max(scale.longest, scale.of(run, run.cycles.value_or(0)));
  if (scale.longest <= 0) return {};
  std::vector<std::vector<CourseSlice>> slices;
  for (const RunResult& run : runs) {
    slices.push_back(slices_of(run, longest));
    if (slices.back().empty()) return {};
  }

  const std::string id = "states-over-time";
  std::vector<std::pair<std::string, std::size_t>> kinds;
  for (const UnitState state : drawn_states) kinds.emplace_back(vrpipe::name_of(state), fill_of(state));
  kinds.emplace_back(vrpipe::name_of(UnitState::starved), fill_of(UnitState::starved));
  std::string body = svg_legend(id, kinds, course_left, 12);
  double y = 30;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    body += fmt::format("<text x=\"4\" y=\"{:.1f}\" class=\"axis strong\">{}</text>\n", y + 14,
                        html_escaped(name_of(runs[i].request)));
    y += course_heading;
    body +=
        fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">most engaged</text>\n", course_left - 8, y + 13);
    body += engaged_strip(runs[i], slices[i], scale, y);
    y += strip_height + 4;
    for (std::size_t unit = 0; unit < slices[i].front().units.size(); ++unit) {
      body += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n", course_left - 8, y + 15,
                          html_escaped(slices[i].front().units[unit].unit));
      body += unit_areas(id, runs[i], slices[i], unit, scale, y);
      y += unit_step;
    }
    y += panel_gap;
  }
  const std::string drawing =
      fmt::format(
          "<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"what units did over time\" "
          "xmlns=\"http://www.w3.org/2000/svg\">\n",
          course_width, y + 42) +
      fill_definitions(id) + body + time_axis(scale, y - panel_gap + 4) + "</svg>\n";
  return html(
      PageFigure{id,
                 "States of units in the course of each run, all on one scale of time. The most engaged of a moment "
                 "is the unit that is the least starved or blocked then; which one bounds a run is told by occupancy.",
                 drawing, slices_csv(runs, slices)});
}

}  // namespace vrpipe::tools
