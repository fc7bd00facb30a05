#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
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

/// What is run: a value on every axis.
struct StudiedPoint {
  std::vector<std::size_t> values;  ///< by axis, a place in its values
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

/// For each point the one that it is relative to: the named axes have the named values, the others of what the GPU is
/// (platform, variant, parameters) their reference, and those of what is drawn and how exactly the point's own. None where that
/// is no point of the study.
std::vector<std::optional<std::size_t>> references(const Study& study);

}  // namespace vrpipe::tools
