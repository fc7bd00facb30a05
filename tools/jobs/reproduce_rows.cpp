#include "jobs/reproduce_rows.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

#include "jobs/reproduce_measures.h"

namespace vrpipe::tools {
namespace {

/// What a statement comes to: the values that it is about, scene by scene, and where it does not hold.
void check_conditions(const Evidence& evidence, RowFinding& finding) {
  std::vector<std::string> six, quantities;
  for (const SceneFinding& each : evidence.scenes) six.push_back(evidence.name_of(each));
  std::map<std::string, std::set<std::string>> about;  // scenes, by quantity
  const auto value = [&](const std::string& quantity, const std::string& scene) {
    if (about.count(quantity) == 0) quantities.push_back(quantity);
    about[quantity].insert(scene);
    return find_quantity(quantity)->of(*evidence.scene(scene));
  };
  std::set<std::string> exceptions;
  for (const RowCondition& condition : finding.row->holds) {
    const std::vector<std::string>& in = condition.in.empty() ? six : condition.in;
    for (const auto* names : {&in, &condition.than_in}) {
      for (const std::string& name : *names) {
        if (evidence.scene(name) == nullptr) return;
      }
    }
    for (const std::string& scene : in) {
      const double own = value(condition.of, scene);
      if (!std::isfinite(own)) return;
      std::vector<double> others;
      if (condition.number) others.push_back(*condition.number);
      for (const std::string& quantity : condition.than) others.push_back(value(quantity, scene));
      for (const std::string& other : condition.than_in) others.push_back(value(condition.of, other));
      const auto is_number = [](double other) { return std::isfinite(other); };
      if (!std::all_of(others.begin(), others.end(), is_number)) return;
      const auto holds = [&](double other) { return condition.is_above ? own > other : own < other; };
      if (!std::all_of(others.begin(), others.end(), holds)) exceptions.insert(scene);
    }
  }
  std::vector<std::string> texts;
  for (const std::string& quantity : quantities) {
    std::vector<std::string> values;
    for (const PlannedScene& scene : evidence.result.plan.scenes) {
      if (about[quantity].count(scene.name) == 0) continue;
      values.push_back(fmt::format("{} {:.3g}", scene.name, value(quantity, scene.name)));
    }
    texts.push_back(fmt::format("{}: {}", quantity, fmt::join(values, ", ")));
  }
  finding.measured = fmt::format("{}", fmt::join(texts, "; "));
  finding.exceptions.assign(exceptions.begin(), exceptions.end());
  finding.verdict = exceptions.empty() ? Verdict::agrees : Verdict::differs;
}

/// A row's measures, or those of a reason, beside the paper.
RowFinding measured_row(const PaperRow& row, const std::vector<std::string>& measures, const Evidence& evidence) {
  RowFinding finding;
  finding.row = &row;
  std::vector<std::string> texts;
  std::string detail;
  for (std::size_t i = 0; i < measures.size(); ++i) {
    const std::optional<Measured> here = measure(measures[i], evidence);
    const bool is_number = here && std::isfinite(here->number);
    const bool is_left_out = evidence.result.plan.quick && !is_of_variants(measures[i]);
    if (here && !is_number && !is_left_out) finding.reason = "nothing was drawn";
    if (!is_number) break;
    texts.push_back(row.text(here->number));
    if (!here->detail.empty()) detail = " (" + here->detail + ")";
    if (here->geometric_mean) detail = " (geometric mean " + row.text(*here->geometric_mean) + ")";
    if (row.published.empty()) continue;
    const std::optional<double> difference = difference_percent(row.published[i], here->number);
    const Verdict verdict = judge(row.relation, row.published[i], row.tolerance_percent, here->number);
    if (finding.verdict != Verdict::differs) finding.verdict = verdict;
    if (finding.number && std::fabs(*difference) <= std::fabs(*finding.difference_percent)) continue;
    finding.number = here->number;
    finding.difference_percent = difference;
  }
  if (texts.size() == measures.size()) {
    finding.measured = fmt::format("{}{}", fmt::join(texts, " / "), texts.size() == 1 ? detail : "");
  }
  if (!row.holds.empty()) check_conditions(evidence, finding);
  if (!row.is_judged()) finding.verdict = row.unjudged;
  return finding;
}

RowFinding row_with(const TrialFinding& trial, const PaperRow& row, const ReproduceResult& result) {
  const std::vector<SceneFinding> no_large;
  return measured_row(row, row.measures, {result, trial.scenes, no_large});
}

/// Whether what was tried gives the row, or at least half of what is missing.
bool explains(const RowFinding& tried, const RowFinding& without) {
  if (tried.verdict == Verdict::agrees) return true;
  if (tried.row->relation == Relation::claim) return tried.exceptions.size() < without.exceptions.size();
  const auto missing = [](const RowFinding& of) {
    return distance(of.row->relation, of.row->number(), of.number.value_or(std::nan("")));
  };
  return missing(tried) <= missing(without) / 2;
}

/// Nothing where it is not tried: in a quick look, and where the platform does not know the setting.
std::optional<TriedReason> try_reason(const RowReason& reason, const RowFinding& finding,
                                      const std::vector<RowFinding>& rows, const ReproduceResult& result,
                                      const Findings& findings) {
  const PaperRow& row = *finding.row;
  if (!reason.measure.empty()) {
    const RowFinding other = measured_row(row, {reason.measure}, {result, findings.scenes, findings.large});
    return TriedReason{&reason, other.short_text(), explains(other, finding)};
  }
  if (!reason.row.empty()) {
    const RowFinding& other =
        *std::find_if(rows.begin(), rows.end(), [&](const RowFinding& each) { return each.row->id == reason.row; });
    const double sides = other.difference_percent.value_or(0) * finding.difference_percent.value_or(0);
    return TriedReason{&reason, other.short_text(), other.verdict == Verdict::differs && sides > 0};
  }
  const TrialFinding* const tried = findings.trial(reason.setting);
  if (tried == nullptr) return std::nullopt;
  const RowFinding with = row_with(*tried, row, result);
  const RowFinding without = row_with(*findings.trial(""), row, result);
  return TriedReason{&reason, with.short_text(), explains(with, without)};
}

/// Where it does not hold, what is shown to be the reason, and what was tried in vain.
std::string reason_text(const RowFinding& finding, bool is_quick) {
  std::vector<std::string> parts, vain;
  if (!finding.exceptions.empty()) parts.push_back(finding.short_text());
  const std::size_t before = parts.size();
  for (const TriedReason& tried : finding.tried) {
    const RowReason& by = *tried.reason;
    const std::string found = by.setting.empty() ? tried.measured : by.setting + ": " + tried.measured;
    (tried.is_shown ? parts : vain).push_back(fmt::format("{} ({})", by.text, found));
  }
  if (parts.size() == before) {
    const bool is_untried = is_quick && finding.tried.size() < finding.row->reasons.size();
    parts.emplace_back(is_untried ? "reasons are not tried in a quick look" : "no reason is known");
  }
  if (!vain.empty()) parts.push_back(fmt::format("tried in vain: {}", fmt::join(vain, ", ")));
  return fmt::format("{}", fmt::join(parts, "; "));
}

}  // namespace

std::string RowFinding::short_text() const {
  if (number) return row->text(*number);
  return exceptions.empty() ? "so in all" : fmt::format("not so in {}", fmt::join(exceptions, ", "));
}

std::vector<RowFinding> find_rows(const ReproduceResult& result, const Findings& findings) {
  std::vector<RowFinding> rows;
  for (const PaperRow& row : result.plan.rows) {
    RowFinding finding = measured_row(row, row.measures, {result, findings.scenes, findings.large});
    if (!row.is_judged()) {
      finding.reason = row.why;
    } else if (finding.verdict == Verdict::cannot_say && finding.reason.empty()) {
      finding.reason = result.plan.quick ? "not in a quick look" : "there is nothing to measure it by";
    }
    rows.push_back(std::move(finding));
  }
  for (RowFinding& finding : rows) {
    if (finding.verdict != Verdict::differs) continue;
    for (const RowReason& reason : finding.row->reasons) {
      std::optional<TriedReason> tried = try_reason(reason, finding, rows, result, findings);
      if (tried) finding.tried.push_back(std::move(*tried));
    }
    finding.reason = reason_text(finding, result.plan.quick);
  }
  return rows;
}

std::vector<RowFinding> find_rows_with(const TrialFinding& trial, const ReproduceResult& result) {
  std::vector<RowFinding> rows;
  for (const PaperRow& row : result.plan.rows) {
    if (!row.is_judged() || !row.is_of_variants()) continue;
    RowFinding finding = row_with(trial, row, result);
    if (finding.verdict != Verdict::cannot_say) rows.push_back(std::move(finding));
  }
  return rows;
}

}  // namespace vrpipe::tools
