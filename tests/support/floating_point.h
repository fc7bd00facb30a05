#pragma once

#include <cfenv>
#include <cmath>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace vrpipe::testing {

/// While it lives, an operation that makes a NaN out of numbers ends the program (SIGFPE). Code under it must not
/// compare with NaN either. Does nothing where the C library cannot trap.
class TrapInvalid {
 public:
  TrapInvalid() {
#if defined(__GLIBC__)
    std::feclearexcept(FE_ALL_EXCEPT);
    before_ = ::feenableexcept(FE_INVALID);
#endif
  }
  TrapInvalid(const TrapInvalid&) = delete;
  TrapInvalid& operator=(const TrapInvalid&) = delete;
  ~TrapInvalid() {
#if defined(__GLIBC__)
    std::feclearexcept(FE_ALL_EXCEPT);
    ::fedisableexcept(FE_ALL_EXCEPT);
    if (before_ > 0) ::feenableexcept(before_);
#endif
  }

 private:
  [[maybe_unused]] int before_ = 0;
};

/// While it lives, denormal operands and results of single and double precision are zeros, as on a GPU with D3D's
/// rules. Does nothing on processors without SSE.
class FlushDenormals {
 public:
  FlushDenormals() {
#if defined(__SSE__)
    before_ = _mm_getcsr();
    _mm_setcsr(before_ | 0x8040U);  // flush to zero, denormals are zero
#endif
  }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;
  ~FlushDenormals() {
#if defined(__SSE__)
    _mm_setcsr(before_);
#endif
  }
  /// Whether it does anything here.
  static bool works() {
    const FlushDenormals flushing;
    // Volatile, so that the product is not formed before or after the flushing.
    volatile float denormal = 1e-40F;
    volatile float product = denormal * 0.5F;
    return product == 0.0F;
  }

 private:
  [[maybe_unused]] unsigned before_ = 0;
};

}  // namespace vrpipe::testing
