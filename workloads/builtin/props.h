#pragma once

#include "capture_painter.h"

namespace vrpipe {

// What more than one of the captures shows.

/// Between two colours by fractal noise, features of 1 / `frequency`; `stretch` makes them longer along axes where it is
/// below 1.
Paint rough(const Vec3& dark, const Vec3& light, double frequency, const Vec3& stretch = {1, 1, 1});

/// A trunk and a crown of clouds; `key` chooses its shape and its green.
void tree(CapturePainter& painter, const Vec3& foot, double height, double key, const Texture& leaves,
          const Texture& bark);

/// Clumps of leaves on the ground.
void bush(CapturePainter& painter, const Vec3& centre, double radius, double key, const Texture& leaves);

/// A wheel about an axis along z or x: tyre, rim and hub, `half` wide to each side.
void wheel(CapturePainter& painter, const Vec3& centre, double radius, double half, bool along_x, const Vec3& rim,
           const Texture& texture);

/// A house with a gable roof, its front towards -z; `centre` of its ground plan.
void house(CapturePainter& painter, const Vec3& centre, double half_width, double half_depth, double height,
           const Vec3& wall, const Vec3& tile, const Texture& texture);

/// A roof of two slopes over a rectangle of half widths x and z, its ridge along x or z, with gables.
void gable_roof(CapturePainter& painter, const Vec3& centre, double half_x, double half_z, double rise, bool along_x,
                const Paint& tiles, const Paint& wall, const Texture& texture);

/// A model bulldozer of studded bricks on a baseplate, about 2 x 1 x 1.2 units before it is scaled; it faces -x.
void bulldozer(CapturePainter& painter, const Vec3& origin, double scale, const Texture& texture);

/// The inside of a dome of sky with clouds, blue above and hazy at the horizon; of a whole circle, that share
/// in the middle of which z is.
void sky(CapturePainter& painter, double radius, double cloudiness, double circle, const Texture& texture);

}  // namespace vrpipe
