#include <vrpipe/arithmetic/divisor.h>

#include <algorithm>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

namespace vrpipe {
namespace {

TEST(Divisor, DividesAsTheProcessorDoesAroundEveryMultiple) {
  for (std::uint64_t divisor = 1; divisor <= 3000; ++divisor) {
    const Divisor by(divisor);
    for (const std::uint64_t multiple : {0UL, 1UL, 2UL, 7UL, 1000UL, 65537UL, (1UL << 32U) + 3}) {
      for (std::uint64_t near = 0; near < 3; ++near) {
        const std::uint64_t dividend = multiple * divisor + near;
        ASSERT_EQ(by.quotient(dividend), dividend / divisor) << dividend << " / " << divisor;
        if (dividend == 0) continue;
        ASSERT_EQ(by.quotient(dividend - 1), (dividend - 1) / divisor) << dividend - 1 << " / " << divisor;
        ASSERT_EQ(by.quotient_up(dividend), (dividend + divisor - 1) / divisor) << dividend << " / " << divisor;
      }
    }
  }
}

TEST(Divisor, IsExactUpToItsLimitForAnyDivisor) {
  for (std::uint64_t i = 0; i < 200'000; ++i) {
    const std::uint64_t divisor = (mix(2 * i) >> (mix(i) % 64)) | 1U;
    const std::uint64_t limit = ~std::uint64_t{0} / divisor;
    const Divisor by(divisor);
    const std::uint64_t dividend = limit == 0 ? 0 : mix(2 * i + 1) % limit;
    ASSERT_EQ(by.quotient(dividend), dividend / divisor) << dividend << " / " << divisor;
    ASSERT_EQ(by.quotient(limit - 1), (limit - 1) / divisor) << limit - 1 << " / " << divisor;
  }
}

TEST(Divisor, DividesAnyDividendWithItsRemainder) {
  for (std::uint64_t i = 0; i < 200'000; ++i) {
    const std::uint64_t divisor = std::max<std::uint64_t>(mix(2 * i) >> (1 + mix(i) % 63), 1);
    const Divisor by(divisor);
    const std::uint64_t any = mix(2 * i + 1);
    const std::uint64_t multiple = any - any % divisor;
    for (const std::uint64_t dividend : {any, multiple, multiple - 1, ~std::uint64_t{0}, std::uint64_t{0}}) {
      const Divisor::Division divided = by.divide(dividend);
      ASSERT_EQ(divided.quotient, dividend / divisor) << dividend << " / " << divisor;
      ASSERT_EQ(divided.remainder, dividend % divisor) << dividend << " / " << divisor;
    }
  }
}

}  // namespace
}  // namespace vrpipe
