#include "output/reproduce_tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/component/printable.h>
#include <vrpipe/workloads/builtin_scenes.h>
#include <vrpipe/workloads/scene.h>

#include "output/report.h"

namespace vrpipe::tools {
namespace {

std::string number(double value, const char* form) {
  return std::isfinite(value) ? fmt::format(form, value) : std::string("-");
}
std::string times(double value) { return number(value, "{:.2f}x"); }
std::string over(double value) { return number(value, "/{:.2f}"); }
std::string said(const char* row) { return paper_row(row).says; }
std::string percent(double share) { return number(100 * share, "{:.0f}"); }

std::string scene_label(const Reproduction& of, const SceneFinding& scene) {
  const PlannedScene& planned = of.result.plan.scenes[scene.scene];
  const bool has_name = builtin_name_of(planned.request) || planned.role == PlannedScene::Role::beside;
  return has_name ? planned.name : printable(scene_name(planned.request));
}

/// Of a scene that is in no mean.
constexpr const char* beside_them = " (beside)";

std::string megacycles(const PointResult& point) {
  return point.run.cycles ? fmt::format("{:.2f}", static_cast<double>(*point.run.cycles) * 1e-6) : "-";
}

template <class Value>
Mean mean_over(const Reproduction& of, const Value& value) {
  std::vector<double> values;
  for (const SceneFinding& scene : of.findings.scenes) values.push_back(value(scene));
  return mean_of(values);
}

std::string studied_names(const ReproducePlan& plan) {
  std::vector<std::string> names;
  for (const std::size_t scene : plan.studied) names.push_back(plan.scenes[scene].name);
  return fmt::format("{}", fmt::join(names, " and "));
}

std::string tolerance_text(const std::vector<PaperRow>& rows) {
  std::string others;
  for (const PaperRow& row : rows) {
    if (!row.is_judged() || row.tolerance_reason.empty()) continue;
    others += fmt::format("; {} within {:g} %: {}", row.id, row.tolerance_percent, row.tolerance_reason);
  }
  return fmt::format(
      "Numbers agree within {:g} % of the paper's{}. It does not say which mean it takes: the arithmetic one is "
      "judged, the geometric one stands beside it.",
      PaperRow::default_tolerance_percent, others);
}

/// A value without what all of them share.
std::string short_value(const std::string& settings) {
  const std::size_t equals = settings.find('=');
  const std::size_t end = std::min(settings.find(','), settings.size());
  return equals == std::string::npos ? settings : settings.substr(equals + 1, end - equals - 1);
}

}  // namespace

Reproduction reproduction_of(const ReproduceResult& result) {
  Reproduction of{result, find(result), {}, {}};
  of.rows = find_rows(result, of.findings);
  for (const std::string& settings : front_ends()) {
    const TrialFinding* const trial = of.findings.trial(settings);
    if (trial == nullptr) continue;
    const std::string name =
        settings.empty() ? result.plan.points.front().request.platform->name : short_value(settings);
    of.front_ends.push_back({name, settings, trial->means, find_rows_with(*trial, result)});
  }
  return of;
}

std::size_t Reproduction::FrontEnd::agree() const {
  return static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [](const RowFinding& row) { return row.verdict == Verdict::agrees; }));
}

bool fits_both(const StudyPoint& point) {
  return std::fabs(point.het_efficiency() - paper_het_efficiency()) * 100 <= near_points &&
         std::fabs(point.het_qm_efficiency() - paper_het_qm_efficiency()) * 100 <= near_points;
}

std::string settings_text(const std::string& settings) {
  if (settings.empty()) return "the defaults";
  std::string text;
  for (const char c : settings) text += c == ',' ? std::string(", ") : std::string(1, c);
  return text;
}

std::string verdict_text(const Reproduction& of, const RowFinding& row) {
  const bool is_judged = row.verdict == Verdict::agrees || row.verdict == Verdict::differs;
  const bool is_quick = of.result.plan.quick && is_judged;
  return std::string(name_of(row.verdict)) + (is_quick ? " (quick)" : "");
}

std::string difference_text(const RowFinding& row) {
  if (!row.difference_percent) return "";
  return fmt::format("{:+.0f} %", std::fabs(*row.difference_percent) < 0.5 ? 0.0 : *row.difference_percent);
}

std::string verdict_summary(const Reproduction& of) {
  std::map<Verdict, unsigned> counts;
  for (const RowFinding& row : of.rows) ++counts[row.verdict];
  const std::string unsaid =
      counts[Verdict::cannot_say] == 0 ? "" : fmt::format("; of {} nothing can be said", counts[Verdict::cannot_say]);
  return fmt::format("{} of {} rows that could have failed agree{}; {} are inputs, {} cannot fail, {} not modelled{}",
                     counts[Verdict::agrees], counts[Verdict::agrees] + counts[Verdict::differs], unsaid,
                     counts[Verdict::input], counts[Verdict::cannot_fail], counts[Verdict::not_modelled],
                     of.result.plan.quick ? "; of a quick look" : "");
}

std::string why_text(const RowFinding& row) {
  const std::string& how = row.row->how;
  if (row.reason.empty() || how.empty()) return row.reason + how;
  return row.reason + "; here: " + how;
}

std::vector<std::string> reproduction_heading(const Reproduction& of) {
  const ReproducePlan& plan = of.result.plan;
  const RunRequest& base = plan.points.front().request;
  std::vector<std::string> files, beside;
  for (const PlannedScene& scene : plan.scenes) {
    if (scene.role == PlannedScene::Role::beside) {
      beside.push_back(scene.name);
    } else if (!builtin_name_of(scene.request)) {
      files.push_back(printable(scene_name(scene.request)));
    }
  }
  const char* const judged =
      "Only rows that could have failed are judged; inputs come out as they went in, and some rows follow from others. "
      "A reason is given where this run has shown it: what it names was tried on the six scenes, and the row then "
      "agreed or lost at least half of its difference.";
  std::vector<std::string> lines{
      fmt::format("{}, {} fidelity, {}, {} simulations.", base.platform->name, vrpipe::name_of(plan.fidelity),
                  vrpipe::name_of(base.format), plan.points.size()),
      files.empty()
          ? "Scenes: stand-ins for the paper's, with the same size and number of Gaussians, like trained scenes "
            "to the pipeline (docs/scenes.md); none is trained."
          : fmt::format("Scenes: stand-ins, none of them trained, but for {}.", fmt::join(files, ", ")),
      tolerance_text(plan.rows), judged, "What only the paper's pictures show is not compared."};
  if (!beside.empty()) {
    lines.insert(lines.begin() + 2, fmt::format("Beside them, in no row and no mean: {}.", fmt::join(beside, ", ")));
  }
  if (plan.quick) {
    lines.emplace_back(fmt::format(
        "Quick look: at {} instead of cycle, {} views a scene, no large ones, no whole frames, no shader that blends, "
        "one number of passes, no "
        "reasons tried, the sensitivity of one scene and of few parameters. Verdicts say that they are of a quick "
        "look.",
        vrpipe::name_of(plan.fidelity), plan.views));
  }
  for (const Setting& setting : base.settings) {
    lines.push_back(printable(fmt::format("Set: {}.{}={}.", setting.unit, setting.parameter, setting.value)));
  }
  for (const UnitChoice& unit : base.units) {
    lines.push_back(
        printable(fmt::format("Unit: {}={}, where the slot is not pass-through.", unit.slot, unit.implementation)));
  }
  return lines;
}

ReportTable scenes_table(const Reproduction& of) {
  ReportTable table;
  table.title = "Speed-ups";
  table.heading = {"scene", "size",   "visible",         "baseline, M cycles", "QM",
                   "HET",   "HET+QM", "bound, baseline", "bound, HET+QM"};
  const auto unit = [](const PointResult& point) {
    const auto& bottleneck = point.run.bottleneck;
    if (!bottleneck) return std::string("-");
    const std::size_t dot = bottleneck->unit.rfind('.');
    return (dot == std::string::npos ? bottleneck->unit : bottleneck->unit.substr(dot + 1)) +
           fmt::format(" {:.0f} %", 100 * bottleneck->occupancy);
  };
  const auto add = [&](const std::string& label, const SceneFinding& scene) {
    const PointResult& baseline = *scene.runs[0];
    table.rows.push_back({label, fmt::format("{}x{}", baseline.width, baseline.height),
                          grouped(baseline.gaussians_visible), megacycles(baseline), times(scene.gains.qm),
                          times(scene.gains.het), times(scene.gains.het_qm), unit(baseline), unit(*scene.runs[3])});
  };
  for (const SceneFinding& scene : of.findings.scenes) add(scene_label(of, scene), scene);
  const auto mean = [&](double Gains::*what) {
    return mean_over(of, [what](const SceneFinding& scene) { return scene.gains.*what; });
  };
  const Mean qm = mean(&Gains::qm), het = mean(&Gains::het), both = mean(&Gains::het_qm);
  table.rows.push_back(
      {"arithmetic mean", "", "", "", times(qm.arithmetic), times(het.arithmetic), times(both.arithmetic), "", ""});
  table.rows.push_back(
      {"geometric mean", "", "", "", times(qm.geometric), times(het.geometric), times(both.geometric), "", ""});
  table.rows.push_back({"paper", "", "", "", said("R3"), said("R4"), said("R2"), "", ""});
  for (const SceneFinding& scene : of.findings.beside) add(scene_label(of, scene) + beside_them, scene);
  table.note = "Bound: the unit that is occupied the most, and how much of the cycles.";
  return table;
}

ReportTable front_ends_table(const Reproduction& of) {
  ReportTable table;
  const std::vector<Reproduction::FrontEnd>& all = of.front_ends;
  if (all.size() < 2) return table;
  table.title = "Front ends";
  table.heading = {"id", "what", "paper"};
  for (const auto& front_end : all) table.heading.push_back(front_end.name);
  const auto add = [&](std::vector<std::string> cells, const auto& cell) {
    for (const auto& front_end : all) cells.push_back(cell(front_end));
    table.rows.push_back(std::move(cells));
  };
  for (std::size_t i = 0; i < all.front().rows.size(); ++i) {
    const PaperRow& row = *all.front().rows[i].row;
    add({row.id, row.what, row.says}, [&](const auto& front_end) {
      const RowFinding& finding = front_end.rows[i];
      return (finding.verdict == Verdict::agrees ? "agrees: " : "") + finding.short_text();
    });
  }
  add({"", "HET, % of what its quads suggest", percent(paper_het_efficiency())},
      [](const auto& front_end) { return percent(front_end.means.het_efficiency()); });
  add({"", "HET+QM, % of what its quads suggest", percent(paper_het_qm_efficiency())},
      [](const auto& front_end) { return percent(front_end.means.het_qm_efficiency()); });
  add({"", "rows that agree", ""},
      [](const auto& front_end) { return fmt::format("{} of {}", front_end.agree(), front_end.rows.size()); });
  table.note = fmt::format("Of the six scenes, at {}; docs/open-parameters.md says what they are.",
                           vrpipe::name_of(sensitivity_fidelity));
  return table;
}

ReportTable blended_table(const Reproduction& of) {
  ReportTable table;
  table.title = "What is blended";
  table.heading = {"scene",      "fragments, HET",   "fragments, QM on top",       "second quads whole",
                   "quads, HET", "quads, QM on top", "fragments a quad, baseline", "fragments a quad, HET",
                   "fall, %"};
  const auto fall = [](double quads, double fragments) { return number(100 * (1 - quads / fragments), "{:.1f}"); };
  for (const SceneFinding& scene : of.findings.scenes) {
    const Gains& gains = scene.gains;
    table.rows.push_back({scene_label(of, scene), over(gains.fragments_het), over(gains.fragments_merging),
                          over(gains.fragments_merging_whole), over(gains.quads_het), over(gains.quads_merging),
                          number(gains.lanes_baseline, "{:.2f}"), number(gains.lanes_het, "{:.2f}"),
                          fall(gains.quads_het, gains.fragments_het)});
  }
  for (const bool is_arithmetic : {true, false}) {
    const auto mean = [&](double Gains::*what) {
      const Mean value = mean_over(of, [what](const SceneFinding& scene) { return scene.gains.*what; });
      return is_arithmetic ? value.arithmetic : value.geometric;
    };
    const double fragments = mean(&Gains::fragments_het), quads = mean(&Gains::quads_het);
    table.rows.push_back({is_arithmetic ? "arithmetic mean" : "geometric mean", over(fragments),
                          over(mean(&Gains::fragments_merging)), over(mean(&Gains::fragments_merging_whole)),
                          over(quads), over(mean(&Gains::quads_merging)),
                          number(mean(&Gains::lanes_baseline), "{:.2f}"), number(mean(&Gains::lanes_het), "{:.2f}"),
                          fall(quads, fragments)});
  }
  table.rows.push_back({"paper", said("R5"), said("R6"), said("R6"), said("R7"), said("R8"), "", "",
                        fmt::format("{:.1f}", paper_fragment_fall_percent())});
  table.note =
      "/2: half as many. Second quads whole: as QM on top, were all fragments of a merged pair's second quad gone, and "
      "not only those on "
      "a live one of the first. The paper does not say which it counts.";
  return table;
}

ReportTable utilization_table(const Reproduction& of) {
  ReportTable table;
  table.title = "Utilisation, % of peak";
  table.heading = {"scene", "variant", "raster", "prop", "zrop", "sm", "crop", "l2"};
  constexpr std::array<const char*, 4> variants{"baseline", "QM", "HET", "HET+QM"};
  for (const auto* scenes : {&of.findings.scenes, &of.findings.large}) {
    for (const SceneFinding& scene : *scenes) {
      for (const std::size_t variant : {0U, 3U}) {
        std::vector<std::string> cells{scene_label(of, scene), variants[variant]};
        for (std::size_t i = 2; i < table.heading.size(); ++i) {
          double share = std::nan("");
          for (const auto& [unit, value] : scene.runs[variant]->run.utilization) {
            if (unit == table.heading[i]) share = value;
          }
          cells.push_back(percent(share));
        }
        table.rows.push_back(std::move(cells));
      }
    }
  }
  return table;
}

ReportTable ratios_table(const Reproduction& of) {
  ReportTable table;
  table.title = "Early-termination ratios over views";
  table.heading = {"scene", "views", "minimum", "lower quartile", "median", "upper quartile", "maximum", "mean"};
  for (const SceneFinding& scene : of.findings.scenes) {
    const auto& distribution = scene.ratio_distribution;
    if (!distribution) continue;
    table.rows.push_back({scene_label(of, scene), std::to_string(distribution->count),
                          number(distribution->minimum, "{:.2f}"), number(distribution->lower_quartile, "{:.2f}"),
                          number(distribution->median, "{:.2f}"), number(distribution->upper_quartile, "{:.2f}"),
                          number(distribution->maximum, "{:.2f}"), number(scene.ratio_mean, "{:.2f}")});
  }
  table.note =
      "Fragments blended without over with termination, functional. Views: round the scene, or of its camera file; the "
      "paper's are all of the data set.";
  return table;
}

ReportTable maps_table(const Reproduction& of) {
  ReportTable table;
  table.title = "Fragments blended a pixel";
  table.heading = {"scene", "mean, without", "with termination", "greatest, without", "with"};
  for (const SceneFinding& scene : of.findings.scenes) {
    if (!scene.map_without->map || !scene.map_with->map) continue;
    const HeatMap &without = *scene.map_without->map, &with = *scene.map_with->map;
    const double pixels = static_cast<double>(without.width) * without.height;
    table.rows.push_back({scene_label(of, scene), number(static_cast<double>(without.sum) / pixels, "{:.1f}"),
                          number(static_cast<double>(with.sum) / pixels, "{:.1f}"), grouped(without.largest),
                          grouped(with.largest)});
  }
  return table;
}

ReportTable passes_table(const Reproduction& of) {
  ReportTable table;
  table.title = "Termination in passes, by software";
  table.heading = {"scene"};
  for (const unsigned passes : planned_passes(of.result.plan.quick))
    table.heading.push_back(fmt::format("{} passes", passes));
  table.heading.emplace_back("HET");
  for (const SceneFinding& scene : of.findings.scenes) {
    std::vector<std::string> cells{scene_label(of, scene)};
    for (const double gain : scene.passes) cells.push_back(times(gain));
    cells.push_back(times(scene.het_beside_passes));
    table.rows.push_back(std::move(cells));
  }
  table.note = fmt::format("Speed-ups over one pass, at {}.", vrpipe::name_of(sensitivity_fidelity));
  return table;
}

ReportTable frames_table(const Reproduction& of) {
  ReportTable table;
  table.title = "Whole frames";
  table.heading = {"scene, ms",
                   "software: project",
                   "lists",
                   "render",
                   "without termination",
                   "lanes that blend, %",
                   "hardware: project",
                   "sort",
                   "draw",
                   "HET+QM's draw",
                   "GSCore",
                   "software / hardware",
                   "hardware / HET+QM"};
  const auto ms = [](double value) { return number(value, "{:.2f}"); };
  for (const SceneFinding& scene : of.findings.scenes) {
    if (scene.frame == nullptr) return {};
    const WholeFrame& frame = *scene.frame;
    const WholeFrame::Preparation& by = frame.measured;
    const FrameTimes whole = frame_times(scene, &WholeFrame::measured);
    table.rows.push_back({scene_label(of, scene), ms(by.software), ms(frame.lists), ms(frame.render),
                          ms(frame.endless_render), number(100 * frame.share_of_lanes_blending(), "{:.1f}"),
                          ms(by.projection), ms(by.sort), ms(whole.draw), ms(scene.runs[3]->run.milliseconds),
                          ms(frame.accelerator), times(whole.software / whole.hardware),
                          times(whole.hardware / whole.het_qm)});
  }
  table.note =
      "Simulated milliseconds, kernels at lt (docs/software.md); preparation at prices that were measured on a GH100. "
      "GSCore has a "
      "clock and a memory of its own (docs/accelerator.md).";
  return table;
}

ReportTable large_table(const Reproduction& of) {
  ReportTable table;
  table.title = "Large scenes";
  table.heading = {"scene", "Gaussians", "visible", "baseline, M cycles", "QM", "HET", "HET+QM", "bound, baseline"};
  for (const SceneFinding& scene : of.findings.large) {
    const PointResult& baseline = *scene.runs[0];
    const auto& bottleneck = baseline.run.bottleneck;
    table.rows.push_back({scene_label(of, scene), grouped(baseline.gaussians_total),
                          grouped(baseline.gaussians_visible), megacycles(baseline), times(scene.gains.qm),
                          times(scene.gains.het), times(scene.gains.het_qm), bottleneck ? bottleneck->unit : "-"});
  }
  return table;
}

ReportTable cost_table(const Reproduction& of) {
  const StorageReport storage = quad_merging_storage(of.findings.scenes.front().runs[3]->run.request);
  ReportTable table;
  table.title = "Hardware cost";
  table.heading = {"unit", "storage, bytes", "paper"};
  table.rows = {{"TGC", grouped(storage.tgc_bytes), said("R14")},
                {"QRU", grouped(storage.qru_bytes), said("R15")},
                {"both, per GPC", grouped(storage.tgc_bytes + storage.qru_bytes), said("R16")}};
  return table;
}

ReportTable microbench_table(const Reproduction& of) {
  ReportTable table;
  table.title = "Microbenchmarks";
  table.heading = {"microbenchmark", "figure", "unit", "paper", "real GPU", "here", "within tolerance"};
  const auto optional = [](const std::optional<double>& value) { return value ? fmt::format("{:.4g}", *value) : "-"; };
  for (const MicrobenchResult& result : of.result.microbenches) {
    for (const MicrobenchFigure& figure : result.figures) {
      const bool is_judged = figure.reference && figure.tolerance_percent >= 0;
      table.rows.push_back({result.name, figure.name, figure.unit, optional(figure.paper), optional(figure.gpu),
                            optional(figure.measured),
                            !is_judged        ? "-"
                            : figure.agrees() ? "yes"
                                              : "no"});
    }
  }
  table.note =
      "What each is of, and why some differ: docs/microbenchmarks.md. The real GPU has half of this GPC's ROPs.";
  return table;
}

ReportTable sensitivity_table(const Reproduction& of) {
  const ReproducePlan& plan = of.result.plan;
  ReportTable table;
  table.title = "Sensitivity: the mean speed-up of HET+QM";
  table.heading = {"parameter", "spread, %", "default", "values"};
  for (const SensitivityFinding& finding : of.findings.sensitivity) {
    std::string values;
    for (std::size_t i = 0; i < finding.values.size(); ++i) {
      values += (i > 0 ? "; " : "") + short_value(finding.parameter.values[i]) + ": " +
                times(finding.values[i].het_qm.arithmetic);
    }
    std::string name = finding.parameter.name;
    if (finding.parameter.breadth == Breadth::headline) name += " *";
    table.rows.push_back(
        {name, number(finding.spread_percent, "{:.1f}"), times(finding.at_default.het_qm.arithmetic), values});
  }
  table.note = fmt::format(
      "One at a time, at {}. With a star: {}, whole images; else the eighth of the width in the middle of {}. In so "
      "narrow an image few tiles take turns, so that CROP's cache and hazards weigh more. Spread: greatest less least, "
      "of the default.",
      vrpipe::name_of(sensitivity_fidelity), studied_names(plan), plan.scenes[plan.column].name);
  return table;
}

ReportTable checks_table(const Reproduction& of) {
  ReportTable table;
  const char* const quick = vrpipe::name_of(sensitivity_fidelity);
  const char* const exact = vrpipe::name_of(of.result.plan.fidelity);
  table.title =
      fmt::format("The same at {} and at {}, of {}", quick, exact, of.result.plan.scenes[of.result.plan.column].name);
  table.heading = {"setting", fmt::format("HET, {}", quick), fmt::format("HET, {}", exact),
                   fmt::format("HET+QM, {}", quick), fmt::format("HET+QM, {}", exact)};
  for (const CheckFinding& check : of.findings.checks) {
    table.rows.push_back({settings_text(check.settings), times(check.quick.het.arithmetic),
                          times(check.exact.het.arithmetic), times(check.quick.het_qm.arithmetic),
                          times(check.exact.het_qm.arithmetic)});
  }
  return table;
}

ReportTable fragments_table(const Reproduction& of) {
  ReportTable table;
  table.title = "Riddle 1: fragments of a blended quad under HET";
  table.heading = {"what differs", "fragments", "quads", "fall, %", "fragments, none late", "fall, none late, %"};
  for (const FragmentFinding& finding : of.findings.fragments) {
    table.rows.push_back({settings_text(finding.settings), over(finding.fragments), over(finding.quads),
                          number(finding.fall_percent, "{:.1f}"), over(finding.fragments_in_time),
                          number(finding.fall_percent_in_time, "{:.1f}")});
  }
  const std::string fall = number(paper_fragment_fall_percent(), "{:.1f}");
  table.rows.push_back({"paper", said("R5"), said("R7"), fall, said("R5"), fall});
  table.note =
      "None late: as if fragments did not count that were tested before the termination of their pixel landed, though "
      "CROP took the time of their quads.";
  return table;
}

ReportTable efficiency_table(const Reproduction& of) {
  ReportTable table;
  table.title = "Riddle 2: speed-up of what the quads suggest";
  table.heading = {"setting", "QM best", "HET", "HET+QM", "HET, % of quads", "HET+QM, %", "fits"};
  const auto add = [&](const std::string& name, const StudyPoint& point) {
    table.rows.push_back({name, times(point.qm_best), times(point.het.arithmetic), times(point.het_qm.arithmetic),
                          percent(point.het_efficiency()), percent(point.het_qm_efficiency()),
                          fits_both(point) ? "both" : ""});
  };
  add("the six scenes", of.findings.main);
  for (const SceneFinding& scene : of.findings.scenes) {
    StudyPoint alone;
    const Gains& gains = scene.gains;
    alone.qm_best = gains.qm;
    alone.het.arithmetic = gains.het;
    alone.het_qm.arithmetic = gains.het_qm;
    alone.quads_het = gains.quads_het;
    alone.quads_het_qm = gains.quads_het * gains.quads_merging;
    add(scene_label(of, scene) + " alone", alone);
  }
  const ReproducePlan& plan = of.result.plan;
  for (const StudyPoint& point : of.findings.indoor_efficiency) {
    add(plan.scenes[plan.indoor].name + ", " + settings_text(point.settings), point);
  }
  for (const StudyPoint& point : of.findings.efficiency) {
    add(studied_names(plan) + ", " + settings_text(point.settings), point);
  }
  table.rows.push_back({"paper", said("R3"), said("R4"), said("R2"), percent(paper_het_efficiency()),
                        percent(paper_het_qm_efficiency()), ""});
  table.note = fmt::format(
      "Those with settings, and with the defaults, at {}. Mean speed-up over the mean of the baseline's quads over the "
      "variant's. Fits: both within {} points of the paper's.",
      vrpipe::name_of(sensitivity_fidelity), near_points);
  return table;
}

std::vector<ReportTable> all_tables(const Reproduction& of) {
  std::vector<ReportTable> tables;
  for (const auto make : {scenes_table, front_ends_table, blended_table, utilization_table, maps_table, ratios_table,
                          passes_table, frames_table, large_table, cost_table, microbench_table, sensitivity_table,
                          checks_table, fragments_table, efficiency_table}) {
    ReportTable table = make(of);
    if (!table.rows.empty()) tables.push_back(std::move(table));  // a quick look leaves some out
  }
  return tables;
}

}  // namespace vrpipe::tools
