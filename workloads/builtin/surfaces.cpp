#include "surfaces.h"

#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>

#include <vrpipe/workloads/portable_math.h>

namespace vrpipe {
namespace {

std::uint64_t scramble(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

double lattice(std::int64_t x, std::int64_t y, std::int64_t z) {
  const std::uint64_t key = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15u ^
                            static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4fu ^
                            static_cast<std::uint64_t>(z) * 0x165667b19e3779f9u;
  return static_cast<double>(scramble(key) >> 11) * (1.0 / 9007199254740992.0);
}

}  // namespace

void tangents(const Vec3& normal, Vec3& t, Vec3& b) {
  t = unit(std::fabs(normal[0]) < 0.6 ? cross(normal, Vec3{1, 0, 0}) : cross(normal, Vec3{0, 1, 0}));
  b = cross(normal, t);
}

std::array<double, 4> quaternion(const Vec3& c0, const Vec3& c1, const Vec3& c2) {
  const double trace = c0[0] + c1[1] + c2[2];
  if (trace > 0) {
    const double s = 2.0 * std::sqrt(1.0 + trace);
    return {0.25 * s, (c1[2] - c2[1]) / s, (c2[0] - c0[2]) / s, (c0[1] - c1[0]) / s};
  }
  if (c0[0] > c1[1] && c0[0] > c2[2]) {
    const double s = 2.0 * std::sqrt(1.0 + c0[0] - c1[1] - c2[2]);
    return {(c1[2] - c2[1]) / s, 0.25 * s, (c1[0] + c0[1]) / s, (c2[0] + c0[2]) / s};
  }
  if (c1[1] > c2[2]) {
    const double s = 2.0 * std::sqrt(1.0 + c1[1] - c0[0] - c2[2]);
    return {(c2[0] - c0[2]) / s, (c1[0] + c0[1]) / s, 0.25 * s, (c2[1] + c1[2]) / s};
  }
  const double s = 2.0 * std::sqrt(1.0 + c2[2] - c0[0] - c1[1]);
  return {(c0[1] - c1[0]) / s, (c2[0] + c0[2]) / s, (c2[1] + c1[2]) / s, 0.25 * s};
}

Vec3 unit(const Vec3& a) {
  const double length = glm::length(a);
  if (!(length > 0)) return {0, 1, 0};
  return a * (1.0 / length);
}

Vec3 mix(const Vec3& a, const Vec3& b, double t) {
  t = std::min(1.0, std::max(0.0, t));
  return a * (1.0 - t) + b * t;
}

std::uint64_t RandomStream::next() {
  state_ += 0x9e3779b97f4a7c15u;
  return scramble(state_);
}

double RandomStream::uniform() { return static_cast<double>(next() >> 11) * (1.0 / 9007199254740992.0); }

double RandomStream::normal() {
  // Marsaglia's polar method; the second value is left unused to keep the stream simple.
  for (;;) {
    const double x = uniform(-1, 1), y = uniform(-1, 1);
    const double s = x * x + y * y;
    if (s > 0 && s < 1) return x * std::sqrt(-2.0 * portable_log(s) / s);
  }
}

Vec3 RandomStream::direction() {
  for (;;) {
    const Vec3 p = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
    const double s = dot(p, p);
    if (s > 1e-6 && s < 1) return p * (1.0 / std::sqrt(s));
  }
}

double value_noise(const Vec3& p) {
  std::array<std::int64_t, 3> cell;
  Vec3 t;
  for (std::size_t i = 0; i < 3; ++i) {
    const double whole = std::floor(p[i]);
    cell[i] = static_cast<std::int64_t>(whole);
    const double f = p[i] - whole;
    t[i] = f * f * (3.0 - 2.0 * f);
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner & 1, dy = (corner >> 1) & 1, dz = corner >> 2;
    const double weight = (dx ? t[0] : 1 - t[0]) * (dy ? t[1] : 1 - t[1]) * (dz ? t[2] : 1 - t[2]);
    sum += weight * lattice(cell[0] + dx, cell[1] + dy, cell[2] + dz);
  }
  return sum;
}

double fractal_noise(const Vec3& p, int octaves) {
  double sum = 0, weight = 0.5, total = 0, frequency = 1;
  for (int i = 0; i < octaves; ++i) {
    sum += weight * value_noise(p * frequency);
    total += weight;
    weight *= 0.5;
    frequency *= 2.03;
  }
  return sum / total;
}

Paint plain(const Vec3& colour) {
  return [colour](const Vec3&, double, double) { return colour; };
}

Surface quad_surface(const Vec3& corner, const Vec3& edge_u, const Vec3& edge_v) {
  const Vec3 normal = unit(cross(edge_u, edge_v));
  return [=](double u, double v) { return SurfacePoint{corner + edge_u * u + edge_v * v, normal}; };
}

Surface frustum_surface(const Vec3& base, const Vec3& top, double base_radius, double top_radius) {
  const Vec3 axis = top - base;
  const double length = std::sqrt(dot(axis, axis));
  const Vec3 along = unit(axis);
  Vec3 t, b;
  tangents(along, t, b);
  return [=](double u, double v) {
    const double angle = 2 * kPi * u;
    const Vec3 out = t * portable_cos(angle) + b * portable_sin(angle);
    const double radius = base_radius + (top_radius - base_radius) * v;
    const Vec3 normal = unit(out + along * ((base_radius - top_radius) / length));
    return SurfacePoint{base + axis * v + out * radius, normal};
  };
}

Surface disc_surface(const Vec3& centre, const Vec3& normal, double inner_radius, double outer_radius) {
  const Vec3 n = unit(normal);
  Vec3 t, b;
  tangents(n, t, b);
  return [=](double u, double v) {
    const double angle = 2 * kPi * u;
    const double radius = inner_radius + (outer_radius - inner_radius) * v;
    return SurfacePoint{centre + (t * portable_cos(angle) + b * portable_sin(angle)) * radius, n};
  };
}

Surface ellipsoid_surface(const Vec3& centre, const Vec3& radii) {
  return [=](double u, double v) {
    const double angle = 2 * kPi * u, y = 2 * v - 1;
    const double ring = std::sqrt(std::max(0.0, 1 - y * y));
    const Vec3 p = {ring * portable_cos(angle), y, ring * portable_sin(angle)};
    return SurfacePoint{centre + p * radii, unit({p[0] / radii[0], p[1] / radii[1], p[2] / radii[2]})};
  };
}

Surface dome_surface(const Vec3& centre, double radius, double low, double high) {
  return [=](double u, double v) {
    const double angle = 2 * kPi * u, y = low + (high - low) * v;
    const double ring = std::sqrt(std::max(0.0, 1 - y * y));
    const Vec3 p = {ring * portable_cos(angle), y, ring * portable_sin(angle)};
    return SurfacePoint{centre + p * radius, p * -1.0};
  };
}

double fraction(double value) { return value - std::floor(value); }

double hash_fraction(double index, double salt) {
  return fraction(value_noise({std::floor(index) * 17.37 + 0.5, salt * 7.13 + 0.5, 3.5}) * 9.7);
}

}  // namespace vrpipe
