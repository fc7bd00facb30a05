#pragma once

#include "mesh_painter.h"

namespace vrpipe {

/// The built-in scene `courtyard`: walls, paving, columns and boxes as a mesh; ivy, a statue, plants and haze before and between
/// them, a garden, trees and the sky behind, as splats.
void paint_courtyard(ScenePainter& painter);
Mesh courtyard_mesh();

}  // namespace vrpipe
