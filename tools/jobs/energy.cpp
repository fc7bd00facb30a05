#include "jobs/energy.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include <vrpipe/pipeline/registry.h>

namespace vrpipe::tools {
namespace {

constexpr double millijoules_per_picojoule = 1e-9;

/// The numbers of a run by name.
class RunNumbers {
 public:
  explicit RunNumbers(const RunResult& run) {
    for (const auto& [key, text] : run.parameters) {
      double value = 0;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
      if (error == std::errc() && end == text.data() + text.size()) numbers_[key] = value;
    }
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

  /// Of the products that the run has numbers for: what a platform lacks does not happen there. None if it lacks all.
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

}  // namespace

EnergyAmounts energy_amounts(const RunResult& run, const EnergyTable& table) {
  const RunNumbers numbers(run);
  EnergyAmounts amounts;
  std::set<std::string> missing;
  const auto count = [&](const CountFormula& formula, const std::string& name) {
    const std::optional<double> value = numbers.value(formula, missing);
    if (!value) amounts.not_counted.push_back(name);
    return value.value_or(0);
  };
  for (const EnergyEvent& event : table.events) {
    amounts.events.push_back(count(event.count, event.unit + ": " + event.name));
  }
  for (const ConstantPower& power : table.powers) {
    amounts.powers.push_back(count(power.count, "constant: " + power.name));
  }
  amounts.missing.assign(missing.begin(), missing.end());
  if (run.cycles) amounts.seconds = static_cast<double>(*run.cycles) / (run.request.platform->frequency_mhz * 1e6);
  amounts.fragments_blended = run.counts.fragments_blended;
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
    const Range spent = event.picojoules * (amounts.events[i] * millijoules_per_picojoule);
    unit->millijoules += spent;
    (event.unit == "TGC" || event.unit == "QRU" ? merging : others) += spent;
  }
  for (const UnitEnergy& unit : report.units) report.moving += unit.millijoules;
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
  if (!baseline.missing.empty() || !run.missing.empty()) return std::nullopt;
  std::vector<Term> terms;
  for (std::size_t i = 0; i < table.events.size(); ++i) {
    terms.push_back({baseline.events[i], run.events[i], table.events[i].picojoules * 1e-12});
  }
  for (std::size_t i = 0; i < table.powers.size(); ++i) {
    const double before = baseline.powers[i] * *baseline.seconds, after = run.powers[i] * *run.seconds;
    terms.push_back({before, after, table.powers[i].watts});
  }
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
    if (!known.empty() && std::find(known.begin(), known.end(), platform.name) == known.end()) {
      names.push_back(power.name);
    }
  }
  return names;
}

}  // namespace vrpipe::tools
