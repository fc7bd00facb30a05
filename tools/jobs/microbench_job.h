#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>

/// The paper's analysis of real GPUs as workloads: what each microbenchmark measures here, beside what is published.

namespace vrpipe {

/// What a microbenchmark measures, and what is known of it.
struct MicrobenchFigure {
  std::string name;   ///< unlike that of any other of the microbenchmark; begins with the group's
  std::string group;  ///< of figures that are judged together; empty: it is judged by itself
  std::string unit;
  std::optional<double> paper;   ///< what the paper states
  std::optional<double> gpu;     ///< as measured on a real GPU
  double measured = 0;           ///< in the simulator
  double tolerance_percent = 0;  ///< within which it is to agree with `reference`; below 0: it need not
  std::string note;              ///< what the value says, or why it differs; may be empty

  std::string
      gpu_is_of;  ///< what the real GPU's number is of where the platform may have more of it: "one ROP partition"
  /// The number that holds for this platform: the paper's of the paper's GPU, the real GPU's of its own platform and where
  /// it is the same on any. None: neither.
  std::optional<double> reference;
  std::string reference_is;  ///< whose it is: "paper", "real GPU"
  std::string source;        ///< of the published numbers

  /// Against the reference; none without, or where that is 0 and the value is not.
  std::optional<double> difference_percent() const;
  bool agrees() const;        ///< within the tolerance, where there is a reference
  std::string label() const;  ///< its name within the group
};

using MicrobenchPoints = std::vector<std::pair<double, double>>;

struct MicrobenchCurve {
  std::string name, x_label, y_label;
  MicrobenchPoints measured;
  MicrobenchPoints gpu;
  MicrobenchPoints paper;
};

/// How far the figures of a group are from their references.
struct MicrobenchGroup {
  std::string name;
  unsigned figures = 0;
  double mean_percent = 0;   ///< of the absolute differences
  double worst_percent = 0;  ///< the largest, with its sign
  std::string worst;         ///< whose that is, a figure's name
};

struct MicrobenchResult {
  std::string name;
  std::string question;
  std::string platform;
  std::vector<MicrobenchFigure> figures;
  std::vector<MicrobenchCurve> curves;
  double seconds = 0;                                           ///< wall time of its simulations
  std::vector<std::pair<std::string, std::string>> parameters;  ///< RunResult::parameters

  /// Of figures that have a group and a reference, in their order; with several, last one of them all, named "all".
  std::vector<MicrobenchGroup> groups() const;
};

/// MicrobenchFigure::gpu_is_of.
inline constexpr const char* one_partition = "one ROP partition";
inline constexpr const char* one_gpc = "one GPC of 2 TPCs";

/// The platform that models the real GPU that was measured.
inline constexpr const char* measured_platform = "gh100-gpc";

/// Those of the paper's analysis, in the order of reports: "all".
std::vector<std::string> microbench_names();
/// Those that a real GPU alone was measured with, to find the laws of its ROPs: "laws".
std::vector<std::string> law_names();
/// Throws UserError naming the nearest.
void check_microbench_name(const std::string& name);
/// Throws UserError for a setting of the draw's state, which is the microbenchmark's own, but for the hardware's precision.
void check_microbench_state(const RunRequest& request);
/// Throws UserError if it measures time, and the fidelity has none.
void check_microbench(const std::string& name, const RunRequest& request);

/// Runs the simulations of a microbenchmark, each in a process of its own, and shows progress on stderr if that is a terminal.
/// Platform, settings, units and fidelity are those of the request, variant and format as well where the microbenchmark does
/// not vary them. The caller must not have other threads meanwhile, nor have used SystemC.
/// @param processes  simulations at a time; 0: one for each processor
/// Throws UserError, or CommandFailure with the text of a simulation that failed.
MicrobenchResult run_microbench(const std::string& name, const RunRequest& request, unsigned processes = 0);

}  // namespace vrpipe
