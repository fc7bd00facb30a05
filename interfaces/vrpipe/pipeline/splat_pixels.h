#pragma once

#include <cstdint>

#include <vrpipe/arithmetic/exp2.h>
#include <vrpipe/arithmetic/lanes.h>
#include <vrpipe/pipeline/draw.h>
#include <vrpipe/pipeline/geometry.h>
#include <vrpipe/pipeline/surface.h>

/// Splats drawn pixel by pixel as the published renderer does, in single precision, eight pixels side by side:
/// alpha = min(0.99, opacity * exp(power)), by the inverse covariance.
namespace vrpipe {

/// When a pixel takes no more splats.
enum class StopRule : std::uint8_t {
  none,
  before,  ///< as published: at the splat that would bring its transmittance under a threshold, which is not blended
  after,   ///< as the hardware does: after the splat that brings its alpha to the threshold of the draw's state
};

/// A splat as the published kernel reads it: centre, inverse covariance, opacity; colour.
struct SplatRecord {
  float cx, cy, xx, xy, yy, opacity;
  float red, green, blue;
};

/// Of one without a covariance that can be inverted all is 0: as published, it is not drawn.
inline SplatRecord splat_record(const Splat& splat) {
  const float scale = splat.r > 0 ? 1 / splat.r : 0.0F;
  const float ax = splat.ax * scale;
  const float ay = splat.ay * scale;
  const float bx = splat.bx * scale;
  const float by = splat.by * scale;
  const float xx = ax * ax + bx * bx;
  const float xy = ax * ay + bx * by;
  const float yy = ay * ay + by * by;
  const float determinant = xx * yy - xy * xy;
  if (determinant == 0 || !is_finite(splat)) return {};
  const float inverse = 1 / determinant;
  return {splat.cx,      splat.cy,  yy * inverse, -xy * inverse, xx * inverse,
          splat.opacity, splat.red, splat.green,  splat.blue};
}

/// Eight pixels: where their samples are, and what is in them so far.
struct SplatPixels {
  LanePair x, y, transmittance, red, green, blue;
  LanePairBits alive;
};

/// Puts one of them at a pixel of a surface.
inline void store_pixel(const SplatPixels& pixels, std::size_t lane, std::uint32_t x, std::uint32_t y,
                        ColorSurface& surface) {
  const TileId tile{static_cast<std::uint16_t>(x / screen_tile_pixels),
                    static_cast<std::uint16_t>(y / screen_tile_pixels)};
  QuadColor& quad = surface.quad(tile, y % screen_tile_pixels / 2 * quads_per_tile_row + x % screen_tile_pixels / 2);
  const unsigned at = y % 2 * 2 + x % 2;
  quad.red[at] = pixels.red[lane];
  quad.green[at] = pixels.green[lane];
  quad.blue[at] = pixels.blue[lane];
  quad.alpha[at] = 1 - pixels.transmittance[lane];
}

struct SplatAlphas {
  LanePair alpha;
  LanePairBits inside;   ///< alive, and with an exponent of 0 or less
  LanePairBits visible;  ///< of these, with an alpha of the pruning threshold at least
};

inline SplatAlphas splat_alphas(const SplatRecord& splat, const SplatPixels& pixels, float pruning_threshold) {
  constexpr float log2_e = 1.44269504F;
  constexpr float most = 0.99F;
  const LanePair dx = splat.cx - pixels.x;
  const LanePair dy = splat.cy - pixels.y;
  const LanePair power = -0.5F * (splat.xx * dx * dx + splat.yy * dy * dy) - splat.xy * dx * dy;
  SplatAlphas alphas;
  alphas.inside = pixels.alive & (power <= 0.0F);
  const LanePair exponent = select<LanePair>(alphas.inside, power, LanePair{});
  const LanePair alpha = splat.opacity * exp2_nonpositive(exponent * log2_e);
  alphas.alpha = select<LanePair>(alpha > most, LanePair{} + most, alpha);
  alphas.visible = alphas.inside & (alphas.alpha >= pruning_threshold);
  return alphas;
}

/// Blends what is visible, front to back; gives the pixels that it was blended in.
/// @param limit  of `before` the least transmittance, of `after` the terminating alpha
template <StopRule Rule>
LanePairBits blend_splat(const SplatRecord& splat, const SplatAlphas& alphas, float limit, SplatPixels& pixels) {
  const LanePair before = pixels.transmittance;
  const LanePair after = before * (1.0F - alphas.alpha);
  LanePairBits blended = alphas.visible;
  if constexpr (Rule == StopRule::before) {
    blended &= after >= limit;
    pixels.alive &= ~alphas.visible | blended;
  }
  if constexpr (Rule == StopRule::after) pixels.alive &= ~(blended & (1.0F - after >= limit));
  const LanePair weight = floats_of<LanePair>(bits_of(alphas.alpha * before) & blended);
  pixels.red += splat.red * weight;
  pixels.green += splat.green * weight;
  pixels.blue += splat.blue * weight;
  pixels.transmittance = select<LanePair>(blended, after, before);
  return blended;
}

}  // namespace vrpipe
