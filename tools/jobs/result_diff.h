#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "image/image_error.h"

namespace vrpipe::tools {

/// A result of any command, as its JSON says it.
struct ResultFile {
  std::filesystem::path path;
  nlohmann::ordered_json content;
};

/// Throws UserError for what is no result of vrpipe.
ResultFile read_result(const std::filesystem::path& path);

/// What a difference is about, in the order in which they are told.
enum class DiffGroup : std::uint8_t { made_by, drawn, settings, units, effects, counts, time, statistics, other };
const char* name_of(DiffGroup group);

/// A value that two results do not share.
struct Difference {
  DiffGroup group = DiffGroup::other;
  std::string run;              ///< its name; empty for what is of all of them
  std::string key;              ///< its place in the run or the result, as in counts.warps
  nlohmann::ordered_json a, b;  ///< null where there is none
  /// From a to b, of numbers, in per cent; none where a is 0.
  std::optional<double> change_percent() const;
};

/// The pictures of a run in both results.
struct PictureDiff {
  std::string run;
  std::optional<bool> same_bits;  ///< of the result hash, which is also of counts and cycles; none where one is missing
  std::optional<ImageError> error;  ///< of b against a, from the EXR files; none if they are not there
  std::string why_none;             ///< why there is no error
};

/// The time that a run takes in both results.
struct TimePair {
  struct Time {
    std::uint64_t cycles = 0;
    std::optional<double> milliseconds;
    std::optional<double> speedup;  ///< over the run that the result names
  };
  std::string run;
  Time a, b;
};

struct ResultDiff {
  ResultFile a, b;
  std::vector<Difference> differences;            ///< by group, then in the order of the results
  std::vector<std::string> only_in_a, only_in_b;  ///< names of runs
  std::vector<PictureDiff> pictures;              ///< of the runs in both
  std::vector<TimePair> times;                    ///< of the runs that have time in both, also the same
  bool equal() const { return differences.empty() && only_in_a.empty() && only_in_b.empty(); }
};

/// Compares all but what the host and the command line make: seconds, load, names of files. Elements that have a name are
/// matched by it, others by their place. Throws UserError for results of different commands, unless these are `run` and
/// `compare`, which hold the same.
ResultDiff diff_results(ResultFile a, ResultFile b);

}  // namespace vrpipe::tools
