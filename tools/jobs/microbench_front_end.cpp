#include "jobs/microbench_bench.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "jobs/published_figures.h"

namespace vrpipe::tools {

void measure_tile_binning(MicrobenchBench& bench) {
  const microbench::GpcTiles& gpc = bench.first_gpc();
  constexpr unsigned rounds = 10;
  std::vector<unsigned> tiles;
  for (unsigned n = 1; n <= 80; ++n) tiles.push_back(n);
  tiles.insert(tiles.end(), {96, 128, 256});
  for (const unsigned n : tiles) bench.add([n, &gpc] { return microbench::rounds_over_tiles(n, rounds, gpc); });
  std::vector<std::size_t> apart;
  for (unsigned pixels = 2; pixels <= 32; pixels += 2)
    apart.push_back(bench.add([pixels] { return microbench::pair_at_distance(pixels); }));
  std::vector<unsigned> order;
  for (unsigned tile = 0; tile < 32; ++tile) order.push_back(tile);
  order.insert(order.end(), {0, 32, 0, 1, 2});
  const std::size_t replacement = bench.add([order, &gpc] { return microbench::quads_in_tiles(order, gpc); });
  bench.run();

  MicrobenchCurve warps{"warps launched for ten rounds of quads", "screen tiles", "warps", {}, {}, {}};
  unsigned bins = 0;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const std::uint64_t launched = bench[i].result.counts.warps;
    warps.measured.emplace_back(tiles[i], launched);
    // Beyond the bins each quad has a warp of its own; up to there eight share one, but for what the time-out parts.
    if (bins + 1 == tiles[i] && 2 * launched < std::uint64_t{rounds} * tiles[i]) bins = tiles[i];
  }
  warps.gpu = gpu_warps_of_ten_rounds();
  warps.paper = {{32, 67}, {33, 330}};
  bench.figure("warps, 320 quads over 32 tiles", static_cast<double>(bench[31].result.counts.warps));
  bench.figure("warps, 330 quads over 33 tiles", static_cast<double>(bench[32].result.counts.warps));
  bench.figure("bins", bins);
  double side = 0;
  for (std::size_t i = 0; i < apart.size() && side == 0; ++i) {
    if (bench[apart[i]].result.counts.warps == 2) side = 2 * static_cast<double>(i + 1);
  }
  bench.figure("side of a bin's tile", side);
  const std::uint64_t replaced = bench[replacement].result.counts.warps;
  bench.figure("warps, tiles 0 to 31, 0, 32, 0, 1, 2", static_cast<double>(replaced),
               replaced == 36   ? "36 of 37: the bin that was allocated first goes, first in, first out"
               : replaced == 35 ? "35 of 37: the bin that was least recently used goes"
                                : "neither first in, first out (36) nor least recently used (35) of 32 bins");
  bench.curve(std::move(warps));
  if (!bench.has_time()) return;

  // What is culled takes the front end's time and makes no quad. How much later the second of the pair comes for it is
  // how much later the frame ends.
  const auto gap_points = [&](unsigned from, unsigned to, unsigned step) {
    std::vector<std::pair<unsigned, std::size_t>> points;
    for (unsigned culled = from; culled < to; culled += step)
      points.emplace_back(culled, bench.add([culled] { return microbench::pair_with_gap(culled); }));
    bench.run();
    return points;
  };
  constexpr unsigned step = 16;
  std::vector<std::pair<unsigned, std::size_t>> points = gap_points(0, 1024, step);
  const auto is_parted = [&](const auto& point) { return bench[point.second].result.counts.warps > 1; };
  const auto first = std::find_if(points.begin(), points.end(), is_parted);
  if (first == points.end() || first == points.begin()) return;
  const unsigned parted = first->first;
  const auto more = gap_points(parted - step + 1, parted, 1);
  points.insert(points.end(), more.begin(), more.end());
  MicrobenchCurve share{"pairs in one warp, by the gap between them", "gap, clk", "share of pairs", {}, {}, {}};
  double together = 0;
  double apart_from = std::numeric_limits<double>::infinity();
  for (const auto& point : points) {
    const double gap = bench.cycles(point.second) - bench.cycles(points.front().second);
    if (gap <= gpu_pairs_by_gap().back().first) share.measured.emplace_back(gap, is_parted(point) ? 0 : 1);
    if (is_parted(point)) apart_from = std::min(apart_from, gap);
    if (!is_parted(point)) together = std::max(together, gap);
  }
  std::sort(share.measured.begin(), share.measured.end());
  share.gpu = gpu_pairs_by_gap();
  bench.figure("gap that parts a pair", (together + apart_from) / 2,
               "where half of the pairs part: a step in the simulator, a slope from 120 to 220 clk on the real GPU");
  bench.curve(std::move(share));
}

void measure_front_end(MicrobenchBench& bench) {
  using microbench::KilledBy;
  using microbench::Small;
  const std::pair<Small, const char*> kinds[] = {{Small::culled, "culled rectangle"},
                                                 {Small::rectangle, "rectangle of 2x2"},
                                                 {Small::two_triangles, "splat of 2x2, two triangles"}};
  std::vector<std::pair<std::string, MicrobenchSlope>> primitives;
  for (const auto& [kind, name] : kinds) {
    primitives.emplace_back(name, MicrobenchSlope(bench, 2000, [kind = kind](unsigned count) {
                              return microbench::small_primitives(kind, count);
                            }));
  }
  struct Pairs {
    const char* name;
    KilledBy killer;
    unsigned side, offset, count;
    double pairs;  ///< of a rectangle
  };
  const Pairs all[] = {{"(rectangle, tile) pair, 1024x1024, killed by stencil", KilledBy::stencil, 1024, 0, 1, 4096},
                       {"(rectangle, tile) pair, 1024x1024, killed by Hi-Z", KilledBy::hi_z, 1024, 0, 1, 4096},
                       {"(rectangle, tile) pair, 16x16 on one tile, killed by stencil", KilledBy::stencil, 16, 0, 1024,
                        1},
                       {"(rectangle, tile) pair, 16x16 across four, killed by stencil", KilledBy::stencil, 16, 8, 1024,
                        4}};
  std::vector<MicrobenchSlope> pairs;
  for (const Pairs& each : all) {
    const unsigned image = each.side == 1024 ? 1024 : 256;
    pairs.emplace_back(bench, each.count, [each, image](unsigned count) {
      return microbench::killed_rectangles(each.killer, each.side, count, image, each.offset);
    });
  }
  bench.run();
  for (const auto& [name, slope] : primitives) bench.figure(name, slope.clk_per_item());
  for (std::size_t i = 0; i < pairs.size(); ++i) bench.figure(all[i].name, pairs[i].clk_per_item() / all[i].pairs);

  MicrobenchCurve curve{
      "killed by stencil, by what is drawn", "quads of a (rectangle, tile) pair", "clk a pair", {}, {}, {}};
  curve.measured = {{1, primitives[1].second.clk_per_item()},
                    {16, pairs[3].clk_per_item() / 4},
                    {64, pairs[2].clk_per_item()}};
  curve.gpu = {{1, published_figure("front-end", "rectangle of 2x2").gpu.value()},
               {64, published_figure("front-end", all[2].name).gpu.value()}};
  bench.curve(std::move(curve));
}

void measure_kill_rate(MicrobenchBench& bench) {
  using microbench::KilledBy;
  struct Kill {
    const char* name;
    KilledBy killer;
    unsigned side;
  };
  const Kill all[] = {{"stencil, 64x64", KilledBy::stencil, 64}, {"stencil, 16x16", KilledBy::stencil, 16},
                      {"stencil, 2x2", KilledBy::stencil, 2},    {"depth without Hi-Z, 64x64", KilledBy::depth, 64},
                      {"Hi-Z, 64x64", KilledBy::hi_z, 64},       {"Hi-Z, 16x16", KilledBy::hi_z, 16},
                      {"shader, 64x64", KilledBy::shader, 64},   {"shader, 2x2", KilledBy::shader, 2}};
  const auto quads_of = [](const Kill& kill) { return kill.side * kill.side / 4; };
  std::vector<MicrobenchSlope> rates;
  for (const Kill& kill : all) {
    const unsigned count = std::min(4096U, 131072 / quads_of(kill));
    const unsigned image = kill.side == 2 ? 64 : 256;
    rates.emplace_back(bench, count, [kill, image](unsigned rectangles) {
      return microbench::killed_rectangles(kill.killer, kill.side, rectangles, image);
    });
  }
  bench.run();
  MicrobenchCurve curve{"quads that stencil kills", "side of the rectangles, pixels", "quads/clk", {}, {}, {}};
  for (std::size_t i = 0; i < rates.size(); ++i) {
    const double rate = quads_of(all[i]) * rates[i].items_per_clk();
    bench.figure(all[i].name, rate);
    if (all[i].killer != KilledBy::stencil) continue;
    curve.measured.emplace_back(all[i].side, rate);
    if (const auto gpu = published_figure("kill-rate", all[i].name).gpu) curve.gpu.emplace_back(all[i].side, *gpu);
  }
  std::sort(curve.measured.begin(), curve.measured.end());
  std::sort(curve.gpu.begin(), curve.gpu.end());
  bench.curve(std::move(curve));
}

}  // namespace vrpipe::tools
