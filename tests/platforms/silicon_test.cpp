// The very draw that was measured on a real GPU: counts of its hardware counters, and its image.

#include <cmath>
#include <fstream>
#include <vector>

#include <gtest/gtest.h>

#ifdef VRPIPE_HAVE_LZMA
#include <lzma.h>
#endif

#include <vrpipe/half.h>
#include <vrpipe/workloads/draw_list.h>

#include "support/shared_folder.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

class MeasuredDraw : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const auto path = testing::shared_folder() / "silicon/playbot_close.spl";
    if (!std::filesystem::exists(path)) return;
    result = std::make_unique<RunResult>(
        testing::run(testing::request_of("baseline", Fidelity::functional), read_draw_list(path).draw));
  }
  static void TearDownTestSuite() { result.reset(); }
  void SetUp() override {
    if (!result) GTEST_SKIP() << "no silicon/playbot_close.spl in " << testing::shared_folder();
  }
  static std::unique_ptr<RunResult> result;
};
std::unique_ptr<RunResult> MeasuredDraw::result;

void expect_within(std::uint64_t got, std::uint64_t measured, double share) {
  EXPECT_NEAR(static_cast<double>(got), static_cast<double>(measured), share * static_cast<double>(measured));
}

TEST_F(MeasuredDraw, LaunchesTheQuadsAndFragmentsOfTheGpu) {
  expect_within(result->counts.quads_shaded, 16'950'276, 0.002);
  expect_within(result->counts.fragments_shaded, 55'154'535, 0.002);
}

TEST_F(MeasuredDraw, PrunesAsTheGpu) {
  expect_within(result->counts.quads_blended, 13'421'300, 0.002);
  expect_within(result->counts.fragments_blended, 43'348'660, 0.002);
}

TEST_F(MeasuredDraw, LaunchesTheWarpsOfTheGpu) { expect_within(result->counts.warps, 2'397'186, 0.005); }

#ifdef VRPIPE_HAVE_LZMA
std::vector<std::uint16_t> read_xz_halves(const std::filesystem::path& path, std::size_t count) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> packed((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  std::vector<std::uint16_t> halves(count);
  std::uint64_t memory_limit = UINT64_MAX;
  std::size_t in = 0;
  std::size_t out = 0;
  const lzma_ret status =
      lzma_stream_buffer_decode(&memory_limit, 0, nullptr, reinterpret_cast<const std::uint8_t*>(packed.data()), &in,
                                packed.size(), reinterpret_cast<std::uint8_t*>(halves.data()), &out,
                                count * sizeof(std::uint16_t));
  EXPECT_EQ(status, LZMA_OK);
  EXPECT_EQ(out, count * sizeof(std::uint16_t));
  return halves;
}

TEST_F(MeasuredDraw, HasTheImageOfTheGpuAt50Decibel) {
  const auto path = testing::shared_folder() / "silicon/playbot_close.rgba16f.xz";
  if (!std::filesystem::exists(path))
    GTEST_SKIP() << "no silicon/playbot_close.rgba16f.xz in " << testing::shared_folder();
  const ColorSurface& surface = result->surface;
  const std::vector<std::uint16_t> halves = read_xz_halves(path, std::size_t{4} * surface.width() * surface.height());
  double squares = 0;
  for (std::uint32_t y = 0; y < surface.height(); ++y) {
    for (std::uint32_t x = 0; x < surface.width(); ++x) {
      for (unsigned channel = 0; channel < 4; ++channel) {
        const auto clamp = [](float value) { return std::fmin(std::fmax(static_cast<double>(value), 0.0), 1.0); };
        const double off = clamp(surface.pixel(x, y)[channel]) -
                           clamp(half_value(halves[4 * (std::size_t{y} * surface.width() + x) + channel]));
        squares += off * off;
      }
    }
  }
  const double psnr = -10 * std::log10(squares / (4.0 * surface.width() * surface.height()));
  RecordProperty("psnr_db", std::to_string(psnr));
  EXPECT_GE(psnr, 50);
}
#endif

}  // namespace
}  // namespace vrpipe
