#include <vrpipe/arithmetic/random.h>
#include <vrpipe/workloads/microbench.h>

#include "microbench/rectangles.h"

namespace vrpipe::microbench {

unsigned live_of(LivePixels pixels) {
  switch (pixels) {
    case LivePixels::four: return 4;
    case LivePixels::three: return 3;
    case LivePixels::two_horizontal:
    case LivePixels::two_vertical:
    case LivePixels::two_diagonal: return 2;
    case LivePixels::one: return 1;
  }
  return 0;
}

namespace {

/// Of a stencil that counts: 1 in odd rows and 2 in odd columns, so 0, 2, 1 and 3 in the pixels of a quad.
StencilFace test_of(LivePixels pixels) {
  StencilFace face;
  switch (pixels) {
    case LivePixels::four: break;
    case LivePixels::three:
      face.compare = Compare::not_equal;
      face.reference = 3;
      break;
    case LivePixels::two_horizontal:  // the upper two
      face.compare = Compare::equal;
      face.read_mask = 1;
      break;
    case LivePixels::two_vertical:  // the left two
      face.compare = Compare::equal;
      face.read_mask = 2;
      break;
    case LivePixels::two_diagonal:  // marked in the row or in the column: those that a third draw has not set to 4
      face.compare = Compare::equal;
      face.read_mask = 4;
      break;
    case LivePixels::one: face.compare = Compare::equal; break;
  }
  return face;
}

DrawState writes_stencil(std::uint8_t bit) {
  DrawState state = rectangle_state();
  state.shader = FragmentShader::none;
  state.stencil.test = true;
  state.stencil.front.pass = StencilOperation::replace;
  state.stencil.front.reference = bit;
  state.stencil.front.write_mask = bit;
  return state;
}

}  // namespace

FramePointer layers_through_stencil(LivePixels pixels, unsigned side, unsigned layers) {
  std::vector<Splat> rows;
  std::vector<Splat> columns;
  std::vector<Splat> both;
  for (unsigned at = 1; at < side; at += 2) {
    rows.push_back(rectangle(0, at, side, 1));
    columns.push_back(rectangle(at, 0, 1, side));
  }
  FrameMaker maker(side, side);
  maker.draw(rows, writes_stencil(1)).draw(columns, writes_stencil(2));
  if (pixels == LivePixels::two_diagonal) {
    // The third bit where rows and columns agree: set everywhere, then taken away where the two differ.
    DrawState state = writes_stencil(4);
    maker.draw({rectangle(0, 0, side, side)}, state);
    state.stencil.front.reference = 1;
    state.stencil.front.read_mask = 3;
    state.stencil.front.compare = Compare::equal;
    state.stencil.front.pass = StencilOperation::zero;
    maker.draw({rectangle(0, 0, side, side)}, state);
    state.stencil.front.reference = 2;
    maker.draw({rectangle(0, 0, side, side)}, state);
  }
  DrawState state = rectangle_state();
  state.stencil.test = true;
  state.stencil.front = test_of(pixels);
  return maker.draw(std::vector<Splat>(layers, rectangle(0, 0, side, side)), state).take();
}

unsigned Shape::quads() const {
  const auto along = [](unsigned pixels, bool odd) { return (pixels + (odd ? 1 : 0) + 1) / 2; };
  return along(width, odd_x) * along(height, odd_y);
}

const std::vector<Shape>& shapes() {
  static const std::vector<Shape> all{
      {"2x256 columns", 2, 256, false, false}, {"2x256 columns at odd x", 2, 256, true, false},
      {"1x256 columns", 1, 256, false, false}, {"256x2 rows", 256, 2, false, false},
      {"256x1 rows", 256, 1, false, false},    {"2x2 pixels", 2, 2, false, false},
      {"1x1 pixels", 1, 1, false, false},      {"2x2 pixels at odd x and y", 2, 2, true, true}};
  return all;
}

FramePointer scattered(const Shape& shape, unsigned count) {
  constexpr unsigned side = 512;
  std::vector<Splat> splats;
  for (unsigned i = 0; i < count; ++i) {
    const auto place = [&](unsigned key, unsigned extent, bool odd) {
      const std::uint64_t places = (side - extent - 1) / 2;
      return static_cast<double>(2 * (mix(2 * std::uint64_t{i} + key) % places) + (odd ? 1 : 0));
    };
    splats.push_back(
        rectangle(place(0, shape.width, shape.odd_x), place(1, shape.height, shape.odd_y), shape.width, shape.height));
  }
  return FrameMaker(side, side).draw(std::move(splats), rectangle_state()).take();
}

}  // namespace vrpipe::microbench
