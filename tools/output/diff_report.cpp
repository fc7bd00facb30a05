#include "output/diff_report.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/printable.h>

#include "output/report.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

// So that a summary is on one screen.
constexpr std::size_t most_settings = 12;
constexpr std::size_t most_changes = 10;
constexpr std::size_t longest_value = 32;
constexpr std::size_t most_columns = 100;

std::string value_text(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return printable(value.get<std::string>());
  if (value.is_number_unsigned()) return grouped(value.get<std::uint64_t>());
  if (value.is_number_float()) return fmt::format("{:.6g}", value.get<double>());
  return printable(value.dump());
}

std::string change_text(const Difference& difference) {
  const std::optional<double> change = difference.change_percent();
  return change ? fmt::format("{:+.2f} %", *change) : std::string();
}

/// In characters of which a summary has so many.
std::string short_text(const Json& value) {
  const std::string text = value_text(value);
  return text.size() <= longest_value ? text : text.substr(0, longest_value - 3) + "...";
}

/// What was asked for, not what came of it.
bool is_of_question(DiffGroup group) {
  return group == DiffGroup::made_by || group == DiffGroup::drawn || group == DiffGroup::settings;
}

std::string group_table(const ResultDiff& diff, DiffGroup group, const TextStyle& style) {
  TextTable table({name_of(group), "A", "B", "change"});
  std::string run;
  bool any = false;
  for (const Difference& each : diff.differences) {
    if (each.group != group) continue;
    any = true;
    if (each.run != run) table.group(printable(run = each.run));
    table.row({printable(each.key), value_text(each.a), value_text(each.b), change_text(each)});
  }
  return any ? table.text(style) + "\n" : std::string();
}

std::string question_text(const ResultDiff& diff, const TextStyle& style) {
  TextTable table({"asked for", "A", "B", "change"});
  std::size_t differing = 0;
  std::string run;
  for (const Difference& each : diff.differences) {
    if (!is_of_question(each.group) || ++differing > most_settings) continue;
    if (each.run != run) table.group(printable(run = each.run));
    table.row({printable(each.key), short_text(each.a), short_text(each.b), change_text(each)});
  }
  if (differing == 0) return {};
  std::string text = table.text(style);
  if (differing > most_settings) text += fmt::format("and {} more\n", differing - most_settings);
  return text + "\n";
}

/// Also of runs that take the same; empty where nothing has time.
std::string cycles_text(const ResultDiff& diff, const TextStyle& style) {
  const auto ratio = [](std::optional<double> a, std::optional<double> b) -> std::string {
    return a && b && *a > 0 ? fmt::format("{:.3f}", *b / *a) : "-";
  };
  const auto speedup = [](const TimePair::Time& time) -> std::string {
    return time.speedup ? fmt::format("{:.2f}x", *time.speedup) : "-";
  };
  std::vector<std::vector<std::string>> rows;
  bool has_speedups = false, has_clocks = false;
  for (const TimePair& time : diff.times) {
    const std::string cycles = ratio(static_cast<double>(time.a.cycles), static_cast<double>(time.b.cycles));
    const std::string milliseconds = ratio(time.a.milliseconds, time.b.milliseconds);
    rows.push_back({printable(time.run), grouped(time.a.cycles), grouped(time.b.cycles), cycles, milliseconds,
                    speedup(time.a), speedup(time.b)});
    has_clocks = has_clocks || cycles != milliseconds;
    has_speedups = has_speedups || time.a.speedup || time.b.speedup;
  }
  if (rows.empty()) return {};
  const auto shown = [&](std::vector<std::string> cells) {
    if (!has_speedups) cells.resize(5);
    if (!has_clocks) cells.erase(cells.begin() + 4);
    return cells;
  };
  TextTable table(shown({"cycles", "A", "B", "B/A", "B/A in ms", "speed-up A", "speed-up B"}));
  for (std::vector<std::string>& row : rows) table.row(shown(std::move(row)));
  return table.text(style) + "\n";
}

/// A statistic's own value, not a bucket, extreme or instance of it.
bool is_value_of_statistic(const Difference& difference) {
  const std::string end = ".value";
  return difference.group == DiffGroup::statistics && difference.key.size() > end.size() &&
         difference.key.compare(difference.key.size() - end.size(), end.size(), end) == 0;
}

/// How far a number moved: from 0 to 1, which is from or to 0, or through it.
double distance(const Difference& difference) {
  const auto a = difference.a.get<double>(), b = difference.b.get<double>();
  return std::min(1.0, std::abs(b - a) / std::max(std::abs(a), std::abs(b)));
}
double size_of(const Difference& difference) {
  return std::max(std::abs(difference.a.get<double>()), std::abs(difference.b.get<double>()));
}

/// Of each statistic the run in which it changed most; of results without statistics of any number that is an answer.
std::string changes_text(const ResultDiff& diff, const TextStyle& style) {
  const bool of_statistics = std::any_of(diff.differences.begin(), diff.differences.end(), is_value_of_statistic);
  std::vector<const Difference*> changed;
  for (const Difference& each : diff.differences) {
    const bool is_asked_for = of_statistics ? is_value_of_statistic(each) : !is_of_question(each.group);
    if (is_asked_for && each.a.is_number() && each.b.is_number()) changed.push_back(&each);
  }
  if (changed.empty()) return {};
  std::stable_sort(changed.begin(), changed.end(), [](const Difference* x, const Difference* y) {
    const double far_x = distance(*x), far_y = distance(*y);
    return far_x != far_y ? far_x > far_y : size_of(*x) > size_of(*y);
  });
  const auto name_of_change = [&](const Difference& each) {
    const std::size_t group = of_statistics ? std::string("statistics.").size() : 0;
    const std::size_t value = of_statistics ? std::string(".value").size() : 0;
    return printable(each.key.substr(group, each.key.size() - group - value));
  };
  TextTable table(
      {of_statistics ? "statistics that changed most" : "numbers that changed most", "run", "A", "B", "change"});
  table.left(1);
  std::vector<std::string> seen;
  for (const Difference* each : changed) {
    if (seen.size() == most_changes) break;
    if (std::find(seen.begin(), seen.end(), each->key) != seen.end()) continue;
    seen.push_back(each->key);
    table.row(
        {name_of_change(*each), printable(each->run), short_text(each->a), short_text(each->b), change_text(*each)});
  }
  return table.text(style) + "\n";
}

std::string lines_of(const std::string& text) {
  std::string lines;
  for (const std::string& line : wrapped(text, most_columns)) lines += line + "\n";
  return lines;
}

/// How many differences there are of each group.
std::string totals_text(const ResultDiff& diff) {
  if (diff.differences.empty()) return {};
  std::string text;
  for (unsigned group = 0; group <= static_cast<unsigned>(DiffGroup::other); ++group) {
    const auto of_group = static_cast<DiffGroup>(group);
    const auto count = std::count_if(diff.differences.begin(), diff.differences.end(),
                                     [&](const Difference& each) { return each.group == of_group; });
    if (count > 0)
      text += fmt::format("{}{} of {}", text.empty() ? "" : ", ", grouped(static_cast<std::uint64_t>(count)),
                          name_of(of_group));
  }
  return lines_of("differences in all: " + text + "; --all lists every one");
}

std::string names(const std::vector<std::string>& all) {
  std::string text;
  for (const std::string& name : all) text += (text.empty() ? "" : ", ") + printable(name);
  return text;
}

std::string picture_text(const PictureDiff& picture) {
  if (picture.error) {
    const ImageError& error = *picture.error;
    if (error.max_abs_error == 0) return "equal pixels";
    return fmt::format("PSNR {:.2f} dB, SSIM {:.5f}, largest difference {:.5f}, {} pixels ({:.3f} %) differ in 8 bits",
                       error.psnr_db, error.ssim, error.max_abs_error, grouped(error.pixels_differing),
                       100 * error.share_differing);
  }
  if (picture.same_bits == true) return "equal, as counts and cycles are (result hash)";
  return "not compared: " + printable(picture.why_none);
}

/// A line for all runs of which there is the same to say.
std::string pictures_text(const ResultDiff& diff) {
  std::vector<std::pair<std::string, std::vector<std::string>>> runs_of_text;
  for (const PictureDiff& picture : diff.pictures) {
    const std::string text = picture_text(picture);
    auto found =
        std::find_if(runs_of_text.begin(), runs_of_text.end(), [&](const auto& each) { return each.first == text; });
    if (found == runs_of_text.end()) found = runs_of_text.insert(found, {text, {}});
    found->second.push_back(picture.run);
  }
  std::string all;
  for (const auto& [text, runs] : runs_of_text) all += lines_of(fmt::format("pictures of {}: {}", names(runs), text));
  return all;
}

}  // namespace

std::string diff_text(const ResultDiff& diff, bool all, const TextStyle& style) {
  std::string text = fmt::format("A: {}\nB: {}\n\n", printable(diff.a.path.string()), printable(diff.b.path.string()));
  if (all) {
    for (unsigned group = 0; group <= static_cast<unsigned>(DiffGroup::other); ++group)
      text += group_table(diff, static_cast<DiffGroup>(group), style);
  } else if (!diff.differences.empty()) {
    text += question_text(diff, style) + cycles_text(diff, style) + changes_text(diff, style);
  }
  if (!diff.only_in_a.empty()) text += "only in A: " + names(diff.only_in_a) + "\n";
  if (!diff.only_in_b.empty()) text += "only in B: " + names(diff.only_in_b) + "\n";
  text += pictures_text(diff);
  if (!all) text += totals_text(diff);
  if (diff.equal()) text += "nothing differs but what the host makes: seconds, load, names of files\n";
  return text;
}

Json diff_json(const ResultDiff& diff) {
  Json differences = Json::array();
  for (const Difference& each : diff.differences) {
    const std::optional<double> change = each.change_percent();
    differences.push_back({{"group", name_of(each.group)},
                           {"run", each.run.empty() ? Json() : Json(each.run)},
                           {"key", each.key},
                           {"a", each.a},
                           {"b", each.b},
                           {"change_percent", change ? Json(*change) : Json()}});
  }
  Json pictures = Json::array();
  for (const PictureDiff& picture : diff.pictures) {
    Json error;
    if (picture.error) {
      const bool is_finite = std::isfinite(picture.error->psnr_db);
      error = {{"psnr_db", is_finite ? Json(picture.error->psnr_db) : Json()},
               {"ssim", picture.error->ssim},
               {"max_abs_error", picture.error->max_abs_error},
               {"pixels_differing", picture.error->pixels_differing}};
    }
    pictures.push_back({{"run", picture.run},
                        {"same_result_hash", picture.same_bits ? Json(*picture.same_bits) : Json()},
                        {"error", std::move(error)},
                        {"reason", picture.why_none.empty() ? Json() : Json(picture.why_none)}});
  }
  return {{"schema", "vrpipe.diff/1"},      {"version", VRPIPE_VERSION},
          {"a", diff.a.path.string()},      {"b", diff.b.path.string()},
          {"equal", diff.equal()},          {"only_in_a", diff.only_in_a},
          {"only_in_b", diff.only_in_b},    {"differences", std::move(differences)},
          {"pictures", std::move(pictures)}};
}

}  // namespace vrpipe::tools
