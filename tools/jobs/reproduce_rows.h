#pragma once

#include <optional>
#include <string>
#include <vector>

#include "jobs/paper_rows.h"
#include "jobs/reproduce_findings.h"

namespace vrpipe::tools {

/// A row of the paper beside what was measured.
struct RowFinding {
  const PaperRow* row = nullptr;
  std::string measured;                      ///< empty: nothing
  std::optional<double> number;              ///< what is judged
  std::optional<double> difference_percent;  ///< of the paper's
  Verdict verdict = Verdict::cannot_say;
  std::string reason;  ///< where it differs, cannot be said, or is by design
};

/// Every row, in the order of the paper_rows().
std::vector<RowFinding> find_rows(const ReproduceResult& result, const Findings& findings);

}  // namespace vrpipe::tools
