#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/workloads/camera.h>
#include <vrpipe/workloads/gaussian_scene.h>

#include "blockers.h"
#include "surfaces.h"

namespace vrpipe {

struct Brush {
  double sigma_pixels = 2.2;  ///< median size of a splat on the default image
  double layers = 60;         ///< boxes over each pixel that shows the surface, about
  double gloss = 0.05;        ///< strength of the view-dependent term
  double opaque = 0.45;       ///< share of nearly opaque splats
  double faint = 0.2;         ///< share of nearly transparent ones; the rest lies between
  double depth = 0.004;       ///< scatter along the normal, as a share of the distance to the viewer
  double thickness = 0.135;   ///< median size along the normal, as a share of that across
  double emission = 0;        ///< share of the colour that needs no light
  int grid = 24;              ///< cells per direction over which density follows the distance
};

/// Paints surfaces with flat oriented splats, as dense and as small as the default camera needs, lit by a sun and a
/// sky with shadows from boxes and balls. Out of the default view there are fewer and larger splats.
class ScenePainter {
 public:
  /// `view` as in BuiltinSceneInfo, y down.
  ScenePainter(std::uint64_t seed, const View& view, const ImageSize& size);

  void set_light(const Vec3& to_sun, const Vec3& sun, const Vec3& sky) {
    to_sun_ = unit(to_sun);
    sun_ = sun;
    sky_ = sky;
  }
  void block_box(const Vec3& centre, const Vec3& half);
  void block_ball(const Vec3& centre, const Vec3& radii);

  /// A box that hides things from the default viewer, but blocks no light: floors, walls.
  void hide_behind(const Vec3& centre, const Vec3& half) { screens_.push_back({centre, half, false}); }
  /// Share of the splats kept where the default viewer cannot see them: captures hold fewer there. Default 1.
  void set_hidden_share(double share) { hidden_share_ = share; }

  void surface(const Surface& surface, const Paint& paint, const Brush& brush);
  /// The six faces of an axis-aligned box; blocks light.
  void box(const Vec3& centre, const Vec3& half, const Paint& paint, const Brush& brush);
  /// Frustum with both lids; blocks light as the box inscribed in its thinner part.
  void cylinder(const Vec3& base, const Vec3& top, double base_radius, double top_radius, const Paint& paint,
                const Brush& brush);
  /// A cloud of splats in an ellipsoid: foliage, smoke.
  void cloud(const Vec3& centre, const Vec3& radii, const Paint& paint, const Brush& brush);
  /// Lone faint splats anywhere in a box.
  void floaters(const Vec3& centre, const Vec3& half, int count, double sigma_pixels);

  RandomStream& random() { return random_; }
  GaussianScene build() { return builder_.build(); }

 private:
  static bool blocked(const std::vector<Blocker>& blockers, const Vec3& from, const Vec3& direction, double reach);
  bool hidden(const Vec3& position, const Vec3& normal) const;
  bool out_of_view(const Vec3& position) const;
  double splat_size(const Vec3& position, double sigma_pixels) const;
  /// Unless hidden and not among the share kept.
  void splat(const Vec3& position, const Vec3& normal, const Paint& paint, double u, double v, const Brush& brush);

  RandomStream random_;
  Vec3 viewer_;
  Camera camera_;
  double pixel_angle_;
  double hidden_share_ = 1;
  Vec3 to_sun_{0, 1, 0}, sun_{0.7, 0.7, 0.7}, sky_{0.3, 0.3, 0.3};
  std::vector<Blocker> blockers_, screens_;
  GaussianSceneBuilder builder_;
};

}  // namespace vrpipe
