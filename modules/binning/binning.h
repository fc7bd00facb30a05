#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/screen_tiling.h>
#include <vrpipe/pipeline/slots/binning.h>
#include <vrpipe/pipeline/touched_tiles.h>

namespace vrpipe {

/// The published binning: tiles counted for each splat, scanned, a pair of key (tile, depth) and splat for each tile, a radix
/// sort of 64-bit keys, and the ranges of tiles in what is sorted.
class PairBinning : public BinningBehaviour {
 public:
  struct Parameters : ParameterSet {
    Choice lists{*this,
                 "lists",
                 {"three_sigma", "box", "obb", "ellipse"},
                 2,
                 "VR-Pipe, text: an oriented box at alpha 1/255; published: three_sigma",
                 "a splat is in the list of a tile if this shape touches it: the square of three sigmas, the "
                 "axis-aligned box at alpha 1/255, the oriented one, or the ellipse itself"};
    Real count_cycles{
        *this, "count_cycles", 1.56, 0, 1e6, "SM cycles", measured_source, "a pair, of counting the tiles of splats"};
    Real scan_cycles{*this,
                     "scan_cycles",
                     0,
                     0,
                     1e6,
                     "SM cycles",
                     "measured on a GH100: 0.016 ms for 211,320 splats, no more than two launches take",
                     "a splat, of summing up the counts"};
    Real duplicate_cycles{*this,           "duplicate_cycles",        2.44, 0, 1e6, "SM cycles",
                          measured_source, "a pair, of writing pairs"};
    Real sort_cycles{*this, "sort_cycles", 9.25, 0, 1e6, "SM cycles", measured_source, "a pair, of sorting pairs"};
    Real range_cycles{
        *this, "range_cycles", 0.49, 0, 1e6, "SM cycles", measured_source, "a pair, of finding the ranges of tiles"};
    Real launch_microseconds{*this,
                             "launch_microseconds",
                             8,
                             0,
                             1e6,
                             "us",
                             "measured on a GH100: what all of binning takes on 4, 8 and 16 SMs alike",
                             "of a grid, before and behind its work; the sort has two and one a pass, the scan two"};
    Real issue_rate{*this,
                    "issue_rate",
                    0.71,
                    0,
                    1,
                    "instructions",
                    "measured on a GH100: 269 M warp instructions of a frame, less 237 M of its render kernel",
                    "that a scheduler issues in a cycle of these prices; energy alone depends on it"};

   private:
    static constexpr const char* measured_source =
        "measured on a GH100: a draw of 820,554 pairs on 4 SMs, less what launching takes";
  };
  PairBinning(const Parameters& parameters, const RenderContext& context);

  TileLists make_lists() override;
  std::vector<KernelWork> kernels() const override;

  Counter splats_listed{*this, "splats_listed", "splats", "in the list of a tile at least"};
  Counter splats_without_area{*this, "splats_without_area", "splats",
                              "in none, since they are not finite or have no area"};

 private:
  const RenderContext& context_;
  const ScreenTiling tiling_;
  const ListShape shape_;
  const double count_cycles_, scan_cycles_, duplicate_cycles_, sort_cycles_, range_cycles_, launch_microseconds_,
      issue_rate_;
};

}  // namespace vrpipe
