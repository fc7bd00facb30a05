#pragma once

#include <array>
#include <string>
#include <vector>

#include <vrpipe/workloads/camera.h>
#include <vrpipe/workloads/gaussian_scene.h>

namespace vrpipe {

/// Spherical harmonics of a Gaussian whose world is turned, or mirrored.
class HarmonicsTurn {
 public:
  /// @param turn  rows of an orthogonal matrix, which takes a direction of the old world to one of the new
  explicit HarmonicsTurn(const std::array<Vec3, 3>& turn);
  /// @param degree  1 to 3, of the coefficients that are turned
  void apply(std::array<float, 15>& coefficients, int degree) const;

 private:
  std::array<std::array<std::array<double, 7>, 7>, 3> bands_{};  ///< by degree - 1: new = matrix old
};

/// From a world whose axes point elsewhere to INRIA's: x right, y down, z forward. Exact but for harmonics.
class AxesTurn {
 public:
  /// @param axes  where its x, y and z point, a letter of left/right, up/down and front/back each: "rub" is right, up, back. One
  ///              of names()
  explicit AxesTurn(const std::string& axes);
  void apply(GaussianAttributes& gaussian, int degree) const;

  /// All that .spz can declare, in the order of its codes from 1 on.
  static const std::vector<std::string>& names();

 private:
  std::array<Vec3, 3> rows() const;

  std::array<std::size_t, 3> from_{};  ///< of each axis here, the one of the file
  std::array<float, 3> sign_{};        ///< and whether they point the same way
  float handedness_ = 1;               ///< -1 where the file's world is mirrored
  bool is_ours_;
  HarmonicsTurn harmonics_;
};

}  // namespace vrpipe
