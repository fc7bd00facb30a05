#pragma once

#include <optional>
#include <string>
#include <vector>

#include "jobs/paper_rows.h"
#include "jobs/reproduce_findings.h"

namespace vrpipe::tools {

/// What came of a reason that was tried.
struct TriedReason {
  const RowReason* reason = nullptr;
  std::string measured;  ///< with it
  bool is_shown = false;
};

/// A row of the paper beside what was measured.
struct RowFinding {
  const PaperRow* row = nullptr;
  std::string measured;                      ///< empty: nothing
  std::optional<double> number;              ///< of several the one that is the farthest from the paper's
  std::optional<double> difference_percent;  ///< of the paper's
  std::vector<std::string> exceptions;       ///< where a statement does not hold
  Verdict verdict = Verdict::cannot_say;
  std::vector<TriedReason> tried;  ///< where it differs
  std::string reason;              ///< where it differs or is not judged

  /// What was found, in a few words.
  std::string short_text() const;
};

/// Every row of the plan, in its order. The plan outlives them.
std::vector<RowFinding> find_rows(const ReproduceResult& result, const Findings& findings);

/// Those that settings can be tried on, judged with a trial's.
std::vector<RowFinding> find_rows_with(const TrialFinding& trial, const ReproduceResult& result);

}  // namespace vrpipe::tools
