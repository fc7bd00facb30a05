#include "formats/attribute_codes.h"

#include <cmath>

#include <vrpipe/workloads/portable_math.h>

namespace vrpipe {

float logit_of_opacity(double opacity) {
  constexpr double kMost = 40;
  if (opacity <= 0) return static_cast<float>(-kMost);
  if (opacity >= 1) return static_cast<float>(kMost);
  const double logit = portable_log(opacity / (1 - opacity));
  return static_cast<float>(std::fmin(std::fmax(logit, -kMost), kMost));
}

const std::array<float, 256>& logits_of_bytes() {
  static const std::array<float, 256> logits = [] {
    std::array<float, 256> table{};
    for (std::size_t byte = 0; byte < table.size(); ++byte)
      table[byte] = logit_of_opacity(static_cast<double>(byte) / 255);
    return table;
  }();
  return logits;
}

float log_scale_of(double scale) { return static_cast<float>(portable_log(scale)); }

double largest_component(double a, double b, double c) {
  return std::sqrt(std::fmax(0.0, 1 - (a * a + b * b + c * c)));
}

std::array<float, 4> quaternion_without(unsigned omitted, double a, double b, double c) {
  const std::array<double, 3> others = {a, b, c};
  std::array<float, 4> quaternion{};
  std::size_t next = 0;
  for (std::size_t i = 0; i < quaternion.size(); ++i) {
    quaternion[i] = static_cast<float>(i == omitted ? largest_component(a, b, c) : others[next++]);
  }
  return quaternion;
}

int sh_degree_of(std::uint64_t coefficients_per_channel) {
  for (std::size_t degree = 0; degree < kShRestPerChannel.size(); ++degree) {
    if (kShRestPerChannel[degree] == coefficients_per_channel) return static_cast<int>(degree);
  }
  return -1;
}

void check_count(std::uint64_t count, std::uint64_t file_bytes, const FileBytes& where) {
  constexpr std::uint64_t kAlways = 65536;
  if (count <= kAlways || count - kAlways <= file_bytes) return;
  where.fail("it announces " + std::to_string(count) + " Gaussians in " + std::to_string(file_bytes) + " bytes",
             "get the file again: trained scenes have six bytes or more for each");
}

}  // namespace vrpipe
