#include <vrpipe/workloads/scene_description.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include <vrpipe/workloads/portable_math.h>
#include <vrpipe/workloads/preprocess.h>

namespace vrpipe {
namespace {

/// The value at the place of kDescribedPercents; `values` are reordered.
double quantile(std::vector<float>& values, unsigned percent) {
  const std::uint64_t place = percent * static_cast<std::uint64_t>(values.size() - 1) / 100;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Quantiles of what `meaning`, which is monotonic, makes of the values.
template <class Meaning>
DescribedQuantiles quantiles(std::vector<float>& values, const Meaning& meaning) {
  DescribedQuantiles result{};
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = meaning(quantile(values, kDescribedPercents[i]));
  return result;
}

}  // namespace

SceneDescription describe(const GaussianScene& scene) {
  SceneDescription result;
  result.count = scene.size();
  std::array<std::vector<float>, 3> coordinates;
  std::vector<float> logits, log_scales, log_ratios;
  for (std::uint64_t i = 0; i < scene.size(); ++i) {
    const GaussianRef gaussian = scene[i];
    const Rejection rejection = rejection_of(gaussian, scene.sh_degree());
    result.rejected.not_finite += rejection == Rejection::not_finite;
    result.rejected.zero_quaternion += rejection == Rejection::zero_quaternion;
    if (rejection != Rejection::none) continue;
    const std::array<float, 3> position = gaussian.position(), log_scale = gaussian.log_scale();
    for (std::size_t axis = 0; axis < 3; ++axis) coordinates[axis].push_back(position[axis]);
    const auto ends = std::minmax_element(log_scale.begin(), log_scale.end());
    logits.push_back(gaussian.opacity_logit());
    log_scales.push_back(*ends.second);
    // Of a Gaussian that is a point, both are minus infinity.
    log_ratios.push_back(*ends.second > *ends.first ? *ends.second - *ends.first : 0);
  }
  if (logits.empty()) return result;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double from = scene.origin()[axis];
    result.low[axis] = from + quantile(coordinates[axis], 0);
    result.high[axis] = from + quantile(coordinates[axis], 100);
    result.low_middle[axis] = from + quantile(coordinates[axis], 1);
    result.high_middle[axis] = from + quantile(coordinates[axis], 99);
  }
  // As bytes have it: what is left of 0 after a logit of -40 is no opacity.
  result.opacity = quantiles(logits, [](double logit) { return logit <= -40 ? 0.0 : sigmoid(logit); });
  result.scale = quantiles(log_scales, portable_exp);
  result.anisotropy = quantiles(log_ratios, portable_exp);
  return result;
}

}  // namespace vrpipe
