// How far lt is off cycle over random configurations of every platform, and how good its own word about that is.
//   lt_errors [--seed N] [--count N] [--short] [--worst N] [--only N] [--at-cycle UNIT,...|any]
// A configuration is a platform, a variant, a format, a termination, and three to five parameters of units and links that the
// platform has, each log-uniform in its range, 7 in 10 of them within 16 times the platform's value; it draws a window of the
// measured draw of the tests or of a built-in scene. What is refused, and what takes a minute, is left out. `--only` does one
// of them, then with each of its parameters alone. `--at-cycle` has units at cycle among others at lt, or another one in each run.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <boost/algorithm/string/replace.hpp>

#include <vrpipe/arithmetic/random.h>
#include <vrpipe/component/error.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/scene.h>

#include "support/measured_scenes.h"
#include "support/random_choices.h"

namespace vrpipe {

namespace {

using testing::Dice;

struct Scene {
  std::string name;
  Draw draw;
};

Scene window_of(const Draw& real, std::uint32_t left, std::uint32_t top, std::uint32_t side) {
  return {fmt::format("measured-{}", side), testing::window_of(real, left, top, side, side)};
}

std::vector<Scene> load_scenes(bool is_short) {
  std::vector<Scene> scenes;
  const Draw real = testing::measured_draw();
  if (is_short) return {window_of(real, 360, 360, 32)};
  scenes.push_back(window_of(real, 360, 360, 64));
  scenes.push_back(window_of(real, 250, 420, 80));
  scenes.push_back(window_of(real, 460, 250, 96));
  const auto zoomed = [&](const char* name, double fovy, std::uint32_t side) {
    SceneRequest request;
    request.scene = std::string("builtin:") + name;
    request.fovy_degrees = fovy;
    request.size = ImageSize{side, side};
    scenes.push_back({request.scene, load_scene(request).draw});
  };
  zoomed("object", 4, 64);
  zoomed("indoor", 6, 80);
  zoomed("outdoor", 10, 96);
  zoomed("train", 5, 80);
  zoomed("palace", 6, 72);
  return scenes;
}

std::string value_of(Dice& dice, const Parameter& parameter) {
  if (dynamic_cast<const Switch*>(&parameter) != nullptr) return dice.chance(50) ? "on" : "off";
  if (dynamic_cast<const Choice*>(&parameter) != nullptr) return dice.one_of(testing::names_of(parameter));
  double low = 0;
  double high = 0;
  if (!testing::bounds_of(parameter, low, high)) throw std::logic_error("no bounds in " + parameter.range());
  const double usual = std::stod(parameter.value());
  const bool is_near = dice.chance(70);
  const double least = is_near ? std::max(low, usual / 16) : low;
  const double most = is_near ? std::min(high, std::max(usual * 16, 1.0)) : high;
  const bool is_whole = dynamic_cast<const Integer*>(&parameter) != nullptr;
  const double offset = is_whole ? 1 : 0.01;
  const double value = std::exp(dice.real(std::log(least + offset), std::log(most + offset))) - offset;
  const double kept = std::min(high, std::max(low, value));
  return is_whole ? fmt::format("{:.0f}", std::floor(kept + 0.5)) : fmt::format("{:.3f}", kept);
}

struct Case {
  RunRequest request;  ///< of lt
  const Scene* scene;
};

/// @param at_cycle  units; "any" for one that is drawn
Case draw_case(std::uint64_t seed, std::uint64_t index, const std::vector<Scene>& scenes, const std::string& at_cycle) {
  Dice dice(mix(mix(seed) ^ index));
  Case c;
  c.scene = &dice.one_of(scenes);
  c.request.platform = &dice.one_of(platforms());
  c.request.variant = dice.one_of(variants());
  const ColorFormat formats[] = {ColorFormat::rgba16f, ColorFormat::rgba8, ColorFormat::rgba32f};
  c.request.format = dice.one_of(formats);
  c.request.termination = dice.chance(40) ? Termination::strict : Termination::paper;
  std::vector<std::pair<std::string, const Parameter*>> all;
  Netlist netlist(c.request.platform->gpcs);
  c.request.platform->wire(netlist);
  const std::vector<ParameterListing> listings = list_parameters(c.request.platform);
  for (const ParameterListing& listing : listings) {
    if (listing.pass_through || listing.unit == "platform" || !testing::has_unit(netlist, listing)) continue;
    for (const Parameter* parameter : listing.parameters->parameters()) all.emplace_back(listing.unit, parameter);
  }
  for (unsigned count = 3 + dice.below(3); count > 0; --count) {
    const auto& [unit, parameter] = dice.one_of(all);
    c.request.settings.push_back({unit, parameter->name(), value_of(dice, *parameter)});
  }
  std::vector<std::string> units;
  for (const Instance& instance : netlist.instances()) {
    if (!Netlist::is_memory(instance)) units.push_back(instance.slot);
  }
  choose_fidelity(c.request,
                  "lt" +
                      (at_cycle.empty() ? "" : "," + (at_cycle == "any" ? dice.one_of(units) : at_cycle) + "=cycle"));
  return c;
}

std::string describe(const Case& c) {
  std::string text =
      fmt::format("{} {} {} {} {}", c.scene->name, c.request.platform->name, c.request.variant.name,
                  name_of(c.request.format), c.request.termination == Termination::strict ? "strict" : "paper");
  if (!c.request.units_at_cycle.empty()) text += " " + fidelity_of(c.request);
  for (const Setting& setting : c.request.settings)
    text += fmt::format(" {}.{}={}", setting.unit, setting.parameter, setting.value);
  return text;
}

struct Measured {
  double error_percent = 0;
  double expected_percent = -1;  ///< what lt says of itself; below 0: nothing
};

/// In a process of its own; none for what is refused or takes too long.
std::optional<Measured> measure(const Case& c) {
  std::array<int, 2> ends;
  if (::pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    ::close(ends[0]);
    const rlimit seconds{60, 60};
    ::setrlimit(RLIMIT_CPU, &seconds);
    const auto result_at = [&](Fidelity fidelity) {
      RunRequest request = c.request;
      request.fidelity = fidelity;
      fresh_simulation();
      return simulate(request, c.scene->draw);
    };
    try {
      const RunResult lt = result_at(Fidelity::lt);
      const auto cycles = static_cast<double>(*result_at(Fidelity::cycle).cycles);
      const Measured measured{100 * (static_cast<double>(*lt.cycles) / cycles - 1),
                              lt.expected_error_percent.value_or(-1)};
      ::_exit(::write(ends[1], &measured, sizeof measured) == sizeof measured ? 0 : 1);
    } catch (const UserError&) {
      ::_exit(0);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s: %s\n", describe(c).c_str(), error.what());
      ::_exit(1);
    }
  }
  ::close(ends[1]);
  Measured measured;
  const bool is_there = ::read(ends[0], &measured, sizeof measured) == sizeof measured;
  ::close(ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  return is_there ? std::optional<Measured>(measured) : std::nullopt;
}

/// Below which a share of them is.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

void print_errors(const char* what, const std::vector<double>& errors) {
  std::printf("%-34s %6zu %7.2f %7.2f %7.2f %7.2f %7.2f %5td\n", what, errors.size(), quantile(errors, 0.5),
              quantile(errors, 0.9), quantile(errors, 0.95), quantile(errors, 0.99), quantile(errors, 1),
              std::count_if(errors.begin(), errors.end(), [](double error) { return error > 3; }));
}

void print_one(const Case& c) {
  const std::optional<Measured> measured = measure(c);
  if (measured)
    std::printf("%+8.2f %%, says +-%4.1f  %s\n", measured->error_percent, measured->expected_percent,
                describe(c).c_str());
}

struct Found {
  Measured measured;
  std::uint64_t index;
};

void print_summary(std::uint64_t seed, const std::vector<Scene>& scenes, const std::string& at_cycle,
                   std::vector<Found> found, std::size_t worst) {
  std::vector<double> all, little, much, unsaid;
  std::size_t within = 0;
  for (const Found& each : found) {
    const double error = std::fabs(each.measured.error_percent);
    const double expected = each.measured.expected_percent;
    all.push_back(error);
    (expected < 0 ? unsaid : expected <= 3 ? little : much).push_back(error);
    if (error <= expected) ++within;
  }
  std::printf("%-34s %6s %7s %7s %7s %7s %7s %5s\n", "error, %", "runs", "p50", "p90", "p95", "p99", "worst", "> 3");
  print_errors("all", all);
  print_errors("of which it says at most 3 %", little);
  print_errors("of which it says more", much);
  print_errors("of which it says that it does not know", unsaid);
  const std::size_t said = little.size() + much.size();
  std::printf("within what it says: %.1f %%\n",
              100 * static_cast<double>(within) / static_cast<double>(std::max<std::size_t>(said, 1)));
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    return std::fabs(a.measured.error_percent) > std::fabs(b.measured.error_percent);
  });
  for (std::size_t i = 0; i < std::min(worst, found.size()); ++i)
    std::printf("%+8.2f, says +-%4.1f  --only %llu  %s\n", found[i].measured.error_percent,
                found[i].measured.expected_percent, static_cast<unsigned long long>(found[i].index),
                describe(draw_case(seed, found[i].index, scenes, at_cycle)).c_str());
}

int measure_all(int argc, char** argv) {
  std::uint64_t seed = 1, count = 2000;
  std::string at_cycle;
  std::size_t worst = 20;
  std::optional<std::uint64_t> only;
  bool is_short = false;
  for (int i = 1; i < argc; ++i) {
    const std::string option = argv[i];
    const auto number = [&] { return i + 1 < argc ? std::stoull(argv[++i]) : 0; };
    if (option == "--seed") {
      seed = number();
    } else if (option == "--count") {
      count = number();
    } else if (option == "--worst") {
      worst = number();
    } else if (option == "--only") {
      only = number();
    } else if (option == "--at-cycle" && i + 1 < argc) {
      at_cycle = argv[++i];
      boost::replace_all(at_cycle, ",", "=cycle,");
    } else if (option == "--short") {
      is_short = true;
    } else {
      const bool help = option == "--help";
      std::fprintf(
          help ? stdout : stderr,
          "usage: lt_errors [--seed N] [--count N] [--worst N] [--only N] [--at-cycle UNIT,...|any] [--short]\n");
      return help ? 0 : 2;
    }
  }
  if (is_short) count = 12;
  const std::vector<Scene> scenes = load_scenes(is_short);
  if (only) {
    Case c = draw_case(seed, *only, scenes, at_cycle);
    print_one(c);
    for (const Setting& setting : std::vector<Setting>(c.request.settings)) {
      c.request.settings = {setting};
      print_one(c);
    }
    return 0;
  }
  std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
  std::vector<Found> found;
  for (std::uint64_t index = 0; index < count; ++index) {
    if (const auto measured = measure(draw_case(seed, index, scenes, at_cycle))) found.push_back({*measured, index});
  }
  print_summary(seed, scenes, at_cycle, std::move(found), worst);
  return 0;
}

}  // namespace

}  // namespace vrpipe

int main(int argc, char** argv) {
  setenv("SYSTEMC_DISABLE_COPYRIGHT_MESSAGE", "1", 1);
  try {
    return vrpipe::measure_all(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lt_errors: %s\n", error.what());
    return 1;
  }
}
