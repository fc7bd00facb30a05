#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/arguments.h"
#include "jobs/simulation_job.h"

namespace vrpipe::tools {

/// The options that look at a run in its course, as typed: intervals, traces, logs and heat maps.
class TimeArguments {
 public:
  /// @param of_one_run  also those that write what one run does
  void declare(Arguments& arguments, const std::string& group, bool of_one_run);
  /// An option that is given, to be named where none of them can be; empty for none.
  std::string any_given() const;
  /// The same, but for what a variant that draws outside the pipeline may have as well.
  std::string any_of_units() const;
  bool heat_maps() const { return heat_maps_; }
  /// Adds observers to the requests of a job, and says what they write. Its other members are final. Throws UserError.
  void observe(SimulationJob& job) const;

 private:
  std::optional<Cycle> every() const;
  void record(RunRequest& request, Cycle every) const;

  Values interval_, interval_csv_, interval_statistics_;
  Values trace_, log_, log_file_, until_;
  bool heat_maps_ = false;
};

}  // namespace vrpipe::tools
