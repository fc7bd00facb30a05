#include "preparation/preparation.h"

#include <algorithm>

#include <vrpipe/pipeline/registry.h>

namespace vrpipe {

PublishedPreparation::PublishedPreparation(const Parameters& parameters, const RenderContext& /*context*/)
    : gaussian_cycles_(parameters.gaussian_cycles),
      record_cycles_(parameters.record_cycles),
      depth_sort_cycles_(parameters.depth_sort_cycles),
      visible_bytes_(parameters.visible_bytes),
      culled_bytes_(parameters.culled_bytes),
      depth_sort_bytes_(parameters.depth_sort_bytes),
      launch_microseconds_(parameters.launch_microseconds) {}

KernelWork PublishedPreparation::project(Path path, std::uint64_t gaussians, std::uint64_t visible) const {
  const double cycles = path == Path::software ? gaussian_cycles_ : record_cycles_;
  const std::uint64_t culled = gaussians - std::min(gaussians, visible);
  return {"preprocess", gaussians, static_cast<double>(gaussians) * cycles,
          visible * visible_bytes_ + culled * culled_bytes_, launch_microseconds_};
}

KernelWork PublishedPreparation::sort_by_depth(std::uint64_t splats) const {
  constexpr double launches = 6;  // histogram, its sum, four passes
  return {"depth sort", splats, static_cast<double>(splats) * depth_sort_cycles_, splats * depth_sort_bytes_,
          launches * launch_microseconds_};
}

namespace {
const SoftwareSlotRegistrar preparation_slot("preparation", 200, "published");
const Registrar<PublishedPreparation, PreparationBehaviour> published_preparation(
    "preparation", "published", "projection of Gaussians and, for a hardware draw, a radix sort by depth", false,
    Trust::trusted);
}  // namespace

}  // namespace vrpipe
