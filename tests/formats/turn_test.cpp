// Worlds whose axes point elsewhere, with all that lies in them.
#include <algorithm>
#include <cmath>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include <vrpipe/workloads/gaussian_file.h>
#include <vrpipe/workloads/preprocess.h>

#include "../workloads/workload_test_support.h"
#include "formats/turn.h"
#include "made_files.h"

namespace vrpipe {
namespace {

using testing::expect_user_error;
using testing::MadeFile;

Vec3 direction_of(char letter) {
  switch (letter) {
    case 'l': return {-1, 0, 0};
    case 'r': return {1, 0, 0};
    case 'u': return {0, -1, 0};
    case 'd': return {0, 1, 0};
    case 'b': return {0, 0, -1};
    default: return {0, 0, 1};
  }
}

/// Columns: where the axes of a world point in INRIA's.
glm::dmat3 matrix_of(const std::string& axes) {
  return {direction_of(axes[0]), direction_of(axes[1]), direction_of(axes[2])};
}

GaussianAttributes some_gaussian() {
  GaussianAttributes g;
  g.position = {1, 2, 3};
  g.log_scale = {-1, -2, -3.5F};
  g.rotation = {0.8F, 0.1F, -0.5F, 0.3F};
  g.f_dc = {0.5F, 0.2F, 0.9F};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t c = 0; c < 15; ++c)
      g.f_rest[channel][c] = 0.02F * static_cast<float>((7 * c + 5 * channel) % 11) - 0.1F;
  }
  return g;
}

glm::dmat3 covariance(const GaussianAttributes& g) {
  const auto& q = g.rotation;
  const glm::dmat3 rotation = glm::mat3_cast(glm::normalize(glm::dquat(q[0], q[1], q[2], q[3])));
  glm::dmat3 squares(0);
  for (std::size_t i = 0; i < 3; ++i) squares[i][i] = std::exp(2.0 * static_cast<double>(g.log_scale[i]));
  return rotation * squares * glm::transpose(rotation);
}

std::array<float, 3> colour(const GaussianAttributes& g, const Vec3& seen, int degree) {
  return sh_colour(testing::scene_of({g}, degree)[0], seen, degree);
}

TEST(AxesTurn, AllSixteenTakePlacesShapesAndColoursWithThem) {
  ASSERT_EQ(AxesTurn::names().size(), 16U);
  for (const std::string& axes : AxesTurn::names()) {
    SCOPED_TRACE(axes);
    const glm::dmat3 turn = matrix_of(axes);
    const GaussianAttributes file = some_gaussian();
    for (int degree = 0; degree <= 3; ++degree) {
      GaussianAttributes here = file;
      AxesTurn(axes).apply(here, degree);
      const Vec3 expected = turn * Vec3{1, 2, 3};
      for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(here.position[i], static_cast<float>(expected[i]));
      const glm::dmat3 shape = turn * covariance(file) * glm::transpose(turn), got = covariance(here);
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(got[i][j], shape[i][j], 1e-12);
      }
      for (const Vec3& seen : {Vec3{1, 0, 0}, Vec3{0, 0.6, 0.8}, Vec3{0.6, -0.64, 0.48}, Vec3{-0.28, 0.96, 0}}) {
        const auto was = colour(file, seen, degree), is = colour(here, turn * seen, degree);
        for (std::size_t channel = 0; channel < 3; ++channel) EXPECT_NEAR(is[channel], was[channel], 5e-7);
      }
    }
  }
}

TEST(AxesTurn, OursIsLeftAsItIs) {
  GaussianAttributes here = some_gaussian();
  AxesTurn("rdf").apply(here, 3);
  EXPECT_EQ(here.f_rest, some_gaussian().f_rest);
  EXPECT_EQ(here.rotation, some_gaussian().rotation);
}

/// One Gaussian at (1, 2, 3) of the file's world, bare, of version 3.
std::string spz(const std::string& extensions, unsigned flags) {
  MadeFile file;
  file.text("NGSP").add(std::uint32_t{3}, std::uint32_t{1});
  file.add(testing::byte(0), testing::byte(0), testing::byte(static_cast<int>(flags)), testing::byte(0));
  for (const int coordinate : {1, 2, 3}) file.add(testing::byte(coordinate), testing::byte(0), testing::byte(0));
  file.add(testing::byte(200), testing::byte(100), testing::byte(100), testing::byte(100));
  file.add(testing::byte(100), testing::byte(100), testing::byte(100), std::uint32_t{0});
  return file.bytes() + extensions;
}
std::string extension(std::uint32_t kind, std::uint32_t value) {
  return MadeFile().add(kind, std::uint32_t{4}, value).bytes();
}
constexpr std::uint32_t axes_kind = 0xadbe0003;

class SpzExtensions : public testing::FolderTest {
 protected:
  GaussianFile read(const std::string& bytes, const std::string& choice = "") const {
    return read_gaussian_file(write("a.spz", bytes).string() + choice);
  }
};

TEST_F(SpzExtensions, SayWhereItsAxesPoint) {
  for (std::size_t code = 0; code <= 16; ++code) {
    const std::string axes = code == 0 ? "rub" : AxesTurn::names()[code - 1];
    const Vec3 expected = matrix_of(axes) * Vec3{1, 2, 3};
    const GaussianFile file = read(spz(extension(axes_kind, static_cast<std::uint32_t>(code)), 2));
    EXPECT_TRUE(file.notes.empty());
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_EQ(file.gaussians[0].position()[i], static_cast<float>(expected[i])) << axes;
    const GaussianFile chosen = read(spz(extension(axes_kind, 4), 2), "#axes=" + axes);
    EXPECT_EQ(chosen.gaussians[0].position(), file.gaussians[0].position()) << axes;
  }
}

TEST_F(SpzExtensions, WhatIsNotUnderstoodIsSaidOrRefused) {
  EXPECT_EQ(read(spz(extension(0xadbe0002, 0) + extension(axes_kind, 6), 2)).notes,
            (std::vector<std::string>{"its extension 0xadbe0002, limits of an orbit, is not used"}));
  EXPECT_EQ(read(spz("", 4)).notes, (std::vector<std::string>{"its flags 0x04 are not understood, nor used"}));
  // What no flag announces is none.
  EXPECT_TRUE(read(spz(extension(0xadbe0002, 0), 0)).notes.empty());
  expect_user_error([&] { read(spz(extension(axes_kind, 17), 2)); }, {"axes have the code 17", "#axes="});
  expect_user_error([&] { read(spz(MadeFile().add(axes_kind, std::uint32_t{400}, std::uint32_t{6}).bytes(), 2)); },
                    {"goes beyond them"});
  expect_user_error([&] { read(spz("", 0), "#axes=rrr"); }, {"`rrr`", "rdf", "lbu"});
}

}  // namespace
}  // namespace vrpipe
