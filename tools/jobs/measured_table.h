#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace vrpipe::tools {

/// A row of measurements, its cells by column.
class MeasuredRow {
 public:
  explicit MeasuredRow(std::map<std::string, std::string> cells) : cells_(std::move(cells)) {}

  /// Throws std::logic_error for a column that there is not.
  const std::string& text(const std::string& column) const;
  double number(const std::string& column) const;
  unsigned count(const std::string& column) const;

 private:
  std::map<std::string, std::string> cells_;
};

/// Of tools/jobs/measured/NAME.csv; that folder's README says how each was measured. Throws std::logic_error if there is none.
const std::vector<MeasuredRow>& measured_table(const std::string& name);

/// The file itself, as it was when this was configured; null if there is none.
const char* measured_text(const std::string& name);

}  // namespace vrpipe::tools
