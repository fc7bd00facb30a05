#pragma once

#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/observers.h>
#include <vrpipe/platforms/simulation.h>

#include "jobs/cycle_window.h"
#include "jobs/level.h"
#include "jobs/trace_file.h"

namespace vrpipe::tools {

/// One run as a timeline that Perfetto opens: states of units, bins and warps that pass, and, every so many cycles, places
/// taken in queues, bins in use, warps in flight and bytes of memories. Written as it comes: of the run it keeps what may
/// still be after its end, and of what comes out of order as much as that takes.
class Trace {
 public:
  static constexpr const char* option = "--trace";
  static constexpr Cycle default_every = 100;

  /// @param every  cycles between values of counters, at least 1
  /// @param scene  for whoever reads the file
  Trace(std::filesystem::path path, CycleWindow window, Cycle every, std::string scene);

  const std::filesystem::path& path() const { return path_; }
  /// Adds its observers; it has to live while they are called. The run has time. Throws UserError.
  void attach(const RunRequest& request, Observers& observers);
  /// After the run: the file appears. Throws UserError.
  void finish();

 private:
  struct Slice {
    UnitState state;
    Cycle from, until;
  };
  struct UnitTrack {
    TraceFile::Track track;
    UnitState state = UnitState::starved;
    Cycle since = 0;
    std::deque<Slice> held;  ///< until the run is known to last as long
  };
  /// A counter of the timeline.
  struct Counter {
    unsigned group;
    std::string name, unit;
    std::int64_t value = 0;
    bool is_begun = false;  ///< in the window
  };
  struct LevelCounter {
    Counter counter;
    Level level;
  };
  /// What a counter shows of statistics: `plus` less `minus`, or what of `plus` is new.
  struct StatisticCounter {
    Counter counter;
    std::string plus, minus;
    std::int64_t before = 0;
  };

  unsigned group_of(const std::string& path) const;
  TraceFile& file();
  void add_units();
  void add_links(Observers& observers);
  void add_statistics(const std::vector<std::string>& there);
  void add_bins(const std::string& link, Observers& observers);
  void add_warps(const std::string& gpc, Observers& observers);
  LevelCounter& add_level(unsigned group, const std::string& name, const std::string& unit);

  void enter(UnitTrack& unit, UnitState state, Cycle from) const;
  void sample(Cycle cycle, const std::vector<Observers::Sampled>& values);
  void end(const RunResult& result);
  /// Writes what is before a cycle; levels, which may come late, before another.
  void write_before(Cycle cycle, Cycle of_levels);
  void show(Counter& counter, Cycle cycle, std::int64_t value);
  /// A counter's value from before the window, at its beginning.
  void begin(Counter& counter);

  const std::filesystem::path path_;
  const CycleWindow window_;
  const Cycle every_;
  const std::string scene_;
  RunRequest request_;
  std::optional<Netlist> netlist_;
  std::unique_ptr<TraceFile> file_;  ///< from the first event on
  std::map<std::string, UnitTrack> units_;
  std::vector<std::pair<std::string, TraceFile::Track>> tracks_;  ///< name and place of each
  std::deque<LevelCounter> levels_;
  std::vector<StatisticCounter> statistics_;
  Cycle sampled_ = 0;  ///< cycle of the last sample
};

}  // namespace vrpipe::tools
