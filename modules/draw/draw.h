#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/pipeline/frame.h>
#include <vrpipe/pipeline/slots/draw.h>

namespace vrpipe {

/// Issues the sorted splats of the frame's draws, up to eight of a draw a warp, or ten or eleven filled rectangles, for vertex shading.
class VertexIssue : public DrawBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer warps_per_1024_cycles{*this,
                                  "warps_per_1024_cycles",
                                  88,
                                  1,
                                  65536,
                                  "warps",
                                  "measured on a GH100 graphics GPC: 5.8 cycles a splat with 2 TPCs, scaled to 8",
                                  "vertex warps issued in 1024 cycles for each GPC: vertex fetch and attribute set-up"};
    Integer rectangle_warps_per_1024_cycles{
        *this,
        "rectangle_warps_per_1024_cycles",
        0,
        0,
        65536,
        "warps",
        "left open by the paper; measured on a GH100 graphics GPC: 3.88 cycles a rectangle",
        "the same of warps of filled rectangles; 0: warps_per_1024_cycles"};
  };
  VertexIssue(const Parameters& parameters, const RenderContext& context);

  bool next(VertexWarp& out) override;
  std::uint32_t warps_per_1024_cycles() const override { return rate_; }
  std::uint32_t rectangle_warps_per_1024_cycles() const override { return rate_of_rectangles_; }

  Counter splats{*this, "splats", "splats", "splats issued"};

 private:
  std::uint32_t splats_that_fit(const DrawCall& call) const;

  const Frame& frame_;
  const std::uint32_t rate_;
  const std::uint32_t rate_of_rectangles_;
  std::size_t command_ = 0;   ///< of the frame
  bool marked_ = false;       ///< its mark has been issued
  std::uint32_t issued_ = 0;  ///< splats of the draw
};

/// Leaves out what has been drawn of a frame that is gone on with.
void leave_out_drawn(DrawBehaviour& draw, const Frame& frame);

}  // namespace vrpipe
