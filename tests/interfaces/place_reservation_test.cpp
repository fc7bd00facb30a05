#include <vrpipe/memory/place_reservation.h>

#include <algorithm>
#include <map>
#include <queue>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/arithmetic/random.h>

namespace vrpipe {
namespace {

TEST(PlaceReservation, OfOneIsAQueue) {
  PlaceReservation places(1);
  EXPECT_EQ(places.free_from(100), 100U);
  places.take(100, 150, 0);
  EXPECT_EQ(places.free_from(99), 99U);
  EXPECT_EQ(places.free_from(100), 150U);
  EXPECT_EQ(places.free_from(149), 150U);
  places.take(150, 170, 0);
  EXPECT_EQ(places.free_from(120), 170U);
}

// A multi-server queue in the order of arrival: who comes takes the place that is free first.
TEST(PlaceReservation, InTheOrderOfTimeIsSoManyServers) {
  for (const std::uint32_t places : {1U, 2U, 7U, 64U}) {
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
      PlaceReservation reservation(places);
      std::priority_queue<Cycle, std::vector<Cycle>, std::greater<>> free_at;
      for (std::uint32_t place = 0; place < places; ++place) free_at.push(0);
      Cycle at = 0;
      for (std::uint64_t i = 0; i < 500; ++i) {
        const Cycle arrival = at + mix(seed << 20U | i) % 40;
        const Cycle expected = std::max(arrival, free_at.top());
        at = reservation.free_from(arrival);
        ASSERT_EQ(at, expected) << places << " " << i;
        const Cycle until = at + mix(seed << 21U | i) % 300;
        free_at.pop();
        free_at.push(until);
        reservation.take(at, until, arrival / 2);
      }
    }
  }
}

TEST(PlaceReservation, InAnyOrderCountsWhoHoldsOneInEachCycle) {
  for (const std::uint32_t places : {1U, 3U, 16U}) {
    PlaceReservation reservation(places);
    std::map<Cycle, std::uint32_t> held;
    Cycle present = 0;
    for (std::uint64_t i = 0; i < 3000; ++i) {
      present += mix(i) % 20;
      const Cycle arrival = present + mix(i + 5000) % 3000;
      Cycle expected = arrival;
      while (held[expected] >= places) ++expected;
      const Cycle at = reservation.free_from(arrival);
      ASSERT_EQ(at, expected) << i;
      const Cycle until = at + mix(i + 10000) % (20 * places);
      reservation.take(at, until, present);
      for (Cycle cycle = at; cycle < until; ++cycle) ++held[cycle];
    }
  }
}

TEST(PlaceReservation, ForgetsWhatLiesBehindAndReservesNothingTooFarAhead) {
  PlaceReservation places(1);
  places.take(10, 1000, 0);
  places.take(1'000'000, 1'000'100, 1'000'000);
  EXPECT_EQ(places.free_from(500), 500U);
  EXPECT_EQ(places.free_from(1'000'000), 1'000'100U);
  places.take(1'000'100, 9'000'000, 1'000'000);
  EXPECT_LE(places.free_from(1'000'100), 1'000'000 + PlaceReservation::most_cycles);
  EXPECT_GT(places.free_from(1'000'100), 1'060'000U);
}

}  // namespace
}  // namespace vrpipe
