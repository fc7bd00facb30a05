#pragma once

#include <optional>
#include <string>
#include <vector>

#include "jobs/reproduce_findings.h"

namespace vrpipe::tools {

/// What rows are computed from: `scenes` and `large` are the run's own, or those of a setting that is tried.
struct Evidence {
  const ReproduceResult& result;
  const std::vector<SceneFinding>& scenes;
  const std::vector<SceneFinding>& large;

  const std::string& name_of(const SceneFinding& scene) const { return result.plan.scenes[scene.scene].name; }
  /// Null where it was not simulated.
  const SceneFinding* scene(const std::string& name) const;
};

/// A number of each scene, by the name that paper_rows.toml has for it.
struct Quantity {
  std::string name;
  double (*of)(const SceneFinding&);  ///< NaN where there is none
  bool is_of_variants;                ///< the runs of the four are all it takes, so that settings can be tried on it
};
const std::vector<Quantity>& quantities();
/// Null for a name that is none.
const Quantity* find_quantity(const std::string& name);

/// The measures of rows are, of a quantity, `mean` over the six scenes, `most` and `least` of them, or SCENE's; and of a
/// microbenchmark `NAME: FIGURE`.
struct Measured {
  double number = 0;   ///< NaN where nothing was drawn
  std::string detail;  ///< of which scene it is
  std::optional<double> geometric_mean;
};
bool is_measure(const std::string& name);
bool is_of_variants(const std::string& measure);
/// Of these but SCENE's.
std::vector<std::string> measure_names();
/// Nothing where it was not simulated.
std::optional<Measured> measure(const std::string& name, const Evidence& of);

}  // namespace vrpipe::tools
