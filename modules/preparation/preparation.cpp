#include "preparation/preparation.h"

#include <algorithm>

#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

PublishedPreparation::Parameters::Parameters(Price gaussian, Price record, Price depth_sort)
    : gaussian_cycles(*this, "gaussian_cycles", gaussian.sm_cycles, 0, 1e6, "SM cycles", gaussian.source,
                      "of projecting one for software, culled ones included"),
      record_cycles(*this, "record_cycles", record.sm_cycles, 0, 1e6, "SM cycles", record.source,
                    "of projecting one for a hardware draw, which takes another record"),
      depth_sort_cycles(*this, "depth_sort_cycles", depth_sort.sm_cycles, 0, 1e6, "SM cycles", depth_sort.source,
                        "of sorting a splat by depth, for a hardware draw") {}

PublishedPreparation::Parameters::Parameters()
    : Parameters({15.3, "measured on a GH100: 0.975 ms for 500,000 Gaussians on 4 SMs"},
                 {14.0, "measured on a GH100: 0.893 ms for 500,000 Gaussians on 4 SMs"},
                 {6.63, "measured on a GH100: 0.225 ms for 211,320 splats on 4 SMs, six launches"}) {}

namespace {
constexpr const char* papers_share = "from the paper: 27.5 % of a frame of 40 ms, with 1.67 M Gaussians, 0.9 M in view";
}  // namespace

PapersPreparation::Parameters::Parameters()
    : PublishedPreparation::Parameters({28.0, papers_share}, {25.6, papers_share}, {12.1, papers_share}) {}

PublishedPreparation::PublishedPreparation(const Parameters& parameters, const RenderContext& /*context*/)
    : gaussian_cycles_(parameters.gaussian_cycles),
      record_cycles_(parameters.record_cycles),
      depth_sort_cycles_(parameters.depth_sort_cycles),
      visible_bytes_(parameters.visible_bytes),
      culled_bytes_(parameters.culled_bytes),
      depth_sort_bytes_(parameters.depth_sort_bytes),
      launch_microseconds_(parameters.launch_microseconds),
      visible_instructions_(parameters.visible_instructions),
      culled_instructions_(parameters.culled_instructions),
      depth_sort_instructions_(parameters.depth_sort_instructions) {}

KernelWork PublishedPreparation::project(Path path, std::uint64_t gaussians, std::uint64_t visible) const {
  const double cycles = path == Path::software ? gaussian_cycles_ : record_cycles_;
  const std::uint64_t culled = gaussians - std::min(gaussians, visible);
  constexpr double threads_of_warp = 32;
  const double instructions =
      static_cast<double>(visible) * visible_instructions_ + static_cast<double>(culled) * culled_instructions_;
  return {"preprocess",
          gaussians,
          static_cast<double>(gaussians) * cycles,
          visible * visible_bytes_ + culled * culled_bytes_,
          launch_microseconds_,
          instructions / threads_of_warp};
}

KernelWork PublishedPreparation::sort_by_depth(std::uint64_t splats) const {
  constexpr double launches = 6;  // histogram, its sum, four passes
  return {"depth sort",
          splats,
          static_cast<double>(splats) * depth_sort_cycles_,
          splats * depth_sort_bytes_,
          launches * launch_microseconds_,
          static_cast<double>(splats) * depth_sort_instructions_};
}

namespace {
const OutsideSlotRegistrar preparation_slot("preparation", 200, "published");
const Registrar<PublishedPreparation, PreparationBehaviour> published_preparation(
    "preparation", "published", "projection of Gaussians and, for a hardware draw, a radix sort by depth", false,
    Trust::trusted);
const Registrar<PapersPreparation, PreparationBehaviour> papers_preparation(
    "preparation", "papers-orin", "the same, as slow as the paper's frames have it, which an Orin was measured with",
    false, Trust::trusted);
}  // namespace

}  // namespace vrpipe
