#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/pipeline/slots/behaviour.h>

namespace vrpipe {

/// Slot `draw`: issues the splats of a frame's draws as vertex warps.
class DrawBehaviour : public Behaviour {
 public:
  /// The next warp, of one draw, or the mark before a clear and before a draw of another state (Frame::commands); false
  /// after the last.
  virtual bool next(VertexWarp& out) = 0;
  /// Vertex warps in 1024 cycles.
  virtual std::uint32_t warps_per_1024_cycles() const = 0;
  /// The same of warps of filled rectangles.
  virtual std::uint32_t rectangle_warps_per_1024_cycles() const { return warps_per_1024_cycles(); }
};

/// The slot's kinds of work, and what they cost by the unit's own words. With time they are cycles between a warp and the next, of
/// one kind; without, warps.
struct DrawWork {
  enum : unsigned { warps, rectangle_warps };
  static std::vector<WorkKind> kinds();
};

/// The slot's SlotCheck.
std::unique_ptr<Behaviour> check_draw(const std::string& name, const RenderContext& context,
                                      std::unique_ptr<Behaviour> behaviour);

}  // namespace vrpipe
