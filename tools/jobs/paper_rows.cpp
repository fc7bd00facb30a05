#include "jobs/paper_rows.h"

#include <cmath>
#include <stdexcept>

namespace vrpipe::tools {
namespace {

// Other scenes than the paper's, so a tenth either way says that it is the same effect.
constexpr double of_scenes = 10;
constexpr double exact = 0.5;

// Why a row is out of reach.
constexpr const char* no_software_rasteriser = "needs a model of the software rasteriser (CUDA), which there is not";
constexpr const char* no_whole_frame = "needs the times of preprocessing and sorting, which are not modelled";
constexpr const char* simulated_energy = "energy of baseline over HET+QM, of counts and time (docs/energy.md)";
constexpr const char* is_input = "goes into the model, and cannot come out of it";

std::vector<PaperRow> all_rows() {
  const Relation about = Relation::about, at_most = Relation::at_most, at_least = Relation::at_least,
                 above = Relation::above, claim = Relation::claim;
  std::vector<PaperRow> rows{
      {"R1", "up to 2.78x", "abstract", "speed-up of HET+QM, best scene", "cycles of baseline over HET+QM", about, 2.78,
       of_scenes},
      {"R2", "2.07x", "VI-B", "the same, mean", "arithmetic mean over the scenes", about, 2.07, of_scenes},
      {"R3", "up to 1.49x", "VI-B", "speed-up of QM alone, best scene", "cycles", about, 1.49, of_scenes},
      {"R4", "1.80x", "VI-B", "speed-up of HET alone, mean", "arithmetic mean over the scenes", about, 1.80, of_scenes},
      {"R5", "/2.52", "VI-C", "fragments blended, HET, mean", "baseline over HET", about, 2.52, of_scenes},
      {"R6", "/1.30", "VI-C", "fragments blended, QM on top of HET", "HET over HET+QM", about, 1.30, of_scenes},
      {"R7", "/1.90", "VI-C", "quads blended, HET, mean", "baseline over HET", about, 1.90, of_scenes},
      {"R8", "/1.32", "VI-C", "quads blended, QM on top of HET", "HET over HET+QM", about, 1.32, of_scenes},
      {"R9", "2.05x", "VI-B", "whole frame, HET+QM over CUDA", no_software_rasteriser},
      {"R10", "1.60x", "VI-B", "whole frame, HET+QM over OpenGL", no_whole_frame},
      {"R11", "> 70 %", "VI-B", "share of rasterisation in a frame", no_whole_frame},
      {"R12", "1.65x", "VI-D", "energy efficiency of the draw, mean", simulated_energy},
      {"R13", "up to 2.15x", "VI-D", "the same, best scene", simulated_energy},
      {"R14", "24.25 KB", "VI-E", "storage of the TGC", "from the configured sizes", about, 24.25, exact},
      {"R15", "688 B", "VI-E", "storage of the QRU", "from the configured sizes", about, 688, exact},
      {"R16", "24.92 KB", "VI-E", "storage of QM, per GPC", "from the configured sizes", about, 24.92, exact},
      {"R17", ">= 3.6 MB", "VII", "SRAM in a GPC of the Orin", "is a fact of a chip, not of the pipeline"},
      {"R18", "nearly 4.4", "VII", "greatest early-termination ratio, Train", "views of the scene, functional", about,
       4.4, of_scenes},
      {"R19", "> 1.5", "VII", "mean ratio, in every scene", "the least of the scenes' means over views", above, 1.5},
      {"R20", "> 33 %", "VII", "fragments that go, in every scene", "1 - 1 / ratio, of the least mean", above, 33.3},
      {"R21", "< 25 FPS", "III-A", "whole frame, OpenGL, on an Orin", no_whole_frame},
      {"R22", "< 40 %", "III-B", "lanes of a CUDA warp that blend", no_software_rasteriser},
      {"R23", "<= 900 K", "VI-A", "Gaussians in the view, most of a scene", "the most of the scenes", at_most, 900e3,
       of_scenes},
      {"R24", "16 KB", "VII", "size of the CROP cache", "microbenchmark crop-cache", about, 16, of_scenes},
      {"R25", "16 / 8 px/clk", "VII", "blended, RGBA8 / RGBA16F", "microbenchmark rop-throughput", about, 8, of_scenes},
      {"R26", ">= 64 B/clk", "VII", "read by CROP from its cache", "R25 times 8 bytes a pixel", at_least, 64,
       of_scenes},
      {"R27", "2 x 8", "VII", "ROP partitions, and ROPs of each", is_input},
      {"R28", "32", "VII", "TC bins", "microbenchmark tile-binning", about, 32, exact},
      {"R29", "67 warps", "VII", "320 rectangles over 32 tiles", "microbenchmark tile-binning", about, 67, 5},
      {"R30", "330 warps", "VII", "330 rectangles over 33 tiles", "microbenchmark tile-binning", about, 330, exact},
      {"R31", "16x16 px", "II", "screen tile of a GPC", is_input},
      {"R32", "9.06 M / 5.21 M", "VII", "Gaussians of Building and Rubble", "the scenes' own; of a stand-in, by design",
       about, 9.06e6, 1},
  };
  const auto says = [&](const char* id, const char* value, const char* where, const char* what, const char* how) {
    rows.push_back({id, value, where, what, how, claim});
  };
  says("C1", "OpenGL faster", "III-A", "than CUDA", no_software_rasteriser);
  says("C2", "PROP, CROP busiest", "III-B", "units of the baseline; SM little", "utilisation in every scene");
  says("C3", "less time than work", "III-B", "saved by termination in CUDA", no_software_rasteriser);
  says("C4", "slower than ROP", "IV-A", "in-shader blending with a lock", "needs in-shader blending, not modelled");
  says("C5", "gain in Train, Truck", "IV-B", "of passes; elsewhere marginal", "1, 4 and 16 passes of the baseline");
  says("C6", "Train, Truck most", "VI-B", "of HET's gains; Bonsai least of the real scenes", "speed-ups of HET");
  says("C7", "Bonsai, Kitchen less", "VI-B", "of QM's gains", "speed-ups of QM");
  says("C8", "quads fall less", "VI-C", "than fragments under HET", "blended, in every scene");
  says("C9", "outdoor above others", "VII", "early-termination ratios", "means over views");
  says("C10", "GSCore faster", "VII", "than VR-Pipe", "needs a model of GSCore, which there is not");
  says("C11", "ROP-bound, gains", "VII", "of Building and Rubble", "bottleneck of the baseline; speed-up of HET+QM");
  says("C12", "partial quads slower", "VII", "in pixels a cycle", "microbenchmark quad-coverage");
  says("C13", "preprocess correlates", "VI-B", "with an Orin, sorting not", no_whole_frame);
  for (PaperRow& row : rows) {
    const std::string how = row.how;
    row.is_within_reach = how.rfind("needs", 0) != 0 && how != is_input && how.rfind("is a fact", 0) != 0;
  }
  return rows;
}

}  // namespace

const char* name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::agrees: return "agrees";
    case Verdict::differs: return "differs";
    case Verdict::cannot_say: break;
  }
  return "cannot say";
}

const char* paper_energy_method() {
  return "measured on an AGX Orin whose shaders imitate termination, by a stencil that counts, and merging, by "
         "shuffles "
         "and blends; TGC and QRU are not in it";
}

const std::vector<PaperRow>& paper_rows() {
  static const std::vector<PaperRow> rows = all_rows();
  return rows;
}

const PaperRow& paper_row(const std::string& id) {
  for (const PaperRow& row : paper_rows()) {
    if (id == row.id) return row;
  }
  throw std::logic_error("the paper has no row " + id);
}

Verdict judge(Relation relation, double paper, double tolerance_percent, double measured) {
  // So that what lies on the edge is within.
  constexpr double rounding = 1e-12;
  const double tolerance = paper * (tolerance_percent / 100 + rounding);
  const auto verdict = [](bool holds) { return holds ? Verdict::agrees : Verdict::differs; };
  if (!std::isfinite(measured)) return Verdict::cannot_say;
  switch (relation) {
    case Relation::about: return verdict(std::fabs(measured - paper) <= tolerance);
    case Relation::at_most: return verdict(measured <= paper + tolerance);
    case Relation::at_least: return verdict(measured >= paper - tolerance);
    case Relation::above: return verdict(measured > paper);
    case Relation::claim: break;
  }
  return Verdict::cannot_say;
}

std::optional<double> difference_percent(double paper, double measured) {
  if (paper == 0 || !std::isfinite(measured)) return std::nullopt;
  return 100 * (measured - paper) / paper;
}

}  // namespace vrpipe::tools
