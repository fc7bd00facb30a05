#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "address_map.h"
#include "data_bus_time.h"
#include "dram_parameters.h"
#include "dram_statistics.h"

#include <vrpipe/memory/bandwidth.h>
#include <vrpipe/pipeline/effects.h>

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
  /// @param refresh  the gate of dram.refresh
  AnnotatedChannel(const DramTiming& timing, DramStatistics& statistics, EffectGate refresh = {});
  /// Is told when data moves; outlives the channel.
  void tell(DataBusTime& data) { data_ = &data; }

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
    Cycle asked = 0;             ///< when it was needed first
    Cycle ready = 0;             ///< when its bursts may be read or written
    Cycle last = 0;              ///< data of it, as far as is known
    std::uint64_t sequence = 0;  ///< of the last burst of it, among reads or writes
    std::uint64_t refreshes = 0;
  };
  static constexpr unsigned rows_kept = 4;
  struct Rows {
    std::array<Row, rows_kept> rows;
    unsigned newest = 0;
  };
  struct Bank {
    explicit Bank(unsigned width) : time(width) {}
    BandwidthReservation time;  ///< a byte a cycle
    Rows read, written;
    unsigned hits = 0;                         ///< since a row was opened
    bool is_read = false, is_written = false;  ///< since the last drain
  };

  std::uint64_t refreshes_before(Cycle cycle) const { return refreshes_ ? cycle / timing_.refi : 0; }
  /// Cycles without those of refreshes, and back.
  Cycle working(Cycle cycle) const;
  Cycle real(Cycle working) const;
  /// The row of a burst, opened if it is not. All that follows is in working time.
  Row& open_row(Bank& bank, std::uint64_t number, Cycle now, Cycle present, std::uint64_t refreshes, bool writes);
  /// When the data of a burst has moved whose row is there; `overhead` of the bus in parts of a cycle.
  Cycle move(const DramAddress& place, Row& row, Cycle now, Cycle latency, Cycle present, Cycle overhead);
  void drain();
  /// Whether a burst is still queued to be written. As a rule the last `write_low` are.
  bool is_queued(std::uint64_t burst) const {
    return std::find(queued_.begin(), queued_.end(), burst) != queued_.end();
  }
  static std::uint64_t number_of(const DramAddress& place) {
    return place.row << 18U | std::uint64_t{place.bank} << 13U | place.column;
  }

  const DramTiming timing_;
  DramStatistics& statistics_;
  DataBusTime* data_ = nullptr;
  EffectGate refresh_gate_;
  bool refreshes_;
  Cycle refresh_cycles_;                    ///< of a period, in which nothing else happens
  Cycle read_row_cycle_, write_row_cycle_;  ///< that a bank is taken by a row, at least
  // What the bus idles for, in parts of a cycle.
  Cycle activate_overhead_;  ///< an activate that does not fit between two bursts
  Cycle turn_overhead_;      ///< the turns of a drain, for each of its writes
  Cycle drain_overhead_;     ///< a drain that begins with another row
  Cycle return_overhead_;    ///< reads that go on after it with a row each, in banks that recover from writes
  BandwidthReservation bus_, activates_;
  std::vector<BandwidthReservation> groups_;
  std::vector<Bank> banks_;
  /// The last bursts, as they were asked for, in a ring: as many as have places in a queue.
  class Places {
   public:
    explicit Places(unsigned count) : places_(count) {}
    /// When there is room for one that is asked for in a cycle. Those that ran ahead of it do not hold it up.
    Cycle room(Cycle asked) const {
      return places_[next_].asked <= asked ? std::max(asked, places_[next_].served) : asked;
    }
    void push(Cycle asked, Cycle served) {
      places_[next_] = {asked, served};
      next_ = next_ + 1 < places_.size() ? next_ + 1 : 0;
    }

   private:
    struct Place {
      Cycle asked = 0, served = 0;
    };
    std::vector<Place> places_;
    std::size_t next_ = 0;
  };
  Places read_places_, write_places_;
  std::vector<std::uint64_t> queued_;       ///< numbers of bursts, in a ring
  std::vector<DramAddress> queued_places_;  ///< and where they are
  std::size_t next_queued_ = 0;
  std::uint64_t reads_ = 0, writes_ = 0;
  unsigned batch_;             ///< writes of a drain
  unsigned written_ = 0;       ///< of this one
  bool drain_opens_ = false;   ///< it has opened a row
  unsigned reads_return_ = 0;  ///< so many of the first reads after a drain are still to open a row each
  unsigned reads_ago_ = ~0U;   ///< bursts since the last read, as far as it matters
};

}  // namespace vrpipe
