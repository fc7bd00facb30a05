#pragma once

#include <cmath>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <rapidcheck/gtest.h>

#include <vrpipe/platforms/simulation.h>

#include "support/builders.h"
#include "support/floating_point.h"

namespace vrpipe {

inline void showValue(const Splat& s, std::ostream& out) {
  out << std::hexfloat << "{" << s.cx << ", " << s.cy << ", " << s.ax << ", " << s.ay << ", " << s.bx << ", " << s.by
      << ", " << s.r << ", 0, " << s.red << ", " << s.green << ", " << s.blue << ", " << s.opacity << "}"
      << std::defaultfloat;
}

inline void showValue(const Draw& draw, std::ostream& out) {
  out << draw.width << "x" << draw.height << "{";
  for (const Splat& splat : draw.splats) {
    out << "\n  ";
    showValue(splat, out);
  }
  out << "}";
}

}  // namespace vrpipe

namespace vrpipe::testing {

constexpr float one_255th = 1.0F / 255.0F;

/// An integer in [low, high), evenly whatever RapidCheck's size is.
inline rc::Gen<int> whole(int low, int high) { return rc::gen::resize(rc::kNominalSize, rc::gen::inRange(low, high)); }

/// A float in [low, high), evenly.
inline rc::Gen<float> even(float low, float high) {
  return rc::gen::map(whole(0, 1 << 20),
                      [=](int k) { return low + (high - low) * static_cast<float>(k) / static_cast<float>(1 << 20); });
}

inline rc::Gen<float> coordinate(std::uint32_t side) {
  const auto size = static_cast<int>(side);
  return rc::gen::weightedOneOf<float>(
      {{6, even(-20.0F, static_cast<float>(side) + 20.0F)},
       {2, rc::gen::map(whole(-4, 2 * size + 4), [](int k) { return static_cast<float>(k) / 2.0F; })},
       {2, rc::gen::map(whole(0, size / 8 + 2), [](int k) { return static_cast<float>(8 * k); })},
       {1, rc::gen::map(whole(0, 256 * size), [](int k) { return static_cast<float>(k) / 256.0F; })},
       {1, rc::gen::element(0.0F, -0.0F, 1e-40F, -1e-40F, -3000.0F, 1e6F, -1e6F, 33000.0F)}});
}

inline rc::Gen<float> sigma() {
  return rc::gen::weightedOneOf<float>({{8, rc::gen::map(even(-1.5F, 3.0F), [](float k) { return std::exp(k); })},
                                        {2, rc::gen::element(0.3F, 0.5477F, 1.0F, 2.0F, 4.0F, 16.0F)},
                                        {2, rc::gen::element(0.0F, 1e-40F, 1e-20F, 1e-6F, 0.001F)},
                                        {1, rc::gen::element(100.0F, 1000.0F, 3000.0F, 1e5F, 3e5F)}});
}

inline rc::Gen<float> opacity() {
  return rc::gen::weightedOneOf<float>(
      {{6, even(0.004F, 1.0F)},
       {2, rc::gen::element(1.0F, 0.99F, 0.5F, 0.996F, 0.9999F)},
       {2, rc::gen::element(one_255th, std::nextafter(one_255th, 0.0F), std::nextafter(one_255th, 1.0F), 0.0F, -0.0F,
                            1e-40F, 2 * one_255th, 1.0F / 18.0F, 0.05F, 0.02F)}});
}

/// A colour channel up to `largest`.
inline rc::Gen<float> channel(float largest) {
  return rc::gen::weightedOneOf<float>({{5, even(0.0F, std::fmin(1.0F, largest))},
                                        {3, rc::gen::element(0.0F, 1.0F, -0.0F, 1e-40F, 6e-8F, 0.5F)},
                                        {1, rc::gen::element(largest, largest / 2, largest / 3)}});
}

inline rc::Gen<Splat> splat_in(std::uint32_t width, std::uint32_t height, float largest) {
  const auto angle =
      rc::gen::weightedOneOf<float>({{2, even(0.0F, 6.2831F)}, {1, rc::gen::element(0.0F, 0.78539816F, 1.5707964F)}});
  const auto thin = rc::gen::weightedOneOf<float>(
      {{3, even(0.05F, 1.0F)}, {2, rc::gen::just(1.0F)}, {1, rc::gen::element(0.0F, 1e-6F, 1e-3F)}});
  return rc::gen::apply(
      [](float x, float y, float a, float t, float turn, float o, float red, float green, float blue) {
        const float visible = std::fmax(o, one_255th);
        Splat splat = splat_at(x, y, a, a * t, turn, visible, red, green, blue);
        splat.opacity = o;
        return splat;
      },
      coordinate(width), coordinate(height), sigma(), thin, angle, opacity(), channel(largest), channel(largest),
      channel(largest));
}

/// A small image with up to `splats` splats; colours up to `largest`. A third of them repeat a position, so that
/// pixels fill up.
inline rc::Gen<Draw> scene(int splats, float largest) {
  return rc::gen::mapcat(rc::gen::pair(rc::gen::element(1U, 2U, 15U, 16U, 17U, 33U, 48U, 64U),
                                       rc::gen::element(1U, 2U, 15U, 16U, 17U, 33U, 65U)),
                         [=](std::pair<std::uint32_t, std::uint32_t> size) {
                           const std::uint32_t width = size.first;
                           const std::uint32_t height = size.second;
                           return rc::gen::map(rc::gen::resize(splats, rc::gen::container<std::vector<Splat>>(
                                                                           splat_in(width, height, largest))),
                                               [=](std::vector<Splat> list) {
                                                 for (std::size_t i = 2; i < list.size(); i += 3) {
                                                   list[i].cx = list[i - 2].cx;
                                                   list[i].cy = list[i - 2].cy;
                                                 }
                                                 return draw_of(width, height, std::move(list));
                                               });
                         });
}

inline rc::Gen<ColorFormat> format() {
  return rc::gen::element(ColorFormat::rgba16f, ColorFormat::rgba8, ColorFormat::rgba32f, ColorFormat::rgba16,
                          ColorFormat::srgb8);
}

/// Of the blender: as measured only where somebody has.
inline rc::Gen<const char*> rounding(ColorFormat of) {
  return is_measured(of) ? rc::gen::element("rne", "rtz", "measured") : rc::gen::element("rne", "rtz");
}

/// Bin sizes and counts far from the defaults, and also the defaults.
inline rc::Gen<std::vector<Setting>> bins() {
  return rc::gen::apply(
      [](const char* tc_bins, const char* tc_quads, const char* tgc_bins, const char* tgc_primitives, const char* grid,
         const char* qru_quads) {
        return std::vector<Setting>{{"tc", "bins", tc_bins},     {"tc", "bin_quads", tc_quads},
                                    {"tgc", "bins", tgc_bins},   {"tgc", "bin_primitives", tgc_primitives},
                                    {"tgc", "grid_tiles", grid}, {"qru", "bin_quads", qru_quads}};
      },
      rc::gen::element("32", "1", "2", "5"), rc::gen::element("128", "1", "7", "16", "300"),
      rc::gen::element("128", "1", "3"), rc::gen::element("16", "1", "2", "9"), rc::gen::element("4", "1", "3"),
      rc::gen::element("128", "1", "2", "13", "64"));
}

inline RunRequest request(const Variant& variant, ColorFormat format, Fidelity fidelity = Fidelity::functional) {
  RunRequest r;
  r.platform = &platform_named("agx-orin-ideal-memory");
  r.variant = variant;
  r.fidelity = fidelity;
  r.format = format;
  return r;
}

/// Of any variant and format. Drawn in statements, whose order every compiler keeps.
inline RunRequest drawn_request(Fidelity fidelity = Fidelity::functional) {
  const Variant variant = *rc::gen::elementOf(variants());
  const ColorFormat color = *format();
  return request(variant, color, fidelity);
}

/// Simulates; making a NaN out of numbers ends the test program.
inline RunResult run_trapped(const RunRequest& request, const Draw& draw) {
  if (request.fidelity != Fidelity::functional) fresh_simulation();
  const TrapInvalid trap;
  return simulate(request, draw);
}

inline bool same_bits(const ColorSurface& a, const ColorSurface& b) {
  for (std::uint32_t y = 0; y < a.height(); ++y) {
    for (std::uint32_t x = 0; x < a.width(); ++x) {
      const std::array<float, 4> p = a.pixel(x, y);
      const std::array<float, 4> q = b.pixel(x, y);
      if (std::memcmp(p.data(), q.data(), sizeof p) != 0) return false;
    }
  }
  return a.width() == b.width() && a.height() == b.height();
}

}  // namespace vrpipe::testing
