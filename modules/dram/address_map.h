#pragma once

#include <cstdint>

#include "dram_parameters.h"

#include <vrpipe/memory/interleaving.h>

namespace vrpipe {

/// Where a burst is.
struct DramAddress {
  unsigned channel = 0;
  unsigned bank = 0;
  std::uint32_t column = 0;  ///< of the row, in bursts
  std::uint64_t row = 0;     ///< no capacity is modelled: any row is there
};

/// The place of each address: one burst of addresses for each place. Fields are bits of the address but for the channel, of
/// which there may be any number: the fields above it are of its round (Interleaving).
class DramAddressMap {
 public:
  explicit DramAddressMap(const DramParameters& parameters);

  DramAddress place_of(std::uint64_t address) const {
    std::uint64_t rest = address >> burst_bits_;
    DramAddress place;
    const std::uint64_t low_column = take(rest, low_column_bits_);
    const Interleaving::Share channel = channels_.share(rest);
    rest = channel.round;
    const std::uint64_t low_bank = take(rest, low_bank_bits_);
    const std::uint64_t high_column = take(rest, high_column_bits_);
    const std::uint64_t high_bank = take(rest, high_bank_bits_);
    place.row = rest;
    place.column = static_cast<std::uint32_t>(high_column << low_column_bits_ | low_column);
    place.bank = static_cast<unsigned>(high_bank << low_bank_bits_ | low_bank);
    place.channel = channel.place;
    if (!hash_) return place;
    place.bank ^= static_cast<unsigned>(rest & ((std::uint64_t{1} << (low_bank_bits_ + high_bank_bits_)) - 1));
    place.channel = channels_.hashed_place<8>(channel);
    return place;
  }

 private:
  static std::uint64_t take(std::uint64_t& rest, unsigned bits) {
    const std::uint64_t field = rest & ((std::uint64_t{1} << bits) - 1);
    rest >>= bits;
    return field;
  }
  Interleaving channels_;
  unsigned burst_bits_, low_column_bits_, low_bank_bits_, high_column_bits_, high_bank_bits_;
  bool hash_;
};

}  // namespace vrpipe
