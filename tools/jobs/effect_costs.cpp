#include "jobs/effect_costs.h"

#include <algorithm>
#include <cstdio>
#include <limits>

#include <fmt/format.h>

#include "host/command_failure.h"

namespace vrpipe::tools {
namespace {

constexpr unsigned measured_rounds = 3;
/// From here on a user wants to know beforehand.
constexpr double long_seconds = 30;

/// A run once more, with other effects.
struct Repetition {
  const RunResult* run;
  EffectChoice effects;
  bool is_same;     ///< the result has to be that of the run
  double* seconds;  ///< the least so far
};

EffectChoice with(EffectChoice choice, const std::string& effect) {
  choice.without.erase(std::remove(choice.without.begin(), choice.without.end(), effect), choice.without.end());
  choice.with.push_back(effect);
  return choice;
}

void add_repetitions(const RunResult& run, EffectCosts& costs, std::vector<Repetition>& all) {
  const EffectChoice& chosen = run.request.effects;
  constexpr double nothing_yet = std::numeric_limits<double>::infinity();
  costs.without = costs.with_all = nothing_yet;
  for (const EffectReport& effect : run.effects) {
    if (effect.omitted) costs.with.emplace_back(effect.name, nothing_yet);
  }
  all.push_back({&run, chosen, true, &costs.without});
  bool all_proved = true;
  auto cost = costs.with.begin();
  for (const EffectReport& effect : run.effects) {
    if (!effect.omitted) continue;
    const bool is_proved = effect.proof != EffectProof::bounded && !chosen.forces_out(effect.name);
    all_proved &= is_proved;
    all.push_back({&run, with(chosen, effect.name), is_proved, &cost->second});
    ++cost;
  }
  all.push_back({&run, EffectChoice::everything(), all_proved, &costs.with_all});
}

}  // namespace

std::optional<double> EffectCosts::with_effect(const std::string& name) const {
  const auto found = std::find_if(with.begin(), with.end(), [&](const auto& effect) { return effect.first == name; });
  return found == with.end() ? std::nullopt : std::optional<double>(found->second);
}

std::string announcement(std::size_t simulations, double seconds) {
  if (seconds < long_seconds) return {};
  const std::string time = seconds < 120 ? fmt::format("{:.0f} s", seconds) : fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("--explain-effects: {} simulations more, one at a time, about {}", simulations, time);
}

std::vector<EffectCosts> measure_effects(const std::vector<RunResult>& runs, const FrameSource& frame,
                                         ProgressLine& progress) {
  std::vector<EffectCosts> costs(runs.size());
  std::vector<Repetition> repetitions;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].effects.empty()) add_repetitions(runs[i], costs[i], repetitions);
  }
  double seconds = 0;
  for (const Repetition& repetition : repetitions) seconds += measured_rounds * repetition.run->cpu_seconds;
  const std::string text = announcement(measured_rounds * repetitions.size(), seconds);
  if (!text.empty()) {
    progress.erase();
    fmt::print(stderr, "{}\n", text);
  }

  std::vector<Task> tasks;
  for (unsigned round = 0; round < measured_rounds; ++round) {
    for (const Repetition& repetition : repetitions) {
      RunRequest request = repetition.run->request;
      request.effects = repetition.effects;
      tasks.push_back({name_of(request) + " " + request.effects.text(), request, frame});
    }
  }
  // One at a time, so that none takes cache or memory from another.
  run_tasks(tasks, false, 1, {"effects ", 0, 0, 0}, progress, [&](std::size_t index, Simulated&& simulated) {
    const Repetition& repetition = repetitions[index % repetitions.size()];
    *repetition.seconds = std::min(*repetition.seconds, simulated.result.cpu_seconds);
    const RunResult& run = *repetition.run;
    if (!repetition.is_same || simulated.result.result_hash == run.result_hash) return;
    throw CommandFailure(
        exit_fault, fmt::format("variant {}: what is left out changes the result: --effects {} gives another than {}",
                                name_of(run.request), run.request.effects.text(), repetition.effects.text()));
  });
  return costs;
}

}  // namespace vrpipe::tools
