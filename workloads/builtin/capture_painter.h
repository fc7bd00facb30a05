#pragma once

#include <cstdint>
#include <vector>

#include <vrpipe/workloads/gaussian_scene.h>

#include "blockers.h"
#include "surfaces.h"

namespace vrpipe {

/// How training distributes sizes and opacities, whatever the Gaussians show: sizes are about log-normal, logits of opacities
/// normal on either side of their median, with many nearly opaque ones, and the larger the fainter. Chosen for what public
/// models show that were trained by INRIA's code; builtin_scenes_test.cpp has their statistics.
struct Population {
  double logit;                     ///< of the median opacity
  double logit_below, logit_above;  ///< deviations below and above the median, of Gaussians of a size: many are opaque
  double logit_by_size;             ///< by how much it falls with each deviation of the size
  double size_deviation;            ///< of the logarithm of the size
  double axis_deviation;            ///< of the logarithm of either axis across, beside that of the size
  double thickness;                 ///< median size along the normal, as a share of that across

  /// Mean area of a splat's box over the square of its median sigma, about.
  double box_area() const;
};

/// Of a street or a yard, of a room, and of a thing with nothing around it.
extern const Population kOutdoorPopulation, kIndoorPopulation, kObjectPopulation;

/// How a surface is covered with splats. Their size follows from how many there are in all.
struct Texture {
  double layers = 46;     ///< boxes over each pixel that shows the surface, about
  double size = 1;        ///< median size of a splat, as it would be seen, over that of the scene
  double gloss = 0.05;    ///< strength of the view-dependent term
  double logit = 0;       ///< added to that of the scene's opacities: glass, haze
  double depth = 0.0025;  ///< scatter along the normal, as a share of the distance of the cameras
  double behind = 0.2;    ///< share of splats that lie deeper, ten times that
  double emission = 0;    ///< share of the colour that needs no light
};

/// Paints a capture: what training leaves of photographs taken all around. Splats are as small as the cameras resolve on
/// average, smaller where colours change, longer along edges than across them, and the fewer the fewer cameras look; so the
/// default view sees a part of them. Strokes are collected first; build() spreads an exact number of Gaussians over them,
/// on all processors.
class CapturePainter {
 public:
  /// `view` and `height`, pixels, as the scene is looked at by default, y down: the first camera.
  CapturePainter(std::uint64_t seed, const View& view, std::uint32_t height, const Population& population,
                 int sh_degree);

  /// Where else photographs were taken; y up.
  void camera(const Vec3& position) { cameras_.push_back(position); }
  /// On a circle around `centre`, at its height.
  void ring_of_cameras(const Vec3& centre, double radius, int count);

  void set_light(const Vec3& to_sun, const Vec3& sun, const Vec3& sky) {
    to_sun_ = unit(to_sun);
    sun_ = sun;
    sky_ = sky;
  }
  /// How far a surface darkens others around it, world units.
  void set_contact_reach(double reach) { contact_reach_ = reach; }
  /// Share of the splats kept where no camera looks.
  void set_hidden_share(double share) { hidden_share_ = share; }
  void block_box(const Vec3& centre, const Vec3& half) { blockers_.push_back({centre, half, false}); }
  void block_ball(const Vec3& centre, const Vec3& radii) { blockers_.push_back({centre, radii, true}); }

  void surface(const Surface& surface, const Paint& paint, const Texture& texture);
  void quad(const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v, const Paint& paint, const Texture& texture);
  /// The six faces of an axis-aligned box; blocks rays.
  void box(const Vec3& centre, const Vec3& half, const Paint& paint, const Texture& texture);
  /// The six faces of a parallelepiped from a corner; a, b, c right-handed. Blocks no rays.
  void slab(const Vec3& corner, const Vec3& a, const Vec3& b, const Vec3& c, const Paint& paint,
            const Texture& texture);
  /// Frustum with both lids; blocks rays as the box inscribed in its thinner part.
  void cylinder(const Vec3& base, const Vec3& top, double base_radius, double top_radius, const Paint& paint,
                const Texture& texture);
  /// An ellipsoid; blocks rays.
  void ball(const Vec3& centre, const Vec3& radii, const Paint& paint, const Texture& texture);
  /// A cloud of splats in an ellipsoid: foliage, steam. Paint gets as v how far outside it is.
  void cloud(const Vec3& centre, const Vec3& radii, const Paint& paint, const Texture& texture);
  /// So many lone faint splats anywhere in a box.
  void floaters(const Vec3& centre, const Vec3& half, std::uint64_t count, double size);

  /// For where things stand; build() draws from streams of its own.
  RandomStream& random() { return random_; }

  /// @param count  Gaussians in the scene, more than there are floaters
  /// @param threads  0: one for each processor. Any number gives the same bits.
  GaussianScene build(std::uint64_t count, unsigned threads = 0);

 private:
  enum class Kind { surface, quad, cloud, floaters };
  struct Stroke {
    Kind kind;
    Surface surface;
    Paint paint;
    Texture texture;
    Vec3 a{}, b{};            ///< edges of a quad; centre and radii, or half, of a cloud
    std::uint64_t count = 0;  ///< of floaters
  };
  /// A patch of a stroke, which is painted at once.
  struct Cell {
    std::uint32_t stroke = 0;
    double u = 0, v = 0, du = 1, dv = 1;
    double distance = 0;  ///< of the cameras
    double size = 1;      ///< factor that its colours ask for
    double weight = 0;    ///< Gaussians, were they of size 1
    bool partly_seen = false;
    std::uint64_t first = 0, count = 0;  ///< its Gaussians
  };
  struct Tools;

  /// At which one camera has as many pixels on a surface with this normal as all cameras have on average, were it to face
  /// it; with no normal, {}, as if 60 degrees off.
  double distance_of_cameras(const Vec3& position, const Vec3& normal) const;
  void divide(std::uint32_t stroke, double u, double v, double du, double dv, int depth,
              std::vector<Cell>& cells) const;
  void weigh(Cell& cell, RandomStream& random, const Tools& tools) const;
  SurfacePoint point(const Stroke& stroke, const Cell& cell, RandomStream& random, double& u, double& v) const;
  static bool sees(const Vec3& camera, const SurfacePoint& point, const Tools& tools);
  bool seen(const SurfacePoint& point, const Tools& tools) const;
  void paint(const Cell& cell, double scale, RandomStream& random, const Tools& tools, GaussianArray& gaussians) const;
  GaussianAttributes splat(const Stroke& stroke, const Cell& cell, const SurfacePoint& point, double u, double v,
                           double scale, RandomStream& random, const Tools& tools) const;

  std::uint64_t seed_;
  RandomStream random_;
  Population population_;
  int sh_degree_;
  double pixel_angle_;
  double hidden_share_ = 0.05;
  double contact_reach_ = 1;
  Vec3 to_sun_{0, 1, 0}, sun_{0.7, 0.7, 0.7}, sky_{0.3, 0.3, 0.3};
  std::vector<Vec3> cameras_;
  std::vector<Blocker> blockers_;
  std::vector<Stroke> strokes_;
};

}  // namespace vrpipe
