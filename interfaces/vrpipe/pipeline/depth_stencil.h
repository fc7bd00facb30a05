#pragma once

#include <cstdint>
#include <string>

namespace vrpipe {

/// How a tested value compares with a stored one (OpenGL 4.6, 17.3.5 and 17.3.6): LESS passes if it is less than that. NEVER is
/// `none` here.
enum class Compare : std::uint8_t { none, less, equal, less_equal, greater, not_equal, greater_equal, always };
inline constexpr unsigned compares = 8;

template <class Value>
constexpr bool passes(Compare compare, Value tested, Value stored) {
  switch (compare) {
    case Compare::none: return false;
    case Compare::less: return tested < stored;
    case Compare::equal: return tested == stored;
    case Compare::less_equal: return tested <= stored;
    case Compare::greater: return tested > stored;
    case Compare::not_equal: return tested != stored;
    case Compare::greater_equal: return tested >= stored;
    case Compare::always: return true;
  }
  return true;
}

/// What becomes of a stored stencil value (OpenGL 4.6, 17.3.5).
enum class StencilOperation : std::uint8_t {
  keep,
  zero,
  replace,
  increment,  ///< up to the largest
  decrement,  ///< down to 0
  invert,
  increment_wrap,
  decrement_wrap
};
inline constexpr unsigned stencil_operations = 8;

/// The most significant bit of a stencil value is early termination's (paper 5.2); an application has the others.
inline constexpr std::uint8_t termination_bit = 0x80;
inline constexpr std::uint8_t stencil_bits = 0x7f;
/// Those that it has where nothing terminates early.
inline constexpr std::uint8_t all_stencil_bits = 0xff;

/// Of what faces the viewer, or turns its back to him.
struct StencilFace {
  Compare compare = Compare::always;
  StencilOperation stencil_fail = StencilOperation::keep;
  StencilOperation depth_fail = StencilOperation::keep;  ///< passes the stencil test, fails the depth test
  StencilOperation pass = StencilOperation::keep;  ///< passes both, or passes that of stencil where depth is not tested
  std::uint8_t reference = 0;                      ///< within `bits`
  std::uint8_t read_mask = stencil_bits;           ///< of what is compared
  std::uint8_t write_mask = stencil_bits;
  std::uint8_t bits = stencil_bits;  ///< of a value; all_stencil_bits only where no draw of the frame terminates early

  bool writes() const {
    const bool changes = stencil_fail != StencilOperation::keep || depth_fail != StencilOperation::keep ||
                         pass != StencilOperation::keep;
    return changes && (write_mask & bits) != 0;
  }
  bool test(std::uint8_t stored) const {
    const unsigned mask = read_mask & bits;
    return passes(compare, reference & mask, stored & mask);
  }
  /// The stored value after an operation; what is not of `bits` stays.
  std::uint8_t apply(StencilOperation operation, std::uint8_t stored) const;
};
bool operator==(const StencilFace& a, const StencilFace& b);

struct StencilState {
  bool test = false;  ///< otherwise all pass, and nothing is written
  StencilFace front;
  StencilFace back;
  const StencilFace& face(bool is_back) const { return is_back ? back : front; }
  bool writes() const { return test && (front.writes() || back.writes()); }
  bool has_all_bits() const { return test && (front.bits == all_stencil_bits || back.bits == all_stencil_bits); }
};
bool operator==(const StencilState& a, const StencilState& b);

struct DepthState {
  bool test = false;  ///< otherwise all pass, and nothing is written
  Compare compare = Compare::less;
  bool write = true;  ///< of what passes
  bool writes() const { return test && write && compare != Compare::none; }
};
bool operator==(const DepthState& a, const DepthState& b);

/// How a depth target stores depth. All have 8 bits of stencil beside it.
enum class DepthFormat : std::uint8_t { d16, d24, d32f };
const char* name_of(DepthFormat format);
/// Throws UserError naming those that exist.
DepthFormat depth_format_named(const std::string& name);
/// With its stencil: D16 is padded to 4 bytes, D32F to 8 (GL_DEPTH32F_STENCIL8).
constexpr std::uint32_t bytes_per_pixel(DepthFormat format) { return format == DepthFormat::d32f ? 8 : 4; }

/// Depth as it is stored, in an order that is that of depth: the nearest of 2^n - 1 steps (OpenGL 4.6, 2.3.5), or the bits of
/// the float. What is not within [0, 1] is clamped to it first; NaN gives 0.
std::uint32_t store_depth(DepthFormat format, double depth);
/// The depth that a stored value stands for.
double depth_of(DepthFormat format, std::uint32_t stored);

}  // namespace vrpipe
