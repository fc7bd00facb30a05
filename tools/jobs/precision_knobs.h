#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/exact_image.h>
#include <vrpipe/workloads/preprocess.h>

namespace vrpipe::tools {

/// What knobs turn: a run, and the preprocessing before it.
struct PrecisionSettings {
  RunRequest request;
  PreprocessOptions preprocess;
};

/// An arithmetic choice of the modelled hardware, or of what feeds it.
struct PrecisionKnob {
  std::string name;
  std::string option;               ///< how the command line sets it, up to the value
  std::string meaning;              ///< one line
  std::vector<std::string> values;  ///< as the command line takes them
  std::string quick_value;        ///< the one that a quick look tries, far from the default; none: leaves the knob out
  bool is_preprocessing = false;  ///< of no meaning for a draw list
  std::function<std::string(const PrecisionSettings&)> value;
  std::function<void(PrecisionSettings&, const std::string&)> set;
  /// Whether the model takes time for it. Without, cycles may still differ: by which fragments live.
  bool is_charged = true;
  bool is_of_pipeline = true;  ///< of no meaning for what is drawn outside it
};

/// All knobs, in the order of reports.
const std::vector<PrecisionKnob>& precision_knobs();

/// Whether the model knows how to round to the format: as measured it does for some.
bool can_round(const PrecisionSettings& settings);

/// By which a bound on the error of a run is proved; none where there is no proof: boxes that are padded otherwise than they have
/// to be, units of one's own, or no pipeline.
std::optional<DrawnPrecision> drawn_precision(const RunRequest& request);

/// Values of several knobs at once, KNOB and VALUE, of those that depend on one another: how a target of few bits rounds, how often it does,
/// and in what it is merged.
const std::vector<std::vector<std::pair<std::string, std::string>>>& precision_crossings();

/// The value as people write it: n/255 for the thresholds that are one, else as it is.
std::string readable_value(const PrecisionKnob& knob, const std::string& value);

}  // namespace vrpipe::tools
