#pragma once

#include <cstdint>

#include <vrpipe/pipeline/slots/behaviour.h>
#include <vrpipe/pipeline/slots/kernel_work.h>

namespace vrpipe {

/// Slot `preparation`: what is done to Gaussians before a frame is drawn.
class PreparationBehaviour : public Behaviour {
 public:
  /// Who takes the splats.
  enum class Path : std::uint8_t { software, hardware };
  /// Projects Gaussians, of which so many are visible.
  virtual KernelWork project(Path path, std::uint64_t gaussians, std::uint64_t visible) const = 0;
  /// Sorts splats by depth alone, as a hardware draw has them. In software the lists of tiles are sorted: slot `binning`.
  virtual KernelWork sort_by_depth(std::uint64_t splats) const = 0;
};

}  // namespace vrpipe
