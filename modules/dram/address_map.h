#pragma once

#include <cstdint>

#include "dram_parameters.h"

namespace vrpipe {

/// Where a burst is.
struct DramAddress {
  unsigned channel = 0;
  unsigned bank = 0;
  std::uint32_t column = 0;  ///< of the row, in bursts
  std::uint64_t row = 0;     ///< no capacity is modelled: any row is there
};

/// The place of each address: one burst of addresses for each place.
class DramAddressMap {
 public:
  explicit DramAddressMap(const DramParameters& parameters);

  DramAddress place_of(std::uint64_t address) const {
    std::uint64_t rest = address >> burst_bits_;
    DramAddress place;
    const std::uint64_t low_column = take(rest, low_column_bits_);
    const std::uint64_t channel = take(rest, channel_bits_);
    const std::uint64_t above = rest;
    const std::uint64_t low_bank = take(rest, low_bank_bits_);
    const std::uint64_t high_column = take(rest, high_column_bits_);
    const std::uint64_t high_bank = take(rest, high_bank_bits_);
    place.row = rest;
    place.column = static_cast<std::uint32_t>(high_column << low_column_bits_ | low_column);
    place.bank = static_cast<unsigned>(high_bank << low_bank_bits_ | low_bank);
    place.channel = static_cast<unsigned>(channel);
    if (!hash_) return place;
    place.bank ^= static_cast<unsigned>(rest & ((std::uint64_t{1} << (low_bank_bits_ + high_bank_bits_)) - 1));
    place.channel ^= static_cast<unsigned>(folded(above) & ((std::uint64_t{1} << channel_bits_) - 1));
    return place;
  }

 private:
  static std::uint64_t take(std::uint64_t& rest, unsigned bits) {
    const std::uint64_t field = rest & ((std::uint64_t{1} << bits) - 1);
    rest >>= bits;
    return field;
  }
  /// The exclusive or of eight neighbouring fields of a channel's width.
  std::uint64_t folded(std::uint64_t value) const {
    value ^= value >> (4 * channel_bits_);
    value ^= value >> (2 * channel_bits_);
    return value ^ value >> channel_bits_;
  }

  unsigned burst_bits_, low_column_bits_, channel_bits_, low_bank_bits_, high_column_bits_, high_bank_bits_;
  bool hash_;
};

}  // namespace vrpipe
