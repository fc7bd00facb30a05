#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "address_map.h"
#include "data_bus_time.h"
#include "dram_parameters.h"
#include "dram_statistics.h"

#include <vrpipe/kernel/ring.h>
#include <vrpipe/pipeline/effects.h>

namespace vrpipe {

/// What a controller tells the banks of its channel.
struct DramCommand {
  enum class Kind : std::uint8_t { activate, read, write, precharge, precharge_all, refresh };
  Cycle at = never;  ///< of the DRAM; the first, of a command that takes several
  Kind kind = Kind::activate;
  unsigned bank = 0;
  std::uint64_t row = 0;
  std::uint32_t column = 0;  ///< in bursts
};

/// Sees the commands of a channel, in their order.
class DramCommandObserver {
 public:
  virtual ~DramCommandObserver() = default;
  virtual void issued(const DramCommand& command) = 0;
};

/// A channel: its banks, and the controller with its queues. Counts cycles of the DRAM; goes from one command to the
/// next, so that idle cycles cost nothing. What it does depends on the cycles in which bursts are asked for alone, not
/// on how `advance` cuts time up.
///
/// Reads go before writes, which are answered as soon as they are queued. Writes drain when `write_high` are queued,
/// down to `write_low` and at most a queue of them; without reads, down to `write_low`. A read of what is queued to be
/// written is answered from there, a write of it replaces it, and a write waits for older reads of its burst. Of reads,
/// or of writes: whichever command can be given first; of several, one for a row that is open, then the oldest. A
/// refresh goes before all that is not given when it falls due.
class DramChannel {
 public:
  struct Completion {
    Cycle at;  ///< the first cycle before which all of the data has come
    std::uint32_t tag;
  };
  /// `statistics` outlive it, and may be shared.
  /// @param refresh  the gate of dram.refresh
  DramChannel(const DramTiming& timing, DramStatistics& statistics, EffectGate refresh = {});
  /// Is told when data moves; outlives the channel.
  void tell(DataBusTime& data) { data_ = &data; }

  void observe(DramCommandObserver& observer) { observer_ = &observer; }

  /// Gives all commands of cycles before `until`.
  void advance(Cycle until) {
    while (true) {
      if (!chosen_) choose();
      if (next_.at >= until) return;
      issue();
    }
  }

  bool can_read() const { return reads_.count < timing_.read_queue; }
  bool can_write() const { return writes_.count < timing_.write_queue; }
  /// Queues a burst in a cycle to which the channel has advanced, if it can.
  void read(const DramAddress& place, std::uint32_t tag, Cycle now);
  void write(const DramAddress& place, Cycle now);

  /// Of reads, by their cycles: to be taken from the front.
  Ring<Completion>& completions() { return completions_; }
  /// When the next command can be given, and places of the queues may become free; `never` while nothing waits to be
  /// read or has to be written.
  Cycle next_command() {
    if (!chosen_) choose();
    return reads_.linked > 0 || draining_ ? next_.at : never;
  }
  /// Whether there are reads whose completion is not known.
  bool awaits_reads() const { return reads_.count > 0; }
  /// From a read command to its completion.
  Cycle data_cycles() const { return timing_.cl + timing_.burst; }
  /// To be called once, when the channel has advanced to its last cycle.
  void close(Cycle end);

 private:
  static constexpr std::uint16_t none = 0xffff;
  static constexpr unsigned most_banks = 32;
  static constexpr unsigned most_groups = 8;

  enum class Cause : std::uint8_t { hit, miss, conflict };
  struct Entry {
    std::uint64_t row;
    std::uint64_t sequence;  ///< in which the bursts came
    Cycle arrived;
    std::uint32_t column;
    std::uint32_t tag;
    std::uint16_t next, previous;  ///< in its list
    std::uint16_t follower;        ///< of a read: a write of the same burst that waits for it
    std::uint8_t bank;
    Cause cause;
  };
  /// In the order of age.
  struct List {
    std::uint16_t first = none, last = none;
    std::uint16_t hit = none;  ///< the oldest for the open row, if one is open
  };
  struct Queue {
    explicit Queue(unsigned capacity);
    std::vector<Entry> entries;
    std::array<List, most_banks> of_bank{};
    // What each bank wants next, kept as it changes.
    std::array<Cycle, most_banks> ready{};         ///< as far as the bank is concerned
    std::array<std::uint8_t, most_banks> limit{};  ///< as far as others are: of `Limits`
    std::array<std::uint64_t, most_banks> turn{};  ///< among those of the same cycle: rank, sequence, bank
    Cycle ages_at = never;                         ///< before it nobody has waited too long
    std::uint32_t banks = 0;                       ///< that have any, a bit each
    unsigned count = 0;                            ///< of places taken
    unsigned linked = 0;                           ///< of entries in the lists: those that may be served
    std::uint16_t free = 0;                        ///< the first of the free places
  };
  struct Bank {
    bool open = false;
    bool conflict = false;  ///< its row was closed because another is needed
    std::uint64_t row = 0;
    Cycle next_activate = 0, next_column = 0, next_precharge = 0;
  };

  std::uint16_t take_place(Queue& queue, const DramAddress& place, Cycle now);
  void append(Queue& queue, std::uint16_t index);
  void remove(Queue& queue, std::uint16_t index);
  void find_hit(Queue& queue, unsigned bank, std::uint16_t from);
  std::uint16_t find(const Queue& queue, std::uint16_t from, const DramAddress& place) const;
  void choose_mode();
  void choose();
  void choose_refresh();
  /// Bounds of the cycles of commands, by what they need: nothing but the bus, to move data in a group, to activate in
  /// one.
  using Limits = std::array<Cycle, 1 + 2 * most_groups>;
  static constexpr unsigned limit_of_data = 1;
  static constexpr unsigned limit_of_activate = 1 + most_groups;
  Limits limits_of(Cycle from) const;
  Cycle limit_of(unsigned limit) const;
  /// A command that may be given, and its turn.
  struct Candidate {
    Cycle at = never;
    std::uint64_t turn = ~std::uint64_t{0};
    bool goes_before(const Candidate& other) const { return at < other.at || (at == other.at && turn < other.turn); }
  };
  Candidate choose_of(const Queue& queue, std::uint32_t banks, const Limits& limits) const;
  std::uint16_t aged(Queue& queue) const;
  void choose_for(const Queue& queue, std::uint16_t aged, const Limits& limits);
  void take(const Queue& queue, const Candidate& candidate);
  void choose_to_close(Cycle from);
  /// After a burst has come: chooses again, if that may change what was chosen.
  void choose_again(Queue& queue, unsigned bank);
  void update(Queue& queue, unsigned bank);
  void update(unsigned bank) {
    update(reads_, bank);
    update(writes_, bank);
  }
  void issue();
  void activate(Cycle at);
  void move_data(Cycle at);
  void refresh(Cycle at);
  void close_bank(Bank& bank, Cycle at, Cycle distance);
  unsigned group_of(unsigned bank) const { return bank & (timing_.groups - 1); }

  const DramTiming timing_;
  DramStatistics& statistics_;
  DataBusTime* data_ = nullptr;
  DramCommandObserver* observer_ = nullptr;

  Queue reads_, writes_;
  std::array<List, most_banks> held_{};  ///< writes that wait for an older read of their burst
  std::uint64_t sequence_ = 0;
  bool draining_ = false;
  unsigned drained_ = 0;  ///< writes of this drain
  unsigned read_ = 0;     ///< reads since the last
  Cycle drains_since_ = 0;

  std::array<Bank, most_banks> banks_{};
  std::uint32_t open_banks_ = 0;
  std::array<Cycle, most_groups> next_activate_{}, next_read_{}, next_write_{};
  std::array<Cycle, 4>
      activated_{};  ///< the first cycles in which the last four allow the fourth after them, in a ring
  unsigned oldest_activate_ = 0;
  Cycle next_refresh_;
  EffectGate refresh_gate_;
  Cycle all_precharged_ = 0;  ///< what was closed last can be refreshed
  Cycle command_bus_ = 0;     ///< is free from then on
  Cycle now_ = 0;             ///< of the last command or burst

  bool chosen_ = false;   ///< `next_` and
  bool is_best_ = false;  ///< it is for `best_`: nobody has waited too long, nothing is refreshed or closed
  Candidate best_;
  DramCommand next_;
  std::uint16_t serves_ = none;  ///< the entry that it is for
  Ring<Completion> completions_;
};

}  // namespace vrpipe
