#include "wdx/wdx.h"

#include <map>
#include <numeric>

#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

namespace {

/// About half of the GPCs further, so that diagonals are no GPC's either; coprime, so that a column has all of them.
unsigned row_step_of(unsigned gpcs) {
  unsigned step = gpcs / 2 + 1;
  while (std::gcd(step, gpcs) != 1) ++step;
  return step;
}

}  // namespace

TileTable::TileTable(const WdxParameters& parameters, const RenderContext& context, unsigned entries,
                     unsigned row_offset)
    : gpcs_(context.placement.gpcs),
      unit_tiles_(parameters.unit_tiles),
      entries_(entries),
      row_offset_(row_offset),
      timing_{parameters.primitives_per_cycle, parameters.latency_cycles, parameters.credits} {}

unsigned TileTable::owner_of(TileId tile) const {
  return (tile.x / unit_tiles_ + tile.y / unit_tiles_ * row_offset_) % entries_ % gpcs_;
}

TileInterleave::TileInterleave(const Parameters& parameters, const RenderContext& context)
    : TileTable(parameters, context, context.placement.gpcs, row_step_of(context.placement.gpcs)) {}

TpcTable::TpcTable(const Parameters& parameters, const RenderContext& context)
    : TileTable(parameters, context, context.placement.gpcs * parameters.tpcs_per_gpc,
                parameters.row_offset > 0 ? static_cast<unsigned>(parameters.row_offset)
                                          : row_offset_of(context.placement.gpcs * parameters.tpcs_per_gpc)) {}

unsigned TpcTable::row_offset_of(unsigned tpcs) {
  static const std::map<unsigned, unsigned> as_listed{{1, 1},  {2, 1},  {3, 2},  {5, 1},  {7, 1},
                                                      {10, 6}, {11, 7}, {13, 2}, {14, 5}, {15, 6}};
  const auto listed = as_listed.find(tpcs);
  if (listed != as_listed.end()) return listed->second;
  // The first odd number above 1 that is coprime is a prime.
  unsigned prime = 3;
  while (std::gcd(prime, tpcs) != 1) prime += 2;
  return prime;
}

namespace {
// The measured draw and builtin:indoor on 2, 4 and 7 GPCs, units of 1 and 4 tiles: cycles within 2 % of `cycle`.
const SlotRegistrar wdx_slot{{"wdx", 25, "interleave", "", false, check_wdx}, {{"credits", 2, 65536}}};
const Registrar<TileInterleave, WdxBehaviour> interleave("wdx", "interleave",
                                                         "units of screen tiles go to the GPCs in turn", false,
                                                         Trust::trusted);
const Registrar<TpcTable, WdxBehaviour> table("wdx", "tpc-table",
                                              "units of screen tiles go to GPCs by a table of TPCs with a row offset",
                                              false, Trust::trusted);
}  // namespace

}  // namespace vrpipe
