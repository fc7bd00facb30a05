#include "jobs/microbench_job.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <thread>

#include <fmt/format.h>

#include <vrpipe/component/error.h>
#include <vrpipe/workloads/microbench.h>

#include "jobs/processes.h"
#include "jobs/published_figures.h"

namespace vrpipe {

namespace {

using microbench::FramePointer;
using tools::GpuScope;
using tools::PublishedFigure;

struct Definition;

/// The simulations of a microbenchmark, and what comes of them.
class Bench {
 public:
  Bench(const Definition& definition, const RunRequest& request, unsigned processes, MicrobenchResult& result)
      : definition_(definition), request_(request), processes_(processes), result_(result) {}

  const RunRequest& request() const { return request_; }
  unsigned gpcs() const { return request_.platform->gpcs; }
  bool has_time() const { return request_.fidelity != Fidelity::functional; }

  /// A simulation that `run` is to do; returns its number.
  std::size_t add(const RunRequest& request, std::function<FramePointer()> frame) {
    tasks_.push_back({definition_name(), request, [frame = std::move(frame)](const RunRequest&) { return frame(); }});
    return tasks_.size() - 1;
  }
  std::size_t add(std::function<FramePointer()> frame) { return add(request_, std::move(frame)); }
  /// All that have been added since the last time.
  void run(bool with_images = false);
  const tools::Simulated& operator[](std::size_t index) const { return done_[index]; }
  double cycles(std::size_t index) const { return static_cast<double>(done_[index].result.cycles.value_or(0)); }

  /// What was measured under a name that published_figures() has.
  void figure(const std::string& name, double measured, const std::string& note = {});
  void curve(MicrobenchCurve curve) { result_.curves.push_back(std::move(curve)); }

 private:
  std::string definition_name() const;

  const Definition& definition_;
  const RunRequest request_;
  const unsigned processes_;
  MicrobenchResult& result_;
  tools::ProgressLine progress_;
  std::vector<tools::Task> tasks_;
  std::vector<tools::Simulated> done_;
};

/// Two frames that differ in how much work they have: start-up and the way through the pipeline cancel.
class Slope {
 public:
  /// @param frame  makes one of so many items
  Slope(Bench& bench, const RunRequest& request, unsigned items,
        const std::function<FramePointer(unsigned items)>& frame)
      : bench_(bench),
        items_(2 * items),
        short_(bench.add(request, [frame, items] { return frame(items); })),
        long_(bench.add(request, [frame, items] { return frame(3 * items); })) {}
  Slope(Bench& bench, unsigned items, const std::function<FramePointer(unsigned items)>& frame)
      : Slope(bench, bench.request(), items, frame) {}

  double clk_per_item() const { return (bench_.cycles(long_) - bench_.cycles(short_)) / items_; }
  double items_per_clk() const { return 1 / clk_per_item(); }
  /// Of a statistic of the longer run.
  double per_item(const std::string& statistic) const {
    return (value(long_, statistic) - value(short_, statistic)) / items_;
  }

 private:
  double value(std::size_t index, const std::string& statistic) const {
    for (const StatisticReport& report : bench_[index].result.statistics) {
      if (report.name == statistic) return static_cast<double>(report.value);
    }
    return 0;
  }
  const Bench& bench_;
  const double items_;
  const std::size_t short_;
  const std::size_t long_;
};

void tile_binning(Bench& bench) {
  const unsigned gpcs = bench.gpcs();
  constexpr unsigned rounds = 10;
  std::vector<unsigned> tiles;
  for (unsigned n = 1; n <= 80; ++n) tiles.push_back(n);
  tiles.insert(tiles.end(), {96, 128, 256});
  for (const unsigned n : tiles) bench.add([n, gpcs] { return microbench::rounds_over_tiles(n, rounds, gpcs); });
  std::vector<std::size_t> apart;
  for (unsigned pixels = 2; pixels <= 32; pixels += 2)
    apart.push_back(bench.add([pixels] { return microbench::pair_at_distance(pixels); }));
  std::vector<unsigned> order;
  for (unsigned tile = 0; tile < 32; ++tile) order.push_back(tile);
  order.insert(order.end(), {0, 32, 0, 1, 2});
  const std::size_t replacement = bench.add([order, gpcs] { return microbench::quads_in_tiles(order, gpcs); });
  bench.run();

  MicrobenchCurve warps{"warps launched for ten rounds of quads", "screen tiles", "warps", {}, {}, {}};
  unsigned bins = 0;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const std::uint64_t launched = bench[i].result.counts.warps;
    warps.measured.emplace_back(tiles[i], launched);
    // Beyond the bins each quad has a warp of its own; up to there eight share one, but for what the time-out parts.
    if (bins + 1 == tiles[i] && 2 * launched < std::uint64_t{rounds} * tiles[i]) bins = tiles[i];
  }
  warps.gpu = tools::gpu_warps_of_ten_rounds();
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
    if (gap <= tools::gpu_pairs_by_gap().back().first) share.measured.emplace_back(gap, is_parted(point) ? 0 : 1);
    if (is_parted(point)) apart_from = std::min(apart_from, gap);
    if (!is_parted(point)) together = std::max(together, gap);
  }
  std::sort(share.measured.begin(), share.measured.end());
  share.gpu = tools::gpu_pairs_by_gap();
  bench.figure("gap that parts a pair", (together + apart_from) / 2,
               "where half of the pairs part: a step in the simulator, a slope from 120 to 220 clk on the real GPU");
  bench.curve(std::move(share));
}

void rop_throughput(Bench& bench) {
  struct Point {
    std::string name;
    ColorFormat format;
    bool blend;
    unsigned side;
    Slope slope;
  };
  std::vector<Point> points;
  for (const unsigned side : {32U, 64U, 1024U}) {
    for (const bool blend : {true, false}) {
      for (const auto& [format, name] : {std::pair{ColorFormat::rgba8, "RGBA8"},
                                         {ColorFormat::rgba16f, "RGBA16F"},
                                         {ColorFormat::rgba32f, "RGBA32F"}}) {
        RunRequest request = bench.request();
        request.format = format;
        // So many that the first fills do not matter where there are no others.
        const unsigned layers = side == 1024 ? 1 : 32;
        points.push_back({fmt::format("{}, {}, {}x{}", name, blend ? "blending" : "no blending", side, side), format,
                          blend, side, Slope(bench, request, layers, [side = side, blend = blend](unsigned count) {
                            return microbench::stacked_layers(side, count, blend);
                          })});
      }
    }
  }
  bench.run();
  std::map<std::string, double> rates;
  const std::string of_a_gpc = bench.gpcs() > 1 ? fmt::format("a GPC's share of {}", bench.gpcs()) : "";
  for (const Point& point : points) {
    rates[point.name] = point.side * point.side * point.slope.items_per_clk() / bench.gpcs();
    bench.figure(point.name, rates[point.name], of_a_gpc);
  }
  bench.figure("RGBA8 over RGBA16F, blending, 32x32",
               rates["RGBA8, blending, 32x32"] / rates["RGBA16F, blending, 32x32"]);
  for (const bool blend : {true, false}) {
    MicrobenchCurve curve{
        blend ? "blending, 32x32 pixels" : "no blending, 32x32 pixels", "bytes of a pixel", "pixels/clk", {}, {}, {}};
    for (const Point& point : points) {
      if (point.blend != blend || point.side != 32) continue;
      const PublishedFigure& published = tools::published_figure("rop-throughput", point.name);
      const double bytes = bytes_per_pixel(point.format);
      curve.measured.emplace_back(bytes, rates[point.name]);
      if (published.gpu) curve.gpu.emplace_back(bytes, *published.gpu);
      if (published.paper) curve.paper.emplace_back(bytes, *published.paper);
    }
    bench.curve(std::move(curve));
  }
}

void quad_coverage(Bench& bench) {
  using microbench::LivePixels;
  constexpr unsigned side = 64;
  const std::pair<LivePixels, const char*> patterns[] = {{LivePixels::four, ""},
                                                         {LivePixels::three, "3 of 4"},
                                                         {LivePixels::two_horizontal, "2 of 4, side by side"},
                                                         {LivePixels::two_vertical, "2 of 4, one above the other"},
                                                         {LivePixels::two_diagonal, "2 of 4, diagonal"},
                                                         {LivePixels::one, "1 of 4"}};
  std::vector<Slope> through_stencil;
  for (const auto& [pixels, name] : patterns) {
    through_stencil.emplace_back(bench, 24, [pixels = pixels](unsigned layers) {
      return microbench::layers_through_stencil(pixels, side, layers);
    });
  }
  std::vector<Slope> scattered;
  for (const microbench::Shape& shape : microbench::shapes()) {
    const unsigned count = shape.quads() > 100 ? 150 : 3000;
    scattered.emplace_back(bench, count, [&shape](unsigned shapes) { return microbench::scattered(shape, shapes); });
  }
  bench.run();
  const auto of_a_live_pixel = [&](std::size_t i) {
    return through_stencil[i].clk_per_item() / microbench::live_of(patterns[i].first);
  };
  MicrobenchCurve curve{"time of a live pixel", "live pixels of a quad", "times that of four", {}, {}, {}};
  for (std::size_t i = 0; i < through_stencil.size(); ++i) {
    const double times = of_a_live_pixel(i) / of_a_live_pixel(0);
    const double live = microbench::live_of(patterns[i].first);
    curve.measured.emplace_back(live, times);
    if (i == 0) {
      curve.gpu.emplace_back(live, 1);
      continue;
    }
    const std::string name = std::string("time of a live pixel, ") + patterns[i].second;
    bench.figure(name, times);
    curve.gpu.emplace_back(live, tools::published_figure("quad-coverage", name).gpu.value());
  }
  std::map<std::string, double> quads;
  for (std::size_t i = 0; i < scattered.size(); ++i) {
    const microbench::Shape& shape = microbench::shapes()[i];
    quads[shape.name] = shape.quads() * scattered[i].items_per_clk();
  }
  bench.figure("quads of 1x256 columns over those of 2x256", quads["1x256 columns"] / quads["2x256 columns"]);
  bench.figure("quads of 256x1 rows over those of 256x2", quads["256x1 rows"] / quads["256x2 rows"]);
  for (const microbench::Shape& shape : microbench::shapes()) {
    bench.figure(shape.name, quads[shape.name],
                 fmt::format("{} live pixel{} a quad", shape.live_per_quad(), shape.live_per_quad() == 1 ? "" : "s"));
  }
  bench.curve(std::move(curve));
}

void crop_cache(Bench& bench) {
  const unsigned gpcs = bench.gpcs();
  constexpr unsigned kilobytes_of_8x16 = 1;  // of RGBA16F
  RunRequest rgba16f = bench.request();
  rgba16f.format = ColorFormat::rgba16f;
  const std::vector<unsigned> sets{1,  2,  4,  6,  7,  8,  9,  10, 11, 12, 13, 14, 15, 16,
                                   17, 18, 20, 24, 28, 31, 32, 33, 34, 36, 40, 48, 64};
  std::vector<Slope> reads;
  for (const unsigned rectangles : sets) {
    reads.emplace_back(bench, rgba16f, 12, [rectangles, gpcs](unsigned rounds) {
      return microbench::rectangles_in_turn(rectangles, rounds, 8, 16, true, gpcs);
    });
  }
  const std::vector<unsigned> in_turn{1, 2, 4, 8, 16, 24, 31, 32, 33, 34, 36, 40, 48, 56, 64, 80, 96, 112, 128};
  struct Return {
    unsigned tiles;
    bool blend;
    Slope slope;
  };
  std::vector<Return> returns;
  for (const bool blend : {true, false}) {
    for (const unsigned tiles : in_turn) {
      returns.push_back(
          {tiles, blend,
           Slope(bench, rgba16f, std::max(64U, 4096 / tiles), [tiles, blend = blend, gpcs](unsigned rounds) {
             return microbench::rectangles_in_turn(tiles, rounds, 2, 2, blend, gpcs);
           })});
    }
  }
  bench.run();

  constexpr double sector_bytes = 32;
  MicrobenchCurve curve{"sectors read for a rectangle of 8x16 pixels", "working set, KB", "sectors", {}, {}, {}};
  double largest = 0;
  bool fits = true;
  for (std::size_t i = 0; i < sets.size(); ++i) {
    const double sectors = reads[i].per_item("crop.cache.bytes_filled") / sector_bytes / sets[i];
    curve.measured.emplace_back(sets[i] * kilobytes_of_8x16, sectors);
    fits = fits && sectors == 0;
    if (fits) largest = sets[i] * kilobytes_of_8x16;
  }
  curve.gpu = tools::gpu_reads_by_working_set();
  bench.figure("largest working set without reads", largest);
  bench.curve(std::move(curve));

  for (const bool blend : {true, false}) {
    MicrobenchCurve turn{blend ? "quads on tiles in turn, blending" : "quads on tiles in turn, no blending",
                         "screen tiles",
                         "clk a quad, times the tiles",
                         {},
                         {},
                         {}};
    for (const Return& each : returns) {
      if (each.blend == blend) turn.measured.emplace_back(each.tiles, each.slope.clk_per_item());
    }
    turn.gpu = blend ? tools::gpu_returns_blending() : tools::gpu_returns_without_blending();
    const auto at = [&](double tiles) {
      return std::find_if(turn.measured.begin(), turn.measured.end(), [&](const auto& p) { return p.first == tiles; })
          ->second;
    };
    if (blend) {
      bench.figure("a quad on the same place, blending", at(1));
      bench.figure("return of a line, 64 tiles in turn, blending", at(64));
      const auto found = std::find_if(returns.begin(), returns.end(),
                                      [](const Return& each) { return each.blend && each.tiles == 64; });
      const double bytes = found->slope.per_item("crop.cache.bytes_filled") +
                           found->slope.per_item("crop.cache.bytes_written_back") +
                           found->slope.per_item("crop.cache.sectors_fetched_again") * sector_bytes;
      bench.figure("sectors moved for a quad, 64 tiles in turn", bytes / sector_bytes / 64);
    } else {
      bench.figure("a quad on 64 tiles in turn, no blending", at(64) / 64);
    }
    bench.curve(std::move(turn));
  }
}

void blend_order(Bench& bench) {
  constexpr unsigned layers = 24;
  constexpr unsigned side = 256;
  // Every port stalls at random, those of the shaders among them, so that warps are done in another order.
  const std::pair<unsigned, const char*> stalls[] = {{0, "pixels out of order, no random stalls"},
                                                     {32, "pixels out of order, stalls in 1 of 8 cycles"},
                                                     {128, "pixels out of order, stalls in 1 of 2 cycles"}};
  for (const auto& [per_256, name] : stalls) {
    RunRequest request = bench.request();
    request.stall_seed = per_256 == 0 ? 0 : 20261121;
    request.stall_per_256 = per_256;
    bench.add(request, [] { return microbench::overlapping_layers(layers, side); });
  }
  bench.run(true);
  std::size_t i = 0;
  for (const auto& [per_256, name] : stalls) {
    const tools::Simulated& simulated = bench[i++];
    BlendRounding rounding = BlendRounding::rne;
    for (const auto& [parameter, value] : simulated.result.parameters) {
      if (parameter == "state.blend_rounding" && value == "rtz") rounding = BlendRounding::rtz;
      if (parameter == "state.blend_rounding" && value == "measured") rounding = BlendRounding::measured;
    }
    const std::array<float, 4> expected = microbench::blended_in_order(*microbench::overlapping_layers(layers, side),
                                                                       simulated.result.request.format, rounding);
    const float* value = simulated.image.value().values();
    unsigned wrong = 0;
    for (unsigned pixel = 0; pixel < side * side; ++pixel, value += 4)
      wrong += std::equal(expected.begin(), expected.end(), value) ? 0 : 1;
    bench.figure(name, wrong, "of 65,536 with 24 layers; the order monitor saw no quad out of order either");
  }
}

void front_end(Bench& bench) {
  using microbench::KilledBy;
  using microbench::Small;
  const std::pair<Small, const char*> kinds[] = {{Small::culled, "culled rectangle"},
                                                 {Small::rectangle, "rectangle of 2x2"},
                                                 {Small::two_triangles, "splat of 2x2, two triangles"}};
  std::vector<std::pair<std::string, Slope>> primitives;
  for (const auto& [kind, name] : kinds) {
    primitives.emplace_back(name, Slope(bench, 2000, [kind = kind](unsigned count) {
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
  std::vector<Slope> pairs;
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
  curve.gpu = {{1, tools::published_figure("front-end", "rectangle of 2x2").gpu.value()},
               {64, tools::published_figure("front-end", all[2].name).gpu.value()}};
  bench.curve(std::move(curve));
}

void kill_rate(Bench& bench) {
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
  std::vector<Slope> rates;
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
    if (const auto gpu = tools::published_figure("kill-rate", all[i].name).gpu)
      curve.gpu.emplace_back(all[i].side, *gpu);
  }
  std::sort(curve.measured.begin(), curve.measured.end());
  std::sort(curve.gpu.begin(), curve.gpu.end());
  bench.curve(std::move(curve));
}

struct Definition {
  const char* name;
  const char* question;
  bool needs_time;
  void (*run)(Bench& bench);
};

const std::vector<Definition>& definitions() {
  static const std::vector<Definition> all{
      {"tile-binning",
       "How many screen tiles are binned at a time, which bin goes for another, and when does one time out?", false,
       tile_binning},
      {"rop-throughput", "How many pixels a clock does CROP write or blend, by format, in its cache and beyond it?",
       true, rop_throughput},
      {"quad-coverage", "Does a quad with fewer live pixels take less time?", true, quad_coverage},
      {"crop-cache", "What does the colour cache hold, and what does a line cost that comes back?", true, crop_cache},
      {"blend-order", "Are pixels blended in the order of primitives, whatever delays the shaders?", false,
       blend_order},
      {"front-end",
       "How many clocks does a primitive take, or a (primitive, screen tile) pair, when nothing is shaded?", true,
       front_end},
      {"kill-rate", "How many quads a clock do stencil, depth, Hi-Z and the shader kill?", true, kill_rate},
  };
  return all;
}

const Definition& definition_named(const std::string& name) {
  const std::vector<Definition>& all = definitions();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Definition& each) { return each.name == name; });
  if (found != all.end()) return *found;
  const std::vector<std::string> known = microbench_names();
  throw UserError("unknown microbenchmark '" + name + "'", "vrpipe microbench", "there is no such one",
                  fmt::format("did you mean {}? There are {}, and all", nearest_name(name, known),
                              fmt::join(known, ", ")));
}

std::string Bench::definition_name() const { return definition_.name; }

void Bench::run(bool with_images) {
  const std::size_t first = done_.size();
  const std::vector<tools::Task> tasks(tasks_.begin() + static_cast<std::ptrdiff_t>(first), tasks_.end());
  done_.resize(tasks_.size());
  tools::BatchPlace place;
  place.title = definition_.name;
  tools::run_tasks(tasks, with_images, processes_, place, progress_,
                   [&](std::size_t index, tools::Simulated&& simulated) {
                     done_[first + index] = std::move(simulated);
                   });
  progress_.erase();
  result_.parameters = done_.front().result.parameters;
}

void Bench::figure(const std::string& name, double measured, const std::string& note) {
  const PublishedFigure& published = tools::published_figure(definition_.name, name);
  const std::string& platform = request_.platform->name;
  const bool is_real_gpus = platform == measured_platform;
  const bool is_papers = platform.rfind("agx-orin", 0) == 0;
  MicrobenchFigure figure;
  figure.name = name;
  figure.unit = published.unit;
  figure.paper = published.paper;
  figure.gpu = published.gpu;
  figure.measured = measured;
  figure.tolerance_percent = published.tolerance_percent;
  figure.source = published.source;
  if (!is_real_gpus && published.gpu && published.scope == GpuScope::partition) figure.gpu_is_of = one_partition;
  if (!is_real_gpus && published.gpu && published.scope == GpuScope::gpc) figure.gpu_is_of = one_gpc;
  const bool is_same = published.scope == GpuScope::any;
  const bool papers_holds = published.paper && (is_papers || is_same);
  if (published.gpu && (is_real_gpus || (is_same && !papers_holds))) {
    figure.reference = published.gpu;
    figure.reference_is = "real GPU";
  } else if (papers_holds) {
    figure.reference = published.paper;
    figure.reference_is = "paper";
  }
  figure.note = note;
  if (note.empty() && !figure.agrees() && figure.reference) figure.note = published.why;
  result_.figures.push_back(std::move(figure));
}

}  // namespace

std::optional<double> MicrobenchFigure::difference_percent() const {
  if (!reference) return std::nullopt;
  if (measured == *reference) return 0;
  if (*reference == 0) return std::nullopt;
  return 100 * (measured / *reference - 1);
}

bool MicrobenchFigure::agrees() const {
  const std::optional<double> difference = difference_percent();
  return difference && std::fabs(*difference) <= std::max(tolerance_percent, 0.0);
}

std::vector<std::string> microbench_names() {
  std::vector<std::string> names;
  for (const Definition& each : definitions()) names.emplace_back(each.name);
  return names;
}

void check_microbench_name(const std::string& name) { definition_named(name); }

void check_microbench(const std::string& name, const RunRequest& request) {
  if (!definition_named(name).needs_time || request.fidelity != Fidelity::functional) return;
  throw UserError("cannot measure " + name, "--fidelity functional", "it measures time, and this fidelity has none",
                  "use bound, lt, at or cycle");
}

MicrobenchResult run_microbench(const std::string& name, const RunRequest& request, unsigned processes) {
  const Definition& definition = definition_named(name);
  check_microbench(name, request);
  MicrobenchResult result;
  result.name = name;
  result.question = definition.question;
  result.platform = request.platform->name;
  // The real GPU has neither extension.
  RunRequest baseline = request;
  baseline.variant = variant_named("baseline");
  if (processes == 0) processes = std::max(1U, std::thread::hardware_concurrency());
  const auto start = std::chrono::steady_clock::now();
  Bench bench(definition, baseline, processes, result);
  definition.run(bench);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace vrpipe
