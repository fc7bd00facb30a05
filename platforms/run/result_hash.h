#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string>

#include <fmt/format.h>

#include <vrpipe/pipeline/surface.h>

namespace vrpipe {

/// Of counts, cycles and the stored bits of an image, by FNV-1a.
class ResultHash {
 public:
  void add(std::uint64_t value) {
    for (unsigned byte = 0; byte < 8; ++byte) hash_ = (hash_ ^ ((value >> (8 * byte)) & 0xffU)) * 0x100000001b3ULL;
  }
  void add(const ColorSurface& surface) {
    for (std::uint32_t y = 0; y < surface.height(); ++y) {
      for (std::uint32_t x = 0; x < surface.width(); ++x) {
        const std::array<float, 4> pixel = surface.pixel(x, y);
        std::array<std::uint64_t, 2> bits;
        std::memcpy(bits.data(), pixel.data(), sizeof bits);
        for (const std::uint64_t each : bits) add(each);
      }
    }
  }
  /// 16 hex digits.
  std::string text() const { return fmt::format("{:016x}", hash_); }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325ULL;
};

}  // namespace vrpipe
