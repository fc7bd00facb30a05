#pragma once

#include <vrpipe/lanes.h>

namespace vrpipe {

/// 2^x for x <= 0 within 2 ulp, the accuracy of a GPU's ex2.approx; x below -126 gives 2^-126.
/// A polynomial of our own: libm's exp2 depends on whether the processor has FMA.
inline Lanes exp2_nonpositive(Lanes x) {
  x = select(x < -126.0F, splat_lanes(-126.0F), x);
  // Adding 1.5 * 2^23 leaves the nearest integer in the low bits of the significand.
  const Lanes shifted = x + 12582912.0F;
  const LaneBits exponent = bits_of(shifted) - 0x4b400000;
  const Lanes f = x - (shifted - 12582912.0F);
  Lanes p = f * 1.5403530e-4F + 1.33335581e-3F;
  p = p * f + 9.61812911e-3F;
  p = p * f + 5.55041087e-2F;
  p = p * f + 2.40226507e-1F;
  p = p * f + 6.93147181e-1F;
  p = p * f + 1.0F;
  return lanes_of(bits_of(p) + (exponent << 23));
}

}  // namespace vrpipe
