// What a request and a platform may say, and what is registered only once.
#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <tuple>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/registry.h>
#include <vrpipe/platforms/configuration.h>
#include <vrpipe/platforms/netlist.h>

#include "qru/qru.h"
#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

/// QRUs of another make: without parameters, and with one of the default's.
struct PlainQru : PairingQru {
  struct Parameters : ParameterSet {};
  PlainQru(const Parameters&, const RenderContext& context) : PairingQru(PairingQru::Parameters(), context) {}
};
struct SmallQru : PairingQru {
  struct Parameters : PairingQru::Parameters {};
  using PairingQru::PairingQru;
};
const Registrar<PlainQru, QruBehaviour> plain_qru("qru", "plain", "pairing without parameters");
const Registrar<SmallQru, QruBehaviour> small_qru("qru", "small", "pairing under another name");

TEST(Configuration, APlatformsSettingsAreForUnitsThatDeclareThem) {
  const Draw draw = random_draw(64, 48, 40, 3);
  RunRequest request = request_of("qm", Fidelity::cycle, [](RunRequest& r) { r.platform = &platform_named("mobile"); });
  const RunResult shipped = run(request, draw);
  request.units = {{"qru", "small"}};
  EXPECT_EQ(run(request, draw).cycles, shipped.cycles);
  request.units = {{"qru", "plain"}};
  EXPECT_GT(run(request, draw).counts.quads_merged, 0U);

  // The user's own mistakes stay mistakes, and so do a platform's.
  request.settings = {{"qru", "bin_quads", "64"}};
  EXPECT_THROW(check_configuration(request), UserError);
  Platform misspelt = platform_named("mobile");
  misspelt.settings = {{"qru", "bin_quad", "64"}};
  request.settings.clear();
  request.platform = &misspelt;
  EXPECT_THROW(check_configuration(request), UserError);
}

TEST(Configuration, ACacheThatCannotBeIsRefusedAtEveryFidelity) {
  for (const Fidelity fidelity : fidelities()) {
    RunRequest request = request_of("baseline", fidelity);
    request.settings = {{"crop", "cache_bytes", "5000"}};
    EXPECT_THROW(check_configuration(request), UserError) << name_of(fidelity);
    EXPECT_THROW(run(request, draw_of(16, 16)), UserError) << name_of(fidelity);
    request.settings = {{"crop", "line_bytes", "32"}};
    EXPECT_NO_THROW(check_configuration(request)) << name_of(fidelity);
    request.format = ColorFormat::rgba32f;
    EXPECT_THROW(check_configuration(request), UserError) << name_of(fidelity);
  }
}

TEST(Configuration, ParametersThatCannotBeAreRefusedWhateverTheFrameCallsFor) {
  for (const char* effects : {"auto", "all"}) {
    for (const Setting& setting : {Setting{"zrop", "sector_bytes", "16"}, Setting{"zrop", "cache_bytes", "100"},
                                   Setting{"sm", "attribute_buffer_bytes", "100"}}) {
      RunRequest request = request_of("qm", Fidelity::functional);
      request.effects = EffectChoice::parse(effects);
      request.settings = {{"state", "depth_format", "d32f"}, setting};
      EXPECT_THROW(check_configuration(request), UserError) << effects << " " << setting.parameter;
    }
  }
}

TEST(Platforms, OneWithoutGpcFrequencyOrWiringOrOfANameThatIsTakenIsRefused) {
  const Platform good = platform_named("agx-orin-ideal-memory");
  EXPECT_THROW(add_platform(good), UserError);
  for (const auto& [gpcs, megahertz, wire] : {std::tuple{0U, 1.0, good.wire},
                                              {1U, 0.0, good.wire},
                                              {1U, 1.0, decltype(good.wire)()},
                                              {most_gpcs + 1, 1.0, good.wire},
                                              {1U, 1e300, good.wire},
                                              {1U, std::nan(""), good.wire}}) {
    Platform bad = good;
    bad.name = "bad";
    bad.gpcs = gpcs;
    bad.frequency_mhz = megahertz;
    bad.wire = wire;
    EXPECT_THROW(add_platform(bad), UserError);
  }
  EXPECT_THROW(platform_named("bad"), UserError);
  for (const char* name : {"", "a/b", "\x1b[31m", "-x", "two words"}) {
    Platform bad = good;
    bad.name = name;
    EXPECT_THROW(add_platform(bad), UserError) << name;
    Variant variant = variant_named("qm");
    variant.name = name;
    EXPECT_THROW(add_variant(variant), UserError) << name;
  }
  Platform described = good;
  described.name = "described";
  described.description = "two\nlines";
  EXPECT_THROW(add_platform(described), UserError);
  Variant twice = variant_named("qm");
  twice.name = "twice";
  twice.settings = {{"tc", "bins", "8"}, {"tc", "bins", "9"}};
  EXPECT_THROW(add_variant(twice), UserError);
}

TEST(Platforms, WiringThatThrowsIsAFaultThatNamesThePlatform) {
  Platform platform = platform_named("agx-orin-ideal-memory");
  platform.name = "broken";
  platform.wire = [](Netlist&) { throw std::out_of_range("no such thing"); };
  const RunRequest request = request_of("qm", Fidelity::lt, [&](RunRequest& r) { r.platform = &platform; });
  try {
    run(request, draw_of(16, 16));
    FAIL() << "accepted";
  } catch (const SimulationFault& fault) {
    EXPECT_EQ(std::string(fault.what()), "platform broken at cycle 0: its wiring throws no such thing");
  }
}

void expect_added_variant_to_have_its_own() {
  Variant tiny = variant_named("qm");
  EXPECT_THROW(add_variant(tiny), UserError);
  tiny.name = "";
  EXPECT_THROW(add_variant(tiny), UserError);
  tiny.name = "tiny";
  tiny.units = {{"qru", "pass-through"}};
  tiny.settings = {{"tc", "bins", "7"}, {"tc", "bin_quads", "16"}};
  add_variant(tiny);
  RunRequest request = request_of("tiny", Fidelity::functional);
  request.settings = {{"tc", "bins", "9"}};
  const Draw draw = draw_of(16, 16);
  const Configuration configuration(request, *Frame::of(draw));
  EXPECT_EQ(configuration.implementation(*configuration.netlist().find("gpc0.qru")).name, "pass-through");
  const auto parameters = configuration.parameters();
  const auto has = [&](const char* name, const char* value) {
    return std::find(parameters.begin(), parameters.end(), std::pair<std::string, std::string>(name, value)) !=
           parameters.end();
  };
  EXPECT_TRUE(has("tc.bins", "9")) << "the run's own settings come last";
  EXPECT_TRUE(has("tc.bin_quads", "16"));
}

TEST(Variants, MayBeAddedWithUnitsAndSettingsOfTheirOwn) {
  // In a process of its own: a variant stays in the list, which other tests run through.
  const auto exit_code = [] {
    expect_added_variant_to_have_its_own();
    return ::testing::Test::HasFailure() ? 1 : 0;
  };
  EXPECT_EXIT(std::_Exit(exit_code()), ::testing::ExitedWithCode(0), "");
}

TEST(Modules, AreNotReplaced) {
  const UnitMaker& shipped = unit_maker("zrop");
  ASSERT_TRUE(Registry::instance().take_problems().empty());
  register_unit_maker("zrop", nullptr);
  register_timed_unit_maker("zrop", nullptr);
  const std::vector<Registry::Problem> problems = Registry::instance().take_problems();
  ASSERT_EQ(problems.size(), 2U);
  EXPECT_EQ(problems[0].why, "slot zrop has a module for cycle already");
  EXPECT_EQ(problems[1].why, "slot zrop has a module for lt already");
  EXPECT_TRUE(shipped);
  EXPECT_TRUE(timed_unit_maker("zrop"));
}

}  // namespace
}  // namespace vrpipe
