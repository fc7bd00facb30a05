#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "dram/dram_channel.h"

namespace vrpipe::testing {

/// Judges the commands of a channel by the rules of the data sheet: each against all that it may be too close to. Knows
/// what a command is and the parameters, and nothing of the channel: distances are worked out here, from picoseconds.
class JedecChecker : public DramCommandObserver {
 public:
  explicit JedecChecker(const DramParameters& parameters) : p_(parameters) {
    const double longest = p_.tcwl_ps + p_.tdqss_ps + p_.twr_ps + p_.trfc_ps + p_.trc_ps + p_.tfaw_ps + p_.tcl_ps;
    window_ = static_cast<Cycle>(cycles(static_cast<std::uint64_t>(longest))) + 64;
  }

  void issued(const DramCommand& command) override { check(command); }

  void check(const DramCommand& c) {
    ++commands_;
    while (!recent_.empty() && recent_.front().at + window_ < c.at) recent_.pop_front();
    if (!recent_.empty()) {
      const DramCommand& last = recent_.back();
      const std::int64_t takes = last.kind == Kind::activate ? p_.activate_cycles : 1;
      at_least(c, last, takes, "one command at a time");
    }
    for (const DramCommand& earlier : recent_) check_pair(earlier, c);
    check_state(c);
    if (c.kind == Kind::activate) check_four_activates(c);
    if (c.kind == Kind::refresh) {
      check_refreshes(c.at);
      ++refreshes_;
    }
    recent_.push_back(c);
  }
  /// To be called at the end: refreshes are due whether or not anything comes after.
  void check_refreshes(Cycle now) {
    if (!p_.refresh) return;
    const std::uint64_t due = now * p_.tck_ps / p_.trefi_ps;
    if (refreshes_ + 1 < due) fail("tREFI", now);
  }

  /// The rules that were broken, each as often as it was.
  const std::map<std::string, unsigned>& broken() const { return broken_; }
  std::string report() const {
    std::string text;
    for (const auto& [rule, count] : broken_)
      text += rule + " " + std::to_string(count) + " times, first in cycle " + std::to_string(first_.at(rule)) + "; ";
    return text;
  }
  std::uint64_t commands() const { return commands_; }
  std::uint64_t refreshes() const { return refreshes_; }

 private:
  using Kind = DramCommand::Kind;
  static bool is_column(Kind kind) { return kind == Kind::read || kind == Kind::write; }
  static bool closes(const DramCommand& c, unsigned bank) {
    return c.kind == Kind::precharge_all || (c.kind == Kind::precharge && c.bank == bank);
  }

  std::int64_t cycles(std::uint64_t ps) const { return static_cast<std::int64_t>((ps + p_.tck_ps - 1) / p_.tck_ps); }
  std::int64_t burst() const { return p_.burst_length / p_.beats_per_cycle; }
  bool same_group(const DramCommand& a, const DramCommand& b) const {
    return a.bank % p_.bank_groups == b.bank % p_.bank_groups;
  }
  void fail(const std::string& rule, Cycle at) {
    if (broken_[rule]++ == 0) first_[rule] = at;
  }
  void at_least(const DramCommand& c, const DramCommand& earlier, std::int64_t distance, const char* rule) {
    if (static_cast<std::int64_t>(c.at) - static_cast<std::int64_t>(earlier.at) < distance) fail(rule, c.at);
  }
  /// The data of a command is on the bus from cycle `first` to `last`, of both.
  std::int64_t first_data(const DramCommand& c) const {
    return static_cast<std::int64_t>(c.at) + cycles(c.kind == Kind::read ? p_.tcl_ps : p_.tcwl_ps);
  }
  std::int64_t last_data(const DramCommand& c) const { return first_data(c) + burst() - 1; }

  void check_pair(const DramCommand& a, const DramCommand& b) {
    const std::int64_t second_half = p_.activate_cycles - 1;  // an activate counts from its last cycle on
    const std::int64_t written = cycles(p_.tcwl_ps) + cycles(p_.tdqss_ps) + burst();
    const bool same_bank = a.bank == b.bank;
    if (a.kind == Kind::activate && b.kind == Kind::activate) {
      if (same_bank) at_least(b, a, cycles(p_.trc_ps), "tRC");
      at_least(b, a, cycles(same_group(a, b) ? p_.trrd_l_ps : p_.trrd_ps), same_group(a, b) ? "tRRD_L" : "tRRD");
    }
    if (a.kind == Kind::activate && is_column(b.kind) && same_bank)
      at_least(b, a, cycles(p_.trcd_ps) + second_half, "tRCD");
    if (a.kind == Kind::activate && closes(b, a.bank)) at_least(b, a, cycles(p_.tras_ps) + second_half, "tRAS");
    if (a.kind == Kind::precharge && b.kind == Kind::activate && same_bank) at_least(b, a, cycles(p_.trp_ps), "tRP");
    if (a.kind == Kind::precharge && b.kind == Kind::refresh) at_least(b, a, cycles(p_.trp_ps), "tRP");
    if (a.kind == Kind::precharge_all && (b.kind == Kind::activate || b.kind == Kind::refresh))
      at_least(b, a, cycles(p_.trp_all_ps), "tRPab");
    if (a.kind == Kind::read && closes(b, a.bank)) at_least(b, a, cycles(p_.trtp_ps), "tRTP");
    if (a.kind == Kind::write && closes(b, a.bank)) at_least(b, a, written + cycles(p_.twr_ps), "tWR");
    if (a.kind == b.kind && is_column(a.kind))
      at_least(b, a, cycles(same_group(a, b) ? p_.tccd_l_ps : p_.tccd_ps), same_group(a, b) ? "tCCD_L" : "tCCD");
    if (a.kind == Kind::write && b.kind == Kind::read)
      at_least(b, a, written + cycles(same_group(a, b) ? p_.twtr_l_ps : p_.twtr_ps),
               same_group(a, b) ? "tWTR_L" : "tWTR");
    if (a.kind == Kind::read && b.kind == Kind::write && first_data(b) - last_data(a) - 1 < cycles(p_.trtw_ps))
      fail("tRTW", b.at);
    if (is_column(a.kind) && is_column(b.kind) && first_data(a) <= last_data(b) && first_data(b) <= last_data(a))
      fail("data bus", b.at);
    if (a.kind == Kind::refresh) at_least(b, a, cycles(p_.trfc_ps), "tRFC");
  }
  void check_state(const DramCommand& c) {
    const auto open = open_rows_.find(c.bank);
    switch (c.kind) {
      case Kind::activate:
        if (open != open_rows_.end()) fail("activate of an open bank", c.at);
        open_rows_[c.bank] = c.row;
        break;
      case Kind::read:
      case Kind::write:
        if (open == open_rows_.end() || open->second != c.row) fail("row not open", c.at);
        if (c.column >= p_.row_bytes / (p_.burst_length * p_.channel_bits / 8)) fail("column beyond the row", c.at);
        break;
      case Kind::precharge: open_rows_.erase(c.bank); break;
      case Kind::precharge_all: open_rows_.clear(); break;
      case Kind::refresh:
        if (!open_rows_.empty()) fail("refresh of an open bank", c.at);
        break;
    }
    if (c.bank >= p_.banks) fail("no such bank", c.at);
  }
  void check_four_activates(const DramCommand& c) {
    unsigned within = 0;
    for (const DramCommand& earlier : recent_) {
      if (earlier.kind == Kind::activate && earlier.at + static_cast<Cycle>(cycles(p_.tfaw_ps)) > c.at) ++within;
    }
    if (within >= 4) fail("tFAW", c.at);
  }

  const DramParameters& p_;
  Cycle window_;  ///< in which commands may be too close
  std::deque<DramCommand> recent_;
  std::map<unsigned, std::uint64_t> open_rows_;
  std::map<std::string, unsigned> broken_;
  std::map<std::string, Cycle> first_;
  std::uint64_t commands_ = 0, refreshes_ = 0;
};

}  // namespace vrpipe::testing
