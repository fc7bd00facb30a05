#pragma once

#include <memory>
#include <vector>

#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/draw_state.h>
#include <vrpipe/pipeline/frame.h>
#include <vrpipe/pipeline/payload.h>
#include <vrpipe/workloads/microbench.h>

namespace vrpipe::microbench {

/// Of one alpha all over: it has no falloff.
Splat rectangle(double x, double y, double width, double height, float alpha = 0.02F);

/// Blends whatever it draws, as filled rectangles of exact size.
DrawState rectangle_state();

/// The first screen tiles of a GPC, row by row; in a row those of 16 for each GPC.
std::vector<TileId> tiles_of(const GpcTiles& gpc, unsigned count);

/// Draws of one size, which take their splats along.
class FrameMaker {
 public:
  FrameMaker(unsigned width, unsigned height) : frame_(std::make_shared<Frame>(width, height)) {}
  FrameMaker& draw(std::vector<Splat> splats, const DrawState& state);
  FrameMaker& clear(const Clear& clear);
  std::shared_ptr<const Frame> take() { return std::move(frame_); }

 private:
  std::shared_ptr<Frame> frame_;
};

}  // namespace vrpipe::microbench
