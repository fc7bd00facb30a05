#include "jobs/result_diff.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/component/error.h>
#include <vrpipe/component/printable.h>

namespace vrpipe::tools {
namespace {

namespace fs = std::filesystem;

const std::string separator = ".";

/// What an element of an array is called; empty if by its place.
std::string element_name(const nlohmann::ordered_json& element) {
  if (!element.is_object()) return {};
  for (const char* key : {"name", "variant", "microbench", "id", "knob"}) {
    const auto found = element.find(key);
    if (found != element.end() && found->is_string()) return found->get<std::string>();
  }
  return {};
}

/// Names of the elements of an array, or their places where not all have a name of their own.
std::vector<std::string> element_names(const nlohmann::ordered_json& array) {
  std::vector<std::string> names;
  std::set<std::string> seen;
  for (const nlohmann::ordered_json& element : array) {
    names.push_back(element_name(element));
    if (names.back().empty() || !seen.insert(names.back()).second) {
      names.clear();
      for (std::size_t i = 0; i < array.size(); ++i) names.push_back(std::to_string(i));
      return names;
    }
  }
  return names;
}

/// Made by the host or the command line, not by what was simulated.
bool is_ignored(const std::string& key) {
  static const std::set<std::string> ignored{"command",     "config",     "host",         "host_seconds",
                                             "cpu_seconds", "images",     "load_seconds", "simulate_seconds",
                                             "meaning",     "result_hash"};
  return ignored.count(key) > 0;
}

/// Leaves by path, in the order of the file.
void flatten(const nlohmann::ordered_json& value, const std::string& path,
             std::vector<std::pair<std::string, nlohmann::ordered_json>>& leaves) {
  const auto below = [&](const std::string& key) { return path.empty() ? key : path + separator + key; };
  if (value.is_object() && !value.empty()) {
    for (const auto& [key, each] : value.items()) {
      if (!is_ignored(key)) flatten(each, below(key), leaves);
    }
  } else if (value.is_array() && !value.empty()) {
    const std::vector<std::string> names = element_names(value);
    for (std::size_t i = 0; i < names.size(); ++i) flatten(value[i], below(names[i]), leaves);
  } else {
    leaves.emplace_back(path, value);
  }
}

DiffGroup group_of(const std::string& key) {
  static const std::array<std::pair<const char*, DiffGroup>, 35> groups{{
      {"schema", DiffGroup::made_by},
      {"version", DiffGroup::made_by},
      {"plugins", DiffGroup::made_by},
      {"seed", DiffGroup::settings},
      {"scene", DiffGroup::drawn},
      {"camera", DiffGroup::drawn},
      {"cameras", DiffGroup::drawn},
      {"passes", DiffGroup::drawn},
      {"addresses", DiffGroup::drawn},
      {"platform", DiffGroup::settings},
      {"frequency_mhz", DiffGroup::settings},
      {"variant", DiffGroup::settings},
      {"changes", DiffGroup::settings},
      {"parameters", DiffGroup::settings},
      {"fidelity", DiffGroup::settings},
      {"format", DiffGroup::settings},
      {"termination", DiffGroup::settings},
      {"relative_to", DiffGroup::settings},
      {"axes", DiffGroup::settings},
      {"implementations", DiffGroup::units},
      {"quad_merging_storage_bytes", DiffGroup::units},
      {"effects", DiffGroup::effects},
      {"counts", DiffGroup::counts},
      {"draws", DiffGroup::counts},
      {"early_termination_ratio", DiffGroup::counts},
      {"cycles", DiffGroup::time},
      {"milliseconds", DiffGroup::time},
      {"bottleneck", DiffGroup::time},
      {"utilization", DiffGroup::time},
      {"units", DiffGroup::time},
      {"speedup", DiffGroup::time},
      {"kernel_events", DiffGroup::other},
      {"statistics", DiffGroup::statistics},
      {"energy", DiffGroup::other},
      {"intervals", DiffGroup::other},
  }};
  const std::string first = key.substr(0, key.find('.'));
  for (const auto& [name, group] : groups) {
    if (first == name) return group;
  }
  return DiffGroup::other;
}

using Leaves = std::vector<std::pair<std::string, nlohmann::ordered_json>>;

void compare(const Leaves& a, const Leaves& b, const std::string& run, std::vector<Difference>& differences) {
  std::map<std::string, const nlohmann::ordered_json*> of_b;
  for (const auto& [key, value] : b) of_b.emplace(key, &value);
  std::set<std::string> of_a;
  for (const auto& [key, value] : a) {
    of_a.insert(key);
    const auto found = of_b.find(key);
    const nlohmann::ordered_json other = found == of_b.end() ? nlohmann::ordered_json() : *found->second;
    if (value != other) differences.push_back({group_of(key), run, key, value, other});
  }
  for (const auto& [key, value] : b) {
    if (of_a.count(key) == 0 && !value.is_null())
      differences.push_back({group_of(key), run, key, nlohmann::ordered_json(), value});
  }
}

/// Runs by name; those of results that have runs at their top.
std::vector<std::pair<std::string, const nlohmann::ordered_json*>> compared_runs(const nlohmann::ordered_json& result) {
  std::vector<std::pair<std::string, const nlohmann::ordered_json*>> runs;
  const auto found = result.find("runs");
  if (found == result.end() || !found->is_array()) return runs;
  const std::vector<std::string> names = element_names(*found);
  for (std::size_t i = 0; i < names.size(); ++i) runs.emplace_back(names[i], &(*found)[i]);
  return runs;
}

std::optional<double> number_in(const nlohmann::ordered_json& object, const std::string& key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
}

/// None where nothing has time.
std::optional<TimePair::Time> time_of(const std::string& name, const nlohmann::ordered_json& run,
                                      const nlohmann::ordered_json& result) {
  const auto cycles = run.find("cycles");
  if (cycles == run.end() || !cycles->is_number_unsigned()) return std::nullopt;
  const nlohmann::ordered_json speedups = result.value("speedup", nlohmann::ordered_json());
  return TimePair::Time{cycles->get<std::uint64_t>(), number_in(run, "milliseconds"),
                        speedups.is_object() ? number_in(speedups, name) : std::nullopt};
}

void check_same_command(const ResultFile& a, const ResultFile& b) {
  const auto schema_of = [](const ResultFile& result) { return result.content["schema"].get<std::string>(); };
  const auto content_of = [](const std::string& schema) {
    return schema == "vrpipe.run/1" ? "vrpipe.compare/1" : schema;
  };
  const std::string of_a = schema_of(a), of_b = schema_of(b);
  if (content_of(of_a) == content_of(of_b)) return;
  throw UserError("results of different commands", b.path.string(),
                  fmt::format("it is of schema {}, {} of {}", printable(of_b), printable(a.path.string()),
                              printable(of_a)),
                  "name two results of the same command");
}

/// A picture's file, from where vrpipe runs or from where the result is.
std::optional<fs::path> picture_of(const nlohmann::ordered_json& run, const ResultFile& result) {
  const nlohmann::ordered_json exr = run.value("/images/exr"_json_pointer, nlohmann::ordered_json());
  if (!exr.is_string()) return std::nullopt;
  const fs::path path = exr.get<std::string>();
  std::error_code ignored;
  for (const fs::path& place : {path, result.path.parent_path() / path}) {
    if (fs::is_regular_file(place, ignored)) return place;
  }
  return std::nullopt;
}

PictureDiff compare_pictures(const std::string& name, const nlohmann::ordered_json& a, const nlohmann::ordered_json& b,
                             const ResultFile& of_a, const ResultFile& of_b) {
  PictureDiff diff{name, {}, {}, {}};
  const nlohmann::ordered_json hash_a = a.value("result_hash", nlohmann::ordered_json()),
                               hash_b = b.value("result_hash", nlohmann::ordered_json());
  if (!hash_a.is_null() && !hash_b.is_null()) diff.same_bits = hash_a == hash_b;
  const auto file_a = picture_of(a, of_a), file_b = picture_of(b, of_b);
  if (!file_a || !file_b) {
    diff.why_none = fmt::format("{} {} no .exr there (--output writes them)",
                                !file_a ? of_a.path.string() : of_b.path.string(), "has");
    return diff;
  }
  try {
    const SharedImage image_a = read_exr(file_a->string()), image_b = read_exr(file_b->string());
    if (image_a.width() != image_b.width() || image_a.height() != image_b.height()) {
      diff.why_none = fmt::format("they are of {}x{} and {}x{} pixels", image_a.width(), image_a.height(),
                                  image_b.width(), image_b.height());
      return diff;
    }
    diff.error = image_error(shown(image_b, {0, 0, 0}), shown(image_a, {0, 0, 0}));
  } catch (const std::runtime_error& error) {
    diff.why_none = error.what();
  }
  return diff;
}

}  // namespace

ResultFile read_result(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::error_code ignored;
  if (!file || fs::is_directory(path, ignored)) {
    throw UserError("cannot read result", path.string(), "there is no such file, or it may not be read",
                    "name a file that --json has written");
  }
  ResultFile result{path, {}};
  try {
    result.content = nlohmann::ordered_json::parse(file);
  } catch (const nlohmann::ordered_json::parse_error& error) {
    throw UserError("cannot read result", path.string(), fmt::format("it is no JSON from byte {} on", error.byte),
                    "name a file that --json has written");
  }
  const nlohmann::ordered_json schema =
      result.content.is_object() ? result.content.value("schema", nlohmann::ordered_json()) : nlohmann::ordered_json();
  if (!schema.is_string() || schema.get<std::string>().rfind("vrpipe.", 0) != 0) {
    throw UserError("cannot read result", path.string(), "it has no schema of vrpipe",
                    "name a file that --json has written");
  }
  return result;
}

const char* name_of(DiffGroup group) {
  static const std::array<const char*, 9> names{"made by", "drawn", "settings",   "units", "effects",
                                                "counts",  "time",  "statistics", "other"};
  return names.at(static_cast<std::size_t>(group));
}

std::optional<double> Difference::change_percent() const {
  if (!a.is_number() || !b.is_number()) return std::nullopt;
  const auto from = a.get<double>(), to = b.get<double>();
  if (from == 0 || !std::isfinite(from) || !std::isfinite(to)) return std::nullopt;
  return 100 * (to - from) / std::abs(from);
}

ResultDiff diff_results(ResultFile a, ResultFile b) {
  check_same_command(a, b);
  ResultDiff diff{std::move(a), std::move(b), {}, {}, {}, {}, {}};
  const auto runs_a = compared_runs(diff.a.content), runs_b = compared_runs(diff.b.content);
  const auto common = [](nlohmann::ordered_json content, bool has_runs) {
    if (has_runs) content.erase("runs");
    // Where a value comes from changes nothing.
    if (content.contains("platform") && content["platform"].is_object()) content["platform"].erase("origins");
    Leaves leaves;
    flatten(content, "", leaves);
    return leaves;
  };
  compare(common(diff.a.content, !runs_a.empty()), common(diff.b.content, !runs_b.empty()), "", diff.differences);
  const auto find = [](const auto& runs, const std::string& name) {
    return std::find_if(runs.begin(), runs.end(), [&](const auto& run) { return run.first == name; });
  };
  for (const auto& [name, run] : runs_a) {
    const auto other = find(runs_b, name);
    if (other == runs_b.end()) {
      diff.only_in_a.push_back(name);
      continue;
    }
    Leaves of_a, of_b;
    flatten(*run, "", of_a);
    flatten(*other->second, "", of_b);
    compare(of_a, of_b, name, diff.differences);
    diff.pictures.push_back(compare_pictures(name, *run, *other->second, diff.a, diff.b));
    const auto time_a = time_of(name, *run, diff.a.content), time_b = time_of(name, *other->second, diff.b.content);
    if (time_a && time_b) diff.times.push_back({name, *time_a, *time_b});
  }
  for (const auto& [name, run] : runs_b) {
    if (find(runs_a, name) == runs_a.end()) diff.only_in_b.push_back(name);
  }
  std::stable_sort(diff.differences.begin(), diff.differences.end(),
                   [](const Difference& x, const Difference& y) { return x.group < y.group; });
  return diff;
}

}  // namespace vrpipe::tools
