#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "address_map.h"
#include "dram_parameters.h"
#include "dram_statistics.h"

#include <vrpipe/memory/bandwidth.h>

namespace vrpipe {

/// A channel whose time is annotated: says at once when a burst is there, for bursts that come in any order of time.
/// What limits a channel is reserved: data bus, groups of banks, activates, banks; a burst takes what is free from its
/// cycle on. Which bursts are row hits is guessed from the order in which they are asked for: those of the row that a
/// bank has open, and those that the controller would have reordered to others of their row, because these still wait
/// and are within a queue's length of them. Refreshes take their cycles out of the time in which all that happens.
///
/// Reads and writes are told apart by what a drain costs: the turns of the bus, and the rows that it closes.
class AnnotatedChannel {
 public:
  /// `statistics` outlive it, and may be shared.
  AnnotatedChannel(const DramTiming& timing, DramStatistics& statistics);

  /// The first cycle before which all data of a read has come that is asked for in a cycle. `present` never decreases,
  /// and is the cycle of the clock that the bursts' cycles may be ahead of.
  Cycle read(const DramAddress& place, Cycle now, Cycle present);
  /// The cycle in which a write has a place in the queue.
  Cycle write(const DramAddress& place, Cycle now, Cycle present);
  void close(Cycle end);

 private:
  /// Of a row that was opened lately.
  struct Row {
    std::uint64_t row = ~std::uint64_t{0};
    Cycle last = 0;              ///< data of it, as far as is known
    std::uint64_t sequence = 0;  ///< of the last burst of it
    std::uint64_t refreshes = 0;
  };
  static constexpr unsigned rows_kept = 4;
  struct Bank {
    explicit Bank(unsigned width) : time(width) {}
    BandwidthReservation time;  ///< a byte a cycle
    std::array<Row, rows_kept> rows;
    unsigned newest = 0;
    unsigned hits = 0;        ///< since the newest was opened
    bool is_written = false;  ///< in this drain
  };

  std::uint64_t refreshes_before(Cycle cycle) const { return timing_.refresh ? cycle / timing_.refi : 0; }
  /// Cycles without those of refreshes, and back.
  Cycle working(Cycle cycle) const;
  Cycle real(Cycle working) const;
  /// When the column command of a burst may be given, in working time.
  Cycle open_row(Bank& bank, const DramAddress& place, Cycle now, Cycle present, std::uint64_t refreshes,
                 unsigned queue);
  Cycle move(Bank& bank, const DramAddress& place, Cycle column, Cycle latency, Cycle present, Cycle overhead);
  void drain();

  const DramTiming timing_;
  DramStatistics& statistics_;
  Cycle refresh_cycles_;  ///< of a period, in which nothing else happens
  BandwidthReservation bus_, activates_;
  std::vector<BandwidthReservation> groups_;
  std::vector<Bank> banks_;
  std::uint64_t sequence_ = 0;
  unsigned batch_;            ///< writes of a drain
  unsigned written_ = 0;      ///< of this one
  unsigned reads_ago_ = ~0U;  ///< bursts since the last read, as far as it matters
};

}  // namespace vrpipe
