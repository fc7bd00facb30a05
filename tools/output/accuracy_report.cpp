#include "output/accuracy_report.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/arithmetic/blend.h>
#include <vrpipe/component/printable.h>

#include "jobs/comparison.h"
#include "output/effects_report.h"
#include "output/report.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

/// With as many decimals as something other than zero needs to show.
int decimals_of(double value, int usual) {
  int decimals = usual;
  for (double least = 0.5 * std::pow(10, -usual); value != 0 && std::fabs(value) < least && decimals < 12;
       least /= 10) {
    ++decimals;
  }
  return decimals;
}

std::string signed_percent(const std::optional<double>& value, int decimals = 2) {
  if (!value) return "-";
  return *value == 0 ? "0" : fmt::format("{:+.{}f}", *value, decimals_of(*value, decimals));
}

std::string decibels(double psnr) { return std::isinf(psnr) ? "equal" : fmt::format("{:.2f}", psnr); }

std::string cycles_text(const RunResult& run) { return run.cycles ? grouped(*run.cycles) : "-"; }

/// How the draw was drawn, beside the platform.
std::string state_text(const AccuracyResult& result) {
  std::string text =
      fmt::format("{} colour, {} termination", vrpipe::name_of(result.base.format), name_of(result.base.termination)) +
      effects_choice_text(result.base);
  for (const std::vector<Setting>* settings : {&result.base.settings, &result.preprocessing}) {
    for (const Setting& setting : *settings) {
      text += fmt::format(", {}.{}={}", setting.unit, setting.parameter, setting.value);
    }
  }
  for (const UnitChoice& unit : result.base.units) text += fmt::format(", {}={}", unit.slot, unit.implementation);
  return text;
}

/// Of a bound: not rounded down.
std::string two_digits_up(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return fmt::format("{:.2g}", value > 0 ? std::ceil(value / unit * (1 - 1e-9)) * unit : 0);
}

std::string megabytes(const std::optional<std::uint64_t>& bytes) {
  return bytes ? fmt::format("{:.2f}", static_cast<double>(*bytes) / 1e6) : "-";
}

std::vector<std::string> precision_cells(const std::string& value, const PrecisionRun& run, bool is_default) {
  const bool free = run.cycles_change_percent && *run.cycles_change_percent == 0;
  return {value,
          decibels(run.error.psnr_db),
          fmt::format("{:.5f}", run.error.ssim),
          fmt::format("{:.2g}", run.error.max_abs_error),
          run.proved_max_error ? two_digits_up(*run.proved_max_error) : "-",
          fmt::format("{:.2f}", 100 * run.error.share_differing),
          grouped(run.pixels_stuck),
          cycles_text(run.run),
          is_default                  ? ""
          : free                      ? "none"
          : run.cycles_change_percent ? signed_percent(run.cycles_change_percent, 3)
                                      : "-",
          megabytes(run.l2_bytes),
          megabytes(run.dram_bytes),
          run.millijoules ? fmt::format("{:.3g}", run.millijoules->nominal) : "-",
          fmt::format("{:.2f}", run.run.cpu_seconds),
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

/// Some columns, in this order, for a terminal of 80 characters.
std::string text_of(const AccuracyTable& source, const std::vector<std::size_t>& columns, const TextStyle& style) {
  const auto chosen = [&](const std::vector<std::string>& cells) {
    std::vector<std::string> some;
    for (const std::size_t column : columns) some.push_back(cells[column]);
    return some;
  };
  TextTable table(chosen(source.heading));
  std::string group;
  for (const AccuracyTable::Row& row : source.rows) {
    if (row.group != group) table.group(row.group);
    group = row.group;
    table.row(chosen(row.cells), row.marked);
  }
  return table.text(style);
}

/// How one fidelity does over all variants.
struct FidelityRange {
  bool is_there = false, is_reference = true;
  bool timed = false;
  bool always_dominated = true;
  struct Times {
    double slowest = INFINITY, fastest = 0;
    void add(double factor) {
      slowest = std::min(slowest, factor);
      fastest = std::max(fastest, factor);
    }
  };
  Times times, times_elapsed;                      // as fast as the most exact
  bool on_several_cores = false;                   // in some variant
  double cycles_percent = 0, speedup_percent = 0;  // the largest errors
  double quads_per_second = INFINITY;              // the least
  double worst_image_db = INFINITY;
};

/// The levels of the ladder, the least exact first, as fidelity_of has them.
std::vector<std::string> levels_of(const AccuracyResult& result) {
  std::vector<std::string> levels;
  for (const Fidelity fidelity : fidelities()) {
    for (const FidelityLevel& level : result.fidelity) {
      const std::string name = fidelity_of(level.run.request);
      if (level.run.request.fidelity == fidelity && std::find(levels.begin(), levels.end(), name) == levels.end())
        levels.push_back(name);
    }
  }
  return levels;
}

FidelityRange range_of(const AccuracyResult& result, const std::string& fidelity) {
  FidelityRange range;
  for (const FidelityLevel& level : result.fidelity) {
    if (fidelity_of(level.run.request) != fidelity) continue;
    range.is_reference = range.is_reference && is_finest(level.run.request);
  }
  for (const FidelityLevel& level : result.fidelity) {
    if (fidelity_of(level.run.request) != fidelity || (is_finest(level.run.request) && !range.is_reference)) continue;
    range.timed = level.run.cycles.has_value();
    range.always_dominated &= level.dominated;
    range.times.add(level.times_as_fast);
    range.times_elapsed.add(level.times_as_fast_elapsed);
    range.on_several_cores |= level.host_seconds < 0.95 * level.cpu_seconds;
    range.cycles_percent = std::max(range.cycles_percent, std::fabs(level.cycles_error_percent.value_or(0)));
    range.speedup_percent = std::max(range.speedup_percent, std::fabs(level.speedup_error_percent.value_or(0)));
    if (level.run.request.variant.is_of_pipeline())
      range.quads_per_second = std::min(range.quads_per_second, level.quads_per_second);
    range.worst_image_db = std::min(range.worst_image_db, level.image.psnr_db);
  }
  return range;
}

/// What bounds the default, and so what can have a price; empty without time.
std::string price_text(const RunResult& run) {
  std::string text = bound_text(run);
  if (text.empty()) return text;
  text.pop_back();  // the end of its line
  if (run.bottleneck->occupancy >= bounding_occupancy) text += ": what spares other units saves no time here";
  return text;
}

std::string times_text(const FidelityRange::Times& times) {
  const std::string slowest = fmt::format("{:.1f}", times.slowest);
  const std::string fastest = fmt::format("{:.1f}", times.fastest);
  return slowest == fastest ? slowest + " times" : slowest + " to " + fastest + " times";
}

}  // namespace

namespace {
Fidelity most_exact(const AccuracyResult& result) {
  Fidelity finest = Fidelity::functional;
  for (const FidelityLevel& level : result.fidelity) finest = std::max(finest, level.run.request.fidelity);
  return finest;
}
}  // namespace

std::string most_exact_text(const AccuracyResult& result) {
  std::string text;
  for (auto fidelity = fidelities().rbegin(); fidelity != fidelities().rend(); ++fidelity) {
    std::vector<std::string> names;
    for (const FidelityLevel& level : result.fidelity) {
      const RunRequest& request = level.run.request;
      if (is_finest(request) && request.fidelity == *fidelity) names.push_back(request.variant.name);
    }
    if (names.empty()) continue;
    text += text.empty() ? vrpipe::name_of(*fidelity)
                         : fmt::format(", {} of {}", vrpipe::name_of(*fidelity), fmt::join(names, ", "));
  }
  return text;
}

AccuracyTable fidelity_table(const AccuracyResult& result) {
  AccuracyTable table;
  table.group_heading = "variant";
  table.heading = {"fidelity",
                   "cycles",
                   "error %",
                   "speed-up",
                   "error %",
                   "CPU s",
                   std::string("vs ") + vrpipe::name_of(most_exact(result)),
                   "dominated",
                   "Mquads/s",
                   "events",
                   "blended +- %",
                   "image, dB",
                   "may err"};
  for (const FidelityLevel& level : result.fidelity) {
    const RunResult& run = level.run;
    table.rows.push_back(
        {run.request.variant.name,
         {fidelity_of(run.request), cycles_text(run), signed_percent(level.cycles_error_percent),
          level.speedup ? fmt::format("{:.3f}", *level.speedup) : "-", signed_percent(level.speedup_error_percent),
          fmt::format("{:.2f}", level.cpu_seconds), fmt::format("{:.2f}x", level.times_as_fast),
          level.dominated ? "yes" : "",
          run.request.variant.is_of_pipeline() ? fmt::format("{:.2f}", level.quads_per_second * 1e-6) : "-",
          grouped(run.kernel_events), signed_percent(level.fragments_blended_error_percent),
          decibels(level.image.psnr_db),
          run.expected_error_percent ? fmt::format("{:.1f}", *run.expected_error_percent) : "-"},
         false});
  }
  return table;
}

AccuracyTable stress_table(const AccuracyResult& result) {
  AccuracyTable table;
  table.group_heading = "configuration";
  table.heading = {"variant", "cycles", "bound %", "lt %"};
  for (const StressRow& row : result.stress) {
    table.rows.push_back({row.configuration, {row.variant, grouped(row.cycles)}, false});
    for (const auto& [fidelity, error] : row.error_percent) table.rows.back().cells.push_back(signed_percent(error));
  }
  return table;
}

AccuracyTable precision_table(const AccuracyResult& result) {
  AccuracyTable table;
  table.group_heading = "knob";
  table.heading = {"value",  "PSNR, dB", "SSIM", "max error", "proved", "8-bit differs, %", "stuck", "cycles", "cost %",
                   "L2, MB", "DRAM, MB", "mJ",   "CPU s",     ""};
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

std::vector<const PrecisionRun*> runs_by_fragments(const AccuracyResult& result) {
  std::vector<const PrecisionRun*> runs{&result.runs.front()};
  for (const PrecisionRow& row : result.precision) {
    if (row.run != 0 && row.knob->name == "format") runs.push_back(&result.runs[row.run]);
  }
  return runs;
}

std::string crossed_title() { return "Of several choices at once"; }

AccuracyTable crossed_table(const AccuracyResult& result) {
  AccuracyTable table;
  table.group_heading = "format, rounding";
  table.heading = {"QM", "merging", "PSNR, dB", "max error", "proved", "stuck", "cycles"};
  for (const CrossedRow& row : result.crossed) {
    const PrecisionRun& run = result.runs[row.run];
    table.rows.push_back({row.values[0].second + ", " + row.values[1].second,
                          {row.values[2].second, row.values[2].second == "off" ? "" : row.values[3].second,
                           decibels(run.error.psnr_db), fmt::format("{:.2g}", run.error.max_abs_error),
                           run.proved_max_error ? two_digits_up(*run.proved_max_error) : "-", grouped(run.pixels_stuck),
                           cycles_text(run.run)},
                          false});
  }
  return table;
}

std::string popping_title() { return "Between two near views: errors of how the image changes"; }

AccuracyTable popping_table(const AccuracyResult& result) {
  AccuracyTable table;
  table.group_heading = "views";
  table.heading = {"run", "rms", "max", "over an 8-bit level, % of pixels"};
  for (const PoppingRow& row : result.popping) {
    table.rows.push_back({"a pixel apart at the middle depth",
                          {row.run, fmt::format("{:.2g}", row.rms), fmt::format("{:.2g}", row.max_abs),
                           fmt::format("{:.2f}", 100 * row.share_of_pixels)},
                          false});
  }
  return table;
}

std::string fragments_title() { return "Errors by the fragments of a pixel"; }

AccuracyTable fragments_table(const AccuracyResult& result) {
  AccuracyTable table;
  table.group_heading = "run";
  table.heading = {"fragments", "pixels", "mean error", "max error", "proved"};
  for (const PrecisionRun* const run : runs_by_fragments(result)) {
    for (const ErrorOfRange& range : run->by_fragments) {
      table.rows.push_back({run->name,
                            {range.from == range.to ? grouped(range.from)
                                                    : fmt::format("{} to {}", grouped(range.from), grouped(range.to)),
                             grouped(range.pixels), fmt::format("{:.2g}", range.mean_abs_error),
                             fmt::format("{:.2g}", range.max_abs_error),
                             range.proved_max_error ? two_digits_up(*range.proved_max_error) : "-"},
                            false});
    }
  }
  return table;
}

std::string stress_title(const AccuracyResult& result) {
  // A draw list has no camera that could take in less.
  return fmt::format("Away from {}, {}: errors of the cycles{}", result.base.platform->name, state_text(result),
                     result.viewpoint ? ", in the middle of the image" : "");
}

std::vector<std::string> stress_notes(const AccuracyResult& result) {
  std::vector<std::string> lines;
  for (const StressLeftOut& left_out : result.stress_left_out)
    lines.push_back(printable("left out: " + left_out.configuration + ": " + left_out.reason));
  return lines;
}

std::string within(double percent) {
  if (percent == 0) return "0 %";
  // Rounded up, since it is a bound.
  const int decimals = decimals_of(percent, 1);
  const double scale = std::pow(10, decimals);
  return fmt::format("{:.{}f} %", std::ceil(percent * scale * (1 - 1e-9)) / scale, decimals);
}

std::string fidelity_verdict(const AccuracyResult& result) {
  const std::string exact = most_exact_text(result);
  std::string text;
  const std::vector<std::string> levels = levels_of(result);
  for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
    const FidelityRange range = range_of(result, *level);
    if (range.is_reference) continue;
    const bool first = text.empty();
    text += fmt::format("{}{}: {}{}, {}", first ? "" : "; ", *level, times_text(range.times),
                        first ? " as fast as " + exact : "",
                        range.timed ? "cycles within " + within(range.cycles_percent) : "without cycles");
  }
  return text;
}

std::string fidelity_definition(const AccuracyResult& result) {
  return fmt::format(
      "dominated: another fidelity of the variant is better in CPU seconds (by over {:g} %) or in error (by over {:g} "
      "points) and no worse in the other; {}, which errors are measured against, never is; may err: by how many % the "
      "run itself says that its cycles may be off",
      100 * fidelity_tolerance.cost_share, fidelity_tolerance.error, most_exact_text(result));
}

std::string precision_definition() {
  return fmt::format(
      "front: nothing is better in cycles (by over {:g} %) or in PSNR (by over {:g} dB) and no worse in the other; of "
      "those that are alike, the first",
      100 * precision_tolerance.cost_share, precision_tolerance.error);
}

std::vector<std::string> fidelity_summary(const AccuracyResult& result) {
  std::vector<std::string> lines;
  for (const std::string& level : levels_of(result)) {
    const FidelityRange range = range_of(result, level);
    std::string line = level + ": ";
    if (range.is_reference) {
      line += "what the others are measured against";
    } else {
      line += times_text(range.times) + " as fast";
      if (range.on_several_cores)
        line += fmt::format(" in CPU seconds, {} with another core beside it", times_text(range.times_elapsed));
      line += range.timed ? fmt::format(", cycles within {}, speed-ups within {}", within(range.cycles_percent),
                                        within(range.speedup_percent))
                          : ", no cycles";
      line += std::isinf(range.worst_image_db) ? ", the same images"
                                               : fmt::format(", images within {:.1f} dB", range.worst_image_db);
    }
    if (!std::isinf(range.quads_per_second))
      line += fmt::format(", at least {:.2f} M quads rasterised per CPU second", range.quads_per_second * 1e-6);
    if (range.always_dominated) line += "; dominated in every variant";
    lines.push_back(line);
  }
  return lines;
}

std::string precision_verdict(const AccuracyResult& result) {
  const PrecisionRun& usual = result.runs.front();
  if (!usual.run.cycles) return {};
  const PrecisionRun* cheapest = nullptr;
  const PrecisionRun* closest = nullptr;
  for (const PrecisionRun& run : result.runs) {
    if (!run.on_front) continue;
    if (cheapest == nullptr || *run.run.cycles < *cheapest->run.cycles) cheapest = &run;
    if (closest == nullptr || run.error.psnr_db > closest->error.psnr_db) closest = &run;
  }
  const auto price = [](const PrecisionRun& run) {
    return fmt::format("{} % of the cycles for {}", signed_percent(run.cycles_change_percent),
                       std::isinf(run.error.psnr_db) ? "the exact image" : decibels(run.error.psnr_db) + " dB");
  };
  std::string text =
      "the default: " + (std::isinf(usual.error.psnr_db) ? "exact" : decibels(usual.error.psnr_db) + " dB");
  if (cheapest != &usual) text += fmt::format("; cheapest, {}: {}", cheapest->name, price(*cheapest));
  if (closest != &usual && closest != cheapest)
    text += fmt::format("; most exact, {}: {}", closest->name, price(*closest));
  return text;
}

std::vector<std::string> precision_summary(const AccuracyResult& result) {
  std::vector<std::string> lines;
  if (const std::string price = price_text(result.runs.front().run); !price.empty()) lines.push_back(price);
  if (!result.runs.front().run.cycles) {
    lines.push_back("without time at this fidelity: images alone");
  } else if (const std::vector<std::string> free = free_knobs(result); !free.empty()) {
    lines.push_back(joined(free) + (free.size() == 1 ? " costs" : " cost") + " no simulated time");
  }
  std::vector<std::string> uncharged;
  for (const PrecisionKnob& knob : precision_knobs()) {
    const auto of_knob = [&](const PrecisionRow& row) { return row.knob == &knob; };
    const bool is_there = std::any_of(result.precision.begin(), result.precision.end(), of_knob);
    if (is_there && !knob.is_charged) uncharged.push_back(knob.name);
  }
  if (result.runs.front().run.cycles && !uncharged.empty()) {
    lines.push_back(joined(uncharged) +
                    (uncharged.size() == 1 ? " has no price of its own: it changes cycles"
                                           : " have no price of their own: they change cycles") +
                    " only by which fragments live");
  }
  if (!result.knobs_left_out.empty()) {
    lines.push_back("left out, since a draw list is preprocessed already: " + joined(result.knobs_left_out));
  }
  if (!result.values_never_measured.empty()) {
    lines.push_back("left out, since no GPU's blender into that format has been measured: " +
                    joined(result.values_never_measured));
  }
  if (!result.knobs_without_pipeline.empty()) {
    lines.push_back("left out, since they are of the graphics pipeline: " + joined(result.knobs_without_pipeline));
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
  lines.push_back(state_text(result));
  if (result.quick) {
    std::string line = "a quick look: two variants, and one value of some knobs";
    if (result.width != result.full_width || result.height != result.full_height) {
      line += fmt::format(", in the middle of {}x{}", result.full_width, result.full_height);
    }
    lines.push_back(line);
  }
  if (result.runs.front().run.counts.fragments_rasterized == 0) {
    lines.push_back(nothing_visible(result.scene, result.viewpoint.has_value()));
  }
  return lines;
}

namespace {

std::string fidelity_title(const AccuracyResult& result) {
  return fmt::format("Fidelity, against {}: one simulation at a time{}", most_exact_text(result),
                     result.repeat > 1 ? fmt::format(", CPU seconds the median of {}", result.repeat) : "");
}

std::string precision_title(const AccuracyResult& result) {
  return fmt::format("Precision of {} at {}, against exact arithmetic: {} simulation{} at a time",
                     result.base.variant.name, fidelity_of(result.base), result.processes,
                     result.processes == 1 ? "" : "s");
}

std::string precision_text(const AccuracyResult& result, const TextStyle& style) {
  std::string text = "\n" + style.bold(precision_title(result)) + "\n\n";
  const AccuracyTable precision = precision_table(result);
  text += text_of(precision, {0, 1, 3, 4, 7, 8, 13}, style) + "\n" + text_of(precision, {0, 6, 9, 10, 11, 12}, style) +
          "\n";
  text +=
      "\n" + style.bold(fragments_title()) + "\n\n" + text_of(fragments_table(result), {0, 1, 2, 3, 4}, style) + "\n";
  if (!result.crossed.empty())
    text += style.bold(crossed_title()) + "\n\n" + text_of(crossed_table(result), {0, 1, 2, 3, 4, 5, 6}, style) + "\n";
  if (!result.popping.empty())
    text += style.bold(popping_title()) + "\n\n" + text_of(popping_table(result), {0, 1, 2, 3}, style) + "\n";
  if (const std::string verdict = precision_verdict(result); !verdict.empty()) text += verdict + "\n";
  for (const std::string& line : precision_summary(result)) text += line + "\n";
  if (result.runs.front().run.cycles) text += precision_definition() + "\n";
  return text;
}

}  // namespace

std::string accuracy_text(const AccuracyResult& result, const TextStyle& style) {
  std::string text;
  for (const std::string& line : accuracy_heading(result)) text += (text.empty() ? style.bold(line) : line) + "\n";
  const AccuracyTable fidelity = fidelity_table(result);
  text += "\n" + style.bold(fidelity_title(result)) + "\n\n";
  text += text_of(fidelity, {0, 1, 2, 3, 4, 5, 6}, style) + "\n" + text_of(fidelity, {0, 7, 8, 9, 10, 11, 12}, style) +
          "\n";
  for (const std::string& line : fidelity_summary(result)) text += line + "\n";
  text += fidelity_definition(result) + "\n";
  if (!result.stress.empty())
    text += "\n" + style.bold(stress_title(result)) + "\n\n" + text_of(stress_table(result), {0, 1, 2, 3}, style);
  for (const std::string& line : stress_notes(result)) text += line + "\n";
  text += result.precision_left_out.empty() ? precision_text(result, style)
                                            : "\nno precision ladder: " + printable(result.precision_left_out) + "\n";
  text += fmt::format("took {:.1f} s", result.seconds);
  if (result.reference_seconds > 0)
    text += fmt::format(", {:.1f} s of it for the exact image", result.reference_seconds);
  return text + "\n";
}

std::string accuracy_markdown(const AccuracyResult& result) {
  std::string text;
  for (const std::string& line : accuracy_heading(result)) text += line + ".\n";
  text += "\n" + markdown(fidelity_table(result)) + "\n";
  for (const std::string& line : fidelity_summary(result)) text += "* " + line + "\n";
  if (!result.stress.empty()) text += "\n" + stress_title(result) + ":\n\n" + markdown(stress_table(result)) + "\n";
  for (const std::string& line : stress_notes(result)) text += "* " + line + "\n";
  if (!result.precision_left_out.empty()) return text + "* no precision ladder: " + result.precision_left_out + "\n";
  text += (result.stress_left_out.empty() ? "" : "\n") + markdown(precision_table(result)) + "\n";
  text += fragments_title() + ":\n\n" + markdown(fragments_table(result)) + "\n";
  if (!result.crossed.empty()) text += crossed_title() + ":\n\n" + markdown(crossed_table(result)) + "\n";
  if (!result.popping.empty()) text += popping_title() + ":\n\n" + markdown(popping_table(result)) + "\n";
  for (const std::string& line : precision_summary(result)) text += "* " + line + "\n";
  return text;
}

}  // namespace vrpipe::tools
