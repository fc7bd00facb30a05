#include "accuracy_report.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/blend.h>
#include <vrpipe/printable.h>

#include "parse.h"
#include "report.h"
#include "text_table.h"

namespace vrpipe::tools {
namespace {

std::string signed_percent(const std::optional<double>& value) {
  return value ? fmt::format("{:+.2f}", *value == 0 ? 0.0 : *value) : "-";
}

std::string decibels(double psnr) { return std::isinf(psnr) ? "equal" : fmt::format("{:.2f}", psnr); }

std::string cycles_text(const RunResult& run) { return run.cycles ? grouped(*run.cycles) : "-"; }

std::string settings_text(const AccuracyResult& result) {
  std::string text;
  for (const std::vector<Setting>* settings : {&result.base.settings, &result.preprocessing}) {
    for (const Setting& setting : *settings) {
      text += fmt::format(", {}.{}={}", setting.unit, setting.parameter, setting.value);
    }
  }
  for (const UnitChoice& unit : result.base.units) text += fmt::format(", {}={}", unit.slot, unit.implementation);
  return text;
}

std::vector<std::string> precision_cells(const std::string& value, const PrecisionRun& run, bool is_default) {
  const bool free = run.cycles_change_percent && *run.cycles_change_percent == 0;
  return {value,
          decibels(run.error.psnr_db),
          fmt::format("{:.5f}", run.error.ssim),
          fmt::format("{:.2g}", run.error.max_abs_error),
          fmt::format("{:.2f}", 100 * run.error.share_differing),
          grouped(run.pixels_stuck),
          cycles_text(run.run),
          is_default                  ? ""
          : free                      ? "none"
          : run.cycles_change_percent ? fmt::format("{:+.3f}", *run.cycles_change_percent)
                                      : "-",
          fmt::format("{:.2f}", run.run.host_seconds),
          run.on_front ? "front" : ""};
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  }
  return text;
}

/// The knobs of which every value takes the cycles of the default.
std::vector<std::string> free_knobs(const AccuracyResult& result) {
  std::vector<std::string> names;
  for (const PrecisionKnob& knob : precision_knobs()) {
    bool tried = false;
    bool free = true;
    for (const PrecisionRow& row : result.precision) {
      if (row.knob != &knob || row.run == 0) continue;
      const std::optional<double>& change = result.runs[row.run].cycles_change_percent;
      tried = true;
      free &= change && *change == 0;
    }
    if (tried && free) names.push_back(knob.name);
  }
  return names;
}

std::string markdown(const AccuracyTable& table) {
  std::string text = "| " + table.group_heading;
  std::string line = "|---";
  for (const std::string& cell : table.heading) {
    text += " | " + cell;
    line += &cell == &table.heading.front() ? "|---" : "|--:";
  }
  text += " |\n" + line + "|\n";
  std::string group;
  for (const AccuracyTable::Row& row : table.rows) {
    text += "| " + (row.group == group ? std::string() : row.group);
    group = row.group;
    for (const std::string& cell : row.cells) text += " | " + cell;
    text += " |\n";
  }
  return text;
}

std::string text_of(const AccuracyTable& source, const TextStyle& style) {
  TextTable table(source.heading);
  std::string group;
  for (const AccuracyTable::Row& row : source.rows) {
    if (row.group != group) table.group(row.group);
    group = row.group;
    table.row(row.cells, row.marked);
  }
  return table.text(style);
}

}  // namespace

AccuracyTable fidelity_table(const AccuracyResult& result) {
  AccuracyTable table;
  table.group_heading = "variant";
  table.heading = {"fidelity", "cycles", "error %",      "speed-up",       "error %",  "host s",
                   "Mquads/s", "events", "blended +- %", "image PSNR, dB", "dominated"};
  for (const FidelityRung& rung : result.fidelity) {
    const RunResult& run = rung.run;
    table.rows.push_back(
        {run.request.variant.name,
         {vrpipe::name_of(run.request.fidelity), cycles_text(run), signed_percent(rung.cycles_error_percent),
          rung.speedup ? fmt::format("{:.3f}", *rung.speedup) : "-", signed_percent(rung.speedup_error_percent),
          fmt::format("{:.2f}", rung.host_seconds), fmt::format("{:.2f}", rung.quads_per_second * 1e-6),
          grouped(run.kernel_events), signed_percent(rung.fragments_blended_error_percent),
          decibels(rung.image.psnr_db), rung.dominated ? "yes" : ""},
         false});
  }
  return table;
}

AccuracyTable precision_table(const AccuracyResult& result) {
  AccuracyTable table;
  table.group_heading = "knob";
  table.heading = {"value", "PSNR, dB", "SSIM",   "max error", "8-bit differs, %",
                   "stuck", "cycles",   "cost %", "host s",    ""};
  table.rows.push_back(
      {"the default", precision_cells("everything", result.runs.front(), true), result.runs.front().on_front});
  for (const PrecisionRow& row : result.precision) {
    if (row.run == 0) continue;
    const auto is_default = [&](const PrecisionRow& other) { return other.knob == row.knob && other.run == 0; };
    const auto usual = std::find_if(result.precision.begin(), result.precision.end(), is_default);
    const std::string group = fmt::format("{}, default {}", row.knob->name, readable_value(*row.knob, usual->value));
    const PrecisionRun& run = result.runs[row.run];
    table.rows.push_back({group, precision_cells(readable_value(*row.knob, row.value), run, false), run.on_front});
  }
  return table;
}

std::vector<std::string> fidelity_summary(const AccuracyResult& result) {
  std::vector<std::string> lines;
  for (const Fidelity fidelity : fidelities()) {
    double cycles = 0;
    double speedup = 0;
    double slowest = 0;
    double worst_image = INFINITY;
    bool timed = false;
    bool always_dominated = true;
    for (const FidelityRung& rung : result.fidelity) {
      if (rung.run.request.fidelity != fidelity) continue;
      timed = rung.run.cycles.has_value();
      cycles = std::max(cycles, std::fabs(rung.cycles_error_percent.value_or(0)));
      speedup = std::max(speedup, std::fabs(rung.speedup_error_percent.value_or(0)));
      slowest = slowest == 0 ? rung.quads_per_second : std::min(slowest, rung.quads_per_second);
      worst_image = std::min(worst_image, rung.image.psnr_db);
      always_dominated &= rung.dominated;
    }
    std::string line = fmt::format("{}: ", vrpipe::name_of(fidelity));
    if (fidelity == fidelities().back()) {
      line += "what the others are measured against";
    } else {
      line += timed ? fmt::format("cycles within {:.1f} %, speed-ups within {:.1f} %", cycles, speedup) : "no time";
      line += std::isinf(worst_image) ? ", the same images" : fmt::format(", images within {:.1f} dB", worst_image);
    }
    line += fmt::format(", at least {:.2f} M quads rasterised per host second", slowest * 1e-6);
    if (always_dominated) line += "; dominated in every variant";
    lines.push_back(line);
  }
  return lines;
}

std::vector<std::string> precision_summary(const AccuracyResult& result) {
  std::vector<std::string> lines;
  if (!result.runs.front().run.cycles) {
    lines.push_back("without time at this fidelity: images alone");
  } else if (const std::vector<std::string> free = free_knobs(result); !free.empty()) {
    lines.push_back("cost no simulated time: " + joined(free));
  }
  std::vector<std::string> uncharged;
  for (const PrecisionKnob& knob : precision_knobs()) {
    const auto of_knob = [&](const PrecisionRow& row) { return row.knob == &knob; };
    const bool is_there = std::any_of(result.precision.begin(), result.precision.end(), of_knob);
    if (is_there && !knob.is_charged) uncharged.push_back(knob.name);
  }
  if (result.runs.front().run.cycles && !uncharged.empty()) {
    lines.push_back("have no price of their own, and change cycles only by which fragments live: " + joined(uncharged));
  }
  if (!result.knobs_left_out.empty()) {
    lines.push_back("left out, since a draw list is preprocessed already: " + joined(result.knobs_left_out));
  }
  return lines;
}

std::vector<std::string> accuracy_heading(const AccuracyResult& result) {
  const RunRequest& base = result.base;
  std::vector<std::string> lines;
  lines.push_back(fmt::format("{}, {}x{}: {} of {} Gaussians visible", printable(result.scene.name), result.width,
                              result.height, grouped(result.scene.gaussians_visible),
                              grouped(result.scene.gaussians_total)));
  lines.push_back(base.platform->name + " (" + base.platform->description + ")");
  lines.push_back(fmt::format("{} colour, {} termination{}", vrpipe::name_of(base.format), name_of(base.termination),
                              settings_text(result)));
  if (result.quick) {
    std::string line = "a quick look: two variants, and one value of some knobs";
    if (result.width != result.full_width || result.height != result.full_height) {
      line += fmt::format(", in the middle of {}x{}", result.full_width, result.full_height);
    }
    lines.push_back(line);
  }
  return lines;
}

namespace {

std::string fidelity_title(const AccuracyResult& result) {
  return fmt::format("Fidelity, against {}: one simulation at a time{}", vrpipe::name_of(fidelities().back()),
                     result.repeat > 1 ? fmt::format(", host seconds the median of {}", result.repeat) : "");
}

std::string precision_title(const AccuracyResult& result) {
  return fmt::format("Precision of {} at {}, against exact arithmetic: {} simulation{} at a time",
                     result.base.variant.name, vrpipe::name_of(result.base.fidelity), result.processes,
                     result.processes == 1 ? "" : "s");
}

}  // namespace

std::string accuracy_text(const AccuracyResult& result, const TextStyle& style) {
  std::string text;
  for (const std::string& line : accuracy_heading(result)) text += (text.empty() ? style.bold(line) : line) + "\n";
  text += "\n" + style.bold(fidelity_title(result)) + "\n\n" + text_of(fidelity_table(result), style) + "\n";
  for (const std::string& line : fidelity_summary(result)) text += line + "\n";
  text += "\n" + style.bold(precision_title(result)) + "\n\n" + text_of(precision_table(result), style) + "\n";
  for (const std::string& line : precision_summary(result)) text += line + "\n";
  text += fmt::format("took {:.1f} s, {:.1f} s of it for the exact image\n", result.seconds, result.reference_seconds);
  return text;
}

std::string accuracy_markdown(const AccuracyResult& result) {
  std::string text;
  for (const std::string& line : accuracy_heading(result)) text += line + ".\n";
  text += "\n" + markdown(fidelity_table(result)) + "\n";
  for (const std::string& line : fidelity_summary(result)) text += "* " + line + "\n";
  text += "\n" + markdown(precision_table(result)) + "\n";
  for (const std::string& line : precision_summary(result)) text += "* " + line + "\n";
  return text;
}

}  // namespace vrpipe::tools
