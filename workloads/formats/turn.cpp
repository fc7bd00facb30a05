#include "formats/turn.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <glm/geometric.hpp>

#include "spherical_harmonics.h"

namespace vrpipe {
namespace {

/// Directions that tell the functions of each band apart: those of degree l by the first 2 l + 1. No band's matrix of them
/// has a condition number above 9.
constexpr std::array<std::array<double, 3>, 7> kDirections = {
    {{-3, 2, -1}, {3, -2, -1}, {-3, -1, 0}, {-3, -2, -2}, {0, -1, 0}, {0, 3, -3}, {1, 1, 0}}};

using Matrix = std::array<std::array<double, 7>, 7>;

/// Solves a x = b for the columns of b, in place: Gauss-Jordan with partial pivoting.
void solve(Matrix& a, Matrix& b, std::size_t size) {
  for (std::size_t column = 0; column < size; ++column) {
    std::size_t pivot = column;
    for (std::size_t row = column + 1; row < size; ++row) {
      if (std::fabs(a[row][column]) > std::fabs(a[pivot][column])) pivot = row;
    }
    std::swap(a[column], a[pivot]);
    std::swap(b[column], b[pivot]);
    for (std::size_t row = 0; row < size; ++row) {
      if (row == column) continue;
      const double factor = a[row][column] / a[column][column];
      for (std::size_t i = 0; i < size; ++i) {
        a[row][i] -= factor * a[column][i];
        b[row][i] -= factor * b[column][i];
      }
    }
  }
  for (std::size_t row = 0; row < size; ++row) {
    for (std::size_t i = 0; i < size; ++i) b[row][i] /= a[row][row];
  }
}

/// Axes that change places have matrices of quarters and square roots: quarters are exact.
double snapped(double value) {
  const double quarters = std::nearbyint(4 * value);
  return std::fabs(4 * value - quarters) < 1e-9 ? quarters / 4 : value;
}

}  // namespace

HarmonicsTurn::HarmonicsTurn(const std::array<Vec3, 3>& turn) {
  for (std::size_t band = 0; band < 3; ++band) {
    const std::size_t size = 2 * band + 3, first = band * (band + 2);
    Matrix here{}, there{};
    for (std::size_t k = 0; k < size; ++k) {
      const Vec3 direction = glm::normalize(Vec3{kDirections[k][0], kDirections[k][1], kDirections[k][2]});
      const Vec3 old = direction.x * turn[0] + direction.y * turn[1] + direction.z * turn[2];
      const std::array<double, 15> of_new = sh_basis(direction, 3), of_old = sh_basis(old, 3);
      for (std::size_t i = 0; i < size; ++i) {
        here[k][i] = of_new[first + i];
        there[k][i] = of_old[first + i];
      }
    }
    solve(here, there, size);
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < size; ++j) bands_[band][i][j] = snapped(there[i][j]);
    }
  }
}

void HarmonicsTurn::apply(std::array<float, 15>& coefficients, int degree) const {
  for (std::size_t band = 0; band < static_cast<std::size_t>(degree); ++band) {
    const std::size_t size = 2 * band + 3, first = band * (band + 2);
    std::array<double, 7> turned{};
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < size; ++j) {
        // What is not finite stays where it is.
        if (bands_[band][i][j] != 0) turned[i] += bands_[band][i][j] * static_cast<double>(coefficients[first + j]);
      }
    }
    for (std::size_t i = 0; i < size; ++i) coefficients[first + i] = static_cast<float>(turned[i]);
  }
}

const std::vector<std::string>& AxesTurn::names() {
  static const std::vector<std::string> names = {"ldb", "rdb", "lub", "rub", "ldf", "rdf", "luf", "ruf",
                                                 "lfd", "rfd", "lfu", "rfu", "lbd", "rbd", "lbu", "rbu"};
  return names;
}

AxesTurn::AxesTurn(const std::string& axes)
    : is_ours_(axes == "rdf"), harmonics_([&] {
        const std::string negative = "lub", positive = "rdf";
        for (std::size_t i = 0; i < 3; ++i) {
          const std::size_t against = negative.find(axes[i]);
          const std::size_t here = against == std::string::npos ? positive.find(axes[i]) : against;
          from_[here] = i;
          sign_[here] = against == std::string::npos ? 1.0f : -1.0f;
        }
        return HarmonicsTurn(rows());
      }()) {
  const std::array<Vec3, 3> turn = rows();
  handedness_ = static_cast<float>(glm::dot(glm::cross(turn[0], turn[1]), turn[2]));
}

std::array<Vec3, 3> AxesTurn::rows() const {
  std::array<Vec3, 3> rows{};
  for (std::size_t i = 0; i < 3; ++i) rows[i][from_[i]] = static_cast<double>(sign_[i]);
  return rows;
}

void AxesTurn::apply(GaussianAttributes& gaussian, int degree) const {
  if (is_ours_) return;
  const GaussianAttributes file = gaussian;
  for (std::size_t i = 0; i < 3; ++i) {
    gaussian.position[i] = sign_[i] * file.position[from_[i]];
    gaussian.log_scale[i] = file.log_scale[from_[i]];
    // Turned from T, a rotation is T R T^-1, whose axis is that of R turned, and goes round the other way where T mirrors.
    gaussian.rotation[1 + i] = handedness_ * sign_[i] * file.rotation[1 + from_[i]];
  }
  for (std::array<float, 15>& channel : gaussian.f_rest) harmonics_.apply(channel, degree);
}

}  // namespace vrpipe
