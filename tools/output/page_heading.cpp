#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <vrpipe/arithmetic/blend.h>

#include "jobs/comparison.h"
#include "jobs/user_variants.h"
#include "output/compare_sections.h"
#include "output/machines_text.h"
#include "output/report.h"
#include "output/result_json.h"
#include "output/svg_plot.h"

namespace vrpipe::tools {
namespace {

/// Texts one after another, each once.
class Terms {
 public:
  void add(const std::string& name, const std::string& text) {
    if (!text.empty()) text_ += "<dt>" + html_escaped(name) + "</dt><dd>" + html_escaped(text) + "</dd>\n";
  }
  void add_code(const std::string& name, const std::string& text) {
    text_ += "<dt>" + html_escaped(name) + "</dt><dd><code>" + html_escaped(text) + "</code></dd>\n";
  }
  std::string text() const { return "<dl>\n" + text_ + "</dl>\n"; }

 private:
  std::string text_;
};

std::string triple_text(const Json& triple) {
  return fmt::format("{},{},{}", triple[0].get<double>(), triple[1].get<double>(), triple[2].get<double>());
}

std::string camera_text(const JobResult& result) {
  if (!result.viewpoint) return "that of the draw list";
  const Json camera = camera_json(result.viewpoint);
  std::string text;
  if (camera["file"].is_string()) {
    text = fmt::format("{}#{}", camera["file"].get<std::string>(), camera["index"].dump());
    if (camera["name"].is_string()) text += " (" + camera["name"].get<std::string>() + ")";
    text += ", ";
  }
  text += "at " + triple_text(camera["eye"]);
  text += camera["look_at"].is_null() ? ", forward " + triple_text(camera["forward"])
                                      : ", looking at " + triple_text(camera["look_at"]);
  return text + (camera["fovy_degrees"].is_null()
                     ? fmt::format(", {} world units high, orthographic", camera["orthographic_height"].get<double>())
                     : fmt::format(", {:.12g} degrees high", camera["fovy_degrees"].get<double>()));
}

std::string scene_text(const JobResult& result) {
  std::string text = fmt::format("{}: {} of {} Gaussians visible", result.scene.name,
                                 grouped(result.scene.gaussians_visible), grouped(result.scene.gaussians_total));
  if (result.scene.triangles > 0) text += fmt::format(", {} triangles of meshes", grouped(result.scene.triangles));
  return text;
}

/// What is the pipeline's alone, where a run is drawn otherwise; empty where none is of the pipeline.
std::string of_pipeline(const std::string& text, const JobResult& result) {
  std::vector<std::string> others;
  for (const RunResult& run : result.runs) {
    if (!run.request.variant.is_of_pipeline()) others.push_back(name_of(run.request));
  }
  if (others.size() == result.runs.size()) return {};
  return text + (others.empty() ? "" : fmt::format(" (not of {})", fmt::join(others, ", ")));
}

std::string settings_line(const JobResult& result) {
  const RunRequest& request = result.runs.front().request;
  std::string text;
  const auto add = [&](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
  for (const std::vector<Setting>* settings : {&request.settings, &result.preprocessing}) {
    for (const Setting& setting : *settings) {
      add(fmt::format("{}.{} = {}", setting.unit, setting.parameter, setting.value));
    }
  }
  std::vector<const Variant*> variants;
  for (const RunResult& run : result.runs) variants.push_back(&run.request.variant);
  for (const UnitChoice& unit : request.units)
    add(unit.slot + " = " + unit.implementation + not_taken_text(unit, variants));
  return text;
}

std::string time_text(const RunResult& run) {
  return fmt::format("{} cycles ({:.3f} ms)", grouped(run.cycles.value_or(0)), run.milliseconds);
}

/// One sentence, plain text.
std::string verdict(const JobResult& result) {
  const std::vector<RunResult>& runs = result.runs;
  const RunResult& baseline = runs[result.baseline];
  if (baseline.counts.fragments_rasterized == 0) return "Nothing is visible.";
  if (!baseline.cycles) {
    return fmt::format("{} blends {} fragments; at {} fidelity nothing takes time.", name_of(baseline.request),
                       grouped(baseline.counts.fragments_blended), fidelity_of(baseline.request));
  }
  const auto bound_by = [](const RunResult& run) {
    std::string text = bound_text(run);
    if (!text.empty()) text.pop_back();
    return text;
  };
  if (runs.size() == 1) {
    const std::string bound = bound_by(baseline);
    return fmt::format("{} takes {}{}.", name_of(baseline.request), time_text(baseline),
                       bound.empty() ? "" : "; " + bound);
  }
  const RunResult* best = nullptr;
  for (const RunResult& run : runs) {
    const auto gain = speedup(baseline, run);
    if (&run != &baseline && gain && (best == nullptr || *gain > *speedup(baseline, *best))) best = &run;
  }
  if (best == nullptr) return fmt::format("{} takes {}.", name_of(baseline.request), time_text(baseline));
  std::string text =
      fmt::format("{} is {:.2f}x as fast as {}: {} rather than {}", name_of(best->request), *speedup(baseline, *best),
                  name_of(baseline.request), time_text(*best), time_text(baseline));
  for (const RunResult* run : {&baseline, best}) {
    if (const std::string bound = bound_by(*run); !bound.empty()) text += "; " + bound;
  }
  return text + ".";
}

}  // namespace

std::string heading_section(const JobResult& result) {
  const RunRequest& request = result.runs.front().request;
  Terms terms;
  terms.add("scene", scene_text(result));
  terms.add("image", fmt::format("{}x{} pixels", result.width, result.height));
  terms.add("colour", of_pipeline(vrpipe::name_of(request.format), result));
  terms.add("camera", camera_text(result));
  std::vector<std::string> seen;
  const auto is_first = [&](const std::string& name) {
    if (std::find(seen.begin(), seen.end(), name) != seen.end()) return false;
    seen.push_back(name);
    return true;
  };
  for (const RunResult& run : result.runs) {
    const Platform& platform = *run.request.platform;
    if (is_first("platform " + platform.name)) {
      terms.add("platform",
                fmt::format("{}: {} ({:g} MHz)", platform.name, platform.description, platform.frequency_mhz));
    }
  }
  terms.add("fidelity", fidelity_of(request));
  terms.add("termination", of_pipeline(name_of(request.termination), result));
  terms.add("effects", of_pipeline(request.effects.text(), result));
  if (result.passes > 1) terms.add("passes", fmt::format("{}", result.passes));
  terms.add("settings", settings_line(result));
  std::string names;
  for (const RunResult& run : result.runs) names += (names.empty() ? "" : ", ") + name_of(run.request);
  terms.add(result.runs.size() > 1 ? "runs" : "run", names);
  if (result.runs.size() > 1) terms.add("relative to", name_of(result.runs[result.baseline].request));
  for (const RunResult& run : result.runs) {
    const Variant& variant = run.request.variant;
    if (variant.base.empty() || !is_first("variant " + variant.name)) continue;
    const std::string changes = changes_text(variant);
    terms.add(variant.name, variant.base + (changes.empty() ? "" : " with " + changes));
  }
  terms.add_code("command", command_text(result.provenance));
  for (const PluginFile& plugin : result.provenance.plugins) {
    terms.add("plugin", plugin.path + ", SHA-256 " + plugin.sha256);
  }
  return "<p class=\"verdict\">" + html_escaped(verdict(result)) + "</p>\n" + terms.text();
}

}  // namespace vrpipe::tools
