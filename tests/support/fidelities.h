#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/pipeline/batch.h>
#include <vrpipe/pipeline/slots/tc.h>
#include <vrpipe/testkit/bench.h>

#include "support/builders.h"

namespace vrpipe::testing {

inline const std::vector<Fidelity>& fidelities_with_time() {
  static const std::vector<Fidelity> all{Fidelity::lt, Fidelity::cycle};
  return all;
}
inline std::string name_of_fidelity(const ::testing::TestParamInfo<Fidelity>& fidelity) {
  return name_of(fidelity.param);
}

/// The cycles of a sink's records.
template <class Item>
std::vector<Cycle> cycles_of(const testkit::Sink<Item>& sink) {
  std::vector<Cycle> cycles;
  for (const auto& record : sink.records()) cycles.push_back(record.cycle);
  return cycles;
}

/// Closes the account of a unit; what it charged to a state. Every cycle is charged to one.
inline std::uint64_t charged(Unit& unit, UnitState state, Cycle end) {
  unit.close_account(end);
  std::uint64_t sum = 0;
  for (unsigned each = 0; each < unit_states; ++each) sum += unit.account().cycles(static_cast<UnitState>(each));
  EXPECT_EQ(sum, end) << "the states' cycles are those of the run";
  return unit.account().cycles(state);
}

/// How long a kind of work kept its resource, up to a cycle.
inline double occupied(const Unit& unit, unsigned kind, Cycle end = never) {
  return unit.occupancy().parts(end).at(kind).cycles;
}

/// Flushed bins, and the places where their quads are.
class Bins {
 public:
  BinItem of(TileId tile, const std::vector<Quad>& quads) {
    BinStorage& storage = storage_.emplace_back();
    storage.in_use = true;
    storage.flush.tile = tile;
    storage.flush.quads = quads;
    BinItem item;
    item.storage = &storage;
    item.tile = tile;
    item.quads = static_cast<std::uint32_t>(quads.size());
    return item;
  }
  /// Full quads at these positions, of splats first, first + 1, ...
  BinItem at(TileId tile, const std::vector<unsigned>& positions, std::uint32_t first_splat = 0) {
    std::vector<Quad> quads;
    for (const unsigned position : positions) {
      quads.push_back({first_splat++, static_cast<std::uint8_t>(position), all_lanes, 0, 0});
    }
    return of(tile, quads);
  }
  static BinItem end() {
    BinItem item;
    item.mark = Mark::end_of_frame;
    return item;
  }

 private:
  std::deque<BinStorage> storage_;
};

/// The splats of a bin's quads.
inline std::vector<std::uint32_t> splats_of(const BinItem& bin) {
  std::vector<std::uint32_t> splats;
  for (std::uint32_t i = 0; i < bin.quads; ++i) splats.push_back(bin.storage->flush.quads[i].splat);
  return splats;
}

}  // namespace vrpipe::testing
