#include <vrpipe/component/parameter.h>

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <vrpipe/component/error.h>
#include <vrpipe/component/statistic.h>
#include <vrpipe/pipeline/registry.h>

#include "support/refusals.h"

namespace vrpipe {
namespace {

struct Example : ParameterSet {
  Integer count{*this, "count", 8, 1, 64, "quads", source::open, "how many"};
  Real share{*this, "share", 0.5, 0.0, 1.0, "alpha", source::paper_text, "how much"};
  Switch forwarding{*this, "forwarding", true, source::open, "whether"};
  Choice order{*this, "order", {"draw", "tile"}, 1, source::measured, "which"};
  Integer cache{*this, "cache", 4096, 128, 1U << 31U, "bytes", source::open, "how large"};
};

std::string message_of(Example& set, const std::string& name, const std::string& value) {
  return testing::refusal_of([&] { set.set("tc", name, value); });
}

TEST(Parameters, AreFoundByNameAndKeepTheirDefault) {
  Example set;
  set.set("tc", "count", "12");
  set.set("tc", "share", "0.25");
  set.set("tc", "forwarding", "off");
  set.set("tc", "order", "draw");
  EXPECT_EQ(set.count, 12u);
  EXPECT_EQ(static_cast<double>(set.share), 0.25);
  EXPECT_FALSE(set.forwarding);
  EXPECT_EQ(set.order, 0u);
  EXPECT_EQ(set.count.default_value(), "8");
  EXPECT_EQ(set.order.default_value(), "tile");
  EXPECT_EQ(set.parameters().size(), 5u);
}

TEST(Parameters, AnUnknownNameGetsTheNearestOne) {
  Example set;
  const std::string message = message_of(set, "cuont", "3");
  EXPECT_NE(message.find("cuont"), std::string::npos);
  EXPECT_NE(message.find("tc.count"), std::string::npos);
}

TEST(Parameters, AValueOutOfRangeNamesTheKeyAndTheRange) {
  Example set;
  const std::vector<std::pair<std::string, std::vector<std::string>>> bad{
      {"count", {"0", "65", "-1", "8.5", "8 ", "", "eight", "99999999999"}},
      {"share", {"-0.1", "1.1", "nan", "inf", "", "0.5x"}},
      {"forwarding", {"yes", "1", ""}},
      {"order", {"tiles", "", "0"}}};
  for (const auto& [name, values] : bad) {
    for (const std::string& value : values) {
      const std::string message = message_of(set, name, value);
      EXPECT_NE(message.find("tc." + name), std::string::npos) << name << "=" << value << ": " << message;
    }
  }
  EXPECT_EQ(set.count, 8u) << "a refused value changes nothing";
}

TEST(Parameters, TheEndsOfTheRangeAreAllowed) {
  Example set;
  for (const char* value : {"1", "64"}) EXPECT_EQ(message_of(set, "count", value), "none");
  for (const char* value : {"0", "1"}) EXPECT_EQ(message_of(set, "share", value), "none");
}

TEST(Parameters, SizesInBytesTakeBinaryMultiples) {
  Example set;
  for (const auto& [text, bytes] : std::vector<std::pair<std::string, std::uint32_t>>{
           {"512", 512}, {"16K", 16384}, {"16KiB", 16384}, {"3M", 3U << 20U}, {"1MiB", 1U << 20U}, {"2G", 1U << 31U}}) {
    EXPECT_EQ(message_of(set, "cache", text), "none");
    EXPECT_EQ(set.cache, bytes) << text;
    EXPECT_EQ(set.cache.value(), std::to_string(bytes)) << text;
  }
  for (const char* text : {"K", "iB", "16k", "16KB", "16iB", "1.5K", "16 K", "-1K", "4G", "4294967295G", "KK"}) {
    const std::string message = message_of(set, "cache", text);
    EXPECT_NE(message.find("128 to 2147483648, where K, M and G are powers of 1024"), std::string::npos) << message;
  }
  EXPECT_EQ(set.cache, 1U << 31U) << "a refused value changes nothing";
  const std::string message = message_of(set, "count", "1K");
  EXPECT_NE(message.find("'1K'"), std::string::npos) << "quads are counted: " << message;
  EXPECT_EQ(message.find("powers"), std::string::npos) << message;
}

TEST(Parameters, AListIsRefusedAsOne) {
  Example set;
  for (const auto& [name, text] : std::vector<std::pair<std::string, std::string>>{{"count", "16,32"},
                                                                                   {"share", "0.1,0.2"},
                                                                                   {"forwarding", "on,off"},
                                                                                   {"order", "draw,tile"},
                                                                                   {"cache", "1K,2K"}}) {
    const std::string message = message_of(set, name, text);
    EXPECT_NE(message.find("it is a list"), std::string::npos) << message;
  }
}

// case T07
TEST(Counter, CountsBeyond32Bits) {
  StatisticSet set;
  Counter counter(set, "quads", "quads", "seen");
  counter += (1ULL << 32U) - 2;
  for (int i = 0; i < 4; ++i) ++counter;
  EXPECT_EQ(counter.value(), (1ULL << 32U) + 2);
  EXPECT_EQ(set.counters().size(), 1u);
}

TEST(Registry, AllSlotsHaveAnImplementationWithParametersThatSayAllAboutThemselves) {
  for (const std::string& slot : Registry::instance().slot_names()) {
    const auto implementations = Registry::instance().of_slot(slot);
    EXPECT_FALSE(implementations.empty()) << slot;
    for (const Implementation* implementation : implementations) {
      EXPECT_FALSE(implementation->description.empty()) << slot;
      const std::unique_ptr<ParameterSet> set = implementation->make_parameters();
      for (const Parameter* parameter : set->parameters()) {
        EXPECT_STRNE(parameter->source(), "") << slot << "." << parameter->name();
        EXPECT_STRNE(parameter->meaning(), "") << slot << "." << parameter->name();
        EXPECT_EQ(parameter->value(), parameter->default_value());
      }
    }
  }
}

TEST(Registry, AnUnknownSlotOrUnitGetsTheNearestName) {
  const auto message = [](const char* slot, const char* name) {
    return testing::refusal_of([&] { Registry::instance().find(slot, name); });
  };
  EXPECT_NE(message("qur", "pairing").find("qru"), std::string::npos);
  EXPECT_NE(message("qru", "paring").find("pairing"), std::string::npos);
}

TEST(Registry, APluginThatIsMissingOrForeignIsRefused) {
  EXPECT_THROW(load_plugin("/nowhere/plugin.so"), UserError);
  EXPECT_THROW(load_plugin("/proc/self/exe/"), UserError);
}

TEST(NearName, IsTheOneWithTheFewestEditsOfAThirdOfTheLettersAtMost) {
  const std::vector<std::string> names{"baseline", "qm", "het", "het+qm", "raster.hi_z"};
  EXPECT_EQ(near_name("hte", names), "het");
  EXPECT_EQ(near_name("basline", names), "baseline");
  EXPECT_EQ(near_name("qn", names), "qm");
  EXPECT_EQ(near_name("x", {}), "");
  EXPECT_EQ(near_name("", names), "");
  EXPECT_EQ(near_name("foo", names), "");
  EXPECT_EQ(near_name("hurt", names), "");
  EXPECT_EQ(near_name("baslne", names), "baseline");
  EXPECT_EQ(near_name("bsllne", names), "");
  EXPECT_EQ(near_name("hi_z", names), "raster.hi_z");
  EXPECT_EQ(near_name("rop.hi_z", names), "");
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
  EXPECT_EQ(edit_distance("base", "bsae"), 1u);
  EXPECT_EQ(edit_distance("", "abc"), 3u);
}

TEST(Suggestion, NamesWhatIsNearAndElseWhatThereIs) {
  const std::vector<std::string> names{"lego", "room"};
  EXPECT_EQ(suggestion("lgeo", names), "did you mean lego? There are lego, room");
  EXPECT_EQ(suggestion("foo", names), "there are lego, room");
  EXPECT_EQ(suggestion("lgeo", names, "`list` lists all", "a:"), "did you mean a:lego? `list` lists all");
  EXPECT_EQ(suggestion("foo", names, "`list` lists all", "a:"), "there are lego, room; `list` lists all");
  EXPECT_EQ(suggestion("foo", {"lego", "room", "lego"}), "there are lego, room");
  std::vector<std::string> many{"something"};
  for (int i = 1; i < 100; ++i) many.push_back("something" + std::to_string(i));
  EXPECT_EQ(suggestion("foo", many, "`list` lists all"), "`list` lists all");
  EXPECT_EQ(suggestion("foo", many), "there are 100, such as something");
  EXPECT_EQ(suggestion("foo", {}), "there is none");
}

TEST(UserError, IsOneLineThatNamesThingPlaceReasonAndRemedy) {
  const std::string message = UserError("cannot read scene", "a.ply", "it is empty", "give another").what();
  for (const char* part : {"cannot read scene", "a.ply", "it is empty", "give another"}) {
    EXPECT_NE(message.find(part), std::string::npos);
  }
  EXPECT_EQ(message.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace vrpipe
