#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include <vrpipe/workloads/camera.h>

namespace vrpipe {

// Vectors in the painter's world: x right, y UP, z away from the default viewer. The painter turns y down on output.
Vec3 unit(const Vec3& a);                          ///< zero gives (0, 1, 0)
Vec3 mix(const Vec3& a, const Vec3& b, double t);  ///< a at t = 0, b at t = 1; t is clamped

/// Two unit vectors at right angles to a unit vector.
void tangents(const Vec3& normal, Vec3& t, Vec3& b);
/// Unit quaternion (w, x, y, z) of the rotation with these columns.
std::array<double, 4> quaternion(const Vec3& c0, const Vec3& c1, const Vec3& c2);

/// A small random generator (splitmix64); the standard library's distributions differ between implementations.
class RandomStream {
 public:
  explicit RandomStream(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next();
  double uniform();  ///< in [0, 1)
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double normal();   ///< mean 0, deviation 1
  Vec3 direction();  ///< uniform on the unit sphere

 private:
  std::uint64_t state_;
};

/// Smooth noise in [0, 1], features of about unit size.
double value_noise(const Vec3& p);
/// Several octaves of it, in [0, 1].
double fractal_noise(const Vec3& p, int octaves);

struct SurfacePoint {
  Vec3 position, normal;
};
/// A surface over (u, v) in [0, 1]^2.
using Surface = std::function<SurfacePoint(double u, double v)>;
/// Albedo of a surface at a point.
using Paint = std::function<Vec3(const Vec3& position, double u, double v)>;
Paint plain(const Vec3& colour);

Surface quad_surface(const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v);  ///< normal: edge_u x edge_v
/// Side of a cone frustum around the segment from `base` to `top`.
Surface frustum_surface(const Vec3& base, const Vec3& top, double base_radius, double top_radius);
Surface disc_surface(const Vec3& centre, const Vec3& normal, double inner_radius, double outer_radius);
Surface ellipsoid_surface(const Vec3& centre, const Vec3& radii);
/// The inside of a sphere, elevation from `low` to `high` (sine of it).
Surface dome_surface(const Vec3& centre, double radius, double low, double high);

/// Whether `value` is in [low, high].
inline bool within(double value, double low, double high) { return value >= low && value <= high; }
/// What is behind the point; of a negative number, too, in [0, 1).
double fraction(double value);
/// A constant in [0, 1) for each whole number, for colours of books, windows, cars; another for each `salt`.
double hash_fraction(double index, double salt);

}  // namespace vrpipe
