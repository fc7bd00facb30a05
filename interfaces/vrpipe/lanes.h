#pragma once

#include <cstdint>
#include <cstring>

namespace vrpipe {

/// The four samples of a quad side by side: lane 0 is (0,0), 1 is (1,0), 2 is (0,1), 3 is (1,1).
/// Arithmetic is lane-wise IEEE single precision, never contracted, so results do not depend on compiler or processor.
using Lanes = float __attribute__((vector_size(16)));
using LaneBits = std::int32_t __attribute__((vector_size(16)));

/// One bit a lane, bit i for lane i.
using LaneMask = std::uint8_t;
constexpr LaneMask all_lanes = 0xF;

inline Lanes splat_lanes(float value) { return Lanes{value, value, value, value}; }

inline LaneBits bits_of(Lanes value) {
  LaneBits bits;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

inline Lanes lanes_of(LaneBits bits) {
  Lanes value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

/// `condition` holds all ones or all zeros in each lane, as a vector comparison gives.
inline Lanes select(LaneBits condition, Lanes if_true, Lanes if_false) { return condition != 0 ? if_true : if_false; }

/// The sign bit of each lane.
inline LaneMask sign_mask(LaneBits bits) {
#if defined(__SSE__)
  return static_cast<LaneMask>(__builtin_ia32_movmskps(lanes_of(bits)));
#else
  LaneMask mask = 0;
  for (int lane = 0; lane < 4; ++lane) mask = static_cast<LaneMask>(mask | ((bits[lane] < 0) << lane));
  return mask;
#endif
}

/// All ones in the lanes whose bit is set.
inline LaneBits expand_mask(LaneMask mask) {
  const LaneBits bit{1, 2, 4, 8};
  const LaneBits set{mask, mask, mask, mask};
  return (set & bit) == bit;
}

/// Lanes set in a mask of four: a table in a register, since the baseline instruction set has no popcnt.
constexpr unsigned popcount(LaneMask mask) { return (0x4332322132212110ULL >> (mask * 4U)) & 0xFU; }

}  // namespace vrpipe
