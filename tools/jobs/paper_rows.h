#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vrpipe::tools {

// What the paper says, as data: paper_rows.toml, which says what each key means.

/// How a measured number is to stand to the paper's. `claim`: the paper makes a statement without a number.
enum class Relation : std::uint8_t { about, at_most, at_least, above, claim };

/// The last three are of rows that are not judged, since they could not be found to be otherwise.
enum class Verdict : std::uint8_t { agrees, differs, cannot_say, input, cannot_fail, not_modelled };
const char* name_of(Verdict verdict);

/// What may explain a difference, and what shows it: exactly one of the three is not empty.
struct RowReason {
  std::string text;
  std::string setting;  ///< in the form of SensitivityParameter::values
  std::string measure;
  std::string row;
};

/// What a statement comes to: that a quantity of scenes is above, or below, others.
struct RowCondition {
  std::string of;               ///< a quantity, by the names of find_quantity()
  std::vector<std::string> in;  ///< scenes; none: the six
  bool is_above = true;
  std::optional<double> number;
  std::vector<std::string> than;     ///< quantities of the same scene
  std::vector<std::string> than_in;  ///< scenes: the same quantity of these
};

/// A number of the paper, or a statement that it makes.
struct PaperRow {
  std::string id;                          ///< R1 to R32; C1 to C13: statements
  std::string says;                        ///< the paper
  std::string section;                     ///< of it
  std::string what;                        ///< it is of
  std::string how;                         ///< it is measured here; may be empty where nothing is
  std::string why;                         ///< it is not judged
  Verdict unjudged = Verdict::cannot_say;  ///< its verdict where it is not judged
  Relation relation = Relation::claim;
  std::vector<double> published;      ///< in `unit`; none of a statement
  std::vector<std::string> measures;  ///< of each of these, by the names of measure()
  std::vector<RowCondition> holds;    ///< what the statement comes to
  std::string unit;
  unsigned decimals = 0;
  double tolerance_percent = default_tolerance_percent;  ///< within which numbers agree
  std::string tolerance_reason;                          ///< of another than the default
  std::vector<RowReason> reasons;

  static constexpr double default_tolerance_percent = 5;

  bool is_judged() const { return unjudged == Verdict::cannot_say; }
  /// The first published. Throws std::logic_error where there is none.
  double number() const;
  /// In its unit: 2.07x, /2.52, 64 warps.
  std::string text(double value) const;
  /// Whether settings can be tried on it.
  bool is_of_variants() const;
};

/// The rows that come with the program, as TOML.
const char* shipped_rows_text();
/// R1 to R32, then C1 to C13, in order.
const std::vector<PaperRow>& paper_rows();
/// Throws std::logic_error for one that there is not.
const PaperRow& paper_row(const std::string& id);

/// @param where  the file, in messages
/// Throws UserError, which names the line.
std::vector<PaperRow> parse_rows(const std::string& text, const std::string& where);
std::vector<PaperRow> read_rows(const std::filesystem::path& path);

/// Whether a measured number stands to the paper's as the row wants.
Verdict judge(Relation relation, double paper, double tolerance_percent, double measured);
/// How far it is from that, the tolerance left out; 0 where it holds.
double distance(Relation relation, double paper, double measured);

/// Of a measured number, percent of the paper's; none where the paper's is 0.
std::optional<double> difference_percent(double paper, double measured);

}  // namespace vrpipe::tools
