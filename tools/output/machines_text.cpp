#include "output/machines_text.h"

#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/component/printable.h>

#include "jobs/comparison.h"
#include "jobs/user_variants.h"
#include "output/effects_report.h"

namespace vrpipe::tools {
namespace {

/// Adds to `seen` what is not there; whether it was not.
bool is_first(const std::string& name, std::vector<std::string>& seen) {
  if (std::find(seen.begin(), seen.end(), name) != seen.end()) return false;
  seen.push_back(name);
  return true;
}

/// @param variants  those that the request is of
std::string common_text(const RunRequest& request, const std::vector<Setting>& preprocessing, std::uint32_t passes,
                        const std::vector<const Variant*>& variants) {
  std::string text = fmt::format("{} fidelity, {} colour, {} termination", fidelity_of(request),
                                 vrpipe::name_of(request.format), name_of(request.termination));
  if (!request.variant.is_of_pipeline())
    text = fmt::format("{} fidelity, colour and termination of its own", vrpipe::name_of(request.fidelity));
  if (passes > 1) text += fmt::format(", {} passes", passes);
  text += effects_choice_text(request);
  for (const std::vector<Setting>* settings : {&request.settings, &preprocessing}) {
    for (const Setting& setting : *settings) {
      text += fmt::format(", {}.{}={}", setting.unit, setting.parameter, setting.value);
    }
  }
  for (const UnitChoice& unit : request.units) {
    text += fmt::format(", {}={}", unit.slot, unit.implementation);
    std::vector<std::string> others;
    for (const Variant* variant : variants) {
      if (own_unit(*variant, unit) != nullptr) is_first(variant->name, others);
    }
    if (!others.empty()) text += printable(fmt::format(" (not in {}, with its own)", fmt::join(others, ", ")));
  }
  return text + "\n";
}

std::string platform_line(const Platform& platform, const TextStyle& style) {
  return style.bold(platform.name) + " (" + platform.description + ")\n";
}

}  // namespace

std::string machines_text(const std::vector<RunResult>& runs, const std::vector<Setting>& preprocessing,
                          std::uint32_t passes, const TextStyle& style) {
  std::string text;
  std::vector<std::string> platforms, variants;
  for (const RunResult& run : runs) {
    const Platform& platform = *run.request.platform;
    if (is_first(platform.name, platforms)) text += platform_line(platform, style);
  }
  // What draws otherwise is not asked for a format or a termination.
  const auto of_pipeline =
      std::find_if(runs.begin(), runs.end(), [](const RunResult& run) { return run.request.variant.is_of_pipeline(); });
  RunRequest common = (of_pipeline == runs.end() ? runs.front() : *of_pipeline).request;
  common.fidelity = finest_fidelity_of(runs);
  std::vector<const Variant*> of_runs;
  for (const RunResult& run : runs) of_runs.push_back(&run.request.variant);
  text += common_text(common, preprocessing, passes, of_runs);
  for (const RunResult& run : runs) {
    const Variant& variant = run.request.variant;
    if (variant.base.empty() || !is_first(variant.name, variants)) continue;
    const std::string changes = changes_text(variant);
    text += fmt::format("{}: {}{}{}\n", style.bold(variant.name), variant.base, changes.empty() ? "" : " with ",
                        printable(changes));
  }
  return text;
}

std::string machine_text(const RunRequest& request, const TextStyle& style) {
  return platform_line(*request.platform, style) + common_text(request, {}, 1, {});
}

}  // namespace vrpipe::tools
