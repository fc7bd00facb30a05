// Platforms of several GPCs: how many, who owns what, and what that may change.
#include <gtest/gtest.h>

#include <vrpipe/pipeline/slots/wdx.h>
#include <vrpipe/platforms/wiring.h>

#include "support/refusals.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using testing::random_draw;
using testing::request_of;
using testing::run;
using testing::same_image;
using testing::statistic;
using testing::strictly;

RunRequest on_gpcs(unsigned gpcs, const std::string& variant, Fidelity fidelity, std::vector<Setting> settings = {},
                   std::vector<UnitChoice> units = {}) {
  RunRequest request = request_of(variant, fidelity, strictly);
  request.platform = &platform_named("agx-orin-ideal-memory");
  request.settings = std::move(settings);
  request.settings.push_back({"platform", "gpcs", std::to_string(gpcs)});
  request.units = std::move(units);
  return request;
}

const std::vector<InstanceStatistic>& by_gpc(const RunResult& result, const std::string& name) {
  for (const StatisticReport& report : result.statistics) {
    if (report.name == name) return report.instances;
  }
  throw std::out_of_range(name);
}

std::string refused_configuration(const RunRequest& request) {
  return testing::refusal_of([&] { check_configuration(request); });
}

TEST(Gpcs, AreAsManyAsIsSaid) {
  EXPECT_EQ(gpcs_of(on_gpcs(7, "qm", Fidelity::lt)), 7U);
  RunRequest request = request_of("qm", Fidelity::lt);
  request.platform = &platform_named("desktop");
  EXPECT_EQ(gpcs_of(request), 4U);
  request.variant.settings = {{"platform", "gpcs", "2"}};
  EXPECT_EQ(gpcs_of(request), 2U);
  const RunResult result = run(request, random_draw(64, 64, 50, 1));
  EXPECT_EQ(by_gpc(result, "crop.quads_blended").size(), 2U);
  EXPECT_NE(refused_configuration(on_gpcs(0, "qm", Fidelity::lt)).find("1 to 256"), std::string::npos);
  EXPECT_NE(refused_configuration(on_gpcs(257, "qm", Fidelity::lt)).find("1 to 256"), std::string::npos);
}

TEST(Gpcs, OfOneTheCrossbarIsNotThereButItsSettingsAreChecked) {
  EXPECT_EQ(refused_configuration(on_gpcs(1, "qm", Fidelity::lt, {{"wdx", "unit_tiles", "4"}})), "none");
  EXPECT_EQ(refused_configuration(on_gpcs(1, "qm", Fidelity::lt, {{"wdx", "row_offset", "4"}}, {{"wdx", "tpc-table"}})),
            "none");
  EXPECT_NE(refused_configuration(on_gpcs(1, "qm", Fidelity::lt, {{"wdx", "unit_tile", "4"}})).find("wdx.unit_tiles"),
            std::string::npos);
  EXPECT_NE(refused_configuration(on_gpcs(1, "qm", Fidelity::lt, {{"wdx", "unit_tiles", "0"}})).find("1 to 64"),
            std::string::npos);
  EXPECT_NE(refused_configuration(on_gpcs(1, "qm", Fidelity::lt, {}, {{"wdx", "interleaf"}})).find("interleave"),
            std::string::npos);
}

// Strictly, order alone decides, and order holds per pixel whoever owns it.
TEST(Gpcs, DrawThePictureOfOneWhoeverOwnsATile) {
  const Draw draw = random_draw(200, 136, 500, 3);
  for (const char* variant : {"baseline", "het"}) {
    const RunResult one = run(on_gpcs(1, variant, Fidelity::functional), draw);
    for (const Fidelity fidelity : {Fidelity::functional, Fidelity::lt, Fidelity::cycle}) {
      for (const unsigned gpcs : {2U, 3U, 7U}) {
        for (const auto& [map, unit] : {std::pair{"interleave", "1"}, {"interleave", "4"}, {"tpc-table", "2"}}) {
          SCOPED_TRACE(std::string(variant) + " " + map + " " + unit + " " + name_of(fidelity));
          const RunResult several =
              run(on_gpcs(gpcs, variant, fidelity, {{"wdx", "unit_tiles", unit}}, {{"wdx", map}}), draw);
          EXPECT_TRUE(same_image(several.framebuffer.color, one.framebuffer.color));
          EXPECT_EQ(several.counts.fragments_blended, one.counts.fragments_blended);
          EXPECT_EQ(several.counts.primitives, one.counts.primitives);
        }
      }
    }
  }
}

TEST(Gpcs, CountTheSameAtEveryFidelity) {
  const Draw draw = random_draw(200, 136, 500, 3);
  const RunResult functional = run(on_gpcs(4, "het+qm", Fidelity::functional), draw);
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    const RunResult timed = run(on_gpcs(4, "het+qm", fidelity), draw);
    EXPECT_EQ(timed.counts.named(), functional.counts.named()) << name_of(fidelity);
    for (const char* counted : {"wdx.primitives", "wdx.copies", "tgc.entries"}) {
      EXPECT_EQ(statistic(timed, counted), statistic(functional, counted)) << counted << " at " << name_of(fidelity);
    }
  }
}

TEST(Gpcs, ThatOwnWholeTileGridsBinAPrimitiveAsOftenAsOne) {
  const Draw draw = random_draw(400, 300, 800, 5);
  const auto entries = [&](unsigned gpcs, const char* unit) {
    return statistic(run(on_gpcs(gpcs, "qm", Fidelity::functional, {{"wdx", "unit_tiles", unit}}), draw),
                     "tgc.entries");
  };
  const std::uint64_t of_one = entries(1, "1");
  for (const unsigned gpcs : {2U, 4U, 7U}) {
    EXPECT_EQ(entries(gpcs, "4"), of_one) << "each grid is one GPC's";
    EXPECT_GT(entries(gpcs, "1"), of_one * 5 / 4) << "tiles of a grid belong to several, which bin it each";
    EXPECT_LE(entries(gpcs, "1"), of_one * gpcs);
  }
}

// Nearly: TC's bins are by screen tile, and each GPC has as many.
TEST(Gpcs, ShareTheWork) {
  const Draw draw = random_draw(256, 256, 3000, 6);
  const std::uint64_t one = *run(on_gpcs(1, "baseline", Fidelity::lt), draw).cycles;
  const std::uint64_t four = *run(on_gpcs(4, "baseline", Fidelity::lt), draw).cycles;
  EXPECT_LT(four, one / 3);
  EXPECT_GT(four, one / 5);
}

/// A map of one's own: all to one GPC.
class AllToOne : public WdxBehaviour {
 public:
  struct Parameters : ParameterSet {
    Integer gpc{*this, "gpc", 1, 0, 1000, "", "a test", "that owns everything"};
  };
  AllToOne(const Parameters& parameters, const RenderContext&) : gpc_(parameters.gpc) {}
  unsigned owner_of(TileId) const override { return gpc_; }
  Timing timing() const override { return {2, 2, 16}; }

 private:
  const unsigned gpc_;
};
const Registrar<AllToOne, WdxBehaviour> all_to_one("wdx", "all-to-one", "a map of one's own");

TEST(Gpcs, GoByAMapOfOnesOwn) {
  const Draw draw = random_draw(100, 80, 100, 8);
  for (const Fidelity fidelity : fidelities()) {
    const RunResult result = run(on_gpcs(3, "het", fidelity, {}, {{"wdx", "all-to-one"}}), draw);
    for (const InstanceStatistic& instance : by_gpc(result, "crop.quads_blended")) {
      EXPECT_EQ(instance.value > 0, instance.path == "gpc1.crop") << instance.path << " at " << name_of(fidelity);
    }
  }
}

TEST(Gpcs, AMapThatNamesAGpcThatIsNotThereIsAFault) {
  const Draw draw = random_draw(100, 80, 100, 8);
  try {
    run(on_gpcs(3, "het", Fidelity::functional, {{"wdx", "gpc", "3"}}, {{"wdx", "all-to-one"}}), draw);
    FAIL();
  } catch (const SimulationFault& fault) {
    EXPECT_NE(std::string(fault.what()).find("belongs to GPC 3 of 3"), std::string::npos) << fault.what();
    EXPECT_NE(std::string(fault.what()).find("wdx=all-to-one"), std::string::npos) << fault.what();
  }
}

TEST(Gpcs, WithoutACrossbarAreRefused) {
  Platform platform = platform_named("agx-orin-ideal-memory");
  platform.gpcs = 2;
  platform.wire = [](Netlist& netlist) {
    wire_pipeline(netlist);
    netlist.remove("wdx");
  };
  RunRequest request = request_of("het", Fidelity::cycle);
  request.platform = &platform;
  EXPECT_NE(refused_configuration(request).find("it has 2 GPCs and 0 crossbars"), std::string::npos)
      << refused_configuration(request);
}

}  // namespace
}  // namespace vrpipe
