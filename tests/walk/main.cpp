// A random walk over everything that can be set, with the outside contract as its oracle.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <vrpipe/workloads/draw_list.h>

#include "support/measured_scenes.h"
#include "walk/isolated.h"

namespace {

using namespace vrpipe;
using namespace vrpipe::walk;

constexpr unsigned most_tries = 150;        ///< of shrinking one case
constexpr unsigned most_shrunk_a_rule = 2;  ///< further cases that break a rule are named only

bool breaks(const Case& c, const std::string& rule, const Limits& limits) {
  for (const Finding& finding : judged_apart(c, limits)) {
    if (finding.rule == rule) return true;
  }
  return false;
}

/// Takes from a case what it can do without and still break the rule.
Case shrunk(Case c, const std::string& rule, const Limits& limits) {
  unsigned tries = 0;
  const auto without = [&](const auto& change) {
    Case candidate = c;
    change(candidate);
    if (++tries > most_tries || !breaks(candidate, rule, limits)) return false;
    c = std::move(candidate);
    return true;
  };
  const std::size_t kept = c.refused ? 1 : 0;
  for (std::size_t i = c.settings.size() - kept; i-- > 0;) {
    without([&](Case& x) { x.settings.erase(x.settings.begin() + static_cast<std::ptrdiff_t>(i)); });
  }
  if (!c.effects.empty()) without([](Case& x) { x.effects.clear(); });
  if (!c.units.empty()) without([](Case& x) { x.units.clear(); });
  if (c.platform != &simplest_platform())
    without([](Case& x) {
      x.platform = &simplest_platform();
      x.edits = {};
    });
  if (c.format != ColorFormat::rgba16f) without([](Case& x) { x.format = ColorFormat::rgba16f; });
  if (c.termination != Termination::paper) without([](Case& x) { x.termination = Termination::paper; });
  for (std::size_t i = c.parts.size(); i-- > 0;) {
    without([&](Case& x) { x.parts[i].own.clear(); });
    without([&](Case& x) { x.parts[i].terminates_early = true; });
    without([&](Case& x) { x.parts[i].clear = {}; });
    without([&](Case& x) { x.parts.erase(x.parts.begin() + static_cast<std::ptrdiff_t>(i)); });
  }
  while (c.passes > 1 && without([](Case& x) { --x.passes; })) {}
  for (std::size_t part = c.draw.splats.size() / 2; part > 0; part /= 2) {
    for (std::size_t first = 0; first + part <= c.draw.splats.size();) {
      const auto begin = static_cast<std::ptrdiff_t>(first);
      const auto end = static_cast<std::ptrdiff_t>(first + part);
      if (!without([&](Case& x) { x.draw.splats.erase(x.draw.splats.begin() + begin, x.draw.splats.begin() + end); })) {
        first += part;
      }
    }
  }
  return c;
}

/// "cycle twice: ..." is about cycle.
Fidelity fidelity_in(const std::string& detail) {
  for (const Fidelity fidelity : fidelities()) {
    const std::string name = name_of(fidelity);
    if (detail.compare(0, name.size(), name) == 0) return fidelity;
  }
  return Fidelity::functional;
}

void print(const Case& c, const std::vector<Finding>& findings) {
  const std::string scene = fmt::format("walk-{}-{}.spl", c.seed, c.index);
  write_draw_list(scene, c.draw);
  fmt::print("  {}\n", describe(c));
  for (const Finding& finding : findings) fmt::print("  {}: {}\n", finding.rule, finding.detail);
  const Fidelity fidelity = findings.empty() ? Fidelity::cycle : fidelity_in(findings.front().detail);
  if (!c.is_single_draw()) {
    fmt::print("  --seed {} --only {} says all of it; a command line, but for the draws:\n", c.seed, c.index);
  }
  fmt::print("  {}\n", command_line(c, fidelity, scene));
}

struct Options {
  std::uint64_t seed = 1;
  std::uint64_t count = 500;
  double seconds = 0;
  std::optional<std::uint64_t> only;
};

int walk_along(const Options& options, const Draw& real, const Limits& limits) {
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  std::map<std::string, unsigned> cases_of_rule;
  std::uint64_t walked = 0;
  std::uint64_t broken = 0;
  fmt::print("seed {}\n", options.seed);
  for (; options.seconds > 0 ? elapsed() < options.seconds : walked < options.count; ++walked) {
    const Case c = draw_case(options.seed, walked, real);
    const std::vector<Finding> findings = judged_apart(c, limits);
    if (findings.empty()) continue;
    ++broken;
    const std::string& rule = findings.front().rule;
    fmt::print("\n{}: --seed {} --only {}\n  {}\n", rule, c.seed, c.index, findings.front().detail);
    if (cases_of_rule[rule]++ < most_shrunk_a_rule) {
      const Case small = shrunk(c, rule, limits);
      fmt::print("  shrunk to:\n");
      print(small, judged_apart(small, limits));
    }
    std::fflush(stdout);
  }
  fmt::print("\n{} configurations, {} of them break a rule, {:.0f} s\n", walked, broken, elapsed());
  for (const auto& [rule, count] : cases_of_rule) fmt::print("  {}: {}\n", rule, count);
  return broken == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Random configurations and scenes at every fidelity, judged by the outside contract.");
  Options options;
  Limits limits;
  app.add_option("--seed", options.seed, "of the whole walk");
  app.add_option("--count", options.count, "configurations");
  app.add_option("--seconds", options.seconds, "to walk for, instead of a count");
  app.add_option("--only", options.only, "judge this configuration alone and write its scene to walk-SEED-N.spl");
  CLI11_PARSE(app, argc, argv);
  setenv("SYSTEMC_DISABLE_COPYRIGHT_MESSAGE", "1", 1);

  const Draw real = vrpipe::testing::measured_draw();
  if (!options.only) return walk_along(options, real, limits);
  const Case c = draw_case(options.seed, *options.only, real);
  const std::vector<Finding> findings = judged_apart(c, limits);
  print(c, findings);
  return findings.empty() ? 0 : 1;
}
