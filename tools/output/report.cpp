#include "output/report.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <vrpipe/arithmetic/blend.h>
#include <vrpipe/component/printable.h>
#include <vrpipe/kernel/accounting.h>

#include "jobs/comparison.h"
#include "output/effects_report.h"
#include "output/energy_report.h"
#include "output/machines_text.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

/// Counts of a table in one scale, so that they compare at a glance.
struct CountScale {
  double divisor;
  const char* suffix;  ///< for the heading of a group
  std::string operator()(std::uint64_t value) const {
    if (value == 0) return "0";
    return divisor > 1 ? fmt::format("{:.2f}", static_cast<double>(value) / divisor) : grouped(value);
  }
};

CountScale scale_for(std::uint64_t largest) {
  if (largest >= 1000000) return {1e6, ", millions"};
  if (largest >= 100000) return {1e3, ", thousands"};
  return {1, ""};
}

std::string tenths_of_percent(double share) { return fmt::format("{:.1f}", 100 * share); }

std::string ratio(std::uint64_t numerator, std::uint64_t denominator) {
  if (denominator == 0) return "-";
  return fmt::format("{:.2f}x", static_cast<double>(numerator) / static_cast<double>(denominator));
}

std::string bytes(std::uint64_t value) {
  return value < 1024 ? fmt::format("{} B", value) : fmt::format("{:.2f} KB", static_cast<double>(value) / 1024);
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

bool is_of_pipeline(const RunResult& run) { return run.request.variant.is_of_pipeline(); }

/// Builds rows with one cell for each run.
class RunTable {
 public:
  explicit RunTable(const std::vector<RunResult>& runs) : runs_(runs), table_(heading(runs)) {}

  void group(const std::string& title) { table_.group(title); }
  template <class Cell>
  void row(const std::string& label, const Cell& cell, bool emphasised = false) {
    std::vector<std::string> cells{label};
    for (const RunResult& run : runs_) cells.push_back(cell(run));
    table_.row(std::move(cells), emphasised);
  }
  /// A row of counts; left out when all are zero and it is not `always` there.
  /// @param of_pipeline  whether only the pipeline has any
  void counts(const std::string& label, std::uint64_t Counts::*member, const CountScale& scale, bool of_pipeline,
              bool always = true) {
    const auto is_zero = [member](const RunResult& run) { return run.counts.*member == 0; };
    if (!always && std::all_of(runs_.begin(), runs_.end(), is_zero)) return;
    row(label,
        [&](const RunResult& run) { return of_pipeline && !is_of_pipeline(run) ? "-" : scale(run.counts.*member); });
  }
  std::string text(const TextStyle& style) const { return table_.text(style); }

 private:
  static std::vector<std::string> heading(const std::vector<RunResult>& runs) {
    std::vector<std::string> cells{""};
    for (const RunResult& run : runs) cells.push_back(name_of(run.request));
    return cells;
  }
  const std::vector<RunResult>& runs_;
  TextTable table_;
};

/// The fates of quads or of fragments.
struct Fates {
  std::uint64_t Counts::*rasterized;
  std::uint64_t Counts::*depth_stencil_failed;
  std::uint64_t Counts::*terminated;
  std::uint64_t Counts::*unshaded;
  std::uint64_t Counts::*shaded;
  std::uint64_t Counts::*pruned;
  std::uint64_t Counts::*merged;
  std::uint64_t Counts::*dropped_late;
  std::uint64_t Counts::*late_failed;
  std::uint64_t Counts::*unblended;
  std::uint64_t Counts::*blended;
};

constexpr Fates quad_fates{&Counts::quads_rasterized,  &Counts::quads_depth_stencil_failed,
                           &Counts::quads_terminated,  &Counts::quads_unshaded,
                           &Counts::quads_shaded,      &Counts::quads_pruned,
                           &Counts::quads_merged,      &Counts::quads_dropped_late,
                           &Counts::quads_late_failed, &Counts::quads_unblended,
                           &Counts::quads_blended};
constexpr Fates fragment_fates{&Counts::fragments_rasterized,  &Counts::fragments_depth_stencil_failed,
                               &Counts::fragments_terminated,  &Counts::fragments_unshaded,
                               &Counts::fragments_shaded,      &Counts::fragments_pruned,
                               &Counts::fragments_merged,      &Counts::fragments_dropped_late,
                               &Counts::fragments_late_failed, &Counts::fragments_unblended,
                               &Counts::fragments_blended};

void add_fates(RunTable& table, const std::string& title, const Fates& fates, const JobResult& result) {
  const std::vector<RunResult>& runs = result.runs;
  const bool of_pipeline = fates.rasterized == quad_fates.rasterized;
  std::uint64_t largest = 0;
  for (const RunResult& run : runs) largest = std::max(largest, run.counts.*fates.rasterized);
  const CountScale scale = scale_for(largest);
  table.group(title + scale.suffix);
  table.counts("rasterized", fates.rasterized, scale, of_pipeline);
  table.counts("depth/stencil failed", fates.depth_stencil_failed, scale, of_pipeline, false);
  table.counts("terminated", fates.terminated, scale, of_pipeline);
  table.counts("not shaded (depth alone)", fates.unshaded, scale, of_pipeline, false);
  table.counts("shaded", fates.shaded, scale, of_pipeline);
  table.counts("pruned (alpha < 1/255)", fates.pruned, scale, of_pipeline);
  table.counts("merged away", fates.merged, scale, of_pipeline);
  table.counts("dropped late", fates.dropped_late, scale, of_pipeline, false);
  table.counts("late failed", fates.late_failed, scale, of_pipeline, false);
  table.counts("not blended (no colour)", fates.unblended, scale, of_pipeline, false);
  table.counts("blended", fates.blended, scale, of_pipeline);
  if (runs.size() > 1) {
    const std::uint64_t before = runs[result.baseline].counts.*fates.blended;
    table.row("blended, reduction", [&](const RunResult& run) {
      return before == 0 ? std::string("-") : ratio(before, run.counts.*fates.blended);
    });
  }
}

void add_time(RunTable& table, const JobResult& result) {
  const std::vector<RunResult>& runs = result.runs;
  const RunResult& baseline = runs[result.baseline];
  table.group("time");
  if (runs.front().cycles) {
    table.row("cycles", [](const RunResult& run) { return grouped(run.cycles.value_or(0)); });
    table.row("simulated ms", [](const RunResult& run) { return fmt::format("{:.3f}", run.milliseconds); });
    if (runs.size() > 1) {
      table.row(
          "speed-up over " + name_of(baseline.request),
          [&](const RunResult& run) {
            const std::optional<double> gain = speedup(baseline, run);
            return gain ? fmt::format("{:.2f}x", *gain) : std::string("-");
          },
          true);
    }
  }
  table.row("host seconds", [](const RunResult& run) { return fmt::format("{:.2f}", run.host_seconds); });
  table.row("CPU seconds", [](const RunResult& run) { return fmt::format("{:.2f}", run.cpu_seconds); });
}

void add_utilization(RunTable& table, const std::vector<RunResult>& runs) {
  const std::vector<std::string> names = utilized(runs);
  if (names.empty()) return;
  table.group("utilization, % of peak");
  for (const std::string& name : names) {
    table.row(name, [&](const RunResult& run) {
      const std::optional<double> share = utilization_of(run, name);
      return share ? tenths_of_percent(*share) : std::string("-");
    });
  }
}

/// A ratio of a run; none where it did not have what it is of.
std::optional<double> statistic_quotient(const RunResult& run, const std::string& name) {
  for (const StatisticReport& report : run.statistics) {
    if (report.name == name) return report.quotient();
  }
  return std::nullopt;
}

void add_cache(RunTable& table, const std::vector<RunResult>& runs) {
  const auto hits = [](const RunResult& run) { return statistic_quotient(run, "crop.cache.sector_hit_rate"); };
  if (std::none_of(runs.begin(), runs.end(), hits)) return;
  table.group("colour cache");
  table.row("sectors hit, %", [&](const RunResult& run) {
    const std::optional<double> rate = hits(run);
    return rate ? tenths_of_percent(*rate) : std::string("-");
  });
}

/// What passed between the levels, by what it was for, on a platform whose L2 misses.
void add_memory(RunTable& table, const std::vector<RunResult>& runs) {
  const auto megabytes = [](const RunResult& run, const std::string& memory, const std::string& traffic) {
    std::optional<double> moved;  // none where there is no such memory
    for (const StatisticReport& report : run.statistics) {
      for (const char* direction : {"read", "written"}) {
        if (report.name == memory + "." + traffic + "_bytes_" + direction)
          moved = moved.value_or(0) + static_cast<double>(report.value) / 1e6;
      }
    }
    return moved;
  };
  const auto misses = [](const RunResult& run) {
    return statistic_quotient(run, "l2.cache.sector_hit_rate").has_value();
  };
  if (std::none_of(runs.begin(), runs.end(), misses)) return;
  table.group("moved to and from memory, MB");
  for (const auto& [memory, shown] : {std::pair{"l2", "L2"}, std::pair{"dram", "DRAM"}}) {
    for (const auto& [traffic, what] :
         {std::pair{"color", "colour"}, std::pair{"depth_stencil", "depth-stencil"}, std::pair{"vertex", "vertices"},
          std::pair{"attribute", "attributes"}, std::pair{"other", "other"}}) {
      const auto cell = [&megabytes, memory = memory, traffic = traffic](const RunResult& run) {
        return megabytes(run, memory, traffic);
      };
      if (std::none_of(runs.begin(), runs.end(), [&](const RunResult& run) { return cell(run).value_or(0) > 0; }))
        continue;
      table.row(fmt::format("{}, {}", shown, what), [&](const RunResult& run) {
        const std::optional<double> moved = cell(run);
        return is_of_pipeline(run) && moved ? fmt::format("{:.2f}", *moved) : "-";
      });
    }
  }
}

/// What each unit spent its cycles on.
std::string unit_states_text(const RunResult& run, const TextStyle& style) {
  std::vector<std::string> heading{"unit cycles, %"};
  for (unsigned state = 0; state < unit_states; ++state) {
    heading.emplace_back(vrpipe::name_of(static_cast<UnitState>(state)));
  }
  TextTable table(std::move(heading));
  const double cycles = static_cast<double>(std::max<std::uint64_t>(run.cycles.value_or(0), 1));
  for (const UnitReport& unit : run.units) {
    std::vector<std::string> cells{unit.name};
    for (const std::uint64_t spent : unit.cycles)
      cells.push_back(tenths_of_percent(static_cast<double>(spent) / cycles));
    table.row(std::move(cells));
  }
  return table.text(style);
}

/// What became of the quads of each draw, in every run.
std::string draws_text(const std::vector<RunResult>& runs, const TextStyle& style) {
  constexpr std::size_t most_shown = 20;
  const std::vector<DrawReport>& draws = runs.front().draws;
  if (draws.empty()) return {};
  const bool tests = std::any_of(runs.begin(), runs.end(), [](const RunResult& run) {
    return run.counts.quads_depth_stencil_failed + run.counts.quads_unshaded > 0;
  });
  std::vector<std::string> columns{"quads_rasterized", "quads_terminated", "quads_shaded", "quads_blended"};
  std::vector<std::string> names{"quads by draw", "rasterized", "terminated", "shaded", "blended"};
  if (tests) {
    columns.insert(columns.begin() + 1, "quads_depth_stencil_failed");
    names.insert(names.begin() + 2, "depth/stencil failed");
    columns.insert(columns.begin() + 3, "quads_unshaded");
    names.insert(names.begin() + 4, "not shaded");
  }
  if (std::any_of(runs.begin(), runs.end(), [](const RunResult& run) { return run.counts.quads_late_failed > 0; })) {
    columns.insert(columns.end() - 1, "quads_late_failed");
    names.insert(names.end() - 1, "late failed");
  }
  const bool timed = draws.front().cycles.has_value();
  if (timed) names.insert(names.end(), {"cycles", "to cycle"});
  TextTable table(std::move(names));
  const auto row = [&](const std::string& label, const DrawReport& draw) {
    std::vector<std::string> cells{label};
    for (const std::string& name : columns) {
      const auto found =
          std::find_if(draw.counts.begin(), draw.counts.end(), [&](const auto& count) { return count.first == name; });
      cells.push_back(grouped(found->second));
    }
    if (timed) {
      cells.push_back(grouped(draw.cycles.value_or(0)));
      cells.push_back(draw.end ? grouped(*draw.end) : "-");
    }
    table.row(std::move(cells));
  };
  for (std::size_t i = 0; i < std::min(draws.size(), most_shown); ++i) {
    if (runs.size() == 1) {
      row(printable(draws[i].name), draws[i]);
      continue;
    }
    table.group(printable(draws[i].name));
    for (const RunResult& run : runs) row(name_of(run.request), run.draws[i]);
  }
  std::string text = table.text(style);
  if (draws.size() > most_shown) text += fmt::format("and {} more draws: see --json\n", draws.size() - most_shown);
  return text + "\n";
}

std::string heading(const JobResult& result, const TextStyle& style) {
  std::string text = style.bold(fmt::format("{}, {}x{}", printable(result.scene.name), result.width, result.height));
  text += fmt::format(": {} of {} Gaussians visible\n", grouped(result.scene.gaussians_visible),
                      grouped(result.scene.gaussians_total));
  if (result.scene.triangles + result.scene.triangles_rejected > 0) {
    text.pop_back();
    text += fmt::format(", {} triangles of meshes", grouped(result.scene.triangles));
    if (result.scene.triangles_rejected > 0)
      text += fmt::format(", {} left out", grouped(result.scene.triangles_rejected));
    text += "\n";
  }
  return text + machines_text(result.runs, result.preprocessing, result.passes, style) + "\n";
}

/// A unit as the text calls it: CROP, or gpc1.CROP where there are several.
std::string unit_text(const std::string& unit, const RunResult& run) {
  const std::size_t dot = unit.rfind('.');
  if (dot == std::string::npos) return upper(unit);
  return (gpcs_of(run.request) > 1 ? unit.substr(0, dot + 1) : std::string()) + upper(unit.substr(dot + 1));
}

/// The largest value of a statistic over the runs; 0 where none has it.
std::uint64_t largest_statistic(const std::vector<RunResult>& runs, const std::string& name) {
  std::uint64_t largest = 0;
  for (const RunResult& run : runs) {
    for (const StatisticReport& report : run.statistics) {
      if (report.name == name) largest = std::max(largest, report.value);
    }
  }
  return largest;
}

/// One line on numbers that went wrong, where any did.
std::string anomaly_text(const std::vector<RunResult>& runs) {
  std::vector<std::string> parts;
  const auto add = [&](const char* statistic, const char* meaning) {
    const std::uint64_t value = largest_statistic(runs, statistic);
    if (value > 0) parts.push_back(fmt::format("{} {}", grouped(value), meaning));
  };
  add("crop.pixels_stuck", "pixels stuck below the termination threshold by rounding");
  add("crop.colors_saturated", "fragments took a colour beyond the format's largest");
  add("sm.colors_clamped", "times a colour was clamped to the format's range");
  add("vpo.dropped_not_finite", "splats dropped as not finite");
  // Within 32 bits for every splat but those far larger than a tile.
  const std::uint64_t bits = largest_statistic(runs, "raster.widest_edge");
  if (largest_statistic(runs, "raster.wide_edges") > 0) parts.push_back(fmt::format("edge functions of {} bits", bits));
  for (const StatisticReport& report : runs.front().statistics) {
    if (report.name != "vpo.smallest_determinant" || report.value >= 1000) continue;
    parts.push_back(fmt::format("smallest splat of determinant {:.6f} px^2", static_cast<double>(report.value) * 1e-6));
  }
  if (parts.empty()) return {};
  std::string text = "numbers to watch: ";
  for (std::size_t i = 0; i < parts.size(); ++i) text += (i > 0 ? "; " : "") + parts[i];
  return text + "\n";
}

/// That all is of a part of the run.
std::string stopped_text(const RunResult& run) {
  if (!run.stopped) return {};
  return fmt::format("stopped at cycle {}: the frame goes on; counts, states and picture are as they were then\n",
                     grouped(run.request.stop_at));
}

/// Where cycles may be farther off than the documentation says: reasons of all runs, then those of some.
std::string validated_text(const std::vector<RunResult>& runs) {
  std::vector<std::pair<std::string, std::vector<std::string>>> names_of_reason;
  for (const RunResult& run : runs) {
    for (const std::string& reason : run.outside_validated_range) {
      auto found = std::find_if(names_of_reason.begin(), names_of_reason.end(),
                                [&](const auto& each) { return each.first == reason; });
      if (found == names_of_reason.end()) found = names_of_reason.insert(found, {reason, {}});
      found->second.push_back(name_of(run.request));
    }
  }
  std::string text;
  for (const auto& [reason, names] : names_of_reason) {
    const bool is_of_all = names.size() == runs.size();
    text += fmt::format("{}{} may be off: {}; confirm at cycle\n", fidelity_of(runs.front().request),
                        is_of_all ? "" : fmt::format(" of {}", fmt::join(names, ", ")), reason);
  }
  return text;
}

/// How far cycles may be off, where they are not exact and that is known.
std::string expected_error_text(const std::vector<RunResult>& runs) {
  std::vector<std::string> parts;
  for (const RunResult& run : runs) {
    if (run.expected_error_percent.value_or(0) == 0 || run.sampling) continue;
    parts.push_back(
        fmt::format("{}+-{:.1f} %", runs.size() > 1 ? name_of(run.request) + " " : "", *run.expected_error_percent));
  }
  if (parts.empty()) return {};
  return fmt::format("{}: cycles within {}, as nine of ten runs whose bottleneck and memory are as busy\n",
                     fidelity_of(runs.front().request), fmt::join(parts, ", "));
}

/// How cycles of windows, and those within an error, were come by.
std::string sampling_text(const std::vector<RunResult>& runs) {
  std::string text;
  for (const RunResult& run : runs) {
    const std::string name = runs.size() > 1 ? name_of(run.request) + ": " : "";
    if (run.way) {
      text += fmt::format("{}--error {:g}% took {}: {}\n", name, run.request.error_percent, run.way->fidelity,
                          run.way->why);
    }
    if (!run.sampling) continue;
    const SamplingReport& sampling = *run.sampling;
    if (sampling.windows == 0) {
      text += fmt::format("{}sampled: all of the frame at cycle: {}\n", name, sampling.whole_because);
      continue;
    }
    text += fmt::format(
        "{}sampled: {} cycles, {:g} of 100 within +-{:.1f} %, {} windows with {:.1f} % of them and {:.1f} % to warm "
        "up, seed {}\n",
        name, grouped(*run.cycles), SamplingReport::confidence_percent, sampling.half_interval_percent,
        sampling.windows, 100 * sampling.measured_share, 100 * sampling.warm_up_share, sampling.seed);
  }
  return text;
}

/// What quad merging adds, once for all runs that add the same.
std::string storage_text(const std::vector<RunResult>& runs) {
  std::vector<std::pair<std::string, std::vector<std::string>>> names_of_text;
  std::size_t merging = 0;
  for (const RunResult& run : runs) {
    if (!run.request.variant.quad_merging) continue;
    ++merging;
    const StorageReport storage = quad_merging_storage(run.request);
    const std::string text =
        fmt::format("adds {} of hardware storage per GPC: TGC {}, QRU {}", bytes(storage.tgc_bytes + storage.qru_bytes),
                    bytes(storage.tgc_bytes), bytes(storage.qru_bytes));
    auto found =
        std::find_if(names_of_text.begin(), names_of_text.end(), [&](const auto& each) { return each.first == text; });
    if (found == names_of_text.end()) found = names_of_text.insert(found, {text, {}});
    found->second.push_back(name_of(run.request));
  }
  std::string all;
  for (const auto& [text, names] : names_of_text) {
    all += names.size() == merging ? "quad merging " + text + "\n"
                                   : fmt::format("quad merging of {} {}\n", fmt::join(names, ", "), text);
  }
  return all;
}

std::string rejected_text(const RejectedGaussians& rejected) {
  if (rejected.total() == 0) return {};
  return fmt::format("rejected {} Gaussians: {} with a NaN or infinite value, {} without an orientation\n",
                     grouped(rejected.total()), grouped(rejected.not_finite), grouped(rejected.zero_quaternion));
}

/// What is not alike where a run is not of the pipeline.
std::string drawn_otherwise_text(const std::vector<RunResult>& runs) {
  std::string text;
  for (const RunResult& run : runs) {
    if (is_of_pipeline(run) || !run.cycles) continue;
    const bool is_accelerator = run.request.variant.drawn_by == DrawnBy::accelerator;
    text += fmt::format(
        "{}: its cycles{} have the sorting of splats among them, which is before a draw of the pipeline; "
        "its target is RGBA32F\n",
        name_of(run.request), is_accelerator ? ", of the platform's clock," : "");
  }
  return text;
}

std::string remarks(const JobResult& result) {
  const std::vector<RunResult>& runs = result.runs;
  std::string text;
  if (draws_nothing(runs.front(), result.scene)) {
    text += nothing_visible(result.scene, result.viewpoint.has_value()) + "\n";
  }
  text += stopped_text(runs.front());
  text += fidelities_text(runs) + drawn_otherwise_text(runs);
  for (const RunResult& run : runs) text += bound_text(run);
  text += sampling_text(runs) + expected_error_text(runs) + validated_text(runs);
  if (const auto early = early_termination_ratio(runs)) {
    text += fmt::format("early-termination ratio {:.2f} (fragments blended without over with termination)\n", *early);
  }
  text += storage_text(runs);
  text += rejected_text(result.scene.rejected);
  for (const std::string& note : result.scene.notes) text += "note: " + printable(note) + "\n";
  text += anomaly_text(runs);
  text += fmt::format("took {:.1f} s to load the scene, {:.1f} s to simulate", result.load_seconds,
                      result.simulate_seconds);
  if (runs.size() > 1) {
    text += fmt::format(" in {} process{}", result.processes, result.processes == 1 ? "" : "es at a time");
  }
  text += "\n";
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (result.images[i]) text += fmt::format("image: {} and .exr\n", printable(result.images[i]->png));
  }
  return text;
}

}  // namespace

std::optional<double> utilization_of(const RunResult& run, const std::string& name) {
  for (const auto& [slot, share] : run.utilization) {
    if (slot == name) return share;
  }
  return std::nullopt;
}

std::vector<std::string> utilized(const std::vector<RunResult>& runs) {
  const auto most = std::max_element(runs.begin(), runs.end(), [](const RunResult& a, const RunResult& b) {
    return a.utilization.size() < b.utilization.size();
  });
  std::vector<std::string> names;
  for (const auto& each : most->utilization) {
    const std::string& name = each.first;
    // DRAM does nothing while L2 is all the memory there is.
    const auto is_idle = [&](const RunResult& run) { return utilization_of(run, name).value_or(0) <= 0; };
    if (name != "dram" || !std::all_of(runs.begin(), runs.end(), is_idle)) names.push_back(name);
  }
  return names;
}

bool draws_nothing(const RunResult& run, const SceneSummary& scene) {
  return run.counts.fragments_rasterized == 0 && (is_of_pipeline(run) || scene.gaussians_visible == 0);
}

std::string fidelities_text(const std::vector<RunResult>& runs) {
  std::string text;
  for (const RunResult& run : runs) {
    if (run.way || run.request.fidelity >= finest_fidelity_of(runs)) continue;
    text +=
        fmt::format("{} is at {}: there is nothing more exact of it\n", name_of(run.request), fidelity_of(run.request));
  }
  return text;
}

std::string grouped(std::uint64_t value) {
  std::string digits = std::to_string(value);
  for (std::size_t place = digits.size(); place > 3;) {
    place -= 3;
    digits.insert(place, 1, ',');
  }
  return digits;
}

std::string nothing_visible(const SceneSummary& scene, bool has_camera) {
  return fmt::format("nothing is visible: none of the {} {} covers a pixel; {}", grouped(scene.gaussians_total),
                     has_camera ? "Gaussians" : "splats",
                     has_camera ? "turn the camera with --camera, or --eye and --look-at"
                                : "save the draw list from a camera that sees the scene");
}

std::vector<std::string> notes_of(const JobResult& result) {
  std::string text;
  if (draws_nothing(result.runs.front(), result.scene)) {
    text += nothing_visible(result.scene, result.viewpoint.has_value()) + "\n";
  }
  text += anomaly_text(result.runs) + sampling_text(result.runs) + expected_error_text(result.runs) +
          validated_text(result.runs) + rejected_text(result.scene.rejected);
  for (const std::string& note : result.scene.notes) text += "note: " + note + "\n";
  text += storage_text(result.runs);
  std::vector<std::string> lines;
  for (std::size_t begin = 0, end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    lines.push_back(text.substr(begin, end - begin));
  }
  return lines;
}

std::string bound_text(const RunResult& run) {
  if (!run.bottleneck) return {};
  const Bottleneck& busiest = *run.bottleneck;
  std::string parts;
  for (const auto& [name, share] : busiest.parts) {
    if (share < 0.001) continue;
    parts += fmt::format("{}{} {} %", parts.empty() ? "" : ", ", name, tenths_of_percent(share));
  }
  const std::string unit = unit_text(busiest.unit, run);
  if (busiest.occupancy >= bounding_occupancy) {
    return fmt::format("{} is bound by {}, occupied {} % ({})\n", name_of(run.request), unit,
                       tenths_of_percent(busiest.occupancy), parts);
  }
  std::string text = fmt::format("no one unit bounds {}: {} is occupied {} % ({})", name_of(run.request), unit,
                                 tenths_of_percent(busiest.occupancy), parts);
  const UnitReport* next = nullptr;
  for (const UnitReport& other : run.units) {
    if (other.name != busiest.unit && (next == nullptr || other.occupancy > next->occupancy)) next = &other;
  }
  if (next != nullptr && next->occupancy > 0) {
    text += fmt::format(", {} {} %", unit_text(next->name, run), tenths_of_percent(next->occupancy));
  }
  return text + "\n";
}

std::string report(const JobResult& result, const TextStyle& style) {
  const std::vector<RunResult>& runs = result.runs;
  RunTable table(runs);
  add_time(table, result);
  add_fates(table, "fragments", fragment_fates, result);
  if (std::any_of(runs.begin(), runs.end(), is_of_pipeline)) {
    add_fates(table, "quads", quad_fates, result);
    const CountScale exact{1, ""};
    table.group("batches");
    table.counts("warps", &Counts::warps, exact, true);
    table.counts("TGC flushes", &Counts::tgc_flushes, exact, true);
    table.counts("TC flushes", &Counts::tc_flushes, exact, true);
    table.counts("termination updates", &Counts::termination_updates, exact, true);
  }
  add_utilization(table, runs);
  add_cache(table, runs);
  add_memory(table, runs);

  std::string text = heading(result, style) + table.text(style) + "\n" + draws_text(runs, style);
  if (runs.size() == 1 && !runs.front().units.empty()) text += unit_states_text(runs.front(), style) + "\n";
  if (result.energies) text += energy_text(runs, result.baseline, *result.energies, style) + "\n";
  return text + remarks(result) + effects_text(runs, result.effect_costs, style);
}

}  // namespace vrpipe::tools
