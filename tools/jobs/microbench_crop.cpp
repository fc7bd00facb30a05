#include "jobs/microbench_bench.h"

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "jobs/published_figures.h"

namespace vrpipe::tools {

void measure_rop_throughput(MicrobenchBench& bench) {
  struct Point {
    std::string name;
    ColorFormat format;
    bool blend;
    unsigned side;
    MicrobenchSlope slope;
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
                          blend, side,
                          MicrobenchSlope(bench, request, layers, [side = side, blend = blend](unsigned count) {
                            return microbench::stacked_layers(side, count, blend);
                          })});
      }
    }
  }
  bench.run();
  std::map<std::string, double> rates;
  const std::string of_a_gpc =
      bench.first_gpc().gpcs > 1 ? fmt::format("a GPC's share of {}", bench.first_gpc().gpcs) : "";
  for (const Point& point : points) {
    rates[point.name] = point.side * point.side * point.slope.items_per_clk() / bench.first_gpc().gpcs;
    bench.figure(point.name, rates[point.name], of_a_gpc);
  }
  bench.figure("RGBA8 over RGBA16F, blending, 32x32",
               rates["RGBA8, blending, 32x32"] / rates["RGBA16F, blending, 32x32"]);
  for (const bool blend : {true, false}) {
    MicrobenchCurve curve{
        blend ? "blending, 32x32 pixels" : "no blending, 32x32 pixels", "bytes of a pixel", "pixels/clk", {}, {}, {}};
    for (const Point& point : points) {
      if (point.blend != blend || point.side != 32) continue;
      const PublishedFigure& published = published_figure("rop-throughput", point.name);
      const double bytes = bytes_per_pixel(point.format);
      curve.measured.emplace_back(bytes, rates[point.name]);
      if (published.gpu) curve.gpu.emplace_back(bytes, *published.gpu);
      if (published.paper) curve.paper.emplace_back(bytes, *published.paper);
    }
    bench.curve(std::move(curve));
  }
}

void measure_quad_coverage(MicrobenchBench& bench) {
  using microbench::LivePixels;
  constexpr unsigned side = 64;
  const std::pair<LivePixels, const char*> patterns[] = {{LivePixels::four, ""},
                                                         {LivePixels::three, "3 of 4"},
                                                         {LivePixels::two_horizontal, "2 of 4, side by side"},
                                                         {LivePixels::two_vertical, "2 of 4, one above the other"},
                                                         {LivePixels::two_diagonal, "2 of 4, diagonal"},
                                                         {LivePixels::one, "1 of 4"}};
  std::vector<MicrobenchSlope> through_stencil;
  for (const auto& [pixels, name] : patterns) {
    through_stencil.emplace_back(bench, 24, [pixels = pixels](unsigned layers) {
      return microbench::layers_through_stencil(pixels, side, layers);
    });
  }
  std::vector<MicrobenchSlope> scattered;
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
    curve.gpu.emplace_back(live, published_figure("quad-coverage", name).gpu.value());
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

void measure_crop_cache(MicrobenchBench& bench) {
  const microbench::GpcTiles& gpc = bench.first_gpc();
  constexpr unsigned kilobytes_of_8x16 = 1;  // of RGBA16F
  RunRequest rgba16f = bench.request();
  rgba16f.format = ColorFormat::rgba16f;
  const std::vector<unsigned> sets{1,  2,  4,  6,  7,  8,  9,  10, 11, 12, 13, 14, 15, 16,
                                   17, 18, 20, 24, 28, 31, 32, 33, 34, 36, 40, 48, 64};
  std::vector<MicrobenchSlope> reads;
  for (const unsigned rectangles : sets) {
    reads.emplace_back(bench, rgba16f, 12, [rectangles, &gpc](unsigned rounds) {
      return microbench::rectangles_in_turn(rectangles, rounds, 8, 16, true, gpc);
    });
  }
  const std::vector<unsigned> in_turn{1, 2, 4, 8, 16, 24, 31, 32, 33, 34, 36, 40, 48, 56, 64, 80, 96, 112, 128};
  struct Return {
    unsigned tiles;
    bool blend;
    MicrobenchSlope slope;
  };
  std::vector<Return> returns;
  for (const bool blend : {true, false}) {
    for (const unsigned tiles : in_turn) {
      returns.push_back(
          {tiles, blend,
           MicrobenchSlope(bench, rgba16f, std::max(64U, 4096 / tiles), [tiles, blend = blend, &gpc](unsigned rounds) {
             return microbench::rectangles_in_turn(tiles, rounds, 2, 2, blend, gpc);
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
  curve.gpu = gpu_reads_by_working_set();
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
    turn.gpu = blend ? gpu_returns_blending() : gpu_returns_without_blending();
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

void measure_blend_order(MicrobenchBench& bench) {
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
    const Simulated& simulated = bench[i++];
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

}  // namespace vrpipe::tools
