#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

/// What Hi-Z can do in a frame, as it follows from the frame's commands. RASTER, TC and ZROP each have it, and so agree.
///
/// Hi-Z knows a depth for each raster tile that no stored one exceeds. What is known late is still true while stored depth
/// can only fall. So a draw that may raise it (written where it is greater, greater or equal, not equal, or always) ends
/// Hi-Z until depth is cleared: an epoch goes from one clear of depth to the next.
class HiZPlan {
 public:
  explicit HiZPlan(const RenderContext& context);

  /// Whether there is anything to cull and to cull by; if not, there are no draws to ask for below.
  bool is_used() const { return !draws_.empty(); }
  /// Whether a raster tile of the draw may be culled where all of its depth is beyond what is known.
  bool culls(DrawIndex draw) const { return draws_[draw].culls; }
  /// Whether a draw that may be culled, perhaps itself, can use what this one stores.
  bool reports(DrawIndex draw) const { return draws_[draw].reports; }
  std::uint16_t epoch(DrawIndex draw) const { return draws_[draw].epoch; }
  /// What depth was cleared to before the draw.
  float cleared_to(DrawIndex draw) const { return draws_[draw].cleared_to; }
  /// Strict termination, where time decides nothing: whether what follows a mark waits until all has come that was stored
  /// before it, and is culled by that alone. The mark goes from RASTER to ZROP, which sends it back. False in paper mode.
  bool waits_at(Mark mark) const;

 private:
  struct OfDraw {
    float cleared_to = 1;
    std::uint16_t epoch = 0;
    bool culls = false;
    bool reports = false;
  };
  std::vector<OfDraw> draws_;
  std::vector<Mark> waits_;  ///< in order
};

/// Whether a fragment beyond what is stored fails the depth test, and leaves no trace.
bool hi_z_may_cull(const DrawState& state);
/// Whether fragments may store a depth beyond what was stored.
bool may_raise_depth(const DepthState& depth);

}  // namespace vrpipe
