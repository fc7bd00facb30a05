#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace vrpipe {

/// Which sectors of which lines there ever were. Lines may be anywhere; memory is taken in pages of them.
class SectorHistory {
 public:
  /// Of a line, a bit each; stays where it is.
  std::uint32_t& of(std::uint64_t line) {
    const std::uint64_t number = line / lines_of_a_page;
    const std::size_t mask = places_.size() - 1;
    std::size_t at = home_of(number);
    for (; places_[at].number != number; at = (at + 1) & mask) {
      if (places_[at].number == no_page) return add_page(number)[line % lines_of_a_page];
    }
    return (*places_[at].page)[line % lines_of_a_page];
  }

 private:
  static constexpr std::uint64_t lines_of_a_page = 1024;
  static constexpr std::uint64_t no_page = ~std::uint64_t{0};
  using Page = std::array<std::uint32_t, lines_of_a_page>;
  struct Place {
    std::uint64_t number = no_page;
    std::unique_ptr<Page> page;
  };
  std::size_t home_of(std::uint64_t number) const { return (number * 0x9e3779b97f4a7c15ULL) >> shift_; }
  [[gnu::noinline]] Page& add_page(std::uint64_t number);

  unsigned shift_ = 64 - 6;
  std::vector<Place> places_ = std::vector<Place>(64);  ///< open addressing, at most half of them taken
  std::size_t pages_ = 0;
};

}  // namespace vrpipe
