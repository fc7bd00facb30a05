#pragma once

#include <deque>
#include <functional>
#include <map>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "dram/dram_channel.h"

namespace vrpipe::testing {

struct StatisticsOwner : StatisticSet {};

/// A channel of a DRAM with what it counts.
class ChannelBench {
 public:
  explicit ChannelBench(const DramParameters& parameters) : channel(timing_of(parameters), statistics) {}
  StatisticsOwner owner;
  DramStatistics statistics{owner, "channel"};
  DramChannel channel;

  /// The completions of all that was asked for, by tag, up to a cycle.
  std::map<std::uint32_t, Cycle> completed(Cycle until) {
    channel.advance(until);
    std::map<std::uint32_t, Cycle> found;
    for (; !channel.completions().empty(); channel.completions().pop())
      found[channel.completions().front().tag] = channel.completions().front().at;
    return found;
  }
};

/// Keeps every command.
class CommandLog : public DramCommandObserver {
 public:
  void issued(const DramCommand& command) override { commands.push_back(command); }
  /// The cycles of a kind.
  std::vector<Cycle> cycles(DramCommand::Kind kind) const {
    std::vector<Cycle> found;
    for (const DramCommand& command : commands) {
      if (command.kind == kind) found.push_back(command.at);
    }
    return found;
  }
  std::vector<DramCommand> commands;
};

/// Passes commands on to several.
class CommandFan : public DramCommandObserver {
 public:
  explicit CommandFan(std::vector<DramCommandObserver*> observers) : observers_(std::move(observers)) {}
  void issued(const DramCommand& command) override {
    for (DramCommandObserver* observer : observers_) observer->issued(command);
  }

 private:
  std::vector<DramCommandObserver*> observers_;
};

/// What data the reads of a channel see: by burst, how many writes of it were asked for before. Follows the commands; a
/// write command stores what was asked for last, as writes of a burst that is queued replace it.
class DataOrder : public DramCommandObserver {
 public:
  void read(const DramAddress& place) {
    Burst& burst = bursts_[key(place.bank, place.row, place.column)];
    if (!burst.write_queued) burst.expected.push_back(burst.asked);  // else it is answered from the queue
  }
  void write(const DramAddress& place) {
    Burst& burst = bursts_[key(place.bank, place.row, place.column)];
    ++burst.asked;
    burst.write_queued = true;
  }
  void issued(const DramCommand& command) override {
    if (command.kind != DramCommand::Kind::read && command.kind != DramCommand::Kind::write) return;
    Burst& burst = bursts_[key(command.bank, command.row, command.column)];
    if (command.kind == DramCommand::Kind::write) {
      if (!burst.write_queued) ++unwanted;
      burst.write_queued = false;
      burst.stored = burst.asked;
      return;
    }
    if (burst.expected.empty()) {
      ++unwanted;
      return;
    }
    if (burst.expected.front() != burst.stored) ++out_of_order;
    burst.expected.pop_front();
  }
  /// Commands that nobody asked for, and reads that saw other data than they should.
  unsigned unwanted = 0, out_of_order = 0;
  /// Reads that no command has served.
  std::size_t unserved() const {
    std::size_t sum = 0;
    for (const auto& burst : bursts_) sum += burst.second.expected.size();
    return sum;
  }

 private:
  struct Burst {
    unsigned asked = 0, stored = 0;
    bool write_queued = false;
    std::deque<unsigned> expected;  ///< by queued reads, in their order
  };
  using Key = std::tuple<unsigned, std::uint64_t, std::uint32_t>;
  static Key key(unsigned bank, std::uint64_t row, std::uint32_t column) { return {bank, row, column}; }
  std::map<Key, Burst> bursts_;
};

/// A burst to be read or written, not before a cycle.
struct Burst {
  DramAddress place;
  bool writes = false;
  Cycle from = 0;
};

/// Asks for bursts in their order, each as soon as it may and there is room, before cycle `stop`, and goes on to `end`.
/// Returns the cycle before which the last of all data that was read has come.
inline Cycle feed(DramChannel& channel, const std::function<bool(Burst&)>& next, Cycle stop, Cycle end,
                  const std::function<void(const Burst&, std::uint32_t tag)>& asked = nullptr,
                  const std::function<void(const DramChannel::Completion&)>& answered = nullptr) {
  Cycle now = 0;
  Cycle last = 0;
  std::uint32_t tag = 0;
  Burst burst;
  const auto take_answers = [&] {
    for (Ring<DramChannel::Completion>& done = channel.completions(); !done.empty(); done.pop()) {
      last = std::max(last, done.front().at);
      if (answered) answered(done.front());
    }
  };
  while (next(burst)) {
    now = std::max(now, burst.from);
    channel.advance(now);
    while (now < stop && !(burst.writes ? channel.can_write() : channel.can_read())) {
      now = channel.next_command() + 1;
      channel.advance(now);
    }
    if (now >= stop) break;
    if (asked) asked(burst, tag);
    if (burst.writes) {
      channel.write(burst.place, now);
    } else {
      channel.read(burst.place, tag++, now);
    }
    take_answers();
  }
  channel.advance(end);
  take_answers();
  return last;
}

}  // namespace vrpipe::testing
