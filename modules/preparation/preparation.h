#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/slots/preparation.h>

namespace vrpipe {

/// The published preprocessing kernel, a thread a Gaussian, and for a hardware draw CUB's radix sort of 32-bit keys.
class PublishedPreparation : public PreparationBehaviour {
 public:
  struct Parameters : ParameterSet {
    Parameters();
    Real gaussian_cycles, record_cycles, depth_sort_cycles;
    Integer visible_bytes{*this,
                          "visible_bytes",
                          323,
                          0,
                          65536,
                          "bytes",
                          "published kernel: 236 read, harmonics of degree 3, and 79 to 87 written",
                          "of projecting a Gaussian that is visible"};
    Integer culled_bytes{*this,
                         "culled_bytes",
                         20,
                         0,
                         65536,
                         "bytes",
                         "published kernel: position, radius and tile count",
                         "of looking at one that is not"};
    Integer depth_sort_bytes{*this,
                             "depth_sort_bytes",
                             68,
                             0,
                             65536,
                             "bytes",
                             "CUB: a histogram and four passes over keys and values of 32 bits",
                             "of sorting a splat by depth"};
    Real launch_microseconds{*this,
                             "launch_microseconds",
                             8,
                             0,
                             1e6,
                             "us",
                             "measured on a GH100: what binning takes on 4, 8 and 16 SMs alike",
                             "of a grid, before and behind its work; projecting has one, sorting six"};

    Real visible_instructions{*this,
                              "visible_instructions",
                              720,
                              0,
                              1e6,
                              "instructions",
                              "SASS of the published kernel, harmonics of degree 3",
                              "of a thread, of projecting a Gaussian that is visible; energy alone depends on it"};
    Real culled_instructions{*this,
                             "culled_instructions",
                             75,
                             0,
                             1e6,
                             "instructions",
                             "SASS of the published kernel: one that is too near",
                             "of a thread, of looking at one that is not; energy alone depends on it"};
    Real depth_sort_instructions{*this,
                                 "depth_sort_instructions",
                                 18.8,
                                 0,
                                 1e6,
                                 "instructions",
                                 "assumed: as many a cycle as in binning, measured on a GH100",
                                 "of a warp, of sorting a splat by depth; energy alone depends on it"};

   protected:
    struct Price {
      double sm_cycles;
      const char* source;
    };
    /// Of a Gaussian for software, of one for a hardware draw, and of sorting a splat for that.
    Parameters(Price gaussian, Price record, Price depth_sort);
  };
  PublishedPreparation(const Parameters& parameters, const RenderContext& context);

  KernelWork project(Path path, std::uint64_t gaussians, std::uint64_t visible) const override;
  KernelWork sort_by_depth(std::uint64_t splats) const override;

 private:
  const double gaussian_cycles_, record_cycles_, depth_sort_cycles_;
  const std::uint64_t visible_bytes_, culled_bytes_, depth_sort_bytes_;
  const double launch_microseconds_;
  const double visible_instructions_, culled_instructions_, depth_sort_instructions_;
};

/// The same kernels as slow as the paper has them, whose times of them are an Orin's: 27.5 % of a frame in which the draw gains
/// 2.07 and the frame 1.60 (VI-B, by Amdahl's law), 11 ms of the 40 of a frame at 25 FPS (III-A), over scenes of 1.67 million
/// Gaussians in the mean (VI-A), of which 0.9 million are in view, on 8 SMs at 612 MHz. All prices are those that were measured on a
/// GH100, times 1.83.
class PapersPreparation : public PublishedPreparation {
 public:
  struct Parameters : PublishedPreparation::Parameters {
    Parameters();
  };
  PapersPreparation(const Parameters& parameters, const RenderContext& context)
      : PublishedPreparation(parameters, context) {}
};

}  // namespace vrpipe
