#pragma once

#include <cstdint>

namespace vrpipe {

/// Divides by a number known only at run time, with a multiplication: a division takes several times as long.
/// A quotient alone is exact for dividends up to 2^64 / divisor.
class Divisor {
 public:
  /// @param divisor not 0
  explicit Divisor(std::uint64_t divisor) : divisor_(divisor), reciprocal_(~std::uint64_t{0} / divisor + 1) {}

  std::uint64_t value() const { return divisor_; }
  /// dividend / divisor, rounded down.
  std::uint64_t quotient(std::uint64_t dividend) const {
    // The reciprocal is (2^64 + e) / divisor with e < divisor: too much by less than the least fraction.
    return reciprocal_ == 0 ? dividend : static_cast<std::uint64_t>((Product{dividend} * reciprocal_) >> 64U);
  }
  /// The same, rounded up.
  std::uint64_t quotient_up(std::uint64_t dividend) const { return quotient(dividend + divisor_ - 1); }
  struct Division {
    std::uint64_t quotient, remainder;
  };
  /// Both, exact for any dividend; of divisors up to 2^63.
  Division divide(std::uint64_t dividend) const {
    const std::uint64_t estimate = quotient(dividend);  // beyond its limit perhaps one too much
    const std::uint64_t rest = dividend - estimate * divisor_;
    return rest < divisor_ ? Division{estimate, rest} : Division{estimate - 1, rest + divisor_};
  }

 private:
  __extension__ typedef unsigned __int128 Product;  // NOLINT(modernize-use-using): takes no __extension__
  std::uint64_t divisor_;
  std::uint64_t reciprocal_;
};

}  // namespace vrpipe
