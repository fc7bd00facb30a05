#include "lens.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>

#include <fmt/format.h>

#include "camera_format.h"

namespace vrpipe {
namespace {

struct Coefficients {
  std::array<double, 6> k{};
  double p1 = 0, p2 = 0, omega = 0;
};

Coefficients coefficients_of(const std::vector<LensParameter>& parameters) {
  Coefficients result;
  for (const auto& [name, value] : parameters) {
    if (name == "k") result.k[0] = value;
    if (name == "p1") result.p1 = value;
    if (name == "p2") result.p2 = value;
    if (name == "omega") result.omega = value;
    if (name.size() == 2 && name[0] == 'k') result.k.at(static_cast<std::size_t>(name[1] - '1')) = value;
  }
  return result;
}

/// By what a ray's distance from the axis grows, less 1, at the square of that distance.
double radial(LensModel model, const Coefficients& c, double r2) {
  // The first term of the series in omega. Where that is far from the whole, both are far above any limit.
  if (model == LensModel::field_of_view) return c.omega * c.omega * (1.0 / 12 - r2 / 3);
  const auto polynomial = [&c, r2](std::size_t from, std::size_t to) {
    double sum = 0;
    for (std::size_t i = to; i-- > from;) sum = (sum + c.k[i]) * r2;
    return sum;
  };
  if (model == LensModel::rational) return (1 + polynomial(0, 3)) / (1 + polynomial(3, 6)) - 1;
  return polynomial(0, 6);
}

}  // namespace

double distortion_pixels(const Camera& camera, LensModel model, const std::vector<LensParameter>& parameters) {
  const Coefficients c = coefficients_of(parameters);
  constexpr unsigned kSteps = 16;
  double farthest = 0;
  for (unsigned row = 0; row <= kSteps; ++row) {
    for (unsigned column = 0; column <= kSteps; ++column) {
      const double x = (camera.width * (static_cast<double>(column) / kSteps) - camera.cx()) / camera.fx;
      const double y = (camera.height * (static_cast<double>(row) / kSteps) - camera.cy()) / camera.fy;
      const double r2 = x * x + y * y, grown = radial(model, c, r2);
      const double right = camera.fx * (x * grown + 2 * c.p1 * x * y + c.p2 * (r2 + 2 * x * x));
      const double down = camera.fy * (y * grown + c.p1 * (r2 + 2 * y * y) + 2 * c.p2 * x * y);
      const double moved = std::sqrt(right * right + down * down);
      if (!std::isfinite(moved)) return std::numeric_limits<double>::infinity();
      farthest = std::max(farthest, moved);
    }
  }
  return farthest;
}

void check_lens(const Lens& lens, Lenses lenses, const std::string& file, const std::string& where, Camera& camera) {
  const double moved = distortion_pixels(camera, lens.model, lens.parameters);
  if (moved <= kLeastDistortion) return;
  const std::string name = std::filesystem::path(file).filename().string();
  if (lenses == Lenses::undistorted) {
    camera.notes.push_back("cameras of " + name + " are taken without their distortion, as --undistorted says");
    return;
  }
  if (!lens.undistorted_by.empty()) {
    camera.notes.push_back("cameras of " + name + " are taken as undistorted: " + lens.undistorted_by);
    return;
  }
  const auto alone = [&](const LensParameter& p) { return distortion_pixels(camera, lens.model, {p}); };
  const LensParameter* most = &lens.parameters.front();
  for (const LensParameter& parameter : lens.parameters) {
    if (alone(parameter) > alone(*most)) most = &parameter;
  }
  throw UserError(kCannotReadCameras, where,
                  fmt::format("{} {} = {:g}, which moves pixels by up to {:.2g}", lens.complaint, most->name,
                              most->value, moved),
                  lens.remedy);
}

}  // namespace vrpipe
