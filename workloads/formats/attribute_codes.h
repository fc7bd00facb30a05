#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <thread>

#include <vrpipe/workloads/gaussian_scene.h>

#include "for_each_chunk.h"
#include "formats/file_bytes.h"

namespace vrpipe {

/// f_dc of a colour: colour = 0.5 + kShBand0 f_dc.
constexpr double kShBand0 = 0.28209479177387814;
inline float f_dc_of_colour(double colour) { return static_cast<float>((colour - 0.5) / kShBand0); }

/// The logit of a linear opacity. At and beyond 0 and 1 it is -40 and 40, whose sigmoids are 0 (4e-18) and 1 in float32:
/// infinities would not survive in every other program.
float logit_of_opacity(double opacity);
/// Of opacities that are a byte / 255.
const std::array<float, 256>& logits_of_bytes();

/// Log scale of a linear one; of 0 minus infinity, below 0 not a number.
float log_scale_of(double scale);

/// The largest component of a unit quaternion from the three others; 0 where rounding took them beyond a unit.
double largest_component(double a, double b, double c);
/// (w, x, y, z) with `omitted` left out and computed from the others, which are in this order.
std::array<float, 4> quaternion_without(unsigned omitted, double a, double b, double c);

/// What lies at `share`, 0 to 1, of the way between two numbers. An end that is infinite is there wherever the other one has
/// no share alone: where scales are 0, their logarithms are.
inline double between(double from, double to, double share) {
  if (std::isfinite(to - from)) return from + (to - from) * share;
  return share <= 0 ? from : share >= 1 ? to : from * (1 - share) + to * share;
}

/// SH degree with this many coefficients per channel beyond the first, 0 to 3; -1 for none.
int sh_degree_of(std::uint64_t coefficients_per_channel);

/// What a compressed file may announce: a Gaussian per byte, beyond some that may all be equal. Trained scenes have at least six
/// bytes for each.
/// @param file_bytes  of all files of the scene together
/// @throws UserError when there are more
void check_count(std::uint64_t count, std::uint64_t file_bytes, const FileBytes& where);

/// Sets `count` Gaussians of `gaussians` from `first` on, each made by decode(index, gaussian), index from 0, on one of all cores;
/// `gaussian` is as default-constructed. `decode` does not throw: which error came first would depend on time.
template <class Decode>
void decode_into(GaussianArray& gaussians, std::uint64_t first, std::uint64_t count, const Decode& decode) {
  constexpr std::uint64_t kChunk = 8192;
  for_each_chunk((count + kChunk - 1) / kChunk, std::thread::hardware_concurrency(), [&](std::uint64_t chunk) {
    const std::uint64_t end = std::min(count, (chunk + 1) * kChunk);
    for (std::uint64_t i = chunk * kChunk; i < end; ++i) {
      GaussianAttributes gaussian;
      decode(i, gaussian);
      gaussians.set(first + i, gaussian);
    }
  });
}

/// A scene of `count` Gaussians, made in the same way.
/// @throws UserError when there is not enough memory
template <class Decode>
GaussianScene decode_gaussians(std::uint64_t count, int sh_degree, const std::string& where, const Decode& decode) {
  GaussianArray gaussians(count, sh_degree, where);
  decode_into(gaussians, 0, count, decode);
  return gaussians.build();
}

}  // namespace vrpipe
