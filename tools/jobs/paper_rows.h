#pragma once

#include <optional>
#include <string>
#include <vector>

namespace vrpipe::tools {

/// How a measured number is to stand to the paper's. `claim`: the paper makes a statement without a number.
enum class Relation { about, at_most, at_least, above, claim };

enum class Verdict { agrees, differs, cannot_say };
const char* name_of(Verdict verdict);

/// A number of the paper, or a statement that it makes.
struct PaperRow {
  const char* id;  ///< R1 to R32; C1 to C13: directions, without a number in the text
  const char* value;
  const char* where;  ///< section of the paper
  const char* what;   ///< it is of
  const char* how;    ///< it is measured here; or what is missing for it
  Relation relation = Relation::claim;
  double number = 0;
  double tolerance_percent = 0;  ///< within which numbers agree
  bool is_within_reach = true;   ///< of what is modelled here
};

/// Of R12 and R13, which is not how energy is simulated here.
const char* paper_energy_method();

/// R1 to R32, then C1 to C13, in order.
const std::vector<PaperRow>& paper_rows();
/// Throws std::logic_error for one that there is not.
const PaperRow& paper_row(const std::string& id);

/// Whether a measured number stands to the paper's as the row wants.
Verdict judge(Relation relation, double paper, double tolerance_percent, double measured);

/// Of a measured number, percent of the paper's; none where the paper's is 0.
std::optional<double> difference_percent(double paper, double measured);

}  // namespace vrpipe::tools
