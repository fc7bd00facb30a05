#include "walk/oracle.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

#include "support/floating_point.h"
#include "support/pixel_oracle.h"
#include "support/simulate.h"

namespace vrpipe::walk {

namespace {

using testing::same_image;

/// Combinations that the documentation calls unusable though each value lies in its range.
bool documented_refusal(const std::string& message) { return message.find("unusable ") != std::string::npos; }

constexpr double rounding = 1e-9;

bool is_a_share(double value) { return value >= 0 && value <= 1 + rounding; }

/// Occupancies against themselves, the bottleneck and the utilizations.
std::vector<Finding> broken_occupancies(const RunResult& result) {
  std::vector<Finding> findings;
  std::map<std::string, double> highest;  // of the units of a slot
  double highest_of_all = 0;
  for (const UnitReport& unit : result.units) {
    bool shares = is_a_share(unit.occupancy);
    for (const auto& part : unit.parts) shares = shares && is_a_share(part.second);
    if (!shares) findings.push_back({"occupancy is a share", fmt::format("{} {}", unit.name, unit.occupancy)});
    double& of_slot = highest[unit.name.substr(unit.name.rfind('.') + 1)];
    of_slot = std::max(of_slot, unit.occupancy);
    highest_of_all = std::max(highest_of_all, unit.occupancy);
  }
  for (const auto& [slot, share] : result.utilization) {
    if (highest.count(slot) != 0 && share > highest[slot] + rounding) {
      findings.push_back(
          {"occupancy covers the utilization", fmt::format("{} is used {}, occupied {}", slot, share, highest[slot])});
    }
  }
  if (!result.bottleneck) return findings;
  const Bottleneck& bottleneck = *result.bottleneck;
  double sum = 0;
  for (const auto& part : bottleneck.parts) sum += part.second;
  if (!is_a_share(bottleneck.occupancy) || std::fabs(sum - bottleneck.occupancy) > rounding ||
      bottleneck.occupancy < highest_of_all - rounding) {
    findings.push_back(
        {"the bottleneck is occupied the most, by its parts",
         fmt::format("{} {}, parts {}, highest {}", bottleneck.unit, bottleneck.occupancy, sum, highest_of_all)});
  }
  return findings;
}

/// Of surfaces of one frame.
bool same_stencil(const DepthStencilSurface& a, const DepthStencilSurface& b) {
  for (std::size_t place = 0; place < a.grid().quads(); ++place) {
    if (a.quad(place).stencil != b.quad(place).stencil) return false;
  }
  return true;
}

using DrawCounts = std::map<std::string, std::uint64_t>;

/// Of a draw alone in its frame, the frame's.
DrawCounts counts_of_draw(const RunResult& result, std::size_t draw) {
  const auto named = result.draws.empty() ? result.counts.named() : result.draws[draw].counts;
  return {named.begin(), named.end()};
}

/// What is counted by draw against what is counted in all.
std::vector<Finding> broken_draws(const RunResult& result) {
  std::vector<Finding> findings;
  DrawCounts sum;
  for (const DrawReport& draw : result.draws) {
    DrawCounts n(draw.counts.begin(), draw.counts.end());
    for (const auto& [name, count] : n) sum[name] += count;
    const auto conserved = [&](const char* what, std::uint64_t in, std::uint64_t out) {
      if (in == out) return;
      findings.push_back(
          {"conservation in a draw", fmt::format("{}, {}: {} went in, {} came out", draw.name, what, in, out)});
    };
    conserved("quads rasterized", n["quads_rasterized"],
              n["quads_depth_stencil_failed"] + n["quads_terminated"] + n["quads_unshaded"] + n["quads_shaded"]);
    conserved("quads shaded", n["quads_shaded"],
              n["quads_pruned"] + n["quads_merged"] + n["quads_dropped_late"] + n["quads_late_failed"] +
                  n["quads_unblended"] + n["quads_blended"]);
    conserved("fragments rasterized", n["fragments_rasterized"],
              n["fragments_depth_stencil_failed"] + n["fragments_terminated"] + n["fragments_unshaded"] +
                  n["fragments_shaded"]);
    // A merged quad's fragments are blended for its front's draw.
    if (result.request.variant.quad_merging) continue;
    conserved("fragments shaded", n["fragments_shaded"],
              n["fragments_pruned"] + n["fragments_dropped_late"] + n["fragments_late_failed"] +
                  n["fragments_unblended"] + n["fragments_blended"]);
  }
  std::uint64_t cycles = 0;
  bool any_end = false;
  for (const DrawReport& draw : result.draws) {
    cycles += draw.cycles.value_or(0);
    any_end = any_end || draw.end;
  }
  if (any_end && cycles != *result.cycles)
    findings.push_back({"cycles of draws sum to the frame's", fmt::format("{} of {}", cycles, *result.cycles)});
  for (const auto& [name, count] : result.counts.named()) {
    if (sum.count(name) != 0 && sum[name] != count) {
      findings.push_back({"draws sum to the frame", fmt::format("{}: {} of {}", name, sum[name], count)});
    }
  }
  return findings;
}

/// Sizes, rates and latencies of the machine left out: the draws' states decide the picture alone. Without the check of
/// the previous alpha a pixel is signalled that a draw which does not terminate has taken past the threshold.
Case on_another_machine(const Case& c) {
  Case other = c;
  other.platform = &simplest_platform();
  other.units.clear();
  other.settings.clear();
  for (const Setting& setting : c.settings) {
    const bool of_frames = setting.parameter == "previous_alpha_check" && !c.is_single_draw();
    if (setting.unit == "state" || of_frames) other.settings.push_back(setting);
  }
  return other;
}

/// Simulates, and reports what it throws.
class Judge {
 public:
  Judge(const Case& c, Verdict& verdict) : case_(c), verdict_(verdict) {}

  void find(const std::string& at, const Finding& finding) {
    verdict_.finding({finding.rule, at + ": " + finding.detail});
  }

  std::optional<RunResult> simulated(const std::string& stage, const RunRequest& request) {
    if (case_.is_single_draw()) return simulated(stage, request, nullptr);
    const Frame frame = case_.frame();
    return simulated(stage, request, &frame);
  }
  /// Without a frame, the scene as a single draw.
  std::optional<RunResult> simulated(const std::string& stage, const RunRequest& request, const Frame* frame) {
    verdict_.stage(stage);
    fresh_simulation();
    try {
      const testing::TrapInvalid trap;
      RunResult result = frame == nullptr ? simulate(request, case_.draw) : simulate(request, *frame);
      for (const Finding& finding : broken_rules(result)) find(stage, finding);
      return result;
    } catch (const UserError& error) {
      // What a depth format asks for is known with the frame.
      const bool of_frame = case_.mixed_seed != 0 && documented_refusal(error.what());
      if (!of_frame) find(stage, {"refused late", error.what()});
    } catch (const std::exception& error) {
      find(stage, {"a fault", error.what()});
    }
    return std::nullopt;
  }

  void refusal() {
    const Setting& bad = case_.settings.back();
    const std::string message = refused();
    if (message.empty()) {
      find("check", {"a bad value is refused", fmt::format("{}.{}='{}'", bad.unit, bad.parameter, bad.value)});
    } else if (message.find(bad.parameter) == std::string::npos) {
      find("check", {"a bad value is refused by name", message});
    }
  }

  /// Whether the configuration can be used; a refusal must be a documented one.
  bool usable() {
    const std::string message = refused();
    if (!message.empty() && !documented_refusal(message)) find("check", {"a good value is taken", message});
    return message.empty();
  }

  /// Why the configuration is refused, the same whatever effects are simulated; empty if it is not.
  std::string refused() {
    verdict_.stage("check");
    std::string messages[2];
    for (const bool all : {false, true}) {
      RunRequest request = case_.request(Fidelity::functional);
      if (all) request.effects = EffectChoice::parse("all");
      try {
        check_configuration(request);
      } catch (const UserError& error) {
        messages[all ? 1 : 0] = error.what();
      }
    }
    if (messages[0] != messages[1]) {
      find("check", {"what a frame does not call for is refused all the same",
                     fmt::format("auto: '{}', all: '{}'", messages[0], messages[1])});
    }
    return messages[0];
  }

  void ladder() {
    std::optional<RunResult> untimed;
    std::optional<std::uint64_t> bound;
    for (const Fidelity fidelity : fidelities()) {
      const std::string stage = name_of(fidelity);
      std::optional<RunResult> result = simulated(stage, case_.request(fidelity));
      if (!result) return;
      if (fidelity == Fidelity::bound) bound = result->cycles;
      if (fidelity == Fidelity::cycle && *bound > *result->cycles) {
        find(stage, {"bound is a bound", fmt::format("bound {}, cycle {}", *bound, *result->cycles)});
      }
      if (untimed) {
        for (const Finding& finding : broken_rules(*untimed, *result)) find(stage, finding);
        compare_stencils(stage, *untimed, *result);
      } else {
        untimed = std::move(result);
      }
    }
    RunRequest stalled = case_.request(case_.stalled);
    stalled.stall_seed = case_.stall_seed;
    stalled.stall_per_256 = 64;
    const std::string stage = std::string(name_of(case_.stalled)) + " with stalls";
    if (const auto result = simulated(stage, stalled)) {
      for (const Finding& finding : broken_rules(*untimed, *result)) find(stage, finding);
      compare_stencils(stage, *untimed, *result);
    }
    mixed(*untimed);
    repetition();
    machine(*untimed);
    split(*untimed);
    beginnings(*untimed);
    pixels(*untimed);
  }

  void compare_stencils(const std::string& stage, const RunResult& untimed, const RunResult& timed) {
    const bool any = std::any_of(case_.parts.begin(), case_.parts.end(),
                                 [](const Part& part) { return part.stencil != Part::Stencil::untested; });
    if (!any || same_stencil(untimed.framebuffer.depth_stencil, timed.framebuffer.depth_stencil)) return;
    find(stage, {"order alone decides what is stored", "the stencil differs from the untimed one"});
  }

  /// A unit at cycle among others at lt.
  void mixed(const RunResult& untimed) {
    RunRequest request = case_.request(Fidelity::lt);
    request.units_at_cycle = case_.units_at_cycle;
    try {
      check_configuration(request);
    } catch (const UserError&) {
      return;  // several GPCs, a memory of another make
    }
    const std::string stage = fidelity_of(request);
    if (const auto result = simulated(stage, request)) {
      for (const Finding& finding : broken_rules(untimed, *result)) find(stage, finding);
      compare_stencils(stage, untimed, *result);
    }
  }

  /// At cycle fidelity the order in which units tick must not matter either.
  void repetition() {
    const std::string stage = std::string(name_of(case_.repeated)) + " twice";
    RunRequest request = case_.request(case_.repeated);
    const auto once = simulated(stage, request);
    if (request.fidelity == Fidelity::cycle) request.tick_order_seed = case_.stall_seed;
    const auto again = simulated(stage, request);
    if (!once || !again) return;
    for (const Finding& finding : broken_repetition(*once, *again)) find(stage, finding);
    effects(*once);
  }

  void effects(const RunResult& automatic) {
    if (case_.effects.empty()) return;
    RunRequest request = case_.request(case_.repeated);
    request.effects = EffectChoice::parse(case_.effects);
    const std::string stage = std::string(name_of(case_.repeated)) + " with effects " + case_.effects;
    const auto other = simulated(stage, request);
    if (!other) return;
    for (const Finding& finding : broken_effects(automatic, *other)) find(stage, finding);
    compare_stencils(stage, automatic, *other);
  }

  void split(const RunResult& untimed) {
    if (case_.parts.empty() || !case_.is_mere_split()) return;
    const auto whole = simulated("one draw", case_.request(Fidelity::functional), nullptr);
    if (!whole) return;
    for (const Finding& finding : broken_split(untimed, *whole)) find("functional", finding);
  }

  /// A target that does not round, without merging: every bit is known.
  void pixels(const RunResult& untimed) {
    const bool order_decides = !case_.variant.early_termination || case_.termination == Termination::strict;
    if (case_.is_single_draw() || case_.mixed_seed != 0 || case_.variant.quad_merging || !order_decides) return;
    if (case_.format != ColorFormat::rgba32f) return;
    for (const Setting& setting : case_.settings) {
      for (const char* other : {"exponential", "blend_rounding", "subpixel_bits", "previous_alpha_check", "shading",
                                "attributes", "export_format", "alpha_max"}) {
        if (setting.parameter == other) return;
      }
    }
    verdict_.stage("pixels");
    const auto expected = testing::pixels_in_order(case_.frame(), case_.variant.early_termination);
    std::size_t wrong = 0;
    for (std::uint32_t i = 0; i < expected.size(); ++i) {
      const auto got = untimed.framebuffer.color.pixel(i % case_.draw.width, i / case_.draw.width);
      wrong += std::memcmp(got.data(), expected[i].data(), sizeof got) != 0;
    }
    if (wrong > 0) find("pixels", {"every pixel is as order makes it", fmt::format("{} are not", wrong)});
  }

  void beginnings(const RunResult& untimed) {
    for (std::size_t i = 0; i < case_.parts.size(); ++i) {
      if (!case_.parts[i].clear.color || !case_.parts[i].clear.termination) continue;
      const Frame frame = case_.frame(i);
      const auto rest =
          simulated("from part " + std::to_string(i) + " on", case_.request(Fidelity::functional), &frame);
      if (!rest) return;
      for (const Finding& finding : broken_beginning(untimed, i, *rest)) find("functional", finding);
    }
  }

  void machine(const RunResult& untimed) {
    const bool order_decides = !case_.variant.early_termination || case_.termination == Termination::strict;
    if (case_.variant.quad_merging || !order_decides) return;
    const auto other = simulated("another machine", on_another_machine(case_).request(Fidelity::functional));
    if (other && !same_image(other->framebuffer.color, untimed.framebuffer.color)) {
      find("another machine", {"the machine does not change the picture", "the images differ"});
    }
  }

 private:
  const Case& case_;
  Verdict& verdict_;
};

}  // namespace

std::vector<Finding> broken_rules(const RunResult& result) {
  std::vector<Finding> findings;
  const Counts& n = result.counts;
  const auto conserved = [&](const char* what, std::uint64_t in, std::uint64_t out) {
    if (in != out) findings.push_back({"conservation", fmt::format("{}: {} went in, {} came out", what, in, out)});
  };
  conserved("quads rasterized", n.quads_rasterized,
            n.quads_depth_stencil_failed + n.quads_terminated + n.quads_unshaded + n.quads_shaded);
  conserved("fragments rasterized", n.fragments_rasterized,
            n.fragments_depth_stencil_failed + n.fragments_terminated + n.fragments_unshaded + n.fragments_shaded);
  conserved("quads shaded", n.quads_shaded,
            n.quads_pruned + n.quads_merged + n.quads_dropped_late + n.quads_late_failed + n.quads_unblended +
                n.quads_blended);
  conserved("fragments shaded", n.fragments_shaded,
            n.fragments_pruned + n.fragments_merged + n.fragments_dropped_late + n.fragments_late_failed +
                n.fragments_unblended + n.fragments_blended);

  const auto none = [&](const char* what, std::uint64_t count) {
    if (count != 0) findings.push_back({"only what the variant does", fmt::format("{} {}", count, what)});
  };
  if (!result.request.variant.early_termination) {
    none("fragments terminated", n.fragments_terminated);
    none("termination updates", n.termination_updates);
  }
  if (!result.request.variant.quad_merging) none("quads merged", n.quads_merged);
  if (result.request.termination == Termination::paper) none("fragments dropped late", n.fragments_dropped_late);
  const auto one_to_four = [&](const char* what, std::uint64_t quads, std::uint64_t fragments) {
    if (fragments < quads || fragments > 4 * quads) {
      findings.push_back(
          {"a quad has 1 to 4 fragments", fmt::format("{} quads, {} fragments {}", quads, fragments, what)});
    }
  };
  one_to_four("rasterized", n.quads_rasterized, n.fragments_rasterized);
  one_to_four("shaded", n.quads_shaded, n.fragments_shaded);
  one_to_four("blended", n.quads_blended, n.fragments_blended);

  const bool timed = result.request.fidelity != Fidelity::functional;
  if (result.cycles.has_value() != timed || result.units.empty() == timed) {
    findings.push_back({"time where the fidelity has it", "cycles or units are there without time, or are missing"});
  }
  for (const UnitReport& unit : result.units) {
    std::uint64_t sum = 0;
    for (unsigned state = 0; state < unit_states; ++state) {
      const std::uint64_t cycles = unit.cycles[state];
      if (cycles > *result.cycles) {
        findings.push_back({"a state is part of the cycles",
                            fmt::format("{} is {} for {} of {} cycles", unit.name,
                                        name_of(static_cast<UnitState>(state)), cycles, *result.cycles)});
      }
      sum += cycles;
    }
    if (sum != *result.cycles) {
      findings.push_back({"states sum to the cycles", fmt::format("{}: {} of {}", unit.name, sum, *result.cycles)});
    }
  }
  for (const auto& [unit, share] : result.utilization) {
    if (!is_a_share(share)) findings.push_back({"utilization is a share", fmt::format("{} {}", unit, share)});
  }
  for (const auto& broken : {broken_occupancies(result), broken_draws(result)}) {
    findings.insert(findings.end(), broken.begin(), broken.end());
  }
  return findings;
}

/// What Hi-Z knows when a primitive comes is a matter of time.
bool culls_by_depth(const RunResult& result) {
  return std::any_of(result.statistics.begin(), result.statistics.end(),
                     [](const StatisticReport& each) { return each.name == "raster.hi_z_tests" && each.value != 0; });
}

std::vector<Finding> broken_rules(const RunResult& untimed, const RunResult& timed) {
  std::vector<Finding> findings;
  const bool strict = timed.request.termination == Termination::strict;
  const auto expected = untimed.counts.named();
  const auto got = timed.counts.named();
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const std::string& name = expected[i].first;
    const bool before_termination =
        name == "primitives" || (name.find("rasterized") != std::string::npos && !culls_by_depth(timed));
    if ((strict || before_termination) && expected[i] != got[i]) {
      findings.push_back({strict ? "strict counts are the same" : "time does not change what is rasterized",
                          fmt::format("{} {}, untimed {}", name, got[i].second, expected[i].second)});
    }
  }
  for (std::size_t draw = 0; strict && draw < untimed.draws.size(); ++draw) {
    if (counts_of_draw(timed, draw) == counts_of_draw(untimed, draw)) continue;
    findings.push_back({"strict counts are the same", "they are not in " + untimed.draws[draw].name});
  }
  const Variant& variant = timed.request.variant;
  const bool order_decides = strict || (!variant.early_termination && !variant.quad_merging);
  if (order_decides && !same_image(untimed.framebuffer.color, timed.framebuffer.color)) {
    findings.push_back({"order alone decides the picture", "the image differs from the untimed one"});
  }
  return findings;
}

std::vector<Finding> broken_split(const RunResult& split, const RunResult& whole) {
  std::vector<Finding> findings;
  if (!same_image(split.framebuffer.color, whole.framebuffer.color)) {
    findings.push_back({"a split changes nothing", "the images differ"});
  }
  const auto expected = whole.counts.named();
  const auto got = split.counts.named();
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (got[i] == expected[i]) continue;
    findings.push_back({"a split changes nothing",
                        fmt::format("{} {}, of one draw {}", got[i].first, got[i].second, expected[i].second)});
  }
  return findings;
}

std::vector<Finding> broken_beginning(const RunResult& frame, std::size_t draw, const RunResult& rest) {
  std::vector<Finding> findings;
  if (!same_image(frame.framebuffer.color, rest.framebuffer.color)) {
    findings.push_back({"what is cleared is gone", "the images differ"});
  }
  const std::size_t draws = std::max<std::size_t>(rest.draws.size(), 1);
  for (std::size_t i = 0; i < draws; ++i) {
    const DrawCounts expected = counts_of_draw(rest, i);
    for (const auto& [name, count] : counts_of_draw(frame, draw + i)) {
      if (expected.at(name) == count) continue;
      findings.push_back({"what is cleared is gone", fmt::format("draw {}: {} {}, without what was before {}", draw + i,
                                                                 name, count, expected.at(name))});
    }
  }
  return findings;
}

std::vector<Finding> broken_repetition(const RunResult& once, const RunResult& again) {
  std::vector<Finding> findings;
  const auto find = [&](const std::string& what, bool equal) {
    if (!equal) findings.push_back({"equal requests, equal results", what + " differ"});
  };
  find(once.result_hash + " and " + again.result_hash, once.result_hash == again.result_hash);
  find("cycles", once.cycles == again.cycles);
  find("counts", once.counts.named() == again.counts.named());
  find("images", same_image(once.framebuffer.color, again.framebuffer.color));
  find("utilizations", once.utilization == again.utilization);
  find("units", once.units.size() == again.units.size());
  for (std::size_t i = 0; i < std::min(once.units.size(), again.units.size()); ++i) {
    const UnitReport& unit = once.units[i];
    find("states of " + unit.name, unit.name == again.units[i].name && unit.cycles == again.units[i].cycles);
  }
  find("numbers of statistics", once.statistics.size() == again.statistics.size());
  for (std::size_t i = 0; i < std::min(once.statistics.size(), again.statistics.size()); ++i) {
    const StatisticReport& one = once.statistics[i];
    const StatisticReport& other = again.statistics[i];
    find(fmt::format("{} {} and {} {}", one.name, one.value, other.name, other.value),
         one.name == other.name && one.value == other.value);
  }
  find("draws", once.draws.size() == again.draws.size());
  for (std::size_t i = 0; i < std::min(once.draws.size(), again.draws.size()); ++i) {
    find("counts of draw " + std::to_string(i), once.draws[i].counts == again.draws[i].counts);
  }
  return findings;
}

std::vector<Finding> broken_effects(const RunResult& result, const RunResult& other) {
  std::vector<Finding> findings;
  const auto find = [&](const std::string& what, bool same) {
    if (!same) findings.push_back({"what a frame does not call for changes nothing", what + " differ"});
  };
  find("images", same_image(result.framebuffer.color, other.framebuffer.color));
  find("counts", result.counts.named() == other.counts.named());
  find("cycles", result.cycles == other.cycles);
  find("hashes", result.result_hash == other.result_hash);
  for (std::size_t i = 0; i < std::min(result.draws.size(), other.draws.size()); ++i) {
    find("counts of draw " + std::to_string(i), result.draws[i].counts == other.draws[i].counts);
  }
  return findings;
}

void judge(const Case& c, Verdict& verdict) {
  Judge judge(c, verdict);
  if (c.refused) {
    judge.refusal();
  } else if (judge.usable()) {
    judge.ladder();
  }
}

}  // namespace vrpipe::walk
