#pragma once

#include <cstdint>

#include <vrpipe/arithmetic/divisor.h>
#include <vrpipe/arithmetic/random.h>

namespace vrpipe {

/// Deals pieces of memory, by their numbers, out to places of any count: lines to sets, sets to banks, neighbouring bytes to
/// channels. Piece n goes to place n mod places in round n / places, as in GPGPU-Sim where channels are no power of two
/// (addrdec_tlx). So no two pieces share a place and a round, and of each round every place has one.
///
/// Hashed, the rounds begin at other places, so that strides spread; each is still one piece for every place. For a power of
/// two the round's digits to that base are XORed into the place; else a pseudo-random number of the round is added to it, mod
/// places (Rau, "Pseudo-randomly interleaved memory", ISCA 1991). What GPUs do is not public.
class Interleaving {
 public:
  /// @param places  not 0
  explicit Interleaving(std::uint32_t places)
      : places_(places),
        is_power_of_two_((places & (places - 1)) == 0),
        shift_(static_cast<unsigned>(__builtin_ctz(places))),
        mask_(places - 1) {}

  std::uint32_t places() const { return static_cast<std::uint32_t>(places_.value()); }

  struct Share {
    std::uint32_t place;
    std::uint64_t round;
  };
  Share share(std::uint64_t piece) const {
    if (is_power_of_two_) return {static_cast<std::uint32_t>(piece & mask_), piece >> shift_};
    const Divisor::Division divided = places_.divide(piece);
    return {static_cast<std::uint32_t>(divided.remainder), divided.quotient};
  }
  static constexpr unsigned all_digits = ~0U;
  /// The place of a share, hashed.
  /// @tparam digits  of the round that are XORed, from the lowest on: all, or for up to 2^12 places 2, 4 or 8
  template <unsigned digits>
  std::uint32_t hashed_place(const Share& share) const {
    if (!is_power_of_two_) {
      const std::uint64_t moved = share.place + ((mix(share.round) >> 32U) * places_.value() >> 32U);
      // No branch: it would be mispredicted half of the time.
      return static_cast<std::uint32_t>(moved - (moved >= places_.value() ? 1U : 0U) * places_.value());
    }
    std::uint64_t folded = 0;
    if constexpr (digits == all_digits) {
      for (std::uint64_t rest = mask_ == 0 ? 0 : share.round; rest != 0; rest >>= shift_) folded ^= rest;
    } else {  // in few steps, each of which halves them
      folded = share.round;
      for (unsigned span = digits / 2; span > 0; span /= 2) folded ^= folded >> (span * shift_);
    }
    return share.place ^ static_cast<std::uint32_t>(folded & mask_);
  }

 private:
  Divisor places_;
  bool is_power_of_two_;
  unsigned shift_;  ///< log2 of a power of two
  std::uint64_t mask_;
};

}  // namespace vrpipe
