#include "jobs/reproduce_findings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "jobs/paper_rows.h"

namespace vrpipe::tools {
namespace {

double quotient(std::uint64_t over, std::uint64_t under) {
  if (under == 0) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(over) / static_cast<double>(under);
}

double gain(const RunResult& baseline, const RunResult& run) {
  return baseline.counts.fragments_rasterized == 0 ? std::numeric_limits<double>::quiet_NaN()
                                                   : quotient(baseline.cycles.value_or(0), run.cycles.value_or(0));
}

std::vector<double> each(const std::vector<Gains>& all, double Gains::*what) {
  std::vector<double> values;
  for (const Gains& gains : all) values.push_back(gains.*what);
  return values;
}

std::array<const PointResult*, 4> runs_of(const ReproduceResult& result, PointKey key) {
  std::array<const PointResult*, 4> runs{};
  constexpr std::array<const char*, 4> variants{"baseline", "qm", "het", "het+qm"};
  for (std::size_t i = 0; i < runs.size(); ++i) {
    key.variant = variants[i];
    runs[i] = &result.at(key);
  }
  return runs;
}

Gains gains_of(const std::array<const PointResult*, 4>& points) {
  const RunResult& baseline = points[0]->run;
  const RunResult& qm = points[1]->run;
  const RunResult& het = points[2]->run;
  const RunResult& both = points[3]->run;
  Gains gains;
  gains.qm = gain(baseline, qm);
  gains.het = gain(baseline, het);
  gains.het_qm = gain(baseline, both);
  gains.fragments_het = quotient(baseline.counts.fragments_blended, het.counts.fragments_blended);
  gains.fragments_het_in_time =
      quotient(baseline.counts.fragments_blended, het.counts.fragments_blended - points[2]->fragments_blended_late);
  gains.fragments_merging = quotient(het.counts.fragments_blended, both.counts.fragments_blended);
  // Of the second quads' fragments those on a live front are gone already.
  gains.fragments_merging_whole =
      quotient(het.counts.fragments_blended,
               both.counts.fragments_blended + both.counts.fragments_merged - points[3]->fragments_of_back_quads);
  gains.quads_het = quotient(baseline.counts.quads_blended, het.counts.quads_blended);
  gains.quads_merging = quotient(het.counts.quads_blended, both.counts.quads_blended);
  gains.quads_qm = quotient(baseline.counts.quads_blended, qm.counts.quads_blended);
  gains.lanes_baseline = quotient(baseline.counts.fragments_blended, baseline.counts.quads_blended);
  gains.lanes_het = quotient(het.counts.fragments_blended, het.counts.quads_blended);
  return gains;
}

double ratio_of(const ReproduceResult& result, PointKey key) {
  key.fidelity = Fidelity::functional;
  key.variant = "baseline";
  const std::uint64_t without = result.at(key).run.counts.fragments_blended;
  key.variant = "het";
  return quotient(without, result.at(key).run.counts.fragments_blended);
}

SceneFinding gains_finding(const ReproduceResult& result, std::size_t scene, Fidelity fidelity,
                           const std::string& settings) {
  PointKey key;
  key.scene = scene;
  key.fidelity = fidelity;
  key.settings = settings;
  SceneFinding finding;
  finding.scene = scene;
  finding.runs = runs_of(result, key);
  finding.gains = gains_of(finding.runs);
  return finding;
}

SceneFinding scene_finding(const ReproduceResult& result, std::size_t scene) {
  const ReproducePlan& plan = result.plan;
  SceneFinding finding = gains_finding(result, scene, plan.fidelity, "");
  if (plan.scenes[scene].role != PlannedScene::Role::six) return finding;
  PointKey key;
  key.scene = scene;
  std::vector<std::optional<double>> ratios;
  for (key.view = 0; key.view < plan.views; ++key.view) {
    finding.ratios.push_back(ratio_of(result, key));
    if (std::isfinite(finding.ratios.back())) ratios.emplace_back(finding.ratios.back());
  }
  key.view = 0;
  finding.ratio_distribution = distribution_of(ratios);
  finding.ratio_mean = mean_of(finding.ratios).arithmetic;
  key.fidelity = Fidelity::functional;
  key.variant = "baseline";
  finding.map_without = &result.at(key);
  key.variant = "het";
  finding.map_with = &result.at(key);
  key.fidelity = sensitivity_fidelity;
  const RunResult& het = result.at(key).run;
  key.variant = "baseline";
  const RunResult& one_pass = result.at(key).run;
  finding.het_beside_passes = gain(one_pass, het);
  if (!plan.quick) {
    key.variant = "in-shader";
    finding.in_shader = gain(result.at(key).run, one_pass);
    key.variant = "in-shader-no-lock";
    finding.in_shader_no_lock = gain(result.at(key).run, one_pass);
    key.variant = PointKey::imitated_variant;
    const std::optional<EnergyAmounts>& imitated = result.at(key).energy;
    key.variant = "baseline";
    const std::optional<EnergyAmounts>& baseline = result.at(key).energy;
    if (baseline && imitated) finding.imitated_efficiency = energy_ratio(*baseline, *imitated, shipped_energies());
  }
  key.variant = "baseline";
  for (const unsigned passes : planned_passes(plan.quick)) {
    key.passes = passes;
    finding.passes.push_back(gain(one_pass, result.at(key).run));
  }
  if (scene < result.frames.size() && result.frames[scene]) finding.frame = &*result.frames[scene];
  return finding;
}

StudyPoint study(const ReproduceResult& result, const std::vector<std::size_t>& scenes, Extent extent,
                 Fidelity fidelity, const std::string& settings) {
  std::vector<Gains> all;
  std::vector<double> both;
  for (const std::size_t scene : scenes) {
    PointKey key;
    key.scene = scene;
    key.extent = extent;
    key.fidelity = fidelity;
    key.settings = settings;
    all.push_back(gains_of(runs_of(result, key)));
    both.push_back(all.back().quads_het * all.back().quads_merging);
  }
  StudyPoint point;
  point.settings = settings;
  point.qm = mean_of(each(all, &Gains::qm));
  point.het = mean_of(each(all, &Gains::het));
  point.het_qm = mean_of(each(all, &Gains::het_qm));
  for (const Gains& gains : all) point.qm_best = std::max(point.qm_best, gains.qm);
  point.quads_het = mean_of(each(all, &Gains::quads_het)).arithmetic;
  point.quads_het_qm = mean_of(both).arithmetic;
  return point;
}

void find_sensitivity(const ReproduceResult& result, Findings& findings) {
  const ReproducePlan& plan = result.plan;
  const auto at = [&](Breadth breadth, const std::string& settings) {
    return study(result, plan.scenes_of(breadth), ReproducePlan::extent_of(breadth), sensitivity_fidelity, settings);
  };
  findings.efficiency.push_back(at(Breadth::headline, ""));
  for (const SensitivityParameter& parameter : plan.parameters) {
    SensitivityFinding finding{parameter, at(parameter.breadth, ""), {}, 0};
    double least = finding.at_default.het_qm.arithmetic, greatest = least;
    for (const std::string& value : parameter.values) {
      finding.values.push_back(at(parameter.breadth, value));
      least = std::min(least, finding.values.back().het_qm.arithmetic);
      greatest = std::max(greatest, finding.values.back().het_qm.arithmetic);
      if (parameter.breadth == Breadth::headline) findings.efficiency.push_back(finding.values.back());
    }
    finding.spread_percent = 100 * (greatest - least) / finding.at_default.het_qm.arithmetic;
    findings.sensitivity.push_back(std::move(finding));
  }
  for (const std::string& settings : efficiency_settings()) {
    PointKey key;
    key.scene = plan.indoor;
    key.fidelity = sensitivity_fidelity;
    key.settings = settings;
    key.variant = "het+qm";
    if (plan.places.count(key.name(plan.scenes)) == 0) continue;
    findings.indoor_efficiency.push_back(study(result, {plan.indoor}, Extent::full, sensitivity_fidelity, settings));
  }
  std::stable_sort(findings.sensitivity.begin(), findings.sensitivity.end(),
                   [](const auto& a, const auto& b) { return a.spread_percent > b.spread_percent; });
  if (plan.quick || plan.fidelity == sensitivity_fidelity) return;
  for (const std::string& settings : checked_settings()) {
    PointKey key;
    key.scene = plan.column;
    key.fidelity = sensitivity_fidelity;
    key.settings = settings;
    if (plan.places.count(key.name(plan.scenes)) == 0) continue;
    const std::vector<std::size_t> one{plan.column};
    findings.checks.push_back({settings, study(result, one, Extent::full, sensitivity_fidelity, settings),
                               study(result, one, Extent::full, plan.fidelity, settings)});
  }
}

FragmentFinding fragment_finding(const ReproduceResult& result, const std::vector<std::size_t>& scenes,
                                 const std::string& name, const PointKey& of) {
  std::vector<double> fragments, quads, in_time;
  for (const std::size_t scene : scenes) {
    PointKey key = of;
    key.scene = scene;
    key.variant = "baseline";
    const Counts& without = result.at(key).run.counts;
    key.variant = "het";
    const PointResult& het = result.at(key);
    const Counts& with = het.run.counts;
    in_time.push_back(quotient(without.fragments_blended, with.fragments_blended - het.fragments_blended_late));
    fragments.push_back(quotient(without.fragments_blended, with.fragments_blended));
    quads.push_back(quotient(without.quads_blended, with.quads_blended));
  }
  FragmentFinding finding;
  finding.settings = name;
  finding.fragments = mean_of(fragments).arithmetic;
  finding.fragments_in_time = mean_of(in_time).arithmetic;
  finding.quads = mean_of(quads).arithmetic;
  finding.fall_percent = 100 * (1 - finding.quads / finding.fragments);
  finding.fall_percent_in_time = 100 * (1 - finding.quads / finding.fragments_in_time);
  return finding;
}

void find_fragments(const ReproduceResult& result, Findings& findings) {
  const ReproducePlan& plan = result.plan;
  const std::vector<std::size_t> six = plan.scenes_of(PlannedScene::Role::six);
  const std::vector<std::size_t> beside = plan.scenes_of(PlannedScene::Role::beside);
  PointKey key;
  key.fidelity = plan.fidelity;
  const auto add = [&](const std::vector<std::size_t>& scenes, const std::string& name) {
    findings.fragments.push_back(fragment_finding(result, scenes, name, key));
  };
  add(six, "main comparison");
  key.fidelity = Fidelity::functional;
  add(six, "no late updates (functional)");
  if (!plan.quick) {
    key.extent = Extent::half;
    add(six, "smaller splats: images of half the width");
    key.extent = Extent::quarter;
    add(six, "smaller splats: images of a quarter of the width");
  }
  key.extent = Extent::full;
  for (const std::size_t scene : six) add({scene}, plan.scenes[scene].name + " alone");
  key.fidelity = plan.fidelity;
  for (const std::size_t scene : beside) add({scene}, plan.scenes[scene].name + " beside the six");
  key.fidelity = Fidelity::functional;
  if (plan.studied.size() > 1) add(plan.studied, "the scenes of what follows");
  for (const std::string& settings : plan.fragment_settings) {
    key.settings = settings;
    add(plan.studied, settings);
  }
  key.fidelity = sensitivity_fidelity;
  for (const std::string& settings : plan.trials) {
    key.settings = settings;
    const std::string with = settings.empty() ? " at lt" : " with " + settings;
    add(six, "the six scenes" + with);
    for (const std::size_t scene : beside) add({scene}, plan.scenes[scene].name + with);
  }
}

void find_trials(const ReproduceResult& result, Findings& findings) {
  const std::vector<std::size_t> six = result.plan.scenes_of(PlannedScene::Role::six);
  for (const std::string& settings : result.plan.trials) {
    const auto all = [&](const std::vector<std::size_t>& scenes) {
      std::vector<SceneFinding> gains;
      for (const std::size_t scene : scenes) {
        gains.push_back(gains_finding(result, scene, sensitivity_fidelity, settings));
      }
      return gains;
    };
    findings.trials.push_back({settings, all(six), all(result.plan.scenes_of(PlannedScene::Role::beside)),
                               study(result, six, Extent::full, sensitivity_fidelity, settings)});
  }
}

}  // namespace

Mean mean_of(const std::vector<double>& values) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::optional<double>> there;
  for (const double value : values) {
    if (!std::isfinite(value) || value <= 0) return {nan, nan};
    there.emplace_back(value);
  }
  if (values.empty()) return {nan, nan};
  return {std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size()),
          distribution_of(there)->geometric_mean};
}

FrameTimes frame_times(const SceneFinding& scene, WholeFrame::Preparation WholeFrame::*by) {
  FrameTimes times;
  if (scene.frame == nullptr || !scene.runs[0]->run.cycles) return times;
  const WholeFrame::Preparation& prepared = scene.frame->*by;
  times.draw = scene.runs[0]->run.milliseconds;
  times.software = scene.frame->software(prepared);
  times.hardware = prepared.hardware() + times.draw;
  times.het_qm = prepared.hardware() + scene.runs[3]->run.milliseconds;
  times.before_render = times.software - scene.frame->render;
  times.before_draw = prepared.hardware();
  return times;
}

const TrialFinding* Findings::trial(const std::string& settings) const {
  const auto at =
      std::find_if(trials.begin(), trials.end(), [&](const auto& each) { return each.settings == settings; });
  return at == trials.end() ? nullptr : &*at;
}

double paper_het_efficiency() { return paper_row("R4").number() / paper_row("R7").number(); }
double paper_het_qm_efficiency() {
  return paper_row("R2").number() / (paper_row("R7").number() * paper_row("R8").number());
}
double paper_fragment_fall_percent() { return 100 * (1 - paper_row("R7").number() / paper_row("R5").number()); }

Findings find(const ReproduceResult& result) {
  const ReproducePlan& plan = result.plan;
  Findings findings;
  for (std::size_t scene = 0; scene < plan.scenes.size(); ++scene) {
    switch (plan.scenes[scene].role) {
      case PlannedScene::Role::six: findings.scenes.push_back(scene_finding(result, scene)); break;
      case PlannedScene::Role::large:
        if (!plan.quick) findings.large.push_back(scene_finding(result, scene));
        break;
      case PlannedScene::Role::beside: findings.beside.push_back(scene_finding(result, scene)); break;
    }
  }
  findings.main = study(result, plan.scenes_of(PlannedScene::Role::six), Extent::full, plan.fidelity, "");
  find_sensitivity(result, findings);
  find_fragments(result, findings);
  find_trials(result, findings);
  return findings;
}

}  // namespace vrpipe::tools
