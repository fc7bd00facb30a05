#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/fragment_observer.h>
#include <vrpipe/pipeline/screen_tiling.h>
#include <vrpipe/pipeline/slots/render.h>
#include <vrpipe/pipeline/splat_pixels.h>
#include <vrpipe/pipeline/surface.h>

namespace vrpipe {

/// What the render kernels have in common: a tile is a block of 256 threads, a pixel each, and batches of 256 splats go
/// through shared memory. Prices are warp instructions of an iteration, by the farthest that any lane goes.
struct TileKernelParameters : ParameterSet {
  struct Prices {
    double pruned, stopping, blending;
    const char* source;
  };
  explicit TileKernelParameters(const Prices& prices)
      : pruned_instructions{*this,         "pruned_instructions",
                            prices.pruned, 0,
                            1e4,           "instructions",
                            prices.source, "of an iteration in which alpha of every live lane is too small"},
        stopping_instructions{*this,
                              "stopping_instructions",
                              prices.stopping,
                              0,
                              1e4,
                              "instructions",
                              "SASS of the published kernel",
                              "of one in which a lane stops and none blends"},
        blending_instructions{*this, "blending_instructions", prices.blending, 0,
                              1e4,   "instructions",          prices.source,   "of one in which a lane blends"} {}

  Choice warp_pixels{
      *this, "warp_pixels", {"16x2", "8x4"}, 0, "published: threads of a block row by row", "the pixels of a warp"};
  Real outside_instructions{*this,
                            "outside_instructions",
                            22,
                            0,
                            1e4,
                            "instructions",
                            "SASS of the published kernel",
                            "of an iteration in which the exponent is above 0 for every live lane"};
  Real pruned_instructions;
  Real stopping_instructions;
  Real blending_instructions;
  Real batch_instructions{*this,
                          "batch_instructions",
                          60,
                          0,
                          1e6,
                          "instructions",
                          "SASS of the published kernel",
                          "of a warp for a batch: the vote, what is fetched, barriers"};
  Integer blocks_per_core{*this,
                          "blocks_per_core",
                          8,
                          1,
                          64,
                          "blocks",
                          "published kernel on a GH100: 32 registers a thread, 7 KB of shared memory",
                          "in flight on a core"};
  Real issue_rate{*this,
                  "issue_rate",
                  0.93,
                  0.001,
                  1,
                  "instructions",
                  "measured on a GH100: 0.93 where warps have the same to do, 0.90 where they end early",
                  "that a scheduler issues in the time of one, at most"};
  Integer instruction_interval_cycles{*this,
                                      "instruction_interval_cycles",
                                      7,
                                      1,
                                      1000,
                                      "cycles",
                                      "measured on a GH100: 400 to 485 cycles a list entry of a block alone",
                                      "from an instruction of a warp to its next, in the mean"};
  Real launch_microseconds{*this,
                           "launch_microseconds",
                           8,
                           0,
                           1e6,
                           "us",
                           "measured on a GH100: what binning takes on 4, 8 and 16 SMs alike",
                           "of the grid, before and behind its work"};
};

/// The published render kernel, with any of the rules. alpha = min(0.99, opacity * exp(power)) in single precision; a lane
/// whose alpha is under the draw's pruning threshold goes on.
class TileKernel : public RenderBehaviour {
 public:
  static constexpr std::uint32_t warps = 8;
  static constexpr std::uint32_t batch_splats = 256;

  void use_surfaces(Framebuffer& framebuffer) override;
  void render(std::size_t tile, const std::uint32_t* splats, std::uint32_t length, BlockWork& out) override;
  /// A fragment is a lane's look at a splat, of a pixel of the frame.
  void add_to(Counts& counts, const CountOf& of) const override;
  TimingParameters timing() const override { return timing_; }
  std::uint64_t bytes() const override { return bytes_; }

  // Iterations by the farthest that any lane goes; those without blending are the other three.
  Counter iterations_outside{*this, "iterations_outside", "iterations", "with an exponent above 0 for all"};
  Counter iterations_pruned{*this, "iterations_pruned", "iterations", "with an alpha that is too small for all"};
  Counter iterations_stopping{*this, "iterations_stopping", "iterations", "in which a lane stops and none blends"};
  Counter iterations_blending{*this, "iterations_blending", "iterations", "in which a lane blends"};

 protected:
  TileKernel(const TileKernelParameters& parameters, const RenderContext& context, StopRule rule,
             float least_transmittance = 0);

 private:
  static constexpr unsigned vectors = 4;  ///< of eight lanes
  struct WarpLanes {
    std::array<SplatPixels, vectors> pixels;
    std::uint32_t alive_mask() const;
  };
  /// Lanes of a warp by what they do with a splat, a bit each.
  struct Fates {
    std::uint32_t inside = 0;   ///< with an exponent of 0 or less
    std::uint32_t visible = 0;  ///< of these, with an alpha that counts
    std::uint32_t blended = 0;  ///< of these
  };

  template <StopRule Rule, bool IsSeen>
  void render_by(std::size_t tile, const std::uint32_t* splats, std::uint32_t length, BlockWork& out);
  template <StopRule Rule>
  Fates look_at(const SplatRecord& splat, WarpLanes& lanes) const;
  WarpLanes begin(std::size_t tile, std::uint32_t warp) const;
  /// Gives the instructions of an iteration, and adds those of its lanes.
  std::uint64_t count(const Fates& fates, std::uint32_t alive, std::uint64_t& lane_instructions);
  void store(std::size_t tile, std::uint32_t warp, const WarpLanes& lanes);
  /// Tells who looks at fragments.
  /// @param in_frame, alive  lanes of pixels of the frame, and of these, before the splat
  void tell(std::size_t tile, std::uint32_t warp, const Fates& fates, std::uint32_t in_frame,
            std::uint32_t alive) const;
  std::uint32_t pixel_x(std::size_t tile, std::uint32_t warp, unsigned lane) const;
  std::uint32_t pixel_y(std::size_t tile, std::uint32_t warp, unsigned lane) const;

  const StopRule rule_;
  const float least_transmittance_;
  const float pruning_threshold_, terminating_alpha_;
  const std::uint32_t width_, height_;
  const ScreenTiling tiling_;
  const std::uint32_t warp_width_;  ///< pixels
  /// In thousandths.
  const std::uint64_t outside_, pruned_, stopping_, blending_, batch_;
  TimingParameters timing_;
  std::vector<SplatRecord> records_;
  FragmentObserver* const fragments_;  ///< null: nobody looks
  ColorSurface* color_ = nullptr;
  std::uint64_t bytes_ = 0;
  std::uint64_t lanes_off_frame_ = 0;  ///< of those that are dead
};

/// Stops as published.
class PublishedKernel : public TileKernel {
 public:
  struct Parameters : TileKernelParameters {
    Parameters();
    Real least_transmittance{*this,
                             "least_transmittance",
                             1e-4,
                             0,
                             1,
                             "transmittance",
                             "published kernel",
                             "a pixel stops before the splat that would bring it under this"};
  };
  PublishedKernel(const Parameters& parameters, const RenderContext& context);
};

/// Never stops.
class EndlessKernel : public TileKernel {
 public:
  struct Parameters : TileKernelParameters {
    Parameters();
  };
  EndlessKernel(const Parameters& parameters, const RenderContext& context);
};

/// Stops as early termination by hardware does.
class ThresholdKernel : public TileKernel {
 public:
  struct Parameters : TileKernelParameters {
    Parameters();
  };
  ThresholdKernel(const Parameters& parameters, const RenderContext& context);
};

}  // namespace vrpipe
