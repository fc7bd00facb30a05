#include "jobs/published_figures.h"

#include <algorithm>
#include <stdexcept>

namespace vrpipe::tools {

namespace {

constexpr std::nullopt_t not_given = std::nullopt;
constexpr double need_not = -1;

// Files are those of the measurements' raw data.
constexpr const char* rop_source =
    "VR-Pipe, VII (16 and 8 pixels a clock, 16 ROPs); crop.json, contiguous_region 32x32";
constexpr const char* line_price = "so the simulator prices a line that is filled or written back";
constexpr const char* bin_quads =
    "the region is larger than the cache, and bins of tc.bin_quads gather fewer layers of a tile than the real GPU's";
constexpr const char* pipe_bytes = "crop.bytes_per_cycle prices a format by its bytes, with blending and without";

}  // namespace

const std::vector<PublishedFigure>& published_figures() {
  static const std::vector<PublishedFigure> all{
      {"tile-binning", "warps, 320 quads over 32 tiles", "warps", 67, 67.2, GpuScope::any, 5,
       "VR-Pipe, VII; bins.json, pm_counter_check_100_draws",
       "the real one loses warps to its time-out, which goes by the clock of its front end"},
      {"tile-binning", "warps, 330 quads over 33 tiles", "warps", 330, 330, GpuScope::any, 0,
       "VR-Pipe, VII; bins.json, paper_points_9_repeats", ""},
      {"tile-binning", "bins", "screen tiles", 32, 32, GpuScope::any, 0, "VR-Pipe, VII; bins.json, sweep_rounds10", ""},
      {"tile-binning", "side of a bin's tile", "pixels", 16, 16, GpuScope::any, 0,
       "VR-Pipe, II; bins.json, tile_size_test", ""},
      {"tile-binning", "warps, tiles 0 to 31, 0, 32, 0, 1, 2", "warps", not_given, 36, GpuScope::any, 0,
       "bins2.json, replacement_points", ""},
      {"tile-binning", "gap that parts a pair", "clk", not_given, 151, GpuScope::any, 10, "bins3.json, timeout_fine",
       ""},

      {"rop-throughput", "RGBA8, blending, 32x32", "pixels/clk", 16, 7.96, GpuScope::partition, 3, rop_source, ""},
      {"rop-throughput", "RGBA16F, blending, 32x32", "pixels/clk", 8, 3.98, GpuScope::partition, 3, rop_source, ""},
      {"rop-throughput", "RGBA32F, blending, 32x32", "pixels/clk", not_given, not_given, GpuScope::partition, need_not,
       "not measured on the real GPU", pipe_bytes},
      {"rop-throughput", "RGBA8, no blending, 32x32", "pixels/clk", not_given, 7.96, GpuScope::partition, 3,
       "crop.json, contiguous_region 32x32", ""},
      {"rop-throughput", "RGBA16F, no blending, 32x32", "pixels/clk", not_given, 3.98, GpuScope::partition, 3,
       "crop.json, contiguous_region 32x32", ""},
      {"rop-throughput", "RGBA32F, no blending, 32x32", "pixels/clk", not_given, not_given, GpuScope::partition,
       need_not, "not measured on the real GPU", pipe_bytes},
      {"rop-throughput", "RGBA8, blending, 64x64", "pixels/clk", not_given, 7.97, GpuScope::partition, 3,
       "rop.json, overdraw", bin_quads},
      {"rop-throughput", "RGBA16F, blending, 64x64", "pixels/clk", not_given, 3.98, GpuScope::partition, 3,
       "rop.json, overdraw", bin_quads},
      {"rop-throughput", "RGBA32F, blending, 64x64", "pixels/clk", not_given, 0.498, GpuScope::partition, 3,
       "rop.json, overdraw", pipe_bytes},
      {"rop-throughput", "RGBA8, no blending, 64x64", "pixels/clk", not_given, 7.97, GpuScope::partition, 3,
       "rop.json, overdraw", bin_quads},
      {"rop-throughput", "RGBA16F, no blending, 64x64", "pixels/clk", not_given, 3.98, GpuScope::partition, 3,
       "rop.json, overdraw", bin_quads},
      {"rop-throughput", "RGBA32F, no blending, 64x64", "pixels/clk", not_given, 1.99, GpuScope::partition, 3,
       "rop.json, overdraw", pipe_bytes},
      {"rop-throughput", "RGBA8, blending, 1024x1024", "pixels/clk", not_given, 6.37, GpuScope::partition, 3,
       "rop.json, overdraw", line_price},
      {"rop-throughput", "RGBA16F, blending, 1024x1024", "pixels/clk", not_given, 3.19, GpuScope::partition, 3,
       "rop.json, overdraw", line_price},
      {"rop-throughput", "RGBA32F, blending, 1024x1024", "pixels/clk", not_given, 0.498, GpuScope::partition, 3,
       "rop.json, overdraw", pipe_bytes},
      {"rop-throughput", "RGBA8, no blending, 1024x1024", "pixels/clk", not_given, 7.08, GpuScope::partition, 3,
       "rop.json, overdraw", line_price},
      {"rop-throughput", "RGBA16F, no blending, 1024x1024", "pixels/clk", not_given, 3.54, GpuScope::partition, 3,
       "rop.json, overdraw", line_price},
      {"rop-throughput", "RGBA32F, no blending, 1024x1024", "pixels/clk", not_given, 1.77, GpuScope::partition, 3,
       "rop.json, overdraw", pipe_bytes},
      {"rop-throughput", "RGBA8 over RGBA16F, blending, 32x32", "times", 2, 2.0, GpuScope::any, 1, rop_source, ""},

      {"quad-coverage", "time of a live pixel, 3 of 4", "times that of 4 of 4", not_given, 1.333, GpuScope::any, 1,
       "VR-Pipe, VII (CROP works by quads); quad.json, stencil_patterns", ""},
      {"quad-coverage", "time of a live pixel, 2 of 4, side by side", "times that of 4 of 4", not_given, 2.0,
       GpuScope::any, 1, "quad.json, stencil_patterns", ""},
      {"quad-coverage", "time of a live pixel, 2 of 4, one above the other", "times that of 4 of 4", not_given, 2.0,
       GpuScope::any, 1, "quad.json, stencil_patterns", ""},
      {"quad-coverage", "time of a live pixel, 2 of 4, diagonal", "times that of 4 of 4", not_given, 2.0, GpuScope::any,
       1, "quad.json, stencil_patterns", ""},
      {"quad-coverage", "time of a live pixel, 1 of 4", "times that of 4 of 4", not_given, 3.998, GpuScope::any, 1,
       "quad.json, stencil_patterns", ""},
      {"quad-coverage", "quads of 1x256 columns over those of 2x256", "times", not_given, 1.0, GpuScope::any, 3,
       "quad.json, shapes_rgba16f_blend", ""},
      {"quad-coverage", "quads of 256x1 rows over those of 256x2", "times", not_given, 1.0, GpuScope::any, 3,
       "quad.json, shapes_rgba16f_blend", ""},
      {"quad-coverage", "2x256 columns", "quads/clk", not_given, 0.677, GpuScope::gpc, need_not,
       "quad.json, shapes_rgba16f_blend", ""},
      {"quad-coverage", "2x256 columns at odd x", "quads/clk", not_given, 0.996, GpuScope::gpc, need_not,
       "quad.json, shapes_rgba16f_blend", ""},
      {"quad-coverage", "1x256 columns", "quads/clk", not_given, 0.677, GpuScope::gpc, need_not,
       "quad.json, shapes_rgba16f_blend", ""},
      {"quad-coverage", "256x2 rows", "quads/clk", not_given, 0.457, GpuScope::gpc, need_not,
       "quad.json, shapes_rgba16f_blend", ""},
      {"quad-coverage", "256x1 rows", "quads/clk", not_given, 0.457, GpuScope::gpc, need_not,
       "quad.json, shapes_rgba16f_blend", ""},
      {"quad-coverage", "2x2 pixels", "quads/clk", not_given, 0.240, GpuScope::gpc, need_not,
       "quad.json, shapes_rgba16f_blend", ""},
      {"quad-coverage", "1x1 pixels", "quads/clk", not_given, 0.240, GpuScope::gpc, need_not,
       "quad.json, shapes_rgba16f_blend", ""},
      {"quad-coverage", "2x2 pixels at odd x and y", "quads/clk", not_given, 0.779, GpuScope::gpc, need_not,
       "quad.json, shapes_rgba16f_blend", ""},

      {"crop-cache", "largest working set without reads", "KB", 16, 8, GpuScope::partition, 0,
       "VR-Pipe, VII (16 rectangles of 8x16 RGBA16F); crop2.json, one_rect_per_tile", ""},
      {"crop-cache", "a quad on the same place, blending", "clk", not_given, 9.04, GpuScope::gpc, 10,
       "crop2.json, one_rect_per_tile, K = 1",
       "the simulator forwards a blend to the next, or waits crop.latency_cycles"},
      {"crop-cache", "return of a line, 64 tiles in turn, blending", "clk", not_given, 496.8, GpuScope::gpc, 10,
       "crop2.json, one_rect_per_tile, K = 64: clk a rectangle times K",
       "crop.fetch_ahead_quads is 0 where the paper is silent"},
      {"crop-cache", "sectors moved for a quad, 64 tiles in turn", "sectors", not_given, 3.0, GpuScope::partition, 5,
       "crop2.json, one_rect_per_tile 2x2, less the 9.6 of its vertices: read twice, written once", ""},
      {"crop-cache", "a quad on 64 tiles in turn, no blending", "clk", not_given, 4.18, GpuScope::gpc, 10,
       "crop2.json, one_rect_per_tile, blend off, K = 64", "its front end takes 4.2 clk a rectangle"},

      {"blend-order", "pixels out of order, no random stalls", "pixels", 0, 0, GpuScope::any, 0,
       "VR-Pipe, II (ROPs blend in primitive order); order.json, rop_order", ""},
      {"blend-order", "pixels out of order, stalls in 1 of 8 cycles", "pixels", 0, 0, GpuScope::any, 0,
       "order.json, rop_order, delays up to 2000 clk", ""},
      {"blend-order", "pixels out of order, stalls in 1 of 2 cycles", "pixels", 0, 0, GpuScope::any, 0,
       "order.json, rop_order, delays up to 20000 clk", ""},

      {"front-end", "culled rectangle", "clk", not_given, 3.86, GpuScope::gpc, 10,
       "kill.json, primitive_rate, offscreen", ""},
      {"front-end", "rectangle of 2x2", "clk", not_given, 4.17, GpuScope::gpc, 10, "rop.json, rect_size 2", ""},
      {"front-end", "splat of 2x2, two triangles", "clk", not_given, 10.04, GpuScope::gpc, 10,
       "kill.json, primitive_rate, instanced strip", ""},
      {"front-end", "(rectangle, tile) pair, 1024x1024, killed by stencil", "clk", not_given, 8.05, GpuScope::gpc, 10,
       "kill.json, stencil_kill 1024", ""},
      {"front-end", "(rectangle, tile) pair, 1024x1024, killed by Hi-Z", "clk", not_given, 1.007, GpuScope::gpc, 10,
       "kill.json, depth_kill_all_fail_cleared 1024", ""},
      {"front-end", "(rectangle, tile) pair, 16x16 on one tile, killed by stencil", "clk", not_given, 10.67,
       GpuScope::gpc, 10, "kill.json, stencil_kill 16", ""},
      {"front-end", "(rectangle, tile) pair, 16x16 across four, killed by stencil", "clk", not_given, not_given,
       GpuScope::gpc, need_not, "not measured on the real GPU", ""},

      {"kill-rate", "stencil, 64x64", "quads/clk", not_given, 7.92, GpuScope::partition, 5,
       "kill.json, stencil_kill 64", ""},
      {"kill-rate", "stencil, 16x16", "quads/clk", not_given, 6.00, GpuScope::partition, 5,
       "kill.json, stencil_kill 16", ""},
      {"kill-rate", "stencil, 2x2", "quads/clk", not_given, not_given, GpuScope::gpc, need_not,
       "not measured on the real GPU", ""},
      {"kill-rate", "depth without Hi-Z, 64x64", "quads/clk", not_given, not_given, GpuScope::partition, need_not,
       "not measured on the real GPU", ""},
      {"kill-rate", "Hi-Z, 64x64", "quads/clk", not_given, 63.6, GpuScope::gpc, 5,
       "kill.json, depth_kill_all_fail_cleared 64", ""},
      {"kill-rate", "Hi-Z, 16x16", "quads/clk", not_given, 6.00, GpuScope::gpc, 5,
       "kill.json, depth_kill_all_fail_cleared 16", ""},
      {"kill-rate", "shader, 64x64", "quads/clk", not_given, 3.18, GpuScope::gpc, 5, "rop.json, no_rop, discard_all 64",
       ""},
      {"kill-rate", "shader, 2x2", "quads/clk", not_given, 0.192, GpuScope::gpc, 5,
       "5.1 to 5.3 clk a (primitive, screen tile) visit of a program that discards", ""},
  };
  return all;
}

const PublishedFigure& published_figure(const std::string& microbench, const std::string& name) {
  const std::vector<PublishedFigure>& all = published_figures();
  const auto found = std::find_if(all.begin(), all.end(), [&](const PublishedFigure& figure) {
    return figure.microbench == microbench && figure.name == name;
  });
  if (found == all.end()) throw std::logic_error("no figure '" + name + "' of " + microbench);
  return *found;
}

// bins.json, sweep_rounds10: filled rectangles, 16 pixels apart.
const MicrobenchPoints& gpu_warps_of_ten_rounds() {
  static const MicrobenchPoints points{
      {1, 2},    {2, 4},    {3, 6},    {4, 8},    {5, 10},   {6, 12},     {7, 14},     {8, 18},   {9, 19},
      {10, 21},  {11, 24},  {12, 24},  {13, 27},  {14, 30},  {15, 30},    {16, 33},    {17, 35},  {18, 39},
      {19, 40},  {20, 42},  {21, 43},  {22, 44},  {23, 50},  {24, 51},    {25, 51},    {26, 55},  {27, 58},
      {28, 58},  {29, 59},  {30, 63},  {31, 65},  {32, 67},  {33, 330},   {34, 340},   {40, 400}, {48, 480},
      {56, 560}, {64, 640}, {72, 720}, {80, 800}, {96, 960}, {128, 1280}, {256, 2560},
  };
  return points;
}

// bins3.json, timeout_fine, mode 0: means of the trials of one gap.
const MicrobenchPoints& gpu_pairs_by_gap() {
  static const MicrobenchPoints points{
      {42, 0.9677}, {119, 0.8925}, {142, 0.6371}, {169, 0.2097}, {196, 0.0726}, {223, 0.0242}, {250, 0.0161}, {277, 0},
  };
  return points;
}

// crop2.json, one_rect_per_tile: RGBA16F, 8x16, saturated blending, so that nothing is written; less the sectors of vertices.
const MicrobenchPoints& gpu_reads_by_working_set() {
  static const MicrobenchPoints points{
      {1, 0},        {2, 0.0031},   {4, 0.0007},   {6, 0.0004},  {7, 0.0008},  {8, 0.0011},  {9, 1.2457},
      {10, 1.3808},  {11, 1.498},   {12, 1.6315},  {13, 1.7487}, {14, 1.8852}, {15, 2.0035}, {16, 2.1364},
      {17, 2.2598},  {18, 2.3836},  {20, 2.648},   {24, 3.1371}, {28, 3.6358}, {32, 4.1476}, {33, 39.9557},
      {36, 43.5111}, {40, 31.9988}, {48, 31.9989}, {64, 31.999},
  };
  return points;
}

// crop2.json, one_rect_per_tile: RGBA16F, 2x2, src+dst/2.
const MicrobenchPoints& gpu_returns_blending() {
  static const MicrobenchPoints points{
      {1, 9.038},    {2, 17.9768},  {4, 35.7761},  {8, 71.1282},   {16, 140.318},  {24, 206.654}, {31, 264.539},
      {32, 272.612}, {33, 496.005}, {34, 496.894}, {36, 497.553},  {40, 495.975},  {48, 496.947}, {56, 497.492},
      {64, 496.806}, {80, 496.364}, {96, 496.956}, {112, 500.359}, {128, 533.408},
  };
  return points;
}

// The same with blend off.
const MicrobenchPoints& gpu_returns_without_blending() {
  static const MicrobenchPoints points{
      {1, 4.1707},   {2, 8.3326},   {4, 16.6651},  {8, 33.3532},   {16, 66.7134},  {24, 100.108}, {31, 129.384},
      {32, 133.48},  {33, 138.063}, {34, 142.25},  {36, 150.629},  {40, 167.361},  {48, 200.843}, {56, 234.325},
      {64, 267.774}, {80, 334.712}, {96, 401.686}, {112, 468.606}, {128, 535.574},
  };
  return points;
}

}  // namespace vrpipe::tools
