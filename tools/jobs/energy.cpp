#include "jobs/energy.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <utility>

#include <vrpipe/pipeline/registry.h>

namespace vrpipe::tools {
namespace {

constexpr double millijoules_per_picojoule = 1e-9;

/// The numbers of a run or a kernel by name.
class EnergyNumbers {
 public:
  EnergyNumbers() = default;
  explicit EnergyNumbers(const RunResult& run) {
    add(run.parameters);
    for (const auto& [name, value] : run.counts.named()) numbers_[name] = static_cast<double>(value);
    for (const StatisticReport& report : run.statistics) {
      if (report.kind == "counter") numbers_[report.name] = static_cast<double>(report.value);
    }
    for (const auto& [slot, name] : run.implementations) {
      for (const Implementation* each : Registry::instance().of_slot(slot)) {
        if (each->name != name) continue;
        if (each->pass_through) passed_.push_back(slot + ".");
        if (each->trust == Trust::checked) own_.emplace_back(slot, name);
      }
    }
  }

  void add(const std::string& name, double value) { numbers_[name] = value; }
  void add(const std::vector<std::pair<std::string, std::string>>& parameters) {
    for (const auto& [key, text] : parameters) {
      double value = 0;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
      if (error == std::errc() && end == text.data() + text.size()) add(key, value);
    }
  }
  bool has(const std::string& name) const { return numbers_.count(name) > 0; }

  /// Of the products that there are numbers for: what a platform lacks does not happen there. None if it lacks all.
  /// @param missing  told what a unit of one's own should say and does not
  std::optional<double> value(const CountFormula& formula, std::set<std::string>& missing) const {
    std::optional<double> sum;
    for (const CountProduct& product : formula.products) {
      if (const std::optional<double> each = value(product, missing)) sum = sum.value_or(0) + *each;
    }
    return sum;
  }

 private:
  std::optional<double> value(const CountProduct& product, std::set<std::string>& missing) const {
    double value = product.factor;
    for (const std::string& name : product.names) {
      const auto is_start = [&](const std::string& slot) { return name.compare(0, slot.size(), slot) == 0; };
      if (std::any_of(passed_.begin(), passed_.end(), is_start)) return 0;
      const auto found = numbers_.find(name);
      if (found == numbers_.end()) {
        // Parts, such as a cache, may well not be there: they have names of their own in between.
        const bool is_of_unit = std::count(name.begin(), name.end(), '.') == 1;
        for (const auto& [slot, unit] : own_) {
          if (is_of_unit && is_start(slot + ".")) missing.insert(name + " of " + slot + "=" + unit);
        }
        return std::nullopt;
      }
      value *= found->second;
    }
    return value;
  }

  std::map<std::string, double> numbers_;
  std::vector<std::string> passed_;                       ///< slots of units that pass items through, with a dot
  std::vector<std::pair<std::string, std::string>> own_;  ///< slots and names of units that are not of this library
};

/// What is spent on one event or power: so often, each time between low and high.
struct Term {
  double baseline, run;
  Range each;
};

double total(const std::vector<Term>& terms, double Term::*amount, double Range::*end) {
  double sum = 0;
  for (const Term& term : terms) sum += term.*amount * (term.each.*end);
  return sum;
}

/// What the quotient of two sums can be where terms up to one are high and all others low. It is least, or greatest, in
/// one of these if terms are in the order of their own quotients: there is no need to try every combination.
std::vector<double> quotients(const std::vector<Term>& terms) {
  std::vector<double> all;
  for (std::size_t high = 0; high <= terms.size(); ++high) {
    double baseline = 0, run = 0;
    for (std::size_t i = 0; i < terms.size(); ++i) {
      const double each = i < high ? terms[i].each.high : terms[i].each.low;
      baseline += terms[i].baseline * each;
      run += terms[i].run * each;
    }
    all.push_back(baseline / run);
  }
  return all;
}

/// @param terms  of which neither side is nothing, even where all are low
Range range_of_ratio(std::vector<Term> terms) {
  const double nominal = total(terms, &Term::baseline, &Range::nominal) / total(terms, &Term::run, &Range::nominal);
  std::stable_sort(terms.begin(), terms.end(),
                   [](const Term& a, const Term& b) { return a.baseline / a.run < b.baseline / b.run; });
  const std::vector<double> low = quotients(terms);
  std::reverse(terms.begin(), terms.end());
  const std::vector<double> high = quotients(terms);
  // Rounding must not put the nominal one outside.
  return {std::min(nominal, *std::min_element(low.begin(), low.end())), nominal,
          std::max(nominal, *std::max_element(high.begin(), high.end()))};
}

/// Of a part of a whole, where part and rest vary by themselves.
Range share_of(const Range& part, const Range& rest) {
  const auto share = [](double of, double others) { return of + others > 0 ? of / (of + others) : 0; };
  return {share(part.low, rest.high), share(part.nominal, rest.nominal), share(part.high, rest.low)};
}

/// @param cycles  that it takes; none without time
EnergyAmounts amounts_of(const EnergyNumbers& numbers, const Platform& platform, const EnergyTable& table,
                         const std::optional<std::uint64_t>& cycles) {
  EnergyAmounts amounts;
  amounts.process = table.process_of(platform.name);
  std::set<std::string> missing;
  const auto counted = [&](const std::optional<double>& value, const std::string& name) {
    if (!value) amounts.not_counted.push_back(name);
    return value.value_or(0);
  };
  for (const EnergyEvent& event : table.events) {
    amounts.events.push_back(counted(numbers.value(event.count, missing), event.unit + ": " + event.name));
  }
  for (const ConstantPower& power : table.powers) {
    amounts.powers.push_back(0);
    if (!table.is_taken(power, platform.name)) continue;
    const std::optional<double> value = numbers.value(power.count, missing);
    if (!power.is_of_cycles) {
      amounts.powers.back() = counted(value, "constant: " + power.name);
    } else if (!value && cycles) {
      missing.insert("cycles of " + power.name);  // somebody is active all the same
    } else if (value && cycles.value_or(0) > 0) {
      amounts.powers.back() = *value / static_cast<double>(*cycles);
    }
  }
  amounts.missing.assign(missing.begin(), missing.end());
  if (cycles) amounts.seconds = static_cast<double>(*cycles) / (platform.frequency_mhz * 1e6);
  return amounts;
}

/// Of an accelerator; none where none is published.
std::optional<double> published_watts(const std::vector<std::pair<std::string, std::string>>& parameters) {
  for (const auto& [name, text] : parameters) {
    double watts = 0;
    if (name != "accelerator.power_watts") continue;
    std::from_chars(text.data(), text.data() + text.size(), watts);
    if (watts > 0) return watts;
  }
  return std::nullopt;
}

}  // namespace

EnergyAmounts& EnergyAmounts::operator+=(const EnergyAmounts& next) {
  const double before = seconds.value_or(0), after = next.seconds.value_or(0), both = before + after;
  for (std::size_t i = 0; i < events.size(); ++i) events[i] += next.events[i];
  for (std::size_t i = 0; i < powers.size(); ++i) {
    powers[i] = both > 0 ? (powers[i] * before + next.powers[i] * after) / both : 0;
  }
  if (seconds && next.seconds) {
    seconds = both;
  } else {
    seconds.reset();
  }
  own_millijoules += next.own_millijoules;
  is_known = is_known && next.is_known;
  fragments_blended += next.fragments_blended;
  const auto add = [](std::vector<std::string>& names, const std::vector<std::string>& others) {
    for (const std::string& name : others) {
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  };
  add(not_counted, next.not_counted);
  add(missing, next.missing);
  return *this;
}

EnergyAmounts energy_amounts(const RunResult& run, const EnergyTable& table) {
  if (!run.request.variant.is_of_pipeline()) {
    const std::optional<double> milliseconds = run.cycles ? std::optional(run.milliseconds) : std::nullopt;
    EnergyAmounts amounts = run.request.variant.drawn_by == DrawnBy::software
                                ? energy_amounts(run.kernels, run, table)
                                : accelerator_amounts(run.kernels, run.parameters, milliseconds, table);
    amounts.fragments_blended = run.counts.fragments_blended;
    return amounts;
  }
  EnergyAmounts amounts = amounts_of(EnergyNumbers(run), *run.request.platform, table, run.cycles);
  amounts.fragments_blended = run.counts.fragments_blended;
  return amounts;
}

EnergyAmounts energy_amounts(const KernelReport& kernel, const RunResult& machine, const EnergyTable& table) {
  EnergyNumbers numbers;
  numbers.add(machine.parameters);
  if (kernel.warp_instructions) numbers.add("kernel.warp_instructions", *kernel.warp_instructions);
  if (kernel.lane_instructions) numbers.add("kernel.lane_instructions", *kernel.lane_instructions);
  numbers.add("kernel.bytes", static_cast<double>(kernel.bytes));
  if (numbers.has("dram.channels")) numbers.add("kernel.dram_bytes", static_cast<double>(kernel.bytes));
  if (kernel.core_cycles) numbers.add("kernel.core_cycles", *kernel.core_cycles);
  EnergyAmounts amounts = amounts_of(numbers, *machine.request.platform, table, kernel.cycles);
  amounts.not_counted.clear();  // it has no part in what units of the pipeline count
  if (!kernel.warp_instructions) amounts.missing.push_back("warp instructions of " + kernel.name);
  return amounts;
}

EnergyAmounts energy_amounts(const std::vector<KernelReport>& kernels, const RunResult& machine,
                             const EnergyTable& table) {
  EnergyAmounts amounts = energy_amounts(kernels.front(), machine, table);
  for (std::size_t i = 1; i < kernels.size(); ++i) amounts += energy_amounts(kernels[i], machine, table);
  return amounts;
}

EnergyAmounts energy_amounts_of_dram(std::uint64_t bytes, const EnergyTable& table) {
  EnergyNumbers numbers;
  numbers.add("kernel.dram_bytes", static_cast<double>(bytes));
  EnergyAmounts amounts;
  std::set<std::string> missing;
  for (const EnergyEvent& event : table.events)
    amounts.events.push_back(numbers.value(event.count, missing).value_or(0));
  amounts.powers.assign(table.powers.size(), 0);
  return amounts;
}

EnergyAmounts accelerator_amounts(const std::vector<KernelReport>& stages,
                                  const std::vector<std::pair<std::string, std::string>>& parameters,
                                  const std::optional<double>& milliseconds, const EnergyTable& table) {
  std::uint64_t bytes = 0;
  for (const KernelReport& stage : stages) bytes += stage.bytes;
  EnergyAmounts amounts = energy_amounts_of_dram(bytes, table);
  const std::optional<double> watts = published_watts(parameters);
  amounts.is_known = watts && milliseconds;
  if (!amounts.is_known) {
    amounts.missing.push_back("power of the accelerator");
    return amounts;
  }
  amounts.seconds = *milliseconds * 1e-3;
  amounts.own_millijoules = *watts * *milliseconds;
  return amounts;
}

EnergyReport energy_report(const EnergyAmounts& amounts, const EnergyTable& table) {
  EnergyReport report;
  Range merging, others;
  for (std::size_t i = 0; i < table.events.size(); ++i) {
    const EnergyEvent& event = table.events[i];
    const auto is_its = [&](const UnitEnergy& each) { return each.unit == event.unit; };
    auto unit = std::find_if(report.units.begin(), report.units.end(), is_its);
    if (unit == report.units.end()) unit = report.units.insert(unit, {event.unit, {}});
    const Range spent = event.picojoules[amounts.process] * (amounts.events[i] * millijoules_per_picojoule);
    unit->millijoules += spent;
    (event.unit == "TGC" || event.unit == "QRU" ? merging : others) += spent;
  }
  for (const UnitEnergy& unit : report.units) report.moving += unit.millijoules;
  const double own = amounts.own_millijoules;
  report.moving += {own, own, own};
  others += {own, own, own};
  if (!amounts.seconds) return report;

  const double seconds = *amounts.seconds;
  Range constant;
  for (std::size_t i = 0; i < table.powers.size(); ++i) {
    constant += table.powers[i].watts * (amounts.powers[i] * seconds * 1e3);
  }
  report.constant = constant;
  report.total = report.moving;
  *report.total += constant;
  others += constant;
  if (amounts.missing.empty()) report.quad_merging_share = share_of(merging, others);
  if (seconds > 0) report.watts = *report.total * (1e-3 / seconds);
  if (amounts.fragments_blended > 0) {
    const double fragments = static_cast<double>(amounts.fragments_blended);
    report.picojoules_per_fragment = *report.total * (1 / (fragments * millijoules_per_picojoule));
  }
  return report;
}

std::optional<Range> energy_ratio(const EnergyAmounts& baseline, const EnergyAmounts& run, const EnergyTable& table) {
  if (!baseline.seconds || !run.seconds || baseline.fragments_blended == 0) return std::nullopt;
  if (!baseline.missing.empty() || !run.missing.empty() || baseline.process != run.process) return std::nullopt;
  std::vector<Term> terms;
  for (std::size_t i = 0; i < table.events.size(); ++i) {
    terms.push_back({baseline.events[i], run.events[i], table.events[i].picojoules[run.process] * 1e-12});
  }
  for (std::size_t i = 0; i < table.powers.size(); ++i) {
    const double before = baseline.powers[i] * *baseline.seconds, after = run.powers[i] * *run.seconds;
    terms.push_back({before, after, table.powers[i].watts});
  }
  terms.push_back({baseline.own_millijoules * 1e-3, run.own_millijoules * 1e-3, {1, 1, 1}});
  // Its quotient would be no number.
  const auto is_nothing = [](const Term& term) { return term.baseline == 0 && term.run == 0; };
  terms.erase(std::remove_if(terms.begin(), terms.end(), is_nothing), terms.end());
  for (double Term::*amount : {&Term::baseline, &Term::run}) {
    if (!(total(terms, amount, &Range::low) > 0)) return std::nullopt;
  }
  return range_of_ratio(std::move(terms));
}

std::vector<std::string> powers_of_other_platforms(const EnergyTable& table, const Platform& platform) {
  std::vector<std::string> names;
  for (const ConstantPower& power : table.powers) {
    const std::vector<std::string>& known = power.platforms;
    const bool is_others = !known.empty() && std::find(known.begin(), known.end(), platform.name) == known.end();
    if (is_others && table.is_taken(power, platform.name)) names.push_back(power.name);
  }
  return names;
}

}  // namespace vrpipe::tools
