#pragma once

namespace vrpipe {

constexpr double kPi = 3.14159265358979323846;

// Elementary functions that give the same bits on every processor and with every compiler (glibc's differ with and
// without FMA). Built from +, -, *, / and sqrt in double; relative error about 1e-15. Compile with -ffp-contract=off.

/// e^x. 0 below about -745.2, +Inf above about 709.8; NaN for NaN.
double portable_exp(double x);

/// Natural logarithm of x. -Inf at 0, NaN below 0 and for NaN, +Inf at +Inf.
double portable_log(double x);

/// Sine and cosine of an angle in radians, |angle| <= 1e5; absolute error about 1e-15, more (4e-16 |angle|) for larger angles.
double portable_sin(double angle);
double portable_cos(double angle);

/// Tangent of an angle of 0 to less than 90 degrees.
double portable_tan_degrees(double degrees);

}  // namespace vrpipe
