#include "image/image_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace vrpipe::testing {
namespace {

using tools::image_error;
using tools::ImageError;
using tools::ShownImage;

ShownImage constant(std::uint32_t width, std::uint32_t height, double value) {
  return {width, height, std::vector<double>(std::size_t{3} * width * height, value)};
}

ShownImage noise(std::uint32_t width, std::uint32_t height, unsigned seed) {
  std::mt19937 random(seed);
  ShownImage image = constant(width, height, 0);
  for (double& value : image.rgb) value = static_cast<double>(random()) / 4294967296.0;
  return image;
}

TEST(ImageErrorTest, OfEqualImagesIsNone) {
  const ShownImage image = noise(23, 17, 1);
  const ImageError error = image_error(image, image);
  EXPECT_EQ(error.psnr_db, std::numeric_limits<double>::infinity());
  EXPECT_EQ(error.ssim, 1);
  EXPECT_EQ(error.max_abs_error, 0);
  EXPECT_EQ(error.pixels_differing, 0U);
}

TEST(ImageErrorTest, OfAConstantOffsetHasItsClosedForms) {
  const ImageError error = image_error(constant(20, 30, 0.6), constant(20, 30, 0.5));
  EXPECT_NEAR(error.psnr_db, 20, 1e-9);
  EXPECT_NEAR(error.max_abs_error, 0.1, 1e-15);
  const double c1 = 1e-4;
  EXPECT_NEAR(error.ssim, (2 * 0.6 * 0.5 + c1) / (0.36 + 0.25 + c1), 1e-9);
  EXPECT_EQ(error.share_differing, 1);
  EXPECT_NEAR(image_error(constant(4, 4, 1), constant(4, 4, 0)).psnr_db, 0, 1e-12);
}

TEST(ImageErrorTest, OfOneChannelOfOnePixelIsSpreadOverAll) {
  ShownImage image = constant(10, 10, 0);
  image.rgb[3 * 42 + 1] = 1;
  const ImageError error = image_error(image, constant(10, 10, 0));
  EXPECT_NEAR(error.psnr_db, 10 * std::log10(300.0), 1e-9);
  EXPECT_EQ(error.max_abs_error, 1);
  EXPECT_EQ(error.pixels_differing, 1U);
  EXPECT_EQ(error.share_differing, 0.01);
}

TEST(ImageErrorTest, CountsPixelsThatDifferOnceRoundedTo8Bits) {
  const ShownImage reference = constant(4, 1, 100.4 / 255);
  ShownImage image = reference;
  image.rgb[0] = 100.49 / 255;  // the same level
  image.rgb[3] = 100.51 / 255;  // the next
  image.rgb[7] = 99.4 / 255;    // one below, twice in one pixel
  image.rgb[8] = 99.4 / 255;
  const ImageError error = image_error(image, reference);
  EXPECT_EQ(error.pixels_differing, 2U);
  EXPECT_EQ(error.share_differing, 0.5);
}

/// Of one channel, window by window, straight from the definition.
double ssim_by_definition(const ShownImage& a, const ShownImage& b) {
  double total = 0;
  const int width = static_cast<int>(a.width);
  const int height = static_cast<int>(a.height);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        double weights = 0, mean_a = 0, mean_b = 0;
        const auto each = [&](const auto& visit) {
          for (int v = std::max(0, y - 5); v <= std::min(height - 1, y + 5); ++v) {
            for (int u = std::max(0, x - 5); u <= std::min(width - 1, x + 5); ++u) {
              const std::size_t at = static_cast<std::size_t>(v * width + u) * 3 + channel;
              visit(std::exp(-((u - x) * (u - x) + (v - y) * (v - y)) / 4.5), a.rgb[at], b.rgb[at]);
            }
          }
        };
        each([&](double w, double p, double q) { weights += w, mean_a += w * p, mean_b += w * q; });
        mean_a /= weights;
        mean_b /= weights;
        double variance_a = 0, variance_b = 0, covariance = 0;
        each([&](double w, double p, double q) {
          variance_a += w / weights * (p - mean_a) * (p - mean_a);
          variance_b += w / weights * (q - mean_b) * (q - mean_b);
          covariance += w / weights * (p - mean_a) * (q - mean_b);
        });
        total += (2 * mean_a * mean_b + 1e-4) * (2 * covariance + 9e-4) /
                 ((mean_a * mean_a + mean_b * mean_b + 1e-4) * (variance_a + variance_b + 9e-4));
      }
    }
  }
  return total / static_cast<double>(a.rgb.size());
}

TEST(ImageErrorTest, StructuralSimilarityIsThatOfItsDefinition) {
  for (const auto& [width, height] : {std::pair<unsigned, unsigned>{19, 25}, {3, 4}, {1, 1}, {40, 2}}) {
    const ShownImage a = noise(width, height, 3);
    ShownImage b = noise(width, height, 4);
    for (std::size_t i = 0; i < b.rgb.size(); ++i) b.rgb[i] = 0.8 * a.rgb[i] + 0.2 * b.rgb[i];
    EXPECT_NEAR(image_error(a, b).ssim, ssim_by_definition(a, b), 1e-10) << width << "x" << height;
  }
}

TEST(ImageErrorTest, ImagesAreComparedAsTheyAreShown) {
  tools::SharedImage image(3, 1);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float pixels[] = {0.25F, 0, 3, 0.5F, nan, 0.5F, 0, 1, 0, 0, 0, 0};
  std::copy(std::begin(pixels), std::end(pixels), image.values());
  const ShownImage over_black = tools::shown(image, {0, 0, 0});
  EXPECT_EQ(over_black.rgb, (std::vector<double>{0.25, 0, 1, 0, 0.5, 0, 0, 0, 0}));
  const ShownImage over_white = tools::shown(image, {1, 1, 1});
  EXPECT_EQ(over_white.rgb, (std::vector<double>{0.75, 0.5, 1, 0, 0.5, 0, 1, 1, 1}));
  ExactImage exact;
  exact.width = 1;
  exact.height = 1;
  exact.rgba = {{0.25, 0.5, 0.125, 0.75}};
  EXPECT_EQ(tools::shown(exact, {1, 0, 0.5F}).rgb, (std::vector<double>{0.5, 0.5, 0.25}));
}

TEST(ImageErrorTest, ImagesOfDifferentSizesAreRefused) {
  EXPECT_THROW(image_error(constant(2, 3, 0), constant(3, 2, 0)), std::invalid_argument);
  EXPECT_THROW(image_error(constant(0, 0, 0), constant(0, 0, 0)), std::invalid_argument);
}

}  // namespace
}  // namespace vrpipe::testing
