// What a pipeline draws is within the bounds that are proved for its precision (docs/numerics.md, F4), pixel by pixel.
#include <algorithm>

#include <vrpipe/workloads/exact_image.h>

#include "numerics_test_support.h"
#include "support/pixel_oracle.h"

namespace vrpipe {
namespace {

using namespace testing;

struct Drawn {
  const char* variant;
  ColorFormat format;
  std::vector<Setting> settings;
  DrawnPrecision precision;
};

Drawn drawn(const char* variant, ColorFormat format, std::vector<Setting> settings = {}) {
  Drawn made{variant, format, std::move(settings), {}};
  made.precision.format = format;
  made.precision.merges = variant_named(variant).quad_merging;
  if (variant_named(variant).early_termination) made.precision.termination_threshold = 0.996;
  return made;
}

/// The largest error over bound of any pixel; of the whole image the same, the largest bound being what a report shows.
double tightest(const Draw& draw, const std::vector<Drawn>& all) {
  std::vector<DrawnPrecision> precisions;
  for (const Drawn& each : all) precisions.push_back(each.precision);
  const BoundedImage bounded = render_with_bounds(draw, precisions);
  const ExactImage alone = render_exactly(draw);
  EXPECT_EQ(alone.rgba, bounded.exact.rgba);
  double tight = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const ColorSurface image =
        simulate(untimed(all[i].variant, all[i].format, all[i].settings), draw).framebuffer.color;
    const auto most = static_cast<double>(largest_color_of(all[i].format));
    for (std::uint32_t y = 0; y < draw.height; ++y) {
      for (std::uint32_t x = 0; x < draw.width; ++x) {
        const PixelBound& bound = bounded.bounds[i][std::size_t{y} * draw.width + x];
        const std::array<double, 4>& exact = bounded.exact.at(x, y);
        const std::array<float, 4> pixel = image.pixel(x, y);
        for (unsigned channel = 0; channel < 4; ++channel) {
          const double off = std::fabs(static_cast<double>(pixel[channel]) - std::min(exact[channel], most));
          const double allowed = channel == 3 ? bound.alpha : bound.color;
          EXPECT_LE(off, allowed) << name_of(all[i].format) << ' ' << all[i].variant << " of case " << i << ", pixel "
                                  << x << ',' << y << " channel " << channel;
          if (off > allowed) return tight;
          if (off > 0) tight = std::max(tight, off / allowed);
        }
      }
    }
  }
  return tight;
}

std::vector<Drawn> all_formats() {
  std::vector<Drawn> all;
  for (const ColorFormat format : color_formats) {
    for (const char* variant : {"baseline", "qm", "het", "het+qm"}) {
      all.push_back(drawn(variant, format));
      all.push_back(drawn(variant, format, {{"state", "blend_rounding", "rtz"}}));
      all.back().precision.device.blend_rounding = BlendRounding::rtz;
      if (!is_measured(format)) continue;
      all.push_back(drawn(variant, format, {{"state", "blend_rounding", "measured"}}));
      all.back().precision.device.blend_rounding = BlendRounding::measured;
    }
  }
  return all;
}

TEST(Bounds, HoldForEveryPixelInEveryFormatRoundingAndVariant) {
  EXPECT_GT(tightest(random_draw(96, 64, 1500, 3), all_formats()), 0.3);
}

TEST(Bounds, HoldWhereThousandsOfLayersStick) {
  std::vector<Splat> splats(3001, flat_box(-4, -4, 12, 12, 0.02F, 1, 1, 1));
  splats[0] = flat_box(-4, -4, 12, 12, 0.99F, 0, 0, 0);
  EXPECT_GT(tightest(draw_of(4, 4, std::move(splats)), all_formats()), 0.3);
}

TEST(Bounds, HoldForAlphasAtTheEdgeOfEveryThreshold) {
  std::vector<Splat> splats;
  const float edges[] = {1.0F / 255, 1.0F / 18, 1.0F / 9, 0.25F, 0.5F / 263, 0.99F, 0.996F};
  for (const float edge : edges) {
    for (const float alpha : {std::nextafter(edge, 0.0F), edge, std::nextafter(edge, 1.0F)}) {
      for (int i = 0; i < 20; ++i) splats.push_back(flat_box(-4, -4, 12, 12, alpha, 0.5F, 1, 0.25F));
    }
  }
  tightest(draw_of(4, 4, splats), all_formats());
  std::reverse(splats.begin(), splats.end());
  tightest(draw_of(4, 4, std::move(splats)), all_formats());
}

TEST(Bounds, HoldForTargetsThatSaturate) {
  std::vector<Splat> splats(400, flat_box(-4, -4, 12, 12, 0.05F, 3, 1, 0.1F));
  tightest(draw_of(4, 4, std::move(splats)), all_formats());
}

TEST(Bounds, HoldForEveryExponentialAndThreshold) {
  const Draw draw = random_draw(80, 64, 900, 8);
  std::vector<Drawn> all;
  const std::pair<const char*, Exponential> exponentials[] = {{"exact", Exponential::exact},
                                                              {"ex2", Exponential::ex2},
                                                              {"fp16", Exponential::fp16},
                                                              {"table256", Exponential::table256},
                                                              {"table16", Exponential::table16}};
  for (const auto& [name, exponential] : exponentials) {
    for (const char* variant : {"baseline", "het+qm"}) {
      all.push_back(drawn(variant, ColorFormat::rgba32f, {{"state", "exponential", name}}));
      all.back().precision.device.exponential = exponential;
    }
  }
  for (const double threshold : {0.0, 2 / 255.0, 4 / 255.0}) {
    all.push_back(drawn("het+qm", ColorFormat::rgba16, {{"state", "pruning_threshold", std::to_string(threshold)}}));
    all.back().precision.pruning_threshold = std::stod(std::to_string(threshold));
  }
  for (const double threshold : {0.9, 0.999}) {
    all.push_back(drawn("het", ColorFormat::rgba16f, {{"state", "termination_threshold", std::to_string(threshold)}}));
    all.back().precision.termination_threshold = threshold;
  }
  for (const char* bits : {"4", "12"})
    all.push_back(drawn("qm", ColorFormat::rgba16, {{"state", "subpixel_bits", bits}}));
  EXPECT_GT(tightest(draw, all), 0.2);
}

TEST(Bounds, HoldForEveryPrecisionOfTheShader) {
  std::vector<Drawn> all;
  const auto add = [&](const char* name, const char* value, const auto& change) {
    for (const char* variant : {"baseline", "qm", "het+qm"}) {
      for (const ColorFormat format : {ColorFormat::rgba32f, ColorFormat::rgba16, ColorFormat::rgba16f}) {
        all.push_back(drawn(variant, format, {{"state", name, value}}));
        change(all.back().precision.device);
      }
    }
  };
  add("shading", "fp16", [](DevicePrecision& device) { device.shading = NumberFormat::fp16; });
  add("merging", "fp16", [](DevicePrecision& device) { device.merging = NumberFormat::fp16; });
  add("export_format", "fp16", [](DevicePrecision& device) { device.export_format = NumberFormat::fp16; });
  add("attributes", "fp16", [](DevicePrecision& device) { device.attributes = AttributeFormat::fp16; });
  add("attributes", "quantized", [](DevicePrecision& device) { device.attributes = AttributeFormat::quantized; });
  add("alpha_max", "1", [](DevicePrecision& device) { device.alpha_max = 1; });
  add("alpha_max", "0.9", [](DevicePrecision& device) { device.alpha_max = 0.9F; });
  // All at once.
  for (const char* variant : {"baseline", "het+qm"}) {
    all.push_back(drawn(variant, ColorFormat::rgba8,
                        {{"state", "shading", "fp16"},
                         {"state", "merging", "fp16"},
                         {"state", "export_format", "fp16"},
                         {"state", "attributes", "quantized"}}));
    DevicePrecision& device = all.back().precision.device;
    device.shading = device.merging = device.export_format = NumberFormat::fp16;
    device.attributes = AttributeFormat::quantized;
  }
  EXPECT_GT(tightest(random_draw(96, 64, 1500, 3), all), 0.1);
  std::vector<Splat> stuck(3001, flat_box(-4, -4, 12, 12, 0.02F, 1, 1, 1));
  stuck[0] = flat_box(-4, -4, 12, 12, 0.99F, 0, 0, 0);
  EXPECT_GT(tightest(draw_of(4, 4, std::move(stuck)), all), 0.1);
  std::vector<Splat> edges;
  for (const float edge : {1.0F / 255, 1.0F / 18, 0.25F, 0.99F}) {
    for (const float alpha : {std::nextafter(edge, 0.0F), edge, std::nextafter(edge, 1.0F)}) {
      for (int i = 0; i < 20; ++i) edges.push_back(flat_box(-4, -4, 12, 12, alpha, 0.5F, 1, 0.25F));
    }
  }
  tightest(draw_of(4, 4, std::move(edges)), all);
}

TEST(Bounds, HoldForSplatsWhoseInverseNoHalfHolds) {
  std::vector<Splat> specks;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const auto x = static_cast<float>(i % 20) + 0.5F, y = static_cast<float>(i / 20) + 0.5F;
    const float off = i % 3 == 0 ? 0 : uniform(5, 3 * i, -3e-5F, 3e-5F);
    specks.push_back(
        splat_at(x + off, y - off, uniform(5, 3 * i + 1, 1e-6F, 3e-5F), 1.5e-5F, uniform(5, 3 * i + 2, 0, 6.2F), 0.9F));
  }
  std::vector<Drawn> all;
  for (const char* attributes : {"fp16", "quantized"}) {
    all.push_back(drawn("baseline", ColorFormat::rgba32f, {{"state", "attributes", attributes}}));
    all.back().precision.device.attributes =
        attributes == std::string("fp16") ? AttributeFormat::fp16 : AttributeFormat::quantized;
  }
  all.push_back(drawn("baseline", ColorFormat::rgba32f, {{"state", "shading", "fp16"}}));
  all.back().precision.device.shading = NumberFormat::fp16;
  EXPECT_GT(tightest(draw_of(20, 20, std::move(specks)), all), 0.01);
}

TEST(Bounds, HoldForBoxesThatEndAtThreeSigmas) {
  std::vector<Drawn> all;
  for (const char* variant : {"baseline", "het+qm"}) {
    all.push_back(drawn(variant, ColorFormat::rgba32f, {{"state", "splat_extent", "three_sigma"}}));
    all.back().precision.sigmas_covered = 3;
  }
  EXPECT_GT(tightest(random_draw(96, 64, 1500, 3), all), 0.1);
  // One alone, whose alpha at three sigmas is 0.0111: what is left out is all that is off.
  std::vector<Splat> alone{round_splat(24.5F, 24.5F, 7, 0.99F)};
  EXPECT_GT(tightest(draw_of(48, 48, alone), all), 0.99);
  all.front().precision.sigmas_covered = 3.2;
  const BoundedImage too_little = render_with_bounds(draw_of(48, 48, alone), {all.front().precision});
  EXPECT_LT(too_little.bounds[0][24 * 48 + 24 + 22].alpha, 1e-4) << "3.14 sigmas out";
}

TEST(Bounds, CountEachPixelsFragments) {
  const Draw draw = draw_of(4, 4, std::vector<Splat>(7, flat_box(-4, -4, 12, 12, 0.5F)));
  const BoundedImage bounded = render_with_bounds(draw, {});
  EXPECT_EQ(bounded.fragments, std::vector<std::uint32_t>(16, 7));
}

}  // namespace
}  // namespace vrpipe
