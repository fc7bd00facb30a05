#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "jobs/distribution.h"
#include "jobs/reproduce_job.h"

namespace vrpipe::tools {

// What the points of a reproduction say, computed from them alone. A number that there is not, as of a scene of which
// nothing is visible, is NaN.

/// Of one quantity over several scenes. The paper does not say which of the two its means are.
struct Mean {
  double arithmetic = 0, geometric = 0;
};
Mean mean_of(const std::vector<double>& values);

/// What the variants of one scene gain over its baseline, and over one another.
struct Gains {
  double qm = 0, het = 0, het_qm = 0;               ///< speed-ups
  double fragments_het = 0, fragments_merging = 0;  ///< blended: baseline over HET, HET over HET+QM
  double fragments_het_in_time = 0;                 ///< the former without fragments that were tested too early
  double fragments_merging_whole = 0;               ///< the latter, were all fragments of a pair's second quad gone
  double quads_het = 0, quads_merging = 0, quads_qm = 0;  ///< likewise; the last: baseline over QM
  double lanes_baseline = 0, lanes_het = 0;               ///< fragments of a blended quad
};

struct SceneFinding {
  std::size_t scene = 0;                     ///< in the plan
  std::array<const PointResult*, 4> runs{};  ///< baseline, qm, het, het+qm
  Gains gains;
  std::vector<double> ratios;  ///< early-termination ratios, by view; of the six
  std::optional<Distribution> ratio_distribution;
  double ratio_mean = 0;  ///< arithmetic
  const PointResult *map_without = nullptr, *map_with = nullptr;
  std::vector<double> passes;  ///< speed-ups of planned_passes() over one pass
  double het_beside_passes = 0;
  /// Time of the draw where the shader blends, with an ordered lock and without one, over the baseline's; NaN in a quick look.
  double in_shader = std::numeric_limits<double>::quiet_NaN();
  double in_shader_no_lock = std::numeric_limits<double>::quiet_NaN();
  /// Energy of the baseline over that of its imitation of HET+QM, by shipped_energies(); none in a quick look.
  std::optional<Range> imitated_efficiency;
  const WholeFrame* frame = nullptr;  ///< null where there is none
};

/// Milliseconds of a scene's whole frames; NaN where they are unknown.
struct FrameTimes {
  double software = std::numeric_limits<double>::quiet_NaN();
  double hardware = software, het_qm = software;  ///< the baseline's draw, and HET+QM's, with what comes before
  double before_render = software, before_draw = software;  ///< what comes first, lists included
  double draw = software;                                   ///< the baseline's
};
/// @param by  what is done before the draw: `measured` or `papers`
FrameTimes frame_times(const SceneFinding& scene, WholeFrame::Preparation WholeFrame::*by);

/// Mean gains at a setting.
struct StudyPoint {
  std::string settings;  ///< empty: the default
  Mean qm, het, het_qm;
  double qm_best = 0;
  double quads_het = 0, quads_het_qm = 0;  ///< arithmetic means of the baseline's quads over theirs
  /// Mean speed-up over mean reduction of quads.
  double het_efficiency() const { return het.arithmetic / quads_het; }
  double het_qm_efficiency() const { return het_qm.arithmetic / quads_het_qm; }
};

struct SensitivityFinding {
  SensitivityParameter parameter;
  StudyPoint at_default;  ///< at the parameter's base
  std::vector<StudyPoint> values;
  double spread_percent = 0;  ///< greatest less least mean speed-up of HET+QM, of that at the default
};

/// A point of the sensitivity at its fidelity, and at that of the main comparison.
struct CheckFinding {
  std::string settings;
  StudyPoint quick, exact;
};

/// How fragments and quads fall under HET.
struct FragmentFinding {
  std::string settings;             ///< or the extent
  double fragments = 0, quads = 0;  ///< arithmetic means of the baseline's over HET's
  double fragments_in_time = 0;     ///< the first without those that HET blends late
  double fall_percent = 0;          ///< of fragments a blended quad
  double fall_percent_in_time = 0;  ///< the same of those in time, over all quads
};

/// What one of ReproducePlan::trials gives: gains alone.
struct TrialFinding {
  std::string settings;
  std::vector<SceneFinding> scenes, beside;  ///< the six, and the user's own
  StudyPoint means;                          ///< of the six
};

struct Findings {
  std::vector<SceneFinding> scenes;             ///< the six
  std::vector<SceneFinding> large;              ///< none in a quick look
  std::vector<SceneFinding> beside;             ///< of the user's own, gains alone
  std::vector<SensitivityFinding> sensitivity;  ///< the greatest spread first
  std::vector<CheckFinding> checks;
  StudyPoint main;                            ///< the six at the main fidelity
  std::vector<StudyPoint> efficiency;         ///< of the studied scenes; the default first
  std::vector<StudyPoint> indoor_efficiency;  ///< of the indoor scene, likewise
  std::vector<FragmentFinding> fragments;     ///< the main comparison, then what could move it
  std::vector<TrialFinding> trials;           ///< as ReproducePlan::trials

  /// Null where it was not simulated.
  const TrialFinding* trial(const std::string& settings) const;
};

Findings find(const ReproduceResult& result);

/// The paper's, for StudyPoint's efficiencies: R4 over R7, R2 over R7 x R8.
double paper_het_efficiency();
double paper_het_qm_efficiency();
/// Of fragments a blended quad under HET, percent: 1 - R7 / R5.
double paper_fragment_fall_percent();

}  // namespace vrpipe::tools
