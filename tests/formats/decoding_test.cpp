// Files made byte by byte, and what the formats' documents say that they hold, worked out by hand.
#include <cmath>
#include <limits>

#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/preprocess.h>

#include "../workloads/workload_test_support.h"
#include "made_files.h"

namespace vrpipe {
namespace {

using testing::byte;
using testing::MadeFile;

class Decoding : public testing::FolderTest {
 protected:
  GaussianFile read(const std::string& name, const std::string& bytes, const std::string& choices = "") const {
    return read_gaussian_file(write(name, bytes).string() + choices);
  }
};

constexpr double kC0 = 0.28209479177387814;

void expect_near(const std::array<float, 3>& values, const std::array<double, 3>& expected, double tolerance = 1e-6) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(values[i], expected[i], tolerance) << i;
}

void expect_rotation(const GaussianRef& gaussian, const std::array<double, 4>& expected) {
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(gaussian.rotation()[i], expected[i], 1e-6) << i;
}

float opacity_of(const GaussianRef& gaussian) { return static_cast<float>(sigmoid(gaussian.opacity_logit())); }

std::array<double, 3> colour_of(const GaussianRef& gaussian) {
  std::array<double, 3> colour{};
  for (std::size_t i = 0; i < 3; ++i) colour[i] = 0.5 + kC0 * static_cast<double>(gaussian.f_dc()[i]);
  return colour;
}

std::string splat_record(int alpha, int w, int x, int y, int z) {
  MadeFile file;
  file.add(1.0F, -2.0F, 3.5F, 1.0F, 0.25F, 0.0F);
  return file.add(byte(255), byte(0), byte(51), byte(alpha), byte(w), byte(x), byte(y), byte(z)).bytes();
}

TEST_F(Decoding, SplatHoldsLinearScalesAndBytes) {
  const GaussianFile file = read("a.splat", splat_record(51, 128 + 64, 128, 128 - 64, 128));
  EXPECT_EQ(file.format, "antimatter15 .splat");
  ASSERT_EQ(file.gaussians.size(), 1U);
  const GaussianRef g = file.gaussians[0];
  EXPECT_EQ(g.position(), (std::array<float, 3>{1, -2, 3.5F}));
  EXPECT_EQ(g.log_scale()[0], 0);
  EXPECT_NEAR(g.log_scale()[1], std::log(0.25), 1e-6);
  EXPECT_EQ(g.log_scale()[2], -std::numeric_limits<float>::infinity());
  EXPECT_NEAR(opacity_of(g), 0.2, 1e-7);
  EXPECT_NEAR(colour_of(g)[0], 1, 1e-6);
  EXPECT_NEAR(colour_of(g)[1], 0, 1e-6);
  EXPECT_NEAR(colour_of(g)[2], 0.2, 1e-6);
  expect_rotation(g, {std::sqrt(0.5), 0, -std::sqrt(0.5), 0});
}

TEST_F(Decoding, ALinearOpacityOfZeroOrOneIsThatAgain) {
  const GaussianFile file =
      read("a.splat", splat_record(0, 255, 128, 128, 128) + splat_record(255, 255, 128, 128, 128));
  EXPECT_LT(opacity_of(file.gaussians[0]), 1e-15F);
  EXPECT_EQ(opacity_of(file.gaussians[1]), 1.0F);
  EXPECT_TRUE(std::isfinite(file.gaussians[0].opacity_logit()) && std::isfinite(file.gaussians[1].opacity_logit()));
}

TEST_F(Decoding, EveryOpacityByteComesBackInFloat) {
  std::string bytes;
  for (int alpha = 0; alpha < 256; ++alpha) bytes += splat_record(alpha, 255, 128, 128, 128);
  const GaussianFile file = read("a.splat", bytes);
  for (unsigned alpha = 0; alpha < 256; ++alpha) {
    EXPECT_NEAR(opacity_of(file.gaussians[alpha]), alpha / 255.0, 1e-7) << alpha;
  }
}

TEST_F(Decoding, ASplatWithoutAnOrientationIsRejectedLater) {
  const GaussianFile file = read("a.splat", splat_record(255, 128, 128, 128, 128));
  EXPECT_EQ(rejection_of(file.gaussians[0], 0), Rejection::zero_quaternion);
}

/// One chunk, one vertex.
std::string compressed_ply(bool colour_range, std::uint32_t position, std::uint32_t rotation, std::uint32_t scale,
                           std::uint32_t colour, const std::vector<int>& sh = {}) {
  std::string header = "ply\nformat binary_little_endian 1.0\nelement chunk 1\n";
  for (const char* prefix : {"", "scale_"}) {
    for (const char* end : {"min_", "max_"}) {
      for (const char* axis : {"x", "y", "z"}) header += std::string("property float ") + end + prefix + axis + "\n";
    }
  }
  if (colour_range) {
    for (const char* name : {"min_r", "min_g", "min_b", "max_r", "max_g", "max_b"}) {
      header += std::string("property float ") + name + "\n";
    }
  }
  header += "element vertex 1\n";
  for (const char* name : {"position", "rotation", "scale", "color"}) {
    header += std::string("property uint packed_") + name + "\n";
  }
  if (!sh.empty()) header += "element sh 1\n";
  for (std::size_t i = 0; i < sh.size(); ++i) header += "property uchar f_rest_" + std::to_string(i) + "\n";
  MadeFile file;
  file.text(header + "end_header\n");
  file.add(0.0F, -1.0F, 10.0F, 2047.0F, 1.0F, 20.0F);
  file.add(-10.0F, -10.0F, -10.0F, 0.0F, 0.0F, 0.0F);
  if (colour_range) file.add(0.0F, 0.0F, -1.0F, 1.0F, 0.5F, 2.0F);
  file.add(position, rotation, scale, colour);
  for (const int value : sh) file.add(byte(value));
  return file.bytes();
}

TEST_F(Decoding, CompressedPlyInterpolatesInTheRangesOfItsChunk) {
  const std::uint32_t ends = 1U << 21U | 0U << 11U | 2047U;  // x: 1 of 2047, y: 0, z: 2047 of 2047
  const std::uint32_t scales = 2047U << 21U | 1023U << 11U | 0U;
  const std::uint32_t same = 3U << 30U | 1023U << 20U | 0U << 10U | 0U;  // over-long: z is what is left, nothing
  const GaussianFile file =
      read("a.compressed.ply", compressed_ply(true, ends, same, scales, 255U << 24U | 51U << 16U | 0U << 8U | 51U));
  EXPECT_EQ(file.format, "PlayCanvas compressed .ply");
  ASSERT_EQ(file.gaussians.size(), 1U);
  const GaussianRef g = file.gaussians[0];
  expect_near(g.position(), {1, -1, 20});
  expect_near(g.log_scale(), {0, 0, -10});
  EXPECT_NEAR(colour_of(g)[0], 1, 1e-6);
  EXPECT_NEAR(colour_of(g)[1], 0.1, 1e-6);
  EXPECT_NEAR(colour_of(g)[2], -1, 1e-6);
  EXPECT_NEAR(opacity_of(g), 0.2, 1e-7);
  const double half = std::sqrt(0.5);
  expect_rotation(g, {half, -half, -half, 0});
}

TEST_F(Decoding, CompressedPlyWithoutColourRangesHasThemFromZeroToOne) {
  const GaussianFile file = read("a.ply", compressed_ply(false, 0, 0, 0, 0x33ff0080U));
  EXPECT_NEAR(colour_of(file.gaussians[0])[0], 0.2, 1e-6);
  EXPECT_NEAR(colour_of(file.gaussians[0])[1], 1, 1e-6);
  EXPECT_NEAR(colour_of(file.gaussians[0])[2], 0, 1e-6);
}

TEST_F(Decoding, CompressedPlyLeavesOutTheLargestComponentOfARotation) {
  const std::uint32_t middle = 511U << 20U | 511U << 10U | 511U;
  for (unsigned omitted = 0; omitted < 4; ++omitted) {
    const GaussianFile file = read("a.ply", compressed_ply(false, 0, omitted << 30U | middle, 0, 0));
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(file.gaussians[0].rotation()[i], i == omitted ? 1 : 0, 1e-3) << omitted << " " << i;
    }
  }
}

TEST_F(Decoding, CompressedPlyHoldsSphericalHarmonicsInBytesChannelByChannel) {
  const GaussianFile file = read("a.ply", compressed_ply(true, 0, 0, 0, 0, {0, 255, 127, 128, 1, 254, 64, 192, 32}));
  EXPECT_EQ(file.gaussians.sh_degree(), 1);
  const GaussianRef g = file.gaussians[0];
  EXPECT_EQ(g.f_rest(0, 1), -4.0F);
  EXPECT_EQ(g.f_rest(0, 2), 4.0F);
  EXPECT_NEAR(g.f_rest(0, 3), ((127 + 0.5) / 256 - 0.5) * 8, 1e-6);
  EXPECT_NEAR(g.f_rest(1, 2), ((1 + 0.5) / 256 - 0.5) * 8, 1e-6);
  EXPECT_NEAR(g.f_rest(2, 3), ((32 + 0.5) / 256 - 0.5) * 8, 1e-6);
}

/// A bare .spz of one Gaussian with SH of degree 1.
std::string spz(std::uint32_t version) {
  MadeFile file;
  file.text("NGSP").add(version, std::uint32_t{1}, byte(1), byte(12), byte(0), byte(0));
  for (const int value : {4096, -8192, 2048}) file.add(byte(value), byte(value >> 8), byte(value >> 16));
  file.add(byte(51));
  file.add(byte(255), byte(0), byte(128));
  file.add(byte(160), byte(0), byte(144));
  if (version == 2) {
    file.add(byte(255), byte(127), byte(128));  // x = 1, y = -1/255, z = 1/255
  } else {
    file.add(2U << 30U | 511U << 20U | 0U << 10U | (0x200U | 511U));  // x = sqrt(1/2), y = 0, w = -sqrt(1/2); z is left
  }
  for (const int value : {128, 0, 255, 192, 64, 96, 160, 129, 127}) file.add(byte(value));
  return file.bytes();
}

TEST_F(Decoding, SpzIsTurnedFromItsAxesToInrias) {
  const GaussianFile file = read("a.spz", spz(3));
  EXPECT_EQ(file.format, "Niantic .spz");
  const GaussianRef g = file.gaussians[0];
  EXPECT_EQ(g.position(), (std::array<float, 3>{1, 2, -0.5F}));
  EXPECT_EQ(g.log_scale(), (std::array<float, 3>{0, -10, -1}));
  EXPECT_NEAR(opacity_of(g), 0.2, 1e-7);
  expect_near(g.f_dc(), {0.5 / 0.15, -0.5 / 0.15, (128 / 255.0 - 0.5) / 0.15});
  const double half = std::sqrt(0.5);
  expect_rotation(g, {-half, half, 0, 0});
  // Coefficients 1 and 2 go with y and z and change sign, 3 goes with x; red, green and blue of one lie together.
  const std::array<double, 9> codes = {0, -128, 127, 64, -64, -32, 32, 1, -1};
  for (std::uint32_t c = 1; c <= 3; ++c) {
    for (std::uint32_t channel = 0; channel < 3; ++channel) {
      EXPECT_EQ(g.f_rest(channel, c), (c == 3 ? 1 : -1) * codes[3 * (c - 1) + channel] / 128) << channel << " " << c;
    }
  }
}

TEST_F(Decoding, SpzThatWasWrittenWithoutTurningIsTakenAsItIs) {
  const GaussianFile file = read("a.spz", spz(3), "#axes=rdf");
  EXPECT_EQ(file.gaussians[0].position(), (std::array<float, 3>{1, -2, 0.5F}));
  EXPECT_EQ(file.gaussians[0].f_rest(1, 1), -1.0F);
  testing::expect_user_error([&] { read("a.spz", spz(3), "#axes=up"); }, {"axes", "up", "rub"});
}

TEST_F(Decoding, SpzVersion2HasThreeBytesForARotation) {
  const GaussianFile file = read("a.spz", spz(2));
  // x is 1, so nothing is left for w.
  expect_rotation(file.gaussians[0], {0, 1, 1 / 255.0, -1 / 255.0});
}

/// A .ksplat of one section with three Gaussians: two fill a bucket, one is in a bucket of its own.
std::string ksplat(std::uint16_t level, std::uint16_t degree) {
  MadeFile file;
  file.add(byte(0), byte(1), std::uint16_t{0}, 1U, 1U, 3U, 3U, level, std::uint16_t{0}).fill(36);
  file.add(-2.0F, 2.0F).fill(4096);
  const std::uint32_t buckets = level == 0 ? 0 : 2;
  file.add(3U, 3U, 2U, buckets, 10.0F, std::uint16_t{12}, std::uint16_t{0}, level == 0 ? 1U : 32767U, 0U);
  file.add(level == 0 ? 0U : 1U, level == 0 ? 0U : 1U, degree).fill(4096 + 1024);
  if (level > 0) file.add(1U).add(100.0F, 200.0F, 300.0F, -100.0F, -200.0F, -300.0F);
  for (int i = 0; i < 3; ++i) {
    if (level == 0) {
      file.add(static_cast<float>(i), 2.0F, 3.0F, 1.0F, 0.5F, 0.25F, 0.0F, 1.0F, 0.0F, 0.0F);
    } else {
      // 5 world units are 32767 codes; halves of 1, 0.5 and 0.25.
      file.add(static_cast<std::uint16_t>(32767 + 32767 * (i - 1)), std::uint16_t{32767}, std::uint16_t{0});
      file.add(std::uint16_t{0x3c00}, std::uint16_t{0x3800}, std::uint16_t{0x3400});
      file.add(std::uint16_t{0}, std::uint16_t{0x3c00}, std::uint16_t{0}, std::uint16_t{0});
    }
    file.add(byte(255), byte(0), byte(51), byte(102));
    const int rest = degree == 0 ? 0 : degree == 1 ? 9 : 24;
    for (int c = 0; c < rest; ++c) {
      if (level == 0) file.add(0.125F * static_cast<float>(c));
      if (level == 1) file.add(static_cast<std::uint16_t>(c == 0 ? 0 : 0x3c00));  // 0, then 1
      if (level == 2) file.add(byte(c == 23 ? 255 : 51));
    }
  }
  return file.bytes();
}

TEST_F(Decoding, KsplatLevel0HoldsFloats) {
  const GaussianFile file = read("a.ksplat", ksplat(0, 2));
  EXPECT_EQ(file.format, "mkkellogg .ksplat");
  ASSERT_EQ(file.gaussians.size(), 3U);
  EXPECT_EQ(file.gaussians.sh_degree(), 2);
  const GaussianRef g = file.gaussians[1];
  EXPECT_EQ(g.position(), (std::array<float, 3>{1, 2, 3}));
  expect_near(g.log_scale(), {0, std::log(0.5), std::log(0.25)});
  expect_rotation(g, {0, 1, 0, 0});
  EXPECT_NEAR(opacity_of(g), 0.4, 1e-7);
  EXPECT_NEAR(colour_of(g)[2], 0.2, 1e-6);
  // Band 1: three of each channel; band 2: five.
  EXPECT_EQ(g.f_rest(0, 1), 0.0F);
  EXPECT_EQ(g.f_rest(1, 1), 0.125F * 3);
  EXPECT_EQ(g.f_rest(2, 3), 0.125F * 8);
  EXPECT_EQ(g.f_rest(0, 4), 0.125F * 9);
  EXPECT_EQ(g.f_rest(1, 4), 0.125F * 14);
  EXPECT_EQ(g.f_rest(2, 8), 0.125F * 23);
}

TEST_F(Decoding, KsplatLevel1HoldsPositionsAroundTheCentresOfItsBuckets) {
  const GaussianFile file = read("a.ksplat", ksplat(1, 1));
  ASSERT_EQ(file.gaussians.size(), 3U);
  expect_near(file.gaussians[0].position(), {95, 200, 295}, 1e-4);
  expect_near(file.gaussians[1].position(), {100, 200, 295}, 1e-4);
  expect_near(file.gaussians[2].position(), {-95, -200, -305}, 1e-4);
  expect_near(file.gaussians[2].log_scale(), {0, std::log(0.5), std::log(0.25)});
  EXPECT_EQ(file.gaussians[0].f_rest(0, 1), 0.0F);
  EXPECT_EQ(file.gaussians[0].f_rest(2, 3), 1.0F);
}

TEST_F(Decoding, KsplatLevel2HoldsSphericalHarmonicsInBytes) {
  const GaussianFile file = read("a.ksplat", ksplat(2, 2));
  EXPECT_NEAR(file.gaussians[2].f_rest(0, 1), -2 + 4 * 0.2, 1e-6);
  EXPECT_EQ(file.gaussians[2].f_rest(2, 8), 2.0F);
}

TEST_F(Decoding, AFormatIsRecognisedByItsHeaderWhateverTheNameSays) {
  EXPECT_EQ(read("a.bin", spz(3)).format, "Niantic .spz");
  EXPECT_EQ(read("a.splat", ksplat(0, 0)).format, "mkkellogg .ksplat");
  EXPECT_EQ(read("a.spz", compressed_ply(true, 0, 0, 0, 0)).format, "PlayCanvas compressed .ply");
  testing::expect_user_error([&] { read("a.bin", splat_record(0, 0, 0, 0, 0)); }, {"known", "antimatter15 .splat"});
}

TEST_F(Decoding, AFileWhoseNameHasAMarkIsOpenedByItsName) {
  EXPECT_EQ(read("a#b.splat", splat_record(0, 0, 0, 0, 0)).gaussians.size(), 1U);
}

TEST_F(Decoding, NerfstudiosExportsSayWhichAxisIsUp) {
  write_gaussian_file(in_folder("plain.ply"), testing::scene_of({testing::ordinary_gaussian()}));
  std::string bytes = testing::read_bytes(in_folder("plain.ply"));
  EXPECT_EQ(read("plain.ply", bytes).up, (Vec3{0, -1, 0}));
  const std::string line = "ply\n";
  bytes.replace(0, line.size(), line + "comment Generated by Nerfstudio 1.1.5\ncomment Vertical Axis: z\n");
  EXPECT_EQ(read("nerfstudio.ply", bytes).up, (Vec3{0, 0, 1}));
}

TEST_F(Decoding, WhatIsWrittenAsSplatIsReadAgainWithinItsBytes) {
  std::vector<GaussianAttributes> gaussians;
  for (int i = 0; i < 200; ++i) {
    GaussianAttributes g = testing::ordinary_gaussian();
    const float t = static_cast<float>(i) / 200;
    g.position = {t, -3 * t, 5 * t};
    g.log_scale = {-8 * t, -4 * t, 2 * t};
    g.rotation = {2 * t, -1, 0.3F, t * t};
    g.opacity_logit = 12 * t - 6;
    g.f_dc = {3 * t - 1.5F, 1.7F * t, 0};
    gaussians.push_back(g);
  }
  EXPECT_TRUE(write_gaussian_file(in_folder("a.splat"), testing::scene_of(gaussians)).empty());
  const GaussianFile file = read_gaussian_file(in_folder("a.splat").string());
  ASSERT_EQ(file.gaussians.size(), gaussians.size());
  for (std::size_t i = 0; i < gaussians.size(); ++i) {
    const GaussianRef g = file.gaussians[i];
    const GaussianAttributes& original = gaussians[i];
    EXPECT_EQ(g.position(), original.position);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(g.log_scale()[k], original.log_scale[k], 1e-6);
      const double colour = 0.5 + kC0 * static_cast<double>(original.f_dc[k]);
      EXPECT_NEAR(colour_of(g)[k], std::min(1.0, std::max(0.0, colour)), 0.5 / 255 + 1e-6);
    }
    EXPECT_NEAR(opacity_of(g), sigmoid(original.opacity_logit), 0.5 / 255 + 1e-6);
    double length = 0;
    for (const float component : original.rotation) length += static_cast<double>(component) * component;
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(g.rotation()[k], original.rotation[k] / std::sqrt(length), 1.0 / 128) << i;
    }
  }
}

}  // namespace
}  // namespace vrpipe
