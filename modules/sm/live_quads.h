#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <vrpipe/arithmetic/lanes.h>
#include <vrpipe/pipeline/payload.h>

namespace vrpipe {

/// The quads of a warp side by side, a lane each.
class QuadLanes {
 public:
  explicit QuadLanes(const Warp& warp) : threads_(~0U >> (4 * (quads_per_warp - warp.count))) {
    static_assert(sizeof warp.quads == 2 * sizeof(LanePairBits) && offsetof(Quad, position) == 4);
    static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
    LanePairBits quads[2];
    std::memcpy(quads, warp.quads.data(), sizeof quads);
    splat_ = __builtin_shufflevector(quads[0], quads[1], 0, 2, 4, 6, 8, 10, 12, 14);
    rest_ = __builtin_shufflevector(quads[0], quads[1], 1, 3, 5, 7, 9, 11, 13, 15);
  }

  /// Threads that are covered, a bit each.
  std::uint32_t covered() const {
    const auto words = reinterpret_cast<Words>((rest_ >> 8 & all_lanes) << first_bits);
    const std::uint64_t both = words[0] | words[1] | words[2] | words[3];
    return static_cast<std::uint32_t>(both | both >> 32U) & threads_;
  }

  /// Hands on those that have a live thread, one behind the other, but for their colours. `live`: a bit a thread.
  [[gnu::always_inline]] void put_live(std::uint32_t live, bool several_draws, ShadedWarp& out) const {
    const LanePairBits live_lanes = spread(live);
    const unsigned quads = sign_mask(live_lanes != 0);
    out.count = static_cast<std::uint8_t>(__builtin_popcount(quads));
    const LanePairBits places = spread(places_of_bits[quads]);
    const LanePairBits order = pick(2 * splat_ + (rest_ >> 16 & 1), places);  // as primitive_order
    std::memcpy(out.first_primitive.data(), &order, sizeof order);
    std::memcpy(out.last_primitive.data(), &order, sizeof order);
    const LanePairBits rest = pick((rest_ & ~0xff00) | live_lanes << 8, places);
    const auto bytes = reinterpret_cast<Bytes>(rest);
    const auto position = __builtin_shufflevector(bytes, bytes, 0, 4, 8, 12, 16, 20, 24, 28);
    const auto live_bytes = __builtin_shufflevector(bytes, bytes, 1, 5, 9, 13, 17, 21, 25, 29);
    std::memcpy(out.position.data(), &position, sizeof position);
    std::memcpy(out.live.data(), &live_bytes, sizeof live_bytes);
    for (unsigned i = 0; several_draws && i < quads_per_warp; ++i)
      out.draw[i] = static_cast<DrawIndex>(rest[i] >> 17 & 0x7fff);
  }

 private:
  static constexpr LanePairBits first_bits{0, 4, 8, 12, 16, 20, 24, 28};
  using Bytes = std::uint8_t __attribute__((vector_size(32)));
  /// By a mask of eight bits: the places of those that are set, lowest first, four bits each.
  static constexpr std::array<std::uint32_t, 256> places_of_bits = [] {
    std::array<std::uint32_t, 256> places{};
    for (unsigned mask = 0; mask < 256; ++mask) {
      unsigned set = 0;
      for (unsigned place = 0; place < 8; ++place) {
        if ((mask >> place & 1U) != 0) places[mask] |= place << (4 * set++);
      }
    }
    return places;
  }();
  /// Eight times four bits, a lane each.
  static LanePairBits spread(std::uint32_t fours) {
    return (LanePairBits{} + static_cast<std::int32_t>(fours)) >> first_bits & 0xf;
  }
  /// The lanes at eight places.
  static LanePairBits pick(LanePairBits lanes, LanePairBits places) {
#if defined(__AVX2__)
    return __builtin_ia32_permvarsi256(lanes, places);
#else
    LanePairBits picked{};
    for (unsigned lane = 0; lane < 8; ++lane) picked[lane] = lanes[places[lane]];
    return picked;
#endif
  }

  LanePairBits splat_;
  LanePairBits rest_;  ///< position, coverage, triangle and draw, as Quad has them
  std::uint32_t threads_;
};

}  // namespace vrpipe
