#include <vrpipe/memory/bandwidth.h>

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

namespace vrpipe {
namespace {

/// What a queue in the order of arrival gives.
class Queue {
 public:
  explicit Queue(unsigned bytes_per_cycle) : per_cycle_(bytes_per_cycle) {}
  Cycle take(Cycle arrival, unsigned bytes) {
    free_at_ = std::max(free_at_, arrival * per_cycle_) + bytes;
    return (free_at_ + per_cycle_ - 1) / per_cycle_;
  }

 private:
  std::uint64_t per_cycle_;
  std::uint64_t free_at_ = 0;
};

/// Every byte that can move, one by one.
class Bytes {
 public:
  Bytes(unsigned bytes_per_cycle, std::size_t cycles)
      : per_cycle_(bytes_per_cycle), taken_(cycles * bytes_per_cycle, false) {}
  Cycle take(Cycle arrival, unsigned bytes) {
    std::size_t byte = arrival * per_cycle_;
    for (; bytes > 0; ++byte) {
      if (taken_.at(byte)) continue;
      taken_[byte] = true;
      --bytes;
    }
    return (byte + per_cycle_ - 1) / per_cycle_;
  }
  std::uint64_t from(Cycle cycle) const {
    const auto begin = static_cast<std::ptrdiff_t>(std::min(cycle * per_cycle_, taken_.size()));
    return static_cast<std::uint64_t>(std::count(taken_.begin() + begin, taken_.end(), true));
  }

 private:
  std::size_t per_cycle_;
  std::vector<bool> taken_;
};

std::uint64_t below(std::uint64_t& seed, std::uint64_t bound) { return mix(++seed) % bound; }

TEST(BandwidthReservation, InTheOrderOfArrivalIsAQueue) {
  for (std::uint64_t stream = 0; stream < 400; ++stream) {
    std::uint64_t seed = stream << 32U;
    const auto per_cycle = static_cast<unsigned>(1 + below(seed, 200));
    const std::uint64_t longest_pause = 1 + below(seed, 20);
    BandwidthReservation bandwidth(per_cycle);
    Queue queue(per_cycle);
    Cycle arrival = 0;
    for (unsigned i = 0; i < 500; ++i) {
      arrival += below(seed, longest_pause);
      const unsigned bytes = 1U << below(seed, 9);
      ASSERT_EQ(bandwidth.take(arrival, bytes, arrival), queue.take(arrival, bytes)) << stream << " " << i;
    }
  }
}

TEST(BandwidthReservation, OutOfOrderEveryByteMovesOnceAndAsSoonAsItCan) {
#ifdef VRPIPE_SANITIZED
  constexpr std::uint64_t streams = 60;
#else
  constexpr std::uint64_t streams = 600;
#endif
  for (std::uint64_t stream = 0; stream < streams; ++stream) {
    std::uint64_t seed = stream << 32U;
    const auto per_cycle = static_cast<unsigned>(1 + below(seed, stream % 2 == 0 ? 8 : 128));
    const std::uint64_t lead = 1 + below(seed, 400);
    const std::uint64_t pause = 1 + below(seed, 12);
    BandwidthReservation bandwidth(per_cycle);
    Bytes bytes(per_cycle, 60000);
    Cycle present = 0;
    for (unsigned i = 0; i < 400; ++i) {
      present += below(seed, pause);
      // Some ahead of the clock, some a little behind.
      const Cycle late = below(seed, 8) == 0 ? below(seed, BandwidthReservation::remembered_cycles) : 0;
      const Cycle arrival = present + below(seed, lead) - std::min(present, late);
      const unsigned length = 1U << below(seed, 8);
      ASSERT_EQ(bandwidth.take(arrival, length, present), bytes.take(arrival, length)) << stream << " " << i;
    }
    std::uint64_t later = 0;
    Cycle before = 50000;
    for (const Cycle cycle : {Cycle{50000}, present + lead, present + lead / 2, present}) {
      const std::uint64_t reserved = bytes.from(cycle);
      ASSERT_EQ(bandwidth.reserved_from(cycle), reserved) << stream;
      ASSERT_EQ(bandwidth.reserved_between(cycle, before), reserved - later) << stream;
      later = reserved;
      before = cycle;
    }
  }
}

TEST(BandwidthReservation, WhatRunsAheadDoesNotDelayWhatComesEarlier) {
  BandwidthReservation bandwidth(32);
  for (Cycle cycle = 4000; cycle < 5000; ++cycle) EXPECT_EQ(bandwidth.take(cycle, 32, 0), cycle + 1);
  EXPECT_EQ(bandwidth.take(0, 32, 0), 1U);
  EXPECT_EQ(bandwidth.take(10, 128, 0), 14U);
  EXPECT_EQ(bandwidth.take(3999, 64, 0), 5001U) << "the cycle before, then behind all that is reserved";
}

TEST(BandwidthReservation, KeepsFractionsOfACycle) {
  BandwidthReservation bandwidth(48);
  EXPECT_EQ(bandwidth.take(100, 32, 0), 101U);
  EXPECT_EQ(bandwidth.take(20, 32, 0), 21U);
  EXPECT_EQ(bandwidth.take(20, 32, 0), 22U);
  EXPECT_EQ(bandwidth.take(20, 32, 0), 22U) << "three of 32 bytes in two cycles of 48";
  EXPECT_EQ(bandwidth.take(20, 16, 0), 23U);
}

TEST(BandwidthReservation, KeepsNoMoreThanCanBeAskedFor) {
  BandwidthReservation bandwidth(64);
  std::size_t most = 0;
  for (Cycle cycle = 0; cycle < 1'000'000; cycle += 3) {
    bandwidth.take(cycle, 32, cycle);
    most = std::max(most, bandwidth.kept_cycles());
  }
  EXPECT_LE(most, 1024U);
}

// As with a clock of an L2 that is ten thousand times slower than that of the DRAM behind it.
TEST(BandwidthReservation, WhatIsFarAheadOfEverythingTakesNoRoom) {
  constexpr Cycle far = Cycle{1} << 34U;
  for (const unsigned width : {1U, 32U}) {
    BandwidthReservation bandwidth(width);
    EXPECT_EQ(bandwidth.take(5, 3 * width, 0), 8U);
    for (Cycle ahead = far; ahead < 8 * far; ahead += far) {
      EXPECT_EQ(bandwidth.take(ahead, width, 0), ahead + 1);
      EXPECT_EQ(bandwidth.take(ahead, width, 0), ahead + 2) << "the furthest are a queue";
    }
    EXPECT_LE(bandwidth.kept_cycles(), BandwidthReservation::most_cycles);
    EXPECT_EQ(bandwidth.take(5, width, 0), 9U);
    EXPECT_EQ(bandwidth.take(far, 2 * width, 0), far + 2) << "that it was taken is forgotten";
    EXPECT_EQ(bandwidth.reserved_between(0, far), 4U * width);
  }
}

TEST(BandwidthReservation, AnAccessFromBeforeWhatItRemembersWaitsAndTakesNothingTwice) {
  BandwidthReservation bandwidth(64);
  bandwidth.take(0, 32, 0);
  bandwidth.take(1000, 32, 1000);
  bandwidth.take(2000, 32, 2000);
  EXPECT_EQ(bandwidth.take(5, 64, 2000), 2000U - BandwidthReservation::remembered_cycles + 1);
  EXPECT_EQ(bandwidth.take(2000, 64, 2000), 2002U);
}

}  // namespace
}  // namespace vrpipe
