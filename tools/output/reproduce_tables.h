#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "jobs/reproduce_findings.h"
#include "jobs/reproduce_rows.h"

namespace vrpipe::tools {

/// Everything that is reported, whatever it is printed on.
struct Reproduction {
  const ReproduceResult& result;
  Findings findings;
  std::vector<RowFinding> rows;

  /// Rows judged with one of front_ends().
  struct FrontEnd {
    std::string name, settings;
    StudyPoint means;  ///< of the six scenes
    std::vector<RowFinding> rows;
    std::size_t agree() const;
  };
  std::vector<FrontEnd> front_ends;
};
/// From the points alone.
Reproduction reproduction_of(const ReproduceResult& result);

/// A table of the report.
struct ReportTable {
  std::string title;
  std::vector<std::string> heading;
  std::vector<std::vector<std::string>> rows;  ///< as many cells as the heading has
  std::string note;                            ///< below it; may be empty
};

ReportTable scenes_table(const Reproduction& of);
ReportTable front_ends_table(const Reproduction& of);
ReportTable blended_table(const Reproduction& of);
ReportTable utilization_table(const Reproduction& of);
ReportTable ratios_table(const Reproduction& of);
ReportTable maps_table(const Reproduction& of);
ReportTable passes_table(const Reproduction& of);
ReportTable frames_table(const Reproduction& of);
ReportTable large_table(const Reproduction& of);
ReportTable cost_table(const Reproduction& of);
ReportTable microbench_table(const Reproduction& of);
ReportTable sensitivity_table(const Reproduction& of);
ReportTable checks_table(const Reproduction& of);
ReportTable fragments_table(const Reproduction& of);
ReportTable efficiency_table(const Reproduction& of);
/// All of them, in the order of the report.
std::vector<ReportTable> all_tables(const Reproduction& of);

/// What was simulated, and what was left out; one sentence each.
std::vector<std::string> reproduction_heading(const Reproduction& of);
/// How many of the rows that could have failed agree, and what the others are.
std::string verdict_summary(const Reproduction& of);
/// The verdict of a row, which says where it is one on a reduced size.
std::string verdict_text(const Reproduction& of, const RowFinding& row);
std::string difference_text(const RowFinding& row);
/// Why it differs or is not judged, else how it was measured.
std::string why_text(const RowFinding& row);
/// Settings, or what stands for none.
std::string settings_text(const std::string& settings);
/// Whether a study point's efficiencies are both near the paper's.
bool fits_both(const StudyPoint& point);
/// Percentage points that are near.
constexpr double near_points = 4;

}  // namespace vrpipe::tools
