#include "output/diff_report.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/printable.h>

#include "output/report.h"
#include "output/text_table.h"

namespace vrpipe::tools {
namespace {

constexpr std::size_t most_statistics = 20;

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

/// How far a value moved; what has no ratio the farthest.
double distance(const Difference& difference) {
  const std::optional<double> change = difference.change_percent();
  return change ? std::abs(*change) : HUGE_VAL;
}

std::string group_table(const ResultDiff& diff, DiffGroup group, bool all, const TextStyle& style) {
  std::vector<const Difference*> of_group;
  for (const Difference& each : diff.differences) {
    if (each.group == group) of_group.push_back(&each);
  }
  if (of_group.empty()) return {};
  std::size_t left_out = 0;
  if (group == DiffGroup::statistics && !all && of_group.size() > most_statistics) {
    std::vector<const Difference*> far = of_group;
    std::stable_sort(far.begin(), far.end(),
                     [](const Difference* x, const Difference* y) { return distance(*x) > distance(*y); });
    far.resize(most_statistics);
    left_out = of_group.size() - most_statistics;
    const auto is_near = [&](const Difference* each) { return std::find(far.begin(), far.end(), each) == far.end(); };
    of_group.erase(std::remove_if(of_group.begin(), of_group.end(), is_near), of_group.end());
  }
  TextTable table({name_of(group), "A", "B", "change"});
  std::string run;
  for (const Difference* each : of_group) {
    if (each->run != run) table.group(printable(run = each->run));
    table.row({printable(each->key), value_text(each->a), value_text(each->b), change_text(*each)});
  }
  std::string text = table.text(style);
  if (left_out > 0) text += fmt::format("and {} more, which changed less: --all, or --json\n", left_out);
  return text + "\n";
}

std::string names(const std::vector<std::string>& all) {
  std::string text;
  for (const std::string& name : all) text += (text.empty() ? "" : ", ") + printable(name);
  return text;
}

std::string picture_text(const PictureDiff& picture) {
  std::string text = printable(picture.run) + ": ";
  if (picture.error) {
    const ImageError& error = *picture.error;
    if (error.max_abs_error == 0) return text + "equal pixels\n";
    return text + fmt::format(
                      "PSNR {:.2f} dB, SSIM {:.5f}, largest difference {:.5f}, {} pixels ({:.3f} %) differ in 8 bits\n",
                      error.psnr_db, error.ssim, error.max_abs_error, grouped(error.pixels_differing),
                      100 * error.share_differing);
  }
  if (picture.same_bits == true) return text + "equal, as counts and cycles are (result hash)\n";
  return text + "not compared: " + printable(picture.why_none) + "\n";
}

}  // namespace

std::string diff_text(const ResultDiff& diff, bool all, const TextStyle& style) {
  std::string text = fmt::format("A: {}\nB: {}\n\n", printable(diff.a.path.string()), printable(diff.b.path.string()));
  for (unsigned group = 0; group <= static_cast<unsigned>(DiffGroup::other); ++group) {
    text += group_table(diff, static_cast<DiffGroup>(group), all, style);
  }
  if (!diff.only_in_a.empty()) text += "only in A: " + names(diff.only_in_a) + "\n";
  if (!diff.only_in_b.empty()) text += "only in B: " + names(diff.only_in_b) + "\n";
  if (!diff.pictures.empty()) text += style.bold("pictures") + "\n";
  for (const PictureDiff& picture : diff.pictures) text += picture_text(picture);
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
