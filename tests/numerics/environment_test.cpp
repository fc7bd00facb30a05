#include <cfenv>

#include "numerics_test_support.h"

namespace vrpipe {
namespace {

using namespace testing;

std::vector<RunRequest> requests() {
  std::vector<RunRequest> all;
  for (const Variant& variant : variants()) {
    for (const ColorFormat format : {ColorFormat::rgba8, ColorFormat::rgba16f, ColorFormat::rgba32f}) {
      for (const Fidelity fidelity : {Fidelity::functional, Fidelity::cycle}) {
        RunRequest request = untimed(variant.name.c_str(), format);
        request.fidelity = fidelity;
        all.push_back(request);
      }
    }
  }
  return all;
}

Draw adversarial() {
  Draw draw = random_draw(96, 64, 120, 6);
  for (std::size_t i = 0; i < draw.splats.size(); i += 7) {
    draw.splats[i].red = 1e-40F;
    draw.splats[i].green = 6e-8F;
  }
  draw.splats.push_back(splat_at(20, 20, 1e-40F, 1e-40F, 0, 0.5F));
  draw.splats.push_back(splat_at(20.5F, 20.5F, 1e-20F, 1e-20F, 0.3F, 0.5F));
  draw.splats.push_back(splat_at(1e-40F, 20, 3, 1e-6F, 0.3F, 1));
  return draw;
}

TEST(Environment, FlushingDenormalsChangesNoBitAndNoCount) {
  if (!FlushDenormals::works()) GTEST_SKIP() << "no flushing of denormals on this processor";
  const Draw draw = adversarial();
  for (RunRequest request : requests()) {
    fresh_simulation();
    const RunResult plain = simulate(request, draw);
    fresh_simulation();
    const FlushDenormals flushing;
    const RunResult flushed = simulate(request, draw);
    EXPECT_EQ(plain.counts.named(), flushed.counts.named());
    EXPECT_EQ(plain.cycles, flushed.cycles);
    // A target of single precision holds denormals; they are the one thing that flushing takes.
    for (std::uint32_t y = 0; y < draw.height; ++y) {
      for (std::uint32_t x = 0; x < draw.width; ++x) {
        const std::array<float, 4> p = plain.framebuffer.color.pixel(x, y);
        const std::array<float, 4> q = flushed.framebuffer.color.pixel(x, y);
        for (unsigned i = 0; i < 4; ++i) {
          if (request.format == ColorFormat::rgba32f && std::fpclassify(p[i]) != FP_NORMAL) continue;
          ASSERT_EQ(std::memcmp(&p[i], &q[i], sizeof p[i]), 0) << x << "," << y << " channel " << i;
        }
      }
    }
  }
}

TEST(Environment, NoRunMakesANanOutOfNumbers) {
  const Draw draw = adversarial();
  for (const RunRequest& request : requests()) {
    fresh_simulation();
    const TrapInvalid trap;
    EXPECT_GT(simulate(request, draw).counts.fragments_blended, 0U);
  }
}

TEST(Environment, NoSceneIsProjectedWithANanOnTheWay) {
  std::vector<GaussianAttributes> scene;
  for (const float value : {0.0F, -0.0F, 1e-40F, 1e-20F, 1.0F, 1e20F, std::numeric_limits<float>::max()}) {
    for (int field = 0; field < 5; ++field) {
      GaussianAttributes g = ordinary_gaussian();
      if (field == 0) g.position = {value, -value, 5};
      if (field == 1) g.position = {0, 0, value};
      if (field == 2) g.log_scale = {value, -value, 0};
      if (field == 3) g.rotation = {value, -value, value, 0};
      if (field == 4) g.f_dc = {value, -value, 0};
      scene.push_back(g);
    }
  }
  const TrapInvalid trap;
  const Draw draw = projected(scene);
  EXPECT_GT(draw.splats.size(), 10U);
}

}  // namespace
}  // namespace vrpipe
