#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace vrpipe::tools {

/// Something that points of a study differ in, and its values as texts, in the order of the study.
struct StudyAxis {
  std::string name;  ///< scene, view, size, platform, variant, fidelity, format, termination, or UNIT.PARAMETER
  std::vector<std::string> values;
  bool numeric = false;       ///< all values are numbers
  std::size_t reference = 0;  ///< the place of the value over which speed-ups are, unless a study names another
};

/// In the place of a value: the axis is of a parameter that the point's units do not have.
constexpr std::size_t no_value = ~std::size_t{0};
/// Of a point on an axis, its value as text; empty for no_value.
const std::string& text_of(const StudyAxis& axis, std::size_t place);

/// What is run: a value on every axis.
struct StudiedPoint {
  std::vector<std::size_t> values;  ///< by axis, a place in its values, or no_value
};

/// Named axes and values, as `variant=baseline,tc.bins=32` says them.
using AxisValues = std::vector<std::pair<std::string, std::string>>;

/// What a study file says beside what a configuration file says (docs/studies.md).
struct Study {
  std::vector<StudyAxis> axes;
  std::vector<StudiedPoint> points;   ///< in the order of the results
  std::uint64_t product = 0;          ///< points of the whole product; 0 for a list
  std::optional<std::uint64_t> seed;  ///< of the sample; none if all of them are run
  AxisValues relative_to;
  std::vector<std::string> columns;  ///< statistics that results have beside what they always have
  std::vector<std::string> pareto;   ///< columns of results; a - in front of those of which more is better
  /// By places on the axes `platform` and `variant`, 0 where there is none: axes of parameters that these do not have.
  std::map<std::pair<std::size_t, std::size_t>, std::set<std::size_t>> absent;

  std::optional<std::size_t> axis(const std::string& name) const;
  /// The places on these axes of a point's values.
  std::pair<std::size_t, std::size_t> machine_of(const std::vector<std::size_t>& values) const;
  /// Without values on the axes that are absent there.
  std::vector<std::size_t> without_absent(std::vector<std::size_t> values) const;
  /// Points that come to the same are one.
  void leave_out_absent();
};

/// Keys of a study file that are no options.
const std::vector<std::string>& study_keys();

/// Reads axes and points. Throws UserError with file and line for what cannot be; that scenes, variants and parameters exist
/// is not looked at.
Study read_study(const std::filesystem::path& path);

/// Whether an axis is of what is drawn and how exactly, not of what the GPU is: a point is compared to one of the same.
bool follows_the_point(const std::string& axis);

/// `AXIS=VALUE,...`. Throws UserError for another form, and for axes and values that the study does not have.
AxisValues parse_axis_values(const std::string& text, const Study& study, const std::string& where);

/// What a point of these values is relative to: the named axes have the named values, the others of what the GPU is
/// (platform, variant, parameters) their reference, and those of what is drawn and how exactly the point's own.
std::vector<std::size_t> reference_values(const Study& study, std::vector<std::size_t> own);
/// For each point the one of these values. None where that is no point of the study.
std::vector<std::optional<std::size_t>> references(const Study& study);

}  // namespace vrpipe::tools
