#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <vrpipe/platforms/simulation.h>

namespace vrpipe::measured {

/// How a draw was drawn when it was measured.
struct Mode {
  const char* name;
  ColorFormat format = ColorFormat::rgba16f;
  std::function<void(DrawState&)> change = {};
  std::uint32_t passes = 1;
  bool terminates = false;  ///< strictly, in bin order
  bool off_screen = false;
  const char* variant = "baseline";
};

const Mode& mode_named(const std::string& name);

/// `gh100-gpc`, or another platform.
class Gpu {
 public:
  explicit Gpu(Fidelity fidelity, const char* platform = "gh100-gpc", std::vector<Setting> settings = {})
      : fidelity_(fidelity), platform_(platform), settings_(std::move(settings)) {}

  Fidelity fidelity() const { return fidelity_; }
  RunResult run(const Draw& draw, const Mode& mode) const;
  /// Millions.
  double cycles(const Draw& draw, const Mode& mode) const { return megacycles(run(draw, mode)); }
  static double megacycles(const RunResult& result) { return static_cast<double>(result.cycles.value_or(0)) / 1e6; }

 private:
  Fidelity fidelity_;
  const char* platform_;
  std::vector<Setting> settings_;
};

inline double percent(double predicted, double measured) { return 100 * (predicted / measured - 1); }
/// What was measured, what is predicted, in columns of a width, and how many percent that is off.
void print_in_columns(int width, int digits, double measured, double predicted);

/// Scenes of synthetic splats. `is_short`: a part of the smallest, to see that it works.
void compare_scenes(const Gpu& gpu, bool is_short);
/// Splats of one size each, in %. `is_short`: a part of one of them.
void compare_uniform(const Gpu& gpu, bool is_short);
/// Blending in the shader, of equal splats and of draws. `is_short`: a part of a few.
void compare_in_shader(const Gpu& gpu, bool is_short);
/// Early termination by software, in passes, of draws. `is_short`: a part of one of them.
void compare_passes(const Gpu& gpu, bool is_short);

}  // namespace vrpipe::measured
