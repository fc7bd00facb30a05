#include "props.h"
#include "scenes.h"

namespace vrpipe {

// A model bulldozer as rendered pictures show it: nothing around, seen from all sides and from above.
void paint_lego(CapturePainter& painter) {
  painter.set_light({-0.5, 1.2, -0.75}, {0.80, 0.76, 0.68}, {0.46, 0.48, 0.52});
  painter.set_contact_reach(0.25);
  painter.ring_of_cameras({0, 0.9, 0}, 3.8, 8);
  painter.ring_of_cameras({0, 2.9, 0}, 2.6, 5);
  Texture brick;
  brick.layers = 62;
  brick.gloss = 0.15;
  brick.depth = 0.0006;
  brick.behind = 0.12;
  bulldozer(painter, {0, 0, 0}, 1.0, brick);
  painter.floaters({0, 0.6, 0}, {1.1, 0.6, 0.8}, 300, 1.5);
}

}  // namespace vrpipe
