#include <vrpipe/memory/interleaving.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace vrpipe {
namespace {

constexpr std::uint32_t counts[] = {1, 2, 3, 5, 6, 7, 8, 10, 11, 12, 16, 20, 24, 33, 40, 48, 64, 2560, 3072};

std::uint32_t place_of(const Interleaving& interleaving, std::uint64_t piece, bool hashed) {
  const Interleaving::Share share = interleaving.share(piece);
  return hashed ? interleaving.hashed_place<8>(share) : share.place;
}

TEST(Interleaving, IsTheRemainderAndTheQuotient) {
  for (const std::uint32_t places : counts) {
    const Interleaving interleaving(places);
    EXPECT_EQ(interleaving.places(), places);
    for (const std::uint64_t first : {std::uint64_t{0}, std::uint64_t{1} << 37U, ~std::uint64_t{0} - 10'000}) {
      for (std::uint64_t piece = first; piece < first + 10'000; ++piece) {
        const Interleaving::Share share = interleaving.share(piece);
        ASSERT_EQ(share.place, piece % places) << piece << " of " << places;
        ASSERT_EQ(share.round, piece / places) << piece << " of " << places;
      }
    }
  }
}

TEST(Interleaving, NoTwoPiecesShareAPlaceAndEveryRoundGoesToAll) {
  for (const bool hashed : {false, true}) {
    for (const std::uint32_t places : counts) {
      const Interleaving interleaving(places);
      for (const std::uint64_t first : {std::uint64_t{0}, (std::uint64_t{1} << 33U) * places}) {
        for (std::uint64_t round = 0; round < 64; ++round) {
          std::vector<bool> taken(places);
          for (std::uint64_t piece = first + round * places; piece < first + (round + 1) * places; ++piece) {
            const std::uint32_t place = place_of(interleaving, piece, hashed);
            ASSERT_LT(place, places);
            ASSERT_FALSE(taken[place]) << piece << " of " << places;
            taken[place] = true;
          }
        }
      }
    }
  }
}

TEST(Interleaving, APowerOfTwoIsHashedByTheExclusiveOrOfItsDigits) {
  for (unsigned bits = 0; bits <= 12; ++bits) {
    const Interleaving interleaving(1U << bits);
    for (std::uint64_t i = 0; i < 2000; ++i) {
      const std::uint64_t piece = mix(i) >> (i % 40);
      std::uint64_t eight = 0;
      std::uint64_t all = 0;
      for (unsigned digit = 0; bits > 0 && digit * bits < 64; ++digit) {
        const std::uint64_t value = (piece >> (digit * bits)) % (1U << bits);
        all ^= value;
        if (digit <= 8) eight ^= value;
      }
      ASSERT_EQ(interleaving.hashed_place<8>(interleaving.share(piece)), eight) << bits;
      ASSERT_EQ(interleaving.hashed_place<Interleaving::all_digits>(interleaving.share(piece)), all) << bits;
    }
  }
}

TEST(Interleaving, HashedOfAnyNumberThatIsNoPowerOfTwoSpreadsEveryStride) {
  constexpr std::uint64_t pieces = 4096;
  for (const std::uint32_t places : {3U, 5U, 6U, 7U, 10U, 11U, 12U, 20U, 24U, 33U, 40U, 48U}) {
    const Interleaving interleaving(places);
    const auto busiest = [&](std::uint64_t stride, bool hashed) {
      std::vector<std::uint64_t> pieces_of(places);
      for (std::uint64_t i = 0; i < pieces; ++i) ++pieces_of[place_of(interleaving, i * stride, hashed)];
      return static_cast<double>(*std::max_element(pieces_of.begin(), pieces_of.end())) * places / pieces;
    };
    EXPECT_DOUBLE_EQ(busiest(places, false), places) << "all in one";
    for (std::uint64_t stride = 1; stride < 300; ++stride) EXPECT_LT(busiest(stride, true), 1.5) << stride << places;
    for (unsigned bits = 9; bits < 30; ++bits) EXPECT_LT(busiest(std::uint64_t{1} << bits, true), 1.5) << bits;
  }
}

}  // namespace
}  // namespace vrpipe
