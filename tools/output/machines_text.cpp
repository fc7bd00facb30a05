#include "output/machines_text.h"

#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/component/printable.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/software.h>

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

/// @param axes      what is not the same for all is left out
/// @param variants  those that the request is of
std::string common_text(const RunRequest& request, const std::vector<Setting>& preprocessing, std::uint32_t passes,
                        const std::vector<std::string>& axes, const std::vector<const Variant*>& variants) {
  std::string text;
  const auto add = [&](const char* axis, const std::string& part) {
    if (std::find(axes.begin(), axes.end(), axis) == axes.end()) text += (text.empty() ? "" : ", ") + part;
  };
  if (request.variant.is_of_pipeline()) {
    add("fidelity", fidelity_of(request) + " fidelity");
    add("format", std::string(vrpipe::name_of(request.format)) + " colour");
    add("termination", std::string(name_of(request.termination)) + " termination");
  } else {
    add("fidelity", std::string(vrpipe::name_of(request.fidelity)) + " fidelity");
    add("", "colour and termination of its own");
  }
  if (passes > 1) add("multi-pass", fmt::format("{} passes", passes));
  if (const std::string effects = effects_choice_text(request); !effects.empty()) add("", effects.substr(2));
  for (const std::vector<Setting>* settings : {&request.settings, &preprocessing}) {
    for (const Setting& setting : *settings)
      add("", fmt::format("{}.{}={}", setting.unit, setting.parameter, setting.value));
  }
  for (const UnitChoice& unit : request.units)
    add("", fmt::format("{}={}", unit.slot, unit.implementation) + printable(not_taken_text(unit, variants)));
  return text.empty() ? text : text + "\n";
}

std::string platform_line(const Platform& platform, const TextStyle& style) {
  return style.bold(platform.name) + " (" + platform.description + ")\n";
}

}  // namespace

std::string not_taken_text(const UnitChoice& unit, const std::vector<const Variant*>& variants) {
  const std::string slot = without_gpc(unit.slot);
  std::vector<std::string> with_own, without;
  for (const Variant* variant : variants) {
    if (!draws_with(*variant, slot)) {
      is_first(variant->name, without);
    } else if (own_unit(*variant, unit) != nullptr) {
      is_first(variant->name, with_own);
    }
  }
  std::string text;
  const auto add = [&](const std::vector<std::string>& names, const std::string& why) {
    if (names.empty()) return;
    text += fmt::format("{}not in {}, {}", text.empty() ? " (" : "; ", fmt::join(names, ", "), why);
  };
  add(with_own, "with its own");
  add(without, "without " + slot);
  return text.empty() ? text : text + ")";
}

std::string machines_text(const std::vector<RunResult>& runs, const std::vector<Setting>& preprocessing,
                          std::uint32_t passes, const TextStyle& style, const std::vector<std::string>& axes) {
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
  text += common_text(common, preprocessing, passes, axes, of_runs);
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
  return platform_line(*request.platform, style) + common_text(request, {}, 1, {}, {});
}

}  // namespace vrpipe::tools
