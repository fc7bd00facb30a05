// Observers of a link and of states, at each fidelity.
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <vrpipe/component/error.h>
#include <vrpipe/kernel/link.h>
#include <vrpipe/pipeline/batch.h>
#include <vrpipe/platforms/observers.h>

#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

struct Seen {
  TileId tile;
  unsigned quads;
  bool is_end;
  bool operator==(const Seen& other) const {
    return tile == other.tile && quads == other.quads && is_end == other.is_end;
  }
};

/// The bins of a recording; checks that the records are in the order of time and within the run.
template <class Record>
std::vector<Seen> seen_in(const std::vector<Record>& records, Cycle end, const std::function<Seen(const Record&)>& what,
                          const std::function<bool(const Record&)>& closes) {
  std::vector<Seen> all;
  Cycle last = 0;
  bool open = false;
  for (const Record& record : records) {
    EXPECT_GE(record.cycle, last);
    EXPECT_LE(record.cycle, end);
    last = record.cycle;
    const Seen seen = what(record);
    if (open) {
      EXPECT_EQ(seen.tile, all.back().tile);
      all.back().quads += seen.quads;
    } else {
      all.push_back(seen);
    }
    open = !closes(record);
  }
  return all;
}

// A flushed bin goes in beats at cycle, in one piece elsewhere.
TEST(LinkObservers, SeeTheSameBinsAtEveryFidelityAndChangeNothing) {
  const Draw draw = random_draw(150, 90, 300, 9);
  using Beat = LinkRecorder<QuadBeat>::Record;
  using Bin = LinkRecorder<BinItem>::Record;

  std::vector<Seen> reference;
  for (const Fidelity fidelity : {Fidelity::cycle, Fidelity::lt, Fidelity::bound, Fidelity::functional}) {
    SCOPED_TRACE(name_of(fidelity));
    RunRequest request = request_of("het+qm", fidelity, strictly);
    const RunResult plain = run(request, draw);
    std::vector<Beat> beats;
    std::vector<Bin> bins;
    request.observers = std::make_shared<Observers>();
    request.observers->on_link<QuadBeat>("gpc0.tc.bins", [&](const auto& passed) {
      beats.push_back({passed.first, passed.item});
    });
    request.observers->on_link<BinItem>("tc.bins", [&](const auto& passed) {
      EXPECT_EQ(passed.link, "gpc0.tc.bins");
      bins.push_back({passed.first, passed.item});
    });
    const RunResult recorded = run(request, draw);
    EXPECT_EQ(recorded.result_hash, plain.result_hash);
    std::vector<Seen> seen;
    if (fidelity == Fidelity::cycle) {
      seen = seen_in<Beat>(
          beats, *recorded.cycles,
          [](const Beat& beat) {
            return Seen{beat.item.tile, beat.item.count, beat.item.mark == Mark::end_of_frame};
          },
          [](const Beat& beat) { return beat.item.last_of_bin || beat.item.mark == Mark::end_of_frame; });
      reference = seen;
    } else {
      seen = seen_in<Bin>(
          bins, recorded.cycles.value_or(0),
          [](const Bin& bin) {
            return Seen{bin.item.tile, bin.item.quads, bin.item.mark == Mark::end_of_frame};
          },
          [](const Bin&) { return true; });
    }
    std::uint64_t quads = 0;
    for (const Seen& bin : seen) quads += bin.quads;
    EXPECT_EQ(quads, recorded.counts.quads_rasterized);
    EXPECT_TRUE(seen == reference);
  }
}

TEST(LinkObservers, OfALinkThatIsNotThereOrCarriesOtherItemsAreRefused) {
  const Draw draw = random_draw(32, 32, 10, 9);
  const auto refused = [&](const auto& observe) {
    RunRequest request = request_of("qm", Fidelity::lt);
    request.observers = std::make_shared<Observers>();
    observe(*request.observers);
    EXPECT_THROW(run(request, draw), UserError);
  };
  refused([](Observers& observers) { observers.on_link<BinItem>("tc.binz", [](const auto&) {}); });
  refused([](Observers& observers) { observers.on_link<Warp>("tc.bins", [](const auto&) {}); });
}

TEST(StateObservers, SeeTheCyclesThatTheAccountsHave) {
  const Draw draw = random_draw(150, 90, 300, 9);
  for (const Fidelity fidelity : {Fidelity::lt, Fidelity::cycle}) {
    RunRequest request = request_of("het+qm", fidelity);
    struct Unit {
      UnitState state = UnitState::starved;
      Cycle since = 0;
      std::vector<std::pair<UnitState, std::pair<Cycle, Cycle>>> spans;
    };
    std::map<std::string, Unit> units;
    request.observers = std::make_shared<Observers>();
    request.observers->on_states([&](const std::string& name, UnitState state, Cycle from) {
      Unit& unit = units[name];
      unit.spans.push_back({unit.state, {unit.since, from}});
      unit.state = state;
      unit.since = from;
    });
    const RunResult result = run(request, draw);
    for (const UnitReport& report : result.units) {
      Unit& unit = units[report.name];
      unit.spans.push_back({unit.state, {unit.since, *result.cycles}});
      std::array<std::uint64_t, unit_states> cycles{};
      for (const auto& [state, span] : unit.spans) {
        const Cycle end = std::min(span.second, *result.cycles);
        if (end > span.first) cycles[static_cast<unsigned>(state)] += end - span.first;
      }
      EXPECT_EQ(cycles, report.cycles) << report.name << " " << name_of(fidelity);
    }
  }
}

}  // namespace
}  // namespace vrpipe
