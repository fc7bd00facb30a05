#pragma once

#include "capture_painter.h"
#include "mesh_painter.h"
#include "scene_painter.h"

namespace vrpipe {

// The built-in scenes, one file each; the registry says how they are looked at.

void paint_object(ScenePainter& painter);
void paint_indoor(ScenePainter& painter);
void paint_outdoor(ScenePainter& painter);

/// Walls, paving, columns and boxes are a mesh; ivy, a statue, plants and haze before and between them, a garden, trees
/// and the sky behind are splats.
void paint_courtyard(ScenePainter& painter);
Mesh courtyard_mesh();

// Stand-ins for the scenes of the paper.
void paint_kitchen(CapturePainter& painter);
void paint_bonsai(CapturePainter& painter);
void paint_train(CapturePainter& painter);
void paint_truck(CapturePainter& painter);
void paint_lego(CapturePainter& painter);
void paint_palace(CapturePainter& painter);
void paint_building(CapturePainter& painter);
void paint_rubble(CapturePainter& painter);

}  // namespace vrpipe
