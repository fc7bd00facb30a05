#include <vrpipe/workloads/portable_math.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace vrpipe {
namespace {

constexpr double kTolerance = 1.2e-15;  // relative; libm itself is within 2e-16

TEST(PortableMath, ExpAgreesWithLibmOverItsWholeRange) {
  for (double x = -708; x < 709; x += 0.0371) EXPECT_NEAR(portable_exp(x) / std::exp(x), 1.0, kTolerance) << x;
  for (double x = -1e-3; x < 1e-3; x += 1.7e-6) EXPECT_NEAR(portable_exp(x) / std::exp(x), 1.0, kTolerance) << x;
}

TEST(PortableMath, ExpKeepsItsLimits) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(portable_exp(0), 1);
  EXPECT_EQ(portable_exp(-infinity), 0);
  EXPECT_EQ(portable_exp(infinity), infinity);
  EXPECT_EQ(portable_exp(1e300), infinity);
  EXPECT_EQ(portable_exp(-1e300), 0);
  EXPECT_TRUE(std::isnan(portable_exp(std::nan(""))));
  EXPECT_NEAR(portable_exp(-740) / std::exp(-740.0), 1.0, 0.01);  // denormal
}

TEST(PortableMath, LogAgreesWithLibm) {
  for (double x = 1e-300; x < 1e300; x *= 1.0173) {
    EXPECT_NEAR(portable_log(x), std::log(x), kTolerance * std::fabs(std::log(x))) << x;
  }
  for (double x = 0.5; x < 2; x += 0.000317) {
    EXPECT_NEAR(portable_log(x), std::log(x), kTolerance * std::fabs(std::log(x))) << x;
  }
  EXPECT_NEAR(portable_log(5e-324), std::log(5e-324), 1e-12);
}

TEST(PortableMath, LogKeepsItsLimits) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(portable_log(1), 0);
  EXPECT_EQ(portable_log(0), -infinity);
  EXPECT_EQ(portable_log(infinity), infinity);
  EXPECT_TRUE(std::isnan(portable_log(-1)));
  EXPECT_TRUE(std::isnan(portable_log(std::nan(""))));
}

TEST(PortableMath, SineAndCosineAgreeWithLibm) {
  for (double x = -50; x < 50; x += 0.00731) {
    EXPECT_NEAR(portable_sin(x), std::sin(x), kTolerance) << x;
    EXPECT_NEAR(portable_cos(x), std::cos(x), kTolerance) << x;
  }
}

TEST(PortableMath, TangentAgreesWithLibmAndStaysAccurateNearNinetyDegrees) {
  const long double radians = 3.14159265358979323846264338327950288L / 180;
  for (double x = 0.001; x < 89.999; x += 0.0173) {
    const double expected = static_cast<double>(std::tan(static_cast<long double>(x) * radians));
    EXPECT_NEAR(portable_tan_degrees(x) / expected, 1.0, kTolerance) << x;
  }
  // tan(89.9995) = 1 / tan(0.0005 degrees)
  EXPECT_NEAR(portable_tan_degrees(89.9995) *
                  static_cast<double>(std::tan((90 - 89.9995) * 3.14159265358979323846L / 180)),
              1.0, kTolerance);
}

}  // namespace
}  // namespace vrpipe
