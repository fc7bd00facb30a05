// What results may not depend on: repetition, the order of ticks, stalls, the depth of queues.

#include <gtest/gtest.h>

#include <vrpipe/error.h>
#include <vrpipe/platforms/gpu.h>
#include <vrpipe/platforms/wiring.h>
#include <vrpipe/testkit/sink.h>

#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::request_of;
using testing::run;
using testing::same_image;
using testing::strictly;

// case T11
TEST(Determinism, RepeatedRunsHaveTheSameHash) {
  const Draw draw = testing::random_draw(64, 64, 300, 1);
  for (const Variant& variant : variants()) {
    const RunResult first = run(request_of(variant.name), draw);
    for (int i = 0; i < 3; ++i)
      EXPECT_EQ(run(request_of(variant.name), draw).result_hash, first.result_hash) << variant.name;
  }
}

TEST(Determinism, TheOrderInWhichUnitsTickChangesNoBit) {
  const Draw draw = testing::random_draw(64, 64, 300, 2);
  for (const Variant& variant : variants()) {
    for (const char* platform : {"agx-orin", "desktop"}) {
      const auto on = [&](std::uint64_t seed) {
        return request_of(variant.name, Fidelity::cycle, [&](RunRequest& r) {
          r.platform = &platform_named(platform);
          r.tick_order_seed = seed;
        });
      };
      const std::string expected = run(on(0), draw).result_hash;
      for (std::uint64_t seed = 1; seed <= 6; ++seed)
        EXPECT_EQ(run(on(seed), draw).result_hash, expected) << variant.name << " " << platform << " " << seed;
    }
  }
}

TEST(Determinism, StrictlyStallsChangeNeitherImageNorCounts) {
  const Draw draw = testing::random_draw(48, 48, 120, 3);
  for (const Variant& variant : variants()) {
    const RunResult expected = run(request_of(variant.name, Fidelity::cycle, strictly), draw);
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
      const RunResult stalled = run(request_of(variant.name, Fidelity::cycle,
                                               [&](RunRequest& r) {
                                                 strictly(r);
                                                 r.stall_seed = seed;
                                                 r.stall_per_256 = static_cast<unsigned>(16 + seed % 100);
                                               }),
                                    draw);
      ASSERT_TRUE(same_image(stalled.surface, expected.surface)) << variant.name << " " << seed;
      ASSERT_EQ(stalled.counts.named(), expected.counts.named()) << variant.name << " " << seed;
      ASSERT_GT(*stalled.cycles, *expected.cycles);
    }
  }
}

TEST(Determinism, InPaperTerminationStallsKeepTheImageWithinItsBound) {
  const Draw draw = testing::random_draw(48, 48, 300, 4);
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    testing::expect_near_reference(run(request_of("het+qm", Fidelity::cycle,
                                                  [&](RunRequest& r) {
                                                    r.stall_seed = seed;
                                                    r.stall_per_256 = 80;
                                                  }),
                                       draw),
                                   draw, 0.004);
  }
}

// case M06
TEST(Determinism, TheLatenciesOfShadersChangeNoImage) {
  const Draw draw = testing::random_draw(64, 64, 300, 5);
  for (const char* variant : {"baseline", "qm"}) {
    RunResult expected;
    for (const char* latency : {"0", "75", "5000"}) {
      const RunResult result = run(
          request_of(
              variant, Fidelity::cycle,
              [&](RunRequest& r) {
                strictly(r);
                r.settings = {{"sm", "fragment_latency_cycles", latency}, {"sm", "attribute_latency_cycles", latency}};
              }),
          draw);
      if (std::string(latency) == "0") {
        expected = result;
      } else {
        EXPECT_TRUE(same_image(result.surface, expected.surface)) << latency;
        EXPECT_EQ(result.counts.named(), expected.counts.named());
      }
    }
  }
}

/// agx-orin with queues of one place between all units.
void wire_shallow(Gpu& gpu) {
  gpu.add_front_end("draw");
  gpu.add_front_end("vpo");
  for (const char* slot : {"tgc", "raster", "tc", "prop", "zrop", "qru", "sm", "crop"}) gpu.add(0, slot);
  const std::pair<const char*, const char*> links[] = {
      {"draw.out_vertices_0", "gpc0.sm.in_vertices"},     {"gpc0.sm.out_vertices", "vpo.in_vertices_0"},
      {"vpo.out_primitives_0", "gpc0.tgc.in_primitives"}, {"gpc0.tgc.out_jobs", "gpc0.raster.in_jobs"},
      {"gpc0.raster.out_quads", "gpc0.tc.in_quads"},      {"gpc0.tc.out_bins", "gpc0.prop.in_bins"},
      {"gpc0.prop.out_test", "gpc0.zrop.in_quads"},       {"gpc0.zrop.out_quads", "gpc0.prop.in_tested"},
      {"gpc0.prop.out_survivors", "gpc0.qru.in_quads"},   {"gpc0.qru.out_warps", "gpc0.sm.in_warps"},
      {"gpc0.sm.out_shaded", "gpc0.prop.in_shaded"},      {"gpc0.prop.out_release", "gpc0.sm.in_release"},
      {"gpc0.prop.out_color", "gpc0.crop.in_color"},      {"gpc0.crop.out_terminations", "gpc0.zrop.in_terminations"}};
  for (const auto& [out, in] : links) gpu.connect(out, in, 1);
  gpu.connect_to_l2("gpc0.crop");
}

// case T10
TEST(QueuesOfOnePlace, CompleteWithTheSameImageAndAreNotFaster) {
  Platform shallow = platform_named("agx-orin");
  shallow.name = "shallow";
  shallow.wire = wire_shallow;
  const Draw draw = testing::random_draw(64, 64, 300, 6);
  for (const Variant& variant : variants()) {
    const auto on = [&](const Platform* platform) {
      return request_of(variant.name, Fidelity::cycle, [&](RunRequest& r) {
        strictly(r);
        r.platform = platform;
        r.settings = {{"l2", "latency_cycles", "1"}};
      });
    };
    const RunResult deep = run(on(&platform_named("agx-orin")), draw);
    const RunResult one = run(on(&shallow), draw);
    EXPECT_TRUE(same_image(deep.surface, one.surface)) << variant.name;
    EXPECT_EQ(deep.counts.named(), one.counts.named()) << variant.name;
    EXPECT_GE(*one.cycles, *deep.cycles) << variant.name;
  }
}

TEST(Deadlock, IsReportedWithTheUnitsThatWait) {
  Platform broken = platform_named("agx-orin");
  broken.name = "broken";
  broken.wire = [](Gpu& gpu) {
    gpu.add_front_end("draw");
    gpu.add_front_end("vpo");
    for (const char* slot : {"tgc", "raster", "tc", "prop", "qru", "sm", "crop"}) gpu.add(0, slot);
    gpu.connect("draw.out_vertices_0", "gpc0.sm.in_vertices");
    gpu.connect("gpc0.sm.out_vertices", "vpo.in_vertices_0");
    gpu.connect("vpo.out_primitives_0", "gpc0.tgc.in_primitives");
    gpu.connect("gpc0.tgc.out_jobs", "gpc0.raster.in_jobs");
    gpu.connect("gpc0.raster.out_quads", "gpc0.tc.in_quads");
    gpu.connect("gpc0.tc.out_bins", "gpc0.prop.in_bins");
    gpu.connect("gpc0.prop.out_survivors", "gpc0.qru.in_quads");
    gpu.connect("gpc0.qru.out_warps", "gpc0.sm.in_warps");
    gpu.connect("gpc0.sm.out_shaded", "gpc0.prop.in_shaded");
    gpu.connect("gpc0.prop.out_release", "gpc0.sm.in_release");
    gpu.unit("gpc0.prop").in("in_tested").stub();
    gpu.unit("gpc0.prop").out("out_test").stub();
    gpu.unit("gpc0.crop").in("in_color").stub();
    gpu.unit("gpc0.crop").out("out_terminations").stub();
    gpu.connect_to_l2("gpc0.crop");
    // Lives as long as the process; the GPU cannot own it.
    auto* const wall = new testkit::Sink<ColorBeat>("wall", gpu.clock());
    wall->close(0);
    gpu.unit("gpc0.prop").out("out_color").connect(wall->in, 2, 1);
    wall->in.open();
  };
  const Draw draw = testing::random_draw(64, 64, 300, 7);
  try {
    run(request_of("baseline", Fidelity::cycle, [&](RunRequest& r) { r.platform = &broken; }), draw);
    FAIL() << "it came to an end";
  } catch (const SimulationFault& fault) {
    const std::string message = fault.what();
    EXPECT_NE(message.find("deadlock"), std::string::npos) << message;
    EXPECT_NE(message.find("gpc0.prop"), std::string::npos) << message;
    EXPECT_NE(message.find("gpc0.sm"), std::string::npos) << message;
    EXPECT_EQ(message.find("gpc0.crop"), std::string::npos) << message << ": CROP has nothing to do";
  }
}

TEST(Wiring, APortLeftOpenIsNamed) {
  Platform open = platform_named("agx-orin");
  open.name = "open";
  open.wire = [](Gpu& gpu) { gpu.add_front_end("draw"); };
  try {
    run(request_of("baseline", Fidelity::cycle, [&](RunRequest& r) { r.platform = &open; }), testing::draw_of(16, 16));
    FAIL();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("draw.out_vertices_0"), std::string::npos) << error.what();
  }
}

TEST(Wiring, UnknownUnitsAndPortsGetTheNearestName) {
  Platform wrong = platform_named("agx-orin");
  wrong.name = "wrong";
  const auto message = [&](void (*wire)(Gpu&)) {
    wrong.wire = wire;
    try {
      run(request_of("baseline", Fidelity::cycle, [&](RunRequest& r) { r.platform = &wrong; }),
          testing::draw_of(16, 16));
    } catch (const UserError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_NE(message([](Gpu& gpu) {
              gpu.add_front_end("draw");
              gpu.add_front_end("vpo");
              gpu.connect("drow.out_vertices_0", "vpo.in_vertices_0");
            }).find("did you mean draw"),
            std::string::npos);
  EXPECT_NE(message([](Gpu& gpu) {
              gpu.add_front_end("draw");
              gpu.add_front_end("vpo");
              gpu.connect("draw.out_vertexes_0", "vpo.in_vertices_0");
            }).find("out_vertices_0"),
            std::string::npos);
  EXPECT_NE(message([](Gpu& gpu) {
              gpu.add_front_end("draw");
              gpu.add(0, "tc");
              gpu.connect("draw.out_vertices_0", "gpc0.tc.in_quads");
            }).find("different items"),
            std::string::npos);
}

TEST(Requests, UnknownNamesAndValuesAreRefusedBeforeAnythingRuns) {
  const auto refused = [](const std::function<void(RunRequest&)>& change) {
    RunRequest request = request_of("het+qm", Fidelity::cycle, change);
    EXPECT_THROW(check_configuration(request), UserError);
  };
  refused([](RunRequest& r) { r.settings = {{"tcc", "bins", "3"}}; });
  refused([](RunRequest& r) { r.settings = {{"tc", "binz", "3"}}; });
  refused([](RunRequest& r) { r.settings = {{"tc", "bins", "0"}}; });
  refused([](RunRequest& r) { r.settings = {{"l2", "latency", "0"}}; });
  refused([](RunRequest& r) { r.units = {{"qru", "pear"}}; });
  refused([](RunRequest& r) { r.units = {{"quru", "pairing"}}; });
  EXPECT_NO_THROW(check_configuration(request_of("baseline", Fidelity::cycle, [](RunRequest& r) {
    r.settings = {{"qru", "quads_per_cycle", "4"}};
  })));
  EXPECT_THROW(platform_named("agx-orni"), UserError);
  EXPECT_THROW(variant_named("hat"), UserError);
}

TEST(Requests, ImagesOfUnusableSizeAreRefused) {
  for (const auto& [width, height] : {std::pair{0U, 16U}, {16U, 0U}, {16385U, 16U}, {16U, 16448U}}) {
    EXPECT_THROW(run(request_of("baseline"), testing::draw_of(width, height)), UserError);
  }
}

}  // namespace
}  // namespace vrpipe
