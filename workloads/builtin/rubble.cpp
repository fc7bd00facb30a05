#include "props.h"
#include "scenes.h"

namespace vrpipe {
void paint_rubble(CapturePainter& painter) { bulldozer(painter, {0, 0, 0}, 1.0, Texture()); }
}  // namespace vrpipe
