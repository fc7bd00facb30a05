#pragma once

#include <array>

#include <vrpipe/workloads/camera.h>

namespace vrpipe {

// Real SH basis constants, as INRIA names them.
constexpr double kShC0 = 0.28209479177387814;
constexpr double kShC1 = 0.4886025119029199;
constexpr std::array<double, 5> kShC2 = {1.0925484305920792, -1.0925484305920792, 0.31539156525252005,
                                         -1.0925484305920792, 0.5462742152960396};
constexpr std::array<double, 7> kShC3 = {-0.5900435899266435, 2.890611442640554,   -0.4570457994644658,
                                         0.3731763325901154,  -0.4570457994644658, 1.445305721320277,
                                         -0.5900435899266435};

/// The basis functions of degree 1 up to `degree`, in INRIA's order, at a direction of length 1; zeros beyond. Each band is a
/// homogeneous polynomial of its degree.
inline std::array<double, 15> sh_basis(const Vec3& direction, int degree) {
  const double x = direction[0], y = direction[1], z = direction[2];
  std::array<double, 15> basis{};
  if (degree >= 1) {
    basis[0] = -kShC1 * y;
    basis[1] = kShC1 * z;
    basis[2] = -kShC1 * x;
  }
  const double xx = x * x, yy = y * y, zz = z * z;
  if (degree >= 2) {
    basis[3] = kShC2[0] * (x * y);
    basis[4] = kShC2[1] * (y * z);
    basis[5] = kShC2[2] * (2.0 * zz - xx - yy);
    basis[6] = kShC2[3] * (x * z);
    basis[7] = kShC2[4] * (xx - yy);
  }
  if (degree >= 3) {
    basis[8] = kShC3[0] * (y * (3.0 * xx - yy));
    basis[9] = kShC3[1] * (x * y * z);
    basis[10] = kShC3[2] * (y * (4.0 * zz - xx - yy));
    basis[11] = kShC3[3] * (z * (2.0 * zz - 3.0 * xx - 3.0 * yy));
    basis[12] = kShC3[4] * (x * (4.0 * zz - xx - yy));
    basis[13] = kShC3[5] * (z * (xx - yy));
    basis[14] = kShC3[6] * (x * (xx - 3.0 * yy));
  }
  return basis;
}

}  // namespace vrpipe
