#include "builtin/capture_painter.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "workload_test_support.h"

namespace vrpipe {
namespace {

const View kView = {{0, 0, -5}, {0, 0, 0}, {0, -1, 0}, 40};

/// A wall before the viewer, and one as large that a third wall hides from all cameras.
GaussianScene walls(std::uint64_t count, double hidden_share, unsigned threads = 1, int sh_degree = 1) {
  CapturePainter painter(7, kView, 100, kObjectPopulation, sh_degree);
  painter.set_hidden_share(hidden_share);
  painter.quad({-1, -1, 0}, {0, 2, 0}, {2, 0, 0}, plain({0.5, 0.4, 0.3}), Texture());
  painter.block_box({0, 0, 0.5}, {50, 50, 0.1});
  painter.quad({-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, plain({0.5, 0.4, 0.3}), Texture());
  return painter.build(count, threads);
}

std::uint64_t behind(const GaussianScene& scene) {
  std::uint64_t count = 0;
  for (std::uint64_t i = 0; i < scene.size(); ++i) count += scene[i].position()[2] > 0.7f;
  return count;
}

TEST(CapturePainter, MakesExactlyAsManyAsAsked) {
  for (const std::uint64_t count : {1u, 7u, 1000u, 54321u}) EXPECT_EQ(walls(count, 0.2).size(), count);
}

TEST(CapturePainter, HasFewWhereNoCameraLooks) {
  const double half = static_cast<double>(behind(walls(20000, 1.0)));
  EXPECT_NEAR(half / 20000, 0.5, 0.1);
  EXPECT_EQ(behind(walls(20000, 0.0)), 0u);
}

TEST(CapturePainter, AnotherCameraThatSeesItChangesThat) {
  CapturePainter painter(7, kView, 100, kObjectPopulation, 0);
  painter.set_hidden_share(0);
  painter.quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, plain({0.5, 0.4, 0.3}), Texture());  // turned away
  EXPECT_THROW(painter.build(100), std::invalid_argument);
  painter.camera({0, 0, 5});
  EXPECT_EQ(painter.build(100).size(), 100u);
}

TEST(CapturePainter, StaysWithinTheStrokesButForWhatScatters) {
  const GaussianScene scene = walls(5000, 1.0);
  for (std::uint64_t i = 0; i < scene.size(); ++i) {
    const auto p = scene[i].position();
    EXPECT_LE(std::max(std::fabs(p[0]), std::fabs(p[1])), 1.0f);
    const auto q = scene[i].rotation();
    EXPECT_NEAR(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3], 1, 1e-5);
  }
}

TEST(CapturePainter, TheSameBitsWithAnyNumberOfThreads) {
  const GaussianScene one = walls(30000, 0.3, 1), four = walls(30000, 0.3, 4);
  for (std::uint64_t i = 0; i < one.size(); ++i) {
    ASSERT_EQ(one[i].position(), four[i].position()) << i;
    ASSERT_EQ(one[i].log_scale(), four[i].log_scale()) << i;
    ASSERT_EQ(one[i].f_rest(2, 3), four[i].f_rest(2, 3)) << i;
  }
}

TEST(CapturePainter, MoreGaussiansAreSmaller) {
  const auto median = [](const GaussianScene& scene) {
    std::vector<float> sizes;
    for (std::uint64_t i = 0; i < scene.size(); ++i) sizes.push_back(scene[i].log_scale()[2]);
    std::sort(sizes.begin(), sizes.end());
    return static_cast<double>(sizes[sizes.size() / 2]);
  };
  // The same layers of four times as many: half as wide.
  EXPECT_NEAR(median(walls(10000, 1.0)) - median(walls(40000, 1.0)), std::log(2.0), 0.05);
}

TEST(CapturePainter, HasFewerWhereFewerCamerasLook) {
  // Two walls back to back, far from a camera before one and three before the other.
  CapturePainter painter(7, {{0, 0, -100}, {0, 0, 0}, {0, -1, 0}, 40}, 100, kObjectPopulation, 0);
  for (const double x : {-1.0, 0.0, 1.0}) painter.camera({x, 0, 100});
  painter.set_hidden_share(0);
  Texture smooth;
  smooth.depth = 0;
  painter.quad({-1, -1, -1}, {0, 2, 0}, {2, 0, 0}, plain({0.5, 0.4, 0.3}), smooth);
  painter.quad({-1, -1, 1}, {2, 0, 0}, {0, 2, 0}, plain({0.5, 0.4, 0.3}), smooth);
  EXPECT_NEAR(static_cast<double>(behind(painter.build(20000))), 15000, 600);
}

TEST(CapturePainter, SplatsAreLargerOnWhatIsSeenAtASlant) {
  const auto count_of_floor = [](double height) {
    CapturePainter painter(7, {{0, -height, -100}, {0, 0, 0}, {0, -1, 0}, 40}, 100, kObjectPopulation, 0);
    Texture smooth;
    smooth.depth = 0;
    painter.quad({-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, plain({0.5, 0.4, 0.3}), smooth);
    painter.quad({-1, -1, -1}, {0, 0, 1.6}, {2.5, 0, 0}, plain({0.5, 0.4, 0.3}), smooth);
    return 20000 - behind(painter.build(20000));
  };
  // As many pixels, as many splats: the sine of the angle.
  EXPECT_NEAR(static_cast<double>(count_of_floor(100)), 10000, 500);
  EXPECT_NEAR(static_cast<double>(count_of_floor(20)), 20000 * 0.2 / 1.2, 700);
}

TEST(CapturePainter, PaintsAllOfAThinPoleThatIsFarAway) {
  CapturePainter painter(7, {{0, 0, -50}, {0, 0, 0}, {0, -1, 0}, 40}, 100, kObjectPopulation, 0);
  painter.surface(frustum_surface({0, 0, 0}, {0, 8, 0}, 0.1, 0.1), plain({0.5, 0.4, 0.3}), Texture());
  const GaussianScene scene = painter.build(800);
  std::vector<int> of_metre(9);
  for (std::uint64_t i = 0; i < scene.size(); ++i) {
    ++of_metre[static_cast<std::size_t>(std::min(8.0f, std::max(0.0f, -scene[i].position()[1])))];
  }
  for (std::size_t metre = 0; metre < 8; ++metre) EXPECT_NEAR(of_metre[metre], 100, 60) << metre;
}

TEST(CapturePainter, LargeSplatsAreFainter) {
  const GaussianScene scene = walls(20000, 1.0);
  double size = 0, logit = 0, product = 0;
  const auto count = static_cast<double>(scene.size());
  for (std::uint64_t i = 0; i < scene.size(); ++i) {
    const double along_normal = scene[i].log_scale()[2];  // no edge limits it
    size += along_normal / count;
    logit += scene[i].opacity_logit() / count;
    product += along_normal * scene[i].opacity_logit() / count;
  }
  EXPECT_LT(product - size * logit, -0.1);
}

TEST(CapturePainter, FloatersAreExtraAndExact) {
  CapturePainter painter(7, kView, 100, kObjectPopulation, 0);
  painter.quad({-1, -1, 0}, {0, 2, 0}, {2, 0, 0}, plain({0.5, 0.4, 0.3}), Texture());
  painter.floaters({0, 100, 0}, {1, 1, 1}, 40, 1);
  const GaussianScene scene = painter.build(500);
  std::uint64_t lone = 0;
  for (std::uint64_t i = 0; i < scene.size(); ++i) lone += scene[i].position()[1] < -90;
  EXPECT_EQ(scene.size(), 500u);
  EXPECT_EQ(lone, 40u);
  EXPECT_THROW(painter.build(40), std::invalid_argument);
}

TEST(BlockerTree, AnswersAsEachOfItsBlockersInTurn) {
  RandomStream random(3);
  const auto triple = [&random](double reach) {
    return Vec3{random.uniform(-reach, reach), random.uniform(-reach, reach), random.uniform(-reach, reach)};
  };
  std::vector<Blocker> blockers;
  for (int i = 0; i < 60; ++i) {
    const Vec3 centre = triple(5);
    const Vec3 half = {random.uniform(0.05, 1), random.uniform(0.05, 1), random.uniform(0.05, 1)};
    blockers.push_back({centre, half, i % 3 == 0});
  }
  const BlockerTree tree(blockers);
  int stopped = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 from = triple(8);
    Vec3 direction = random.direction();
    if (i % 5 == 0) direction[static_cast<std::size_t>(i / 5 % 3)] = 0;
    const double reach = random.uniform(0.1, 12);
    const bool each = std::any_of(blockers.begin(), blockers.end(),
                                  [&](const Blocker& one) { return one.blocks(from, direction, reach); });
    ASSERT_EQ(tree.blocks(from, direction, reach), each) << i;
    stopped += each;
  }
  EXPECT_GT(stopped, 1000);
  EXPECT_FALSE(BlockerTree().blocks({0, 0, 0}, {0, 0, 1}, 10));
}

}  // namespace
}  // namespace vrpipe
