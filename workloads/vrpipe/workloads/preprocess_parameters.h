#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/workloads/preprocess.h>

namespace vrpipe {

/// What preprocessing can be told on the command line, set as `preprocess.NAME`.
struct PreprocessParameters : ParameterSet {
  Integer sh_degree{
      *this,
      "sh_degree",
      3,
      0,
      3,
      "",
      "INRIA: all bands that were trained",
      "highest degree of the spherical harmonics that is evaluated; a scene of a lower degree uses its own"};
  Choice depth_key_bits{*this, "depth_key_bits",       {"32", "24", "16", "12"},
                        0,     "INRIA: 32-bit depths", "of the depths that splats are sorted by"};
  Choice opacity_compensation{
      *this,
      "opacity_compensation",
      {"scene", "on", "off"},
      0,
      "off, as INRIA trains, unless the scene's file says that it was trained so",
      "opacities times sqrt(det / det dilated) of the 2-D covariance, as anti-aliased models are trained"};
  Real dilation{*this, "dilation", kDilation, 0.001, 100, "pixels^2", "INRIA", "of every 2-D covariance"};

  /// Throws UserError as ParameterSet::set.
  void set(const std::string& name, const std::string& value) { ParameterSet::set("preprocess", name, value); }
  /// The options that these parameters stand for.
  PreprocessOptions options() const;
};

}  // namespace vrpipe
