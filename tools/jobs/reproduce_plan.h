#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/camera.h>
#include <vrpipe/workloads/scene_substitution.h>

#include "jobs/paper_rows.h"
#include "jobs/sensitivity_table.h"

namespace vrpipe::tools {

/// What of a scene's image is drawn.
enum class Extent {
  full,
  column,  ///< the eighth of the width that is in the middle, as it is in the whole
  half,    ///< all of it, in half the pixels a side, so that splats are smaller
  quarter
};
const char* name_of(Extent extent);

/// A scene that stands for one of the paper's, or is looked at beside them.
struct PlannedScene {
  enum class Role {
    six,    ///< of the paper's six, which its means are of
    large,  ///< Building, Rubble
    beside  ///< of the user's own: in no row, but beside the six where variants and settings are compared
  };
  std::string name;                   ///< of the built-in one, without "builtin:", or the user's
  std::string request;                ///< SceneRequest::scene: builtin:NAME, NAME=FILE, or of the user's own FILE
  std::optional<std::string> camera;  ///< SceneRequest::camera
  Role role = Role::six;
};

/// What tells one simulation from the others.
struct PointKey {
  std::size_t scene = 0;  ///< in ReproducePlan::scenes
  Extent extent = Extent::full;
  std::size_t view = 0;  ///< 0: the scene's own camera
  unsigned passes = 1;
  Fidelity fidelity = Fidelity::cycle;
  std::string settings;              ///< as SensitivityParameter::values
  std::string variant = "baseline";  ///< or imitated_variant

  /// The baseline that imitates HET+QM, as the paper measured energy (Imitation).
  static constexpr const char* imitated_variant = "imitation";

  std::string name(const std::vector<PlannedScene>& scenes) const;
};

struct ReproducePoint {
  PointKey key;
  RunRequest request;
  bool with_map = false;  ///< fragments blended are counted for each pixel
};

/// A setting that is not tried, since the platform does not know it.
struct SkippedSetting {
  std::string settings;
  std::string reason;
};

struct ReproduceOptions {
  bool quick = false;
  std::optional<std::size_t> views;                          ///< of each scene; none: as many as there is time for
  std::vector<std::pair<std::string, std::string>> cameras;  ///< scene and SceneRequest::camera
  Lenses lenses = Lenses::as_written;                        ///< of these
  std::vector<std::string> substitutions;                    ///< NAME=FILE
  std::vector<SceneSubstitution> beside;                     ///< of names that no scene of the paper has
  std::vector<PaperRow> rows = paper_rows();
  RunRequest base;                   ///< platform, settings and so on of every point
  std::optional<Fidelity> fidelity;  ///< of the main comparison; none: as exact as there is time for
};

/// Everything that `reproduce` simulates, in the order in which it does.
struct ReproducePlan {
  std::vector<PlannedScene> scenes;  ///< the paper's six, the large ones, which a quick look leaves out, those beside
  std::vector<std::size_t> studied;  ///< scenes of Breadth::headline
  std::size_t indoor = 0;            ///< the scene of efficiency_settings()
  std::size_t column = 0;            ///< the scene of Breadth::open
  bool quick = false;
  std::size_t views = 0;  ///< of each of the six scenes
  Fidelity fidelity = Fidelity::cycle;
  std::vector<ReproducePoint> points;
  std::map<std::string, std::size_t> places;     ///< of the points, by the names of their keys
  std::vector<SensitivityParameter> parameters;  ///< that are varied, with the values that the platform knows
  std::vector<std::string> fragment_settings;    ///< that could move fragments a quad
  std::vector<PaperRow> rows;
  /// The default, front_ends() if it is the paper's GPU, and the settings of reasons, with which rows are judged again; none in a quick look.
  std::vector<std::string> trials;
  std::vector<SkippedSetting> skipped;

  /// The scenes of a parameter's points, and what of them is drawn.
  std::vector<std::size_t> scenes_of(Breadth breadth) const;
  static Extent extent_of(Breadth breadth);
  std::vector<std::size_t> scenes_of(PlannedScene::Role role) const;
};

/// Of the sensitivity; a few of its points are repeated at the fidelity of the main comparison.
constexpr Fidelity sensitivity_fidelity = Fidelity::lt;
/// Settings of those.
const std::vector<std::string>& checked_settings();
/// What could keep HET+QM from what its quads suggest, tried on an indoor scene, which CROP bounds; not in a quick look.
const std::vector<std::string>& efficiency_settings();
/// Of the paper's GPU, settings of each: what its text leaves open, and what the simulator has that it changed.
const std::vector<std::string>& front_ends();
/// Beside one.
const std::vector<unsigned>& planned_passes(bool quick);

/// Throws UserError.
ReproducePlan plan_reproduction(const ReproduceOptions& options);

}  // namespace vrpipe::tools
