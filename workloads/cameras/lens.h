#pragma once

#include <string>
#include <vector>

#include <vrpipe/workloads/camera.h>

namespace vrpipe {

/// A parameter of a lens that is 0 for none, by the name that OpenCV and COLMAP give it.
struct LensParameter {
  std::string name;
  double value = 0;
};

/// What the parameters are of.
enum class LensModel {
  polynomial,     ///< k or k1 to k6 times even powers of the radius, and p1, p2
  rational,       ///< OpenCV's of eight: k4 to k6 divide
  field_of_view,  ///< omega, radians
};

/// How far a lens moves what a pinhole would see, pixels: the farthest of a grid over the image, with its corners; infinite
/// where that overflows.
double distortion_pixels(const Camera& camera, LensModel model, const std::vector<LensParameter>& parameters);

/// What a format knows about a camera's lens.
struct Lens {
  LensModel model = LensModel::polynomial;
  std::vector<LensParameter> parameters;
  std::string complaint;  ///< what a refusal begins with, up to what distorts
  std::string
      undistorted_by;  ///< why the camera is undistorted all the same, a clause for Camera::notes; empty: it is not
  std::string remedy;
};

/// Takes the camera as undistorted where nothing speaks against it, and notes it where pixels move.
/// @throws UserError for a camera that is distorted, with the parameter that moves pixels farthest
void check_lens(const Lens& lens, Lenses lenses, const std::string& file, const std::string& where, Camera& camera);

}  // namespace vrpipe
