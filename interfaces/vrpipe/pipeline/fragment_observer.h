#pragma once

#include <cstdint>

#include <vrpipe/arithmetic/lanes.h>
#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// What becomes of fragments, where it is decided.
enum class FragmentFate : std::uint8_t {
  rasterized,
  terminated,  ///< taken by the termination test, or in strict termination by CROP
  merged,      ///< taken away by merging: of the back quad, where both are live
  blended,
};
constexpr unsigned fragment_fates = 4;

/// Sees what becomes of fragments, from outside, at every fidelity. Units of one's own may tell it, as those of this
/// library do (RenderContext::fragments).
class FragmentObserver {
 public:
  virtual ~FragmentObserver() = default;
  /// @param position  of the quad in the screen tile
  /// @param lanes     its fragments that this happened to, one at least
  virtual void happened(FragmentFate fate, TileId tile, unsigned position, LaneMask lanes) = 0;
};

}  // namespace vrpipe
