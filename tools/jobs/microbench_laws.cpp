#include <algorithm>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/workloads/measured_splats.h>

#include "jobs/measured_table.h"
#include "jobs/microbench_bench.h"

namespace vrpipe::tools {

namespace {

using microbench::Box;
using microbench::BoxesAre;
using microbench::SplatsAre;

/// A figure of a law, before what it comes from has been simulated.
struct LawRow {
  std::string group, label;
  double gpu;  ///< clk
  std::function<double()> clk;
  std::string source;
};

/// `pieces`: of an item of the slope.
std::function<double()> clk_of(const MicrobenchSlope& slope, double pieces = 1) {
  return [slope, pieces] { return slope.clk_per_item() / pieces; };
}

void report(MicrobenchBench& bench, const std::vector<LawRow>& rows, const char* unit) {
  for (const LawRow& row : rows) bench.law(row.group, row.label, row.clk(), row.gpu, unit, row.source);
}

/// How splats were drawn: a column of their table.
struct SplatMode {
  const char* column;
  const char* group;
  const char* format;
  SplatsAre what;
};

constexpr float splat_opacity = 0.02F;

RunRequest of_format(const MicrobenchBench& bench, const std::string& format) {
  RunRequest request = bench.request();
  request.format = format == "RGBA8"     ? ColorFormat::rgba8
                   : format == "RGBA16F" ? ColorFormat::rgba16f
                                         : ColorFormat::rgba32f;
  return request;
}

/// Of the tables' column `colour`.
BoxesAre colour_of(const MeasuredRow& row) {
  const std::string& colour = row.text("colour");
  if (colour == "blending") return BoxesAre::blended;
  if (colour == "unchanged") return BoxesAre::unchanged;
  if (colour == "no blending") return BoxesAre::written;
  throw std::logic_error("no colour " + colour);
}

/// Of words such as 4x2 and 4x2@8+6, the latter not in the corner but at pixel (8, 6).
std::vector<Box> boxes_of(const std::string& words) {
  std::vector<Box> boxes;
  std::istringstream in(words);
  for (std::string word; in >> word;) {
    std::istringstream box(word);
    Box& made = boxes.emplace_back(Box{0, 0, 0, 0});
    char separator = 0;
    box >> made.width >> separator >> made.height;
    if (box >> separator) box >> made.x >> separator >> made.y;
  }
  return boxes;
}

/// "4x2, 4x2 at (8, 6) in turn"; rows of quads as such.
std::string label_of(const std::vector<Box>& boxes) {
  if (boxes.size() == 1 && boxes.front().height == 2 && boxes.front().width > 1) {
    const unsigned quads = boxes.front().width / 2;
    return quads == 1 ? "a quad" : fmt::format("a row of {} quads", quads);
  }
  std::string label;
  for (const Box& box : boxes) {
    if (!label.empty()) label += ", ";
    label += fmt::format("{}x{}", box.width, box.height);
    if (box.x > 0 || box.y > 0) label += fmt::format(" at ({}, {})", box.x, box.y);
  }
  return boxes.size() == 1 ? label : label + " in turn";
}

/// Of words such as 1+0: quads by column and row in their tile.
std::vector<Box> quads_of(const std::string& words) {
  std::vector<Box> quads;
  std::istringstream in(words);
  unsigned column = 0, row = 0;
  for (char separator = 0; in >> column >> separator >> row;) quads.push_back({2 * column, 2 * row, 2, 2});
  return quads;
}

/// "(0, 0), (1, 0)"
std::string label_of_quads(const std::vector<Box>& quads) {
  std::string label;
  for (const Box& quad : quads) label += fmt::format("{}({}, {})", label.empty() ? "" : ", ", quad.x / 2, quad.y / 2);
  return label;
}

/// Loops of one-quad rectangles over screen tiles.
std::vector<LawRow> tiles_in_turn(MicrobenchBench& bench) {
  // Some loops have two states, in which their lines come back or do not. On the GPU they do; rounds of one visit, which are
  // shorter than a trip, make them do so here.
  constexpr unsigned first_rounds = 8;
  const microbench::GpcTiles& gpc = bench.first_gpc();
  std::vector<LawRow> rows;
  for (const MeasuredRow& row : measured_table("tiles_in_turn")) {
    const std::string& kind = row.text("what");
    const BoxesAre what = kind == "killed"            ? BoxesAre::killed
                          : kind == "stencil written" ? BoxesAre::stencil_written
                                                      : BoxesAre::blended;
    const std::vector<Box> quads = quads_of(row.text("quads"));
    const unsigned tiles = row.count("tiles");
    // So many that all queues are full of quads that wait, from the shorter frame on.
    const auto rounds = static_cast<unsigned>(2048 / (tiles * quads.size()));
    const MicrobenchSlope slope(bench, of_format(bench, kind == "RGBA8" ? kind : "RGBA16F"), std::max(rounds, 2U),
                                [=, &gpc](unsigned count) {
                                  return microbench::boxes_of_tiles(quads, tiles, count, what, gpc, first_rounds);
                                });
    rows.push_back({fmt::format("{}, {} tiles in turn", kind, tiles), label_of_quads(quads), row.number("clk"),
                    clk_of(slope), "rmtwice.json"});
  }
  return rows;
}

}  // namespace

void measure_strips(MicrobenchBench& bench) {
  constexpr unsigned of_a_round = 512;
  std::vector<LawRow> rows;
  for (const MeasuredRow& row : measured_table("strips")) {
    const unsigned width = row.count("width"), height = row.count("height");
    const BoxesAre what = colour_of(row);
    const MicrobenchSlope slope(bench, of_format(bench, row.text("format")), 2, [=](unsigned rounds) {
      return microbench::strips(width, height, of_a_round, rounds, what);
    });
    rows.push_back({fmt::format("{}, {}", row.text("format"), row.text("colour")), fmt::format("{}x{}", width, height),
                    row.number("clk"), clk_of(slope, of_a_round), row.text("source")});
  }
  bench.run();
  report(bench, rows, "clk a rectangle");
}

void measure_equal_splats(MicrobenchBench& bench) {
  const SplatMode modes[] = {{"rgba16f", "RGBA16F, blending", "RGBA16F", SplatsAre::blended},
                             {"not_blended", "RGBA16F, no blending", "RGBA16F", SplatsAre::written},
                             {"rgba8", "RGBA8, blending", "RGBA8", SplatsAre::blended},
                             {"stencil_all_pass", "RGBA16F, passing stencil", "RGBA16F", SplatsAre::passed},
                             {"stencil_all_killed", "killed by stencil", "RGBA16F", SplatsAre::killed}};
  std::vector<LawRow> rows;
  for (const SplatMode& mode : modes) {
    for (const MeasuredRow& row : measured_table("equal_splats")) {
      // Where pixels saturate it takes all the splats to see what that saves.
      if (row.text("opacity") != "0.02") continue;
      const double a = row.number("a"), b = row.number("b");
      const unsigned share = mode.what == SplatsAre::killed ? 16 : 48;
      const MicrobenchSlope slope(bench, of_format(bench, mode.format), row.count("splats") / share,
                                  [=, what = mode.what](unsigned count) {
                                    return microbench::equal_splats(a, b, splat_opacity, count,
                                                                    measured::equal_splats_side, what);
                                  });
      rows.push_back({mode.group, row.text("scene"), row.number(mode.column), clk_of(slope), "rmuni.json"});
    }
  }
  bench.run();
  report(bench, rows, "clk a splat");
}

void measure_same_place(MicrobenchBench& bench) {
  std::vector<LawRow> rows;
  for (const MeasuredRow& row : measured_table("same_place")) {
    const std::vector<Box> boxes = boxes_of(row.text("rectangles"));
    const BoxesAre what = colour_of(row);
    const MicrobenchSlope slope(bench, of_format(bench, row.text("format")), 200,
                                [=](unsigned rounds) { return microbench::boxes_in_turn(boxes, rounds, what); });
    rows.push_back({fmt::format("{}, {}", row.text("format"), row.text("colour")), label_of(boxes), row.number("clk"),
                    clk_of(slope, static_cast<double>(boxes.size())), "rmraw.json"});
  }
  bench.run();
  report(bench, rows, "clk a rectangle");
  MicrobenchCurve curve{
      "rows of quads on the same place, RGBA16F, blending", "quads of a row", "clk a row", {}, {}, {}};
  for (const LawRow& row : rows) {
    if (row.group != "RGBA16F, blending" || row.label.find("quad") == std::string::npos) continue;
    const auto quads = static_cast<double>(curve.measured.size() + 1);
    curve.measured.emplace_back(quads, row.clk());
    curve.gpu.emplace_back(quads, row.gpu);
  }
  bench.curve(std::move(curve));
}

void measure_returning_lines(MicrobenchBench& bench) {
  const std::vector<LawRow> in_turn = tiles_in_turn(bench);
  const SplatMode modes[] = {{"killed", "killed", "RGBA16F", SplatsAre::killed},
                             {"rgba8", "RGBA8", "RGBA8", SplatsAre::blended},
                             {"rgba16f", "RGBA16F", "RGBA16F", SplatsAre::blended}};
  std::vector<LawRow> scattered, squares;
  for (const SplatMode& mode : modes) {
    const RunRequest request = of_format(bench, mode.format);
    const BoxesAre boxes = mode.what == SplatsAre::killed ? BoxesAre::killed : BoxesAre::blended;
    for (const MeasuredRow& row : measured_table("scattered_rectangles")) {
      const unsigned side = row.count("side"), step = row.count("step"), region = row.count("region");
      const MicrobenchSlope slope(bench, request, 4000, [=](unsigned count) {
        return microbench::scattered_boxes(side, step, region, count, boxes);
      });
      scattered.push_back({fmt::format("scattered rectangles, {}", mode.group),
                           fmt::format("{0}x{0} at multiples of {1} in {2}x{2}", side, step, region),
                           row.number(mode.column), clk_of(slope), "rmlad.json"});
    }
    // These as they were measured, each with all its splats: pixels saturate.
    for (const MeasuredRow& row : measured_table("hot_squares")) {
      const double half = row.number("half_axis");
      const unsigned region = row.count("region"), splats = row.count("splats");
      const std::size_t frame = bench.add(request, [=, what = mode.what] {
        return microbench::equal_splats(half, half, splat_opacity, splats, region, what);
      });
      squares.push_back({fmt::format("splats in a square, {}", mode.group),
                         fmt::format("{0}x{0} in {1}x{1}", half, region), row.number(mode.column),
                         [=, &bench] { return bench.cycles(frame) / splats; }, "rmhot.json"});
    }
  }
  bench.run();
  report(bench, in_turn, "clk a round");
  report(bench, scattered, "clk a rectangle");
  report(bench, squares, "clk a splat");
  auto square = squares.begin();
  for (const SplatMode& mode : modes) {
    MicrobenchCurve curve;
    curve.name = fmt::format("splats of 4x4 in a square, {}", mode.group);
    curve.x_label = "side of the square, pixels";
    curve.y_label = "clk a splat";
    for (const MeasuredRow& row : measured_table("hot_squares")) {
      const LawRow& splats = *square++;
      if (row.count("half_axis") != 4) continue;
      curve.measured.emplace_back(row.count("region"), splats.clk());
      curve.gpu.emplace_back(row.count("region"), splats.gpu);
    }
    bench.curve(std::move(curve));
  }
}

}  // namespace vrpipe::tools
