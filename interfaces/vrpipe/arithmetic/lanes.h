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

/// Two of these side by side: two quads, or two channels of a quad.
using LanePair = float __attribute__((vector_size(32)));
using LanePairBits = std::int32_t __attribute__((vector_size(32)));

/// The integers of as many lanes; a comparison gives all ones or all zeros in each.
template <class Floats>
using BitsOf = decltype(Floats{} < Floats{});

inline LanePair join(Lanes first, Lanes second) {
  return __builtin_shufflevector(first, second, 0, 1, 2, 3, 4, 5, 6, 7);
}
inline LanePairBits join(LaneBits first, LaneBits second) {
  return __builtin_shufflevector(first, second, 0, 1, 2, 3, 4, 5, 6, 7);
}
inline Lanes first_of(LanePair pair) { return __builtin_shufflevector(pair, pair, 0, 1, 2, 3); }
inline Lanes second_of(LanePair pair) { return __builtin_shufflevector(pair, pair, 4, 5, 6, 7); }

/// One of the two, twice.
inline LanePair first_twice(LanePair pair) { return __builtin_shufflevector(pair, pair, 0, 1, 2, 3, 0, 1, 2, 3); }
inline LanePair second_twice(LanePair pair) { return __builtin_shufflevector(pair, pair, 4, 5, 6, 7, 4, 5, 6, 7); }

inline Lanes splat_lanes(float value) { return Lanes{value, value, value, value}; }
inline LanePair splat_pair(float value) { return LanePair{value, value, value, value, value, value, value, value}; }

template <class Floats>
inline BitsOf<Floats> bits_of(Floats value) {
  return reinterpret_cast<BitsOf<Floats>>(value);
}
template <class Floats>
inline Floats floats_of(BitsOf<Floats> bits) {
  return reinterpret_cast<Floats>(bits);
}

/// `condition` holds all ones or all zeros in each lane, as a vector comparison gives.
template <class Floats>
inline Floats select(BitsOf<Floats> condition, Floats if_true, Floats if_false) {
  return condition != 0 ? if_true : if_false;
}

/// The sign bit of each lane.
inline LaneMask sign_mask(LaneBits bits) {
#if defined(__SSE__)
  return static_cast<LaneMask>(__builtin_ia32_movmskps(floats_of<Lanes>(bits)));
#else
  LaneMask mask = 0;
  for (int lane = 0; lane < 4; ++lane) mask = static_cast<LaneMask>(mask | ((bits[lane] < 0) << lane));
  return mask;
#endif
}

/// The sign bits of a pair, the second's in the upper four bits.
inline unsigned sign_mask(LanePairBits bits) {
#if defined(__AVX__)
  return static_cast<unsigned>(__builtin_ia32_movmskps256(floats_of<LanePair>(bits)));
#else
  LaneBits lanes[2];
  std::memcpy(lanes, &bits, sizeof lanes);
  return sign_mask(lanes[0]) | static_cast<unsigned>(sign_mask(lanes[1])) << 4U;
#endif
}

/// The sign bits of four pairs: those of the firsts in the lower 16 bits, those of the seconds in the upper.
inline std::uint32_t sign_masks(const LanePairBits (&pairs)[4]) {
#if defined(__AVX2__)
  const auto lower = __builtin_ia32_packssdw256(pairs[0], pairs[1]);
  const auto upper = __builtin_ia32_packssdw256(pairs[2], pairs[3]);
  return static_cast<std::uint32_t>(__builtin_ia32_pmovmskb256(__builtin_ia32_packsswb256(lower, upper)));
#else
  std::uint32_t masks = 0;
  for (unsigned pair = 0; pair < 4; ++pair) {
    const unsigned mask = sign_mask(pairs[pair]);
    masks |= (mask & 0xFU) << (4 * pair) | (mask >> 4U) << (16 + 4 * pair);
  }
  return masks;
#endif
}

/// Four words of 64 bits side by side.
using Words = std::uint64_t __attribute__((vector_size(32)));

/// The uppermost bit of each.
inline unsigned sign_mask(Words words) {
#if defined(__AVX__)
  using Doubles = double __attribute__((vector_size(32)));
  return static_cast<unsigned>(__builtin_ia32_movmskpd256(reinterpret_cast<Doubles>(words)));
#else
  unsigned mask = 0;
  for (int word = 0; word < 4; ++word) mask |= static_cast<unsigned>(words[word] >> 63U) << word;
  return mask;
#endif
}

/// Whether any bit is set in any lane.
inline bool any_bit(LanePairBits bits) {
  const auto words = reinterpret_cast<Words>(bits);
#if defined(__AVX__)
  using Integers = long long __attribute__((vector_size(32)));
  return __builtin_ia32_ptestz256(reinterpret_cast<Integers>(words), reinterpret_cast<Integers>(words)) == 0;
#else
  return (words[0] | words[1] | words[2] | words[3]) != 0;
#endif
}

/// All ones in the lanes whose bit is set.
inline LaneBits expand_mask(LaneMask mask) {
  const LaneBits bit{1, 2, 4, 8};
  const LaneBits set{mask, mask, mask, mask};
  return (set & bit) == bit;
}

/// All ones in the lanes of a pair whose bit is set, the second's bits being the upper four.
inline LanePairBits expand_mask_pair(std::uint32_t masks) {
  const LanePairBits bit{1, 2, 4, 8, 16, 32, 64, 128};
  return ((LanePairBits{} + static_cast<std::int32_t>(masks)) & bit) == bit;
}

/// All ones in the lanes of a pair whose bit is set, both having the same bits.
inline LanePairBits expand_mask_twice(LaneMask mask) {
  const LanePairBits bit{1, 2, 4, 8, 1, 2, 4, 8};
  return ((LanePairBits{} + mask) & bit) == bit;
}

/// Lanes set in a mask of four.
constexpr unsigned popcount(LaneMask mask) {
#if defined(__POPCNT__)
  return static_cast<unsigned>(__builtin_popcount(mask));
#else
  return (0x4332322132212110ULL >> (mask * 4U)) & 0xFU;  // a table in a register; the builtin would be a call
#endif
}

}  // namespace vrpipe
