#include "image/color_scale.h"

#include <algorithm>

namespace vrpipe::tools {

std::array<std::uint8_t, 3> viridis(double share) {
  // M. Zucker's polynomials for matplotlib's table, in the public domain.
  constexpr double coefficients[7][3] = {{0.2777273272234177, 0.005407344544966578, 0.3340998053353061},
                                         {0.1050930431085774, 1.404613529898575, 1.384590162594685},
                                         {-0.3308618287255563, 0.214847559468213, 0.09509516302823659},
                                         {-4.634230498983486, -5.799100973351585, -19.33244095627987},
                                         {6.228269936347081, 14.17993336680509, 56.69055260068105},
                                         {4.776384997670288, -13.74514537774601, -65.35303263337234},
                                         {-5.435455855934631, 4.645852612178535, 26.3124352495832}};
  const double x = std::min(std::max(share, 0.0), 1.0);
  std::array<std::uint8_t, 3> color{};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    double value = 0;
    for (unsigned power = 7; power-- > 0;) value = value * x + coefficients[power][channel];
    color[channel] = static_cast<std::uint8_t>(std::min(std::max(value, 0.0), 1.0) * 255 + 0.5);
  }
  return color;
}

}  // namespace vrpipe::tools
