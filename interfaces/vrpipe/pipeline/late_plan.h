#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/pipeline/render_context.h>

namespace vrpipe {

/// Which draws are tested after shading, and what has to wait for that, as it follows from the frame's commands. TC, PROP and
/// ZROP each have it, and so agree.
///
/// Late tests of a screen tile are in launch order, so late draws need not wait for one another. But tests before shading, and
/// clears, would overtake late tests of draws before them.
class LatePlan {
 public:
  explicit LatePlan(const RenderContext& context);

  bool is_used() const { return !late_.empty(); }
  /// Whether depth and stencil of a draw are tested after shading.
  bool is_late(DrawIndex draw) const { return is_used() && late_[draw] != 0; }
  /// Whether ZROP leaves a mark undone, and tests nothing behind it, until it has come around through QRU, SM and PROP, behind
  /// the late tests of all draws before it: since a clear of depth or stencil, or a draw that is tested before shading, follows
  /// and one of the two writes what the other tests; or since Hi-Z is to know what they have stored (HiZPlan::waits_at).
  bool waits_at(Mark mark) const;

 private:
  std::vector<std::uint8_t> late_;  ///< by draw; none where no draw is
  std::vector<Mark> waits_;         ///< in order
};

struct PortNeed;
/// The way from PROP to ZROP and back: both need their end of it, where any draw is tested late.
PortNeed way_of_late_tests();

}  // namespace vrpipe
