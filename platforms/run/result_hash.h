#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <vrpipe/pipeline/counts.h>
#include <vrpipe/pipeline/surface.h>
#include <vrpipe/platforms/simulation.h>

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

/// Of a frame that the pipeline draws.
inline std::string hash_of(const RunResult& result) {
  ResultHash hash;
  for (const CountField& field : Counts::fields()) {
    const std::uint64_t count = result.counts.*field.value;
    if (count != 0 || !field.is_rare) hash.add(count);
  }
  hash.add(result.cycles.value_or(0));
  hash.add(result.framebuffer.color);
  return hash.text();
}

/// Of one that is drawn outside the pipeline.
inline std::string hash_of(const std::vector<StatisticReport>& statistics, std::optional<std::uint64_t> cycles,
                           const ColorSurface& image) {
  ResultHash hash;
  for (const StatisticReport& statistic : statistics) hash.add(statistic.value);
  hash.add(cycles.value_or(0));
  hash.add(image);
  return hash.text();
}

}  // namespace vrpipe
