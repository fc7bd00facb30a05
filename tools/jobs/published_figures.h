#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "jobs/microbench_job.h"

namespace vrpipe::tools {

/// What a number of the real GPU is of.
enum class GpuScope : std::uint8_t {
  any,        ///< the same on GPUs of any size
  partition,  ///< its one ROP partition; the paper's GPC has two
  gpc         ///< its graphics GPC, of two TPCs
};

/// A figure with the numbers that are published of it; the real GPU is one graphics GPC of a GH100 (H200 PCIe, OpenGL 4.6,
/// 2026-11-21), in GPU clocks.
struct PublishedFigure {
  const char* microbench;
  const char* name;
  const char* unit;
  std::optional<double> paper;
  std::optional<double> gpu;
  GpuScope scope;
  double tolerance_percent;  ///< below 0: it need not agree
  const char* source;
  const char* why;  ///< the simulator is known to differ; may be empty
};
const std::vector<PublishedFigure>& published_figures();
/// Throws std::logic_error for a figure that is not listed.
const PublishedFigure& published_figure(const std::string& microbench, const std::string& name);

// Curves of the real GPU.
const MicrobenchPoints& gpu_warps_of_ten_rounds();   ///< screen tiles, warps
const MicrobenchPoints& gpu_pairs_by_gap();          ///< clk, share of pairs in one warp
const MicrobenchPoints& gpu_reads_by_working_set();  ///< KB of RGBA16F, sectors read for a rectangle of 8x16 pixels
/// Screen tiles, clk a rectangle of one quad times their number.
const MicrobenchPoints& gpu_returns_blending();
const MicrobenchPoints& gpu_returns_without_blending();

}  // namespace vrpipe::tools
