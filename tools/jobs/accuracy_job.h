#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/platforms/simulation.h>

#include "host/progress_line.h"
#include "image/image_error.h"
#include "image/picture.h"
#include "jobs/energy.h"
#include "jobs/error_by_fragments.h"
#include "jobs/precision_knobs.h"
#include "jobs/simulation_job.h"
#include "jobs/trade_off.h"

namespace vrpipe::tools {

/// What `vrpipe accuracy` is asked to do.
struct AccuracyJob {
  SimulationJob simulation;
  bool quick = false;                         ///< the middle of the image, fewer variants and values
  unsigned repeat = 1;                        ///< times that each level of the fidelity ladder is measured
  std::optional<std::filesystem::path> html;  ///< file
  bool markdown = false;                      ///< the tables for documentation in place of the report
  /// Units that are at cycle among others at lt, a level of the fidelity ladder for each set of them, where it can be had.
  std::vector<std::vector<std::string>> units_at_cycle = {{"zrop", "crop"}};
};

// Of the ladders. CPU seconds and error in cycles, percent; simulated cycles and dB of PSNR.
constexpr Tolerance fidelity_tolerance{0.05, 0.01};
constexpr Tolerance precision_tolerance{0.001, 0.1};

/// One variant at one fidelity, beside the most exact fidelity that there is of it.
struct FidelityLevel {
  RunResult run;
  double host_seconds = 0;                     ///< the median
  double cpu_seconds = 0;                      ///< the median
  double times_as_fast = 0;                    ///< in CPU seconds, as the most exact fidelity of the variant
  double times_as_fast_elapsed = 0;            ///< in host seconds
  std::optional<double> cycles_error_percent;  ///< above 0: too many cycles; none without time
  std::optional<double> speedup;               ///< over the baseline at the same fidelity
  std::optional<double> speedup_error_percent;
  double quads_per_second = 0;  ///< rasterised, per CPU second
  double fragments_blended_error_percent = 0;
  ImageError image;        ///< against the most exact fidelity's
  bool dominated = false;  ///< by another level of the variant, in CPU seconds and error; the most exact never is
};

/// A run of the precision ladder.
struct PrecisionRun {
  std::string name;  ///< KNOB=VALUE, or "default"
  RunResult run;
  ImageError error;                             ///< against the exact image
  std::optional<double> proved_max_error;       ///< that no pixel passes; none where nothing is proved
  std::vector<ErrorOfRange> by_fragments;       ///< by the exact number of a pixel
  std::uint64_t pixels_stuck = 0;               ///< below the termination threshold, by rounding
  std::optional<std::uint64_t> l2_bytes;        ///< read and written; none where no L2 counts
  std::optional<std::uint64_t> dram_bytes;      ///< the same
  std::optional<Range> millijoules;             ///< none without time
  std::optional<double> cycles_change_percent;  ///< against the default; none without time
  bool on_front = false;                        ///< the Pareto front of cycles and PSNR; false without time
  Picture picture, error_map;                   ///< for the page; else empty
};

/// A knob's value, and the run that has it.
struct PrecisionRow {
  const PrecisionKnob* knob;
  std::string value;
  std::size_t run;  ///< 0 is the default
};

/// Values of several knobs at once, and the run that has them.
struct CrossedRow {
  std::vector<std::pair<std::string, std::string>> values;  ///< KNOB and VALUE
  std::size_t run;
};

/// How an image changes from one view to the next, a step of the camera to the right by which what is at the middle depth moves by
/// a pixel: how far that is from how the exact image changes. What is as wrong in both views is none of it; what pops is.
struct PoppingRow {
  std::string run;  ///< KNOB=VALUE, or "default"
  double rms = 0;   ///< over all pixels and channels
  double max_abs = 0;
  double share_of_pixels = 0;  ///< of which a channel changes by over an 8-bit level too much or too little
};

/// A stress configuration of what was asked for: cycles at the most exact fidelity, and the errors of the others in the order
/// of `fidelities()`.
struct StressRow {
  std::string configuration;
  std::string variant;
  std::uint64_t cycles = 0;
  std::vector<std::pair<Fidelity, double>> error_percent;
};

/// A stress configuration that what was asked for cannot have.
struct StressLeftOut {
  std::string configuration;
  std::string reason;
};

struct AccuracyResult {
  Provenance provenance;
  SceneSummary scene;
  std::optional<Viewpoint> viewpoint;             ///< none for a draw list
  std::uint32_t width = 0, height = 0;            ///< pixels
  std::uint32_t full_width = 0, full_height = 0;  ///< of which a quick look takes the middle
  bool quick = false;
  unsigned repeat = 1;
  unsigned processes = 1;                   ///< of the precision ladder
  std::vector<Setting> preprocessing;       ///< what --set changed of it
  RunRequest base;                          ///< what the precision ladder varies: of the pipeline, if anything is
  std::vector<FidelityLevel> fidelity;      ///< by variant, then from the least exact to the most
  std::string precision_left_out;           ///< why there is no precision ladder, only the default's run; or empty
  std::vector<PrecisionRun> runs;           ///< the default first
  std::vector<PrecisionRow> precision;      ///< by knob
  std::vector<CrossedRow> crossed;          ///< none in a quick look
  std::vector<PoppingRow> popping;          ///< none of a draw list
  std::vector<std::string> knobs_left_out;  ///< those that mean nothing for a draw list
  std::vector<std::string> knobs_without_pipeline;  ///< those that mean nothing for what draws outside it
  std::vector<std::string> values_never_measured;   ///< KNOB=VALUE, of which nobody knows the measured rounding
  std::vector<StressRow> stress;                    ///< by configuration, then by variant
  std::vector<StressLeftOut> stress_left_out;
  Picture reference;             ///< the exact image, for the page
  double reference_seconds = 0;  ///< to render it
  double seconds = 0;            ///< wall time of everything
  ResultFiles files;             ///< written so far: images
};

/// Runs both ladders. Images go to the folder of --output. Throws UserError, CommandFailure or a fault.
AccuracyResult measure_accuracy(const AccuracyJob& job, ProgressLine& progress);

}  // namespace vrpipe::tools
