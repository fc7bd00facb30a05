#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/slots/preparation.h>

namespace vrpipe {

/// The published preprocessing kernel, a thread a Gaussian, and for a hardware draw CUB's radix sort of 32-bit keys.
class PublishedPreparation : public PreparationBehaviour {
 public:
  struct Parameters : ParameterSet {
    Real gaussian_cycles{*this,
                         "gaussian_cycles",
                         15.3,
                         0,
                         1e6,
                         "SM cycles",
                         "measured on a GH100: 0.975 ms for 500,000 Gaussians on 4 SMs",
                         "of projecting one for software, culled ones included"};
    Real record_cycles{*this,
                       "record_cycles",
                       14.0,
                       0,
                       1e6,
                       "SM cycles",
                       "measured on a GH100: 0.893 ms for 500,000 Gaussians on 4 SMs",
                       "of projecting one for a hardware draw, which takes another record"};
    Real depth_sort_cycles{*this,
                           "depth_sort_cycles",
                           6.63,
                           0,
                           1e6,
                           "SM cycles",
                           "measured on a GH100: 0.225 ms for 211,320 splats on 4 SMs, six launches",
                           "of sorting a splat by depth, for a hardware draw"};
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
  };
  PublishedPreparation(const Parameters& parameters, const RenderContext& context);

  KernelWork project(Path path, std::uint64_t gaussians, std::uint64_t visible) const override;
  KernelWork sort_by_depth(std::uint64_t splats) const override;

 private:
  const double gaussian_cycles_, record_cycles_, depth_sort_cycles_;
  const std::uint64_t visible_bytes_, culled_bytes_, depth_sort_bytes_;
  const double launch_microseconds_;
};

}  // namespace vrpipe
