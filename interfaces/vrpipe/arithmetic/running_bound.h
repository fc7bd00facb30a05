#pragma once

#include <vrpipe/arithmetic/blend.h>

namespace vrpipe {

/// The most that one rounding of a colour channel to what a target stores is off, of values up to `magnitude`. It never
/// falls with the magnitude, but for single-precision rounding.
double color_rounding_error(ColorFormat format, BlendRounding rounding, double magnitude);
/// The same of alpha.
double alpha_rounding_error(ColorFormat format, BlendRounding rounding, double magnitude);

/// How far a pixel that a blender makes may be from what its fragments come to in exact arithmetic (docs/numerics.md, F4, has the proof).
/// Where the format clamps, from that, clamped.
struct PixelBound {
  double color = 0;  ///< of the channel that may be farthest off
  double alpha = 0;
};

/// How far what a shader sends to the blender may be from the exact fragment.
struct FragmentBound {
  double color = 0;  ///< premultiplied
  double alpha = 0;
};

/// Takes a pixel's bound along with its fragments.
class RunningBound {
 public:
  /// @param merges      two fragments may be blended as one before they are blended into the target
  /// @param sent_error  relative, of what is sent to the target, a fragment or a merged pair, beyond single precision's
  RunningBound(ColorFormat format, BlendRounding rounding, bool merges, double sent_error = 0)
      : sent_error_(sent_error),
        format_(format),
        rounding_(rounding),
        merges_(merges),
        arithmetic_((merges ? 8.0 : 4.0) / 16777216.0) {}

  /// A fragment has been blended.
  /// @param fragment_alpha, fragment_color  the exact ones of the fragment: of its largest channel, premultiplied
  /// @param pixel_alpha_before, pixel_alpha, pixel_color  the exact ones of the pixel: of its largest channel
  void blended(PixelBound& bound, double fragment_alpha, double fragment_color, double pixel_alpha_before,
               double pixel_alpha, double pixel_color, const FragmentBound& off = {}) const;

 private:
  double sent_error_;
  ColorFormat format_;
  BlendRounding rounding_;
  bool merges_;
  double arithmetic_;  ///< of the blend's single-precision operations, of values up to 1
};

}  // namespace vrpipe
