#pragma once

#include <array>

namespace vrpipe {

// Real SH basis constants, as INRIA names them.
constexpr double kShC0 = 0.28209479177387814;
constexpr double kShC1 = 0.4886025119029199;
constexpr std::array<double, 5> kShC2 = {1.0925484305920792, -1.0925484305920792, 0.31539156525252005,
                                         -1.0925484305920792, 0.5462742152960396};
constexpr std::array<double, 7> kShC3 = {-0.5900435899266435, 2.890611442640554,   -0.4570457994644658,
                                         0.3731763325901154,  -0.4570457994644658, 1.445305721320277,
                                         -0.5900435899266435};

}  // namespace vrpipe
